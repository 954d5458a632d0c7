# Debian's packages as imported targets. Heavy headers stay private to one .cpp each.
find_package(Threads REQUIRED)
find_package(glm REQUIRED)
find_package(TBB REQUIRED)
find_package(fmt REQUIRED)
find_package(ZLIB REQUIRED)
find_package(Imath REQUIRED CONFIG)
find_package(nlohmann_json REQUIRED)
find_package(pugixml REQUIRED CONFIG)
find_package(OpenSSL REQUIRED COMPONENTS Crypto)
find_package(nanoflann REQUIRED CONFIG)
find_package(PkgConfig REQUIRED)
pkg_check_modules(LZ4 REQUIRED IMPORTED_TARGET liblz4)
pkg_check_modules(ZIP REQUIRED IMPORTED_TARGET libzip)
pkg_check_modules(BLOSC REQUIRED IMPORTED_TARGET blosc)
pkg_check_modules(HWY REQUIRED IMPORTED_TARGET libhwy)
if(MOTE_HDF5)
  pkg_check_modules(HDF5 REQUIRED IMPORTED_TARGET hdf5-serial)
endif()

# OpenVDB's own find module demands Boost's libraries too, which it was built with and we do not use.
if(MOTE_OPENVDB OR MOTE_PEERS)
  find_path(OPENVDB_INCLUDE openvdb/openvdb.h REQUIRED)
  find_library(OPENVDB_LIBRARY openvdb REQUIRED)
  add_library(OpenVDB::openvdb UNKNOWN IMPORTED)
  set_target_properties(OpenVDB::openvdb PROPERTIES IMPORTED_LOCATION ${OPENVDB_LIBRARY}
    INTERFACE_INCLUDE_DIRECTORIES ${OPENVDB_INCLUDE} INTERFACE_LINK_LIBRARIES TBB::tbb)
endif()

if(MOTE_FUZZ)
  return() # what follows reads neither particles nor scenes
endif()
find_package(PNG REQUIRED)
find_package(OpenEXR REQUIRED CONFIG)
find_package(CLI11 REQUIRED)
find_package(Vulkan REQUIRED)
find_package(assimp REQUIRED CONFIG)
find_package(embree 3 REQUIRED CONFIG)

# libvulkan-volk-dev ships the loader as one C file; it is compiled once here.
find_file(VOLK_SOURCE volk.c PATHS /usr/include REQUIRED)
add_library(volk STATIC ${VOLK_SOURCE})
target_link_libraries(volk PUBLIC Vulkan::Headers ${CMAKE_DL_LIBS})
