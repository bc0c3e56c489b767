# Tests of the second scheme, of radial grids and of charges; see ocublast_test in CMakeLists.txt.
foreach(name muscl_schemes radial_grids radial_sedov)
  ocublast_test(NAME test_${name} LABEL verification SOURCES verification/${name}.cpp
                LIBRARIES ocublast_flow_step TIMEOUT 120)
  target_include_directories(test_${name} PRIVATE ${CMAKE_SOURCE_DIR})
endforeach()

ocublast_test(NAME test_charge_kingery_bulmash LABEL validation SOURCES verification/charge_kingery_bulmash.cpp
              LIBRARIES ocublast_flow_waves TIMEOUT 120)
target_include_directories(test_charge_kingery_bulmash PRIVATE ${CMAKE_SOURCE_DIR})
