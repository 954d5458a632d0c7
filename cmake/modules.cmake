# mote_module(NAME DEPS...): static library mote_NAME from the sources of the calling folder and the folders in it.
function(mote_module name)
  file(GLOB sources CONFIGURE_DEPENDS *.cpp *.h */*.cpp */*.h)
  add_library(mote_${name} STATIC ${sources})
  set_target_properties(mote_${name} PROPERTIES LINKER_LANGUAGE CXX)
  target_link_libraries(mote_${name} PUBLIC mote_options)
  target_link_libraries(mote_${name} ${ARGN})
endfunction()
