# Tests of the protocol, the link library and the coupler; see ocublast_test in CMakeLists.txt.

# Two tiny real participants: a gas column and a piston on a spring, with an exact solution.
add_executable(coupler_gas_column coupled/coupler_gas_column.cpp)
add_executable(coupler_spring coupled/coupler_spring.cpp)
foreach(toy coupler_gas_column coupler_spring)
  target_link_libraries(${toy} PRIVATE ocublast_link ocublast_base fmt::fmt ocublast_warnings)
endforeach()
