# Compiler options of every target of ours, as the interface target mote_options.
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()
set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O2 -g1") # without NDEBUG: assertions stay on in dev and asan
set(CMAKE_CXX_FLAGS_RELEASE "-O3 -DNDEBUG")

add_library(mote_options INTERFACE)
target_include_directories(mote_options INTERFACE ${PROJECT_SOURCE_DIR})
target_compile_definitions(mote_options INTERFACE MOTE_VERSION="${PROJECT_VERSION}")
# -ffp-contract=off: the host, the scalar path and the compute shader must round alike (DESIGN, pitfalls).
# -Wno-restrict: GCC 12 takes "text" + string for an overlapping copy at -O3 (its bug 105651).
target_compile_options(mote_options INTERFACE -Wall -Wextra -Wshadow -ffp-contract=off $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict> $<$<BOOL:${MOTE_WERROR}>:-Werror>)
if(MOTE_SANITIZE)
  # -O1: instrumented SIMD kernels take GCC minutes at -O2 and run no faster for it.
  target_compile_options(mote_options INTERFACE -O1)
  # null, vptr and object-size: AddressSanitizer stops there too, and they take a quarter of the compiler's time.
  target_compile_options(mote_options INTERFACE -fsanitize=address,undefined -fno-sanitize=null,vptr,object-size
    -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(mote_options INTERFACE -fsanitize=address,undefined)
endif()
if(MOTE_FUZZ)
  target_compile_options(mote_options INTERFACE -fsanitize=fuzzer-no-link) # coverage, for libFuzzer
endif()
