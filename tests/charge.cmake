# Tests of the second scheme, of radial grids and of charges; see ocublast_test in CMakeLists.txt.
foreach(name muscl_schemes radial_grids radial_sedov)
  ocublast_test(NAME test_${name} LABEL verification SOURCES verification/${name}.cpp
                LIBRARIES ocublast_flow_step TIMEOUT 120)
  target_include_directories(test_${name} PRIVATE ${CMAKE_SOURCE_DIR})
endforeach()
# The compact scheme on the same problems takes a minute.
ocublast_test(NAME test_radial_sedov_long LABEL verification SOURCES verification/radial_sedov.cpp
              LIBRARIES ocublast_flow_step TIMEOUT 600 LONG)
target_include_directories(test_radial_sedov_long PRIVATE ${CMAKE_SOURCE_DIR})
target_compile_definitions(test_radial_sedov_long PRIVATE OCU_LONG_TESTS)

ocublast_test(NAME test_charge_kingery_bulmash LABEL validation SOURCES verification/charge_kingery_bulmash.cpp
              LIBRARIES ocublast_flow_waves TIMEOUT 120)
ocublast_test(NAME test_charge_mapping LABEL verification SOURCES verification/charge_mapping.cpp
              LIBRARIES ocublast_flow TIMEOUT 120)
ocublast_test(NAME test_charge_runs LABEL verification SOURCES verification/charge_runs.cpp
              LIBRARIES ocublast_flow TIMEOUT 120)
ocublast_test(NAME test_point_blast LABEL verification SOURCES verification/point_blast.cpp
              LIBRARIES ocublast_flow_waves TIMEOUT 120)
# On finer grids.
ocublast_test(NAME test_point_blast_long LABEL verification SOURCES verification/point_blast.cpp
              LIBRARIES ocublast_flow_waves TIMEOUT 600 LONG)
target_compile_definitions(test_point_blast_long PRIVATE OCU_LONG_TESTS)
foreach(name charge_kingery_bulmash charge_mapping point_blast point_blast_long)
  target_include_directories(test_${name} PRIVATE ${CMAKE_SOURCE_DIR})
endforeach()

add_executable(flow_accuracy bench/flow_accuracy.cpp)
target_link_libraries(flow_accuracy PRIVATE ocublast_flow_core ocublast_warnings)
target_include_directories(flow_accuracy PRIVATE ${CMAKE_SOURCE_DIR})
