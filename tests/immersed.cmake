# Tests of this part; see ocublast_test in CMakeLists.txt.
ocublast_test(NAME test_immersed_geometry LABEL unit SOURCES unit/immersed_geometry.cpp
  LIBRARIES ocublast_flow_immersed ocublast_flow_grid)
ocublast_test(NAME test_immersed_boundary LABEL unit
  SOURCES unit/immersed_boundary.cpp unit/immersed_ghosts.cpp unit/immersed_readout.cpp
  LIBRARIES ocublast_flow_immersed ocublast_flow_grid)
ocublast_test(NAME test_immersed_rigid LABEL unit SOURCES unit/immersed_rigid.cpp
  LIBRARIES ocublast_flow_immersed ocublast_flow_grid)
ocublast_test(NAME test_immersed_speed LABEL verification SOURCES verification/immersed_speed.cpp
  LIBRARIES ocublast_flow_immersed ocublast_flow_grid)
if(TARGET ocublast_flow_step)
  foreach(name shock wedge impulse viscous motion free bodies)
    ocublast_test(NAME test_immersed_${name} LABEL verification TIMEOUT 120
      SOURCES verification/immersed_${name}.cpp LIBRARIES ocublast_flow_step)
  endforeach()
  ocublast_test(NAME test_immersed_case_runs LABEL verification SOURCES verification/immersed_case_runs.cpp
    LIBRARIES ocublast_flow)
  foreach(name wedge impulse)
    ocublast_test(NAME test_immersed_${name}_long LABEL verification TIMEOUT 600 LONG
      SOURCES verification/immersed_${name}.cpp LIBRARIES ocublast_flow_step)
    target_compile_definitions(test_immersed_${name}_long PRIVATE OCU_LONG_TESTS)
  endforeach()
endif()
