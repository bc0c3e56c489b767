# Solid solver.
add_executable(solid_speed bench/solid_speed.cpp)
target_include_directories(solid_speed PRIVATE ${CMAKE_SOURCE_DIR})
target_link_libraries(solid_speed PRIVATE ocublast_solid_core ocublast_warnings)
add_executable(solid_rank_speed bench/solid_ranks.cpp)
target_include_directories(solid_rank_speed PRIVATE ${CMAKE_SOURCE_DIR})
target_link_libraries(solid_rank_speed PRIVATE ocublast_solid_core ocublast_warnings)
ocublast_test(NAME test_solid_elements LABEL unit SOURCES unit/solid_elements.cpp LIBRARIES ocublast_solid)
ocublast_test(NAME test_solid_materials LABEL unit SOURCES unit/solid_materials.cpp LIBRARIES ocublast_solid)
foreach(part dynamics control waves columns statics vibrations stability contact)
  ocublast_test(NAME test_solid_${part} LABEL verification SOURCES verification/solid_${part}.cpp
                LIBRARIES ocublast_solid TIMEOUT 120)
endforeach()
ocublast_test(NAME test_solid_output LABEL verification SOURCES verification/solid_output.cpp
              LIBRARIES ocublast_solid)
target_compile_definitions(test_solid_output PRIVATE SOLID_SOLVER="$<TARGET_FILE:solid_solver>")
add_dependencies(test_solid_output solid_solver)
foreach(part columns statics beam stability hertz)
  ocublast_test(NAME test_solid_${part}_long LABEL verification
                SOURCES verification/solid_${part}_long.cpp LIBRARIES ocublast_solid TIMEOUT 900
                LONG)
endforeach()
set(solid_programs SOLID_SOLVER="$<TARGET_FILE:solid_solver>")
ocublast_test(NAME test_solid_bad_input LABEL faults SOURCES faults/solid_bad_input.cpp
              LIBRARIES ocublast_solid)
target_compile_definitions(test_solid_bad_input PRIVATE ${solid_programs})
add_dependencies(test_solid_bad_input solid_solver)

add_executable(solid_toy_flow coupled/solid_toy_flow.cpp)
target_link_libraries(solid_toy_flow PRIVATE ocublast_link ocublast_base ocublast_warnings)
if(TARGET coupler)
  ocublast_test(NAME test_solid_coupled LABEL coupled SOURCES coupled/solid_coupled.cpp
                LIBRARIES ocublast_solid TIMEOUT 120)
  target_compile_definitions(test_solid_coupled PRIVATE ${solid_programs}
    COUPLER="$<TARGET_FILE:coupler>" TOY_FLOW="$<TARGET_FILE:solid_toy_flow>")
  add_dependencies(test_solid_coupled solid_solver solid_toy_flow coupler)
endif()

# Several ranks of the solid: a probe that mpirun starts, and the program itself.
add_executable(solid_ranks_probe verification/solid_ranks_probe.cpp)
target_link_libraries(solid_ranks_probe PRIVATE ocublast_solid_core ocublast_base ocublast_warnings)
ocublast_test(NAME test_solid_ranks LABEL verification
              SOURCES verification/solid_ranks.cpp verification/solid_ranks_program.cpp
              LIBRARIES ocublast_solid)
target_compile_definitions(test_solid_ranks PRIVATE ${solid_programs}
                           RANKS_PROBE="$<TARGET_FILE:solid_ranks_probe>")
add_dependencies(test_solid_ranks solid_ranks_probe solid_solver)
if(TARGET coupler)
  target_compile_definitions(test_solid_ranks PRIVATE COUPLER="$<TARGET_FILE:coupler>"
                             TOY_FLOW="$<TARGET_FILE:solid_toy_flow>")
  add_dependencies(test_solid_ranks solid_toy_flow coupler)
endif()
