# ocublast::link, the participant library (C and C++); see include/ocublast_link.h and coupler/link/participant.hpp.
include(CMakeFindDependencyMacro)
find_dependency(Threads)
find_dependency(fmt)
find_dependency(Protobuf)
find_dependency(cppzmq)
get_filename_component(OCUBLAST_PREFIX "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
if(NOT TARGET ocublast::link)
  add_library(ocublast::link STATIC IMPORTED)
  set_target_properties(ocublast::link PROPERTIES
    IMPORTED_LOCATION "${OCUBLAST_PREFIX}/lib/libocublast_link.a"
    INTERFACE_INCLUDE_DIRECTORIES "${OCUBLAST_PREFIX}/include"
    INTERFACE_LINK_LIBRARIES "${OCUBLAST_PREFIX}/lib/libocublast_base.a;${OCUBLAST_PREFIX}/lib/libocublast_proto.a;protobuf::libprotobuf;cppzmq;fmt::fmt;Threads::Threads")
endif()
