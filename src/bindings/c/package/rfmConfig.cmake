# find_package(rfm) gives the targets rfm::rfm, the shared library, and rfm::static.
# The place of this file decides: lib/cmake/rfm below the prefix.

get_filename_component(_rfm_prefix "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)

if(NOT TARGET rfm::rfm)
  add_library(rfm::rfm SHARED IMPORTED)
  set_target_properties(rfm::rfm PROPERTIES
    IMPORTED_LOCATION "${_rfm_prefix}/lib/librfm${CMAKE_SHARED_LIBRARY_SUFFIX}"
    IMPORTED_NO_SONAME TRUE
    INTERFACE_INCLUDE_DIRECTORIES "${_rfm_prefix}/include")
endif()

if(NOT TARGET rfm::static)
  find_package(Threads REQUIRED)
  add_library(rfm::static STATIC IMPORTED)
  set_target_properties(rfm::static PROPERTIES
    IMPORTED_LOCATION "${_rfm_prefix}/lib/librfm.a"
    INTERFACE_LINK_LIBRARIES "Threads::Threads;m;${CMAKE_DL_LIBS}"
    INTERFACE_INCLUDE_DIRECTORIES "${_rfm_prefix}/include")
endif()

unset(_rfm_prefix)
