# Tests of the flow core; see ocublast_test in CMakeLists.txt.
ocublast_test(NAME test_flow_grid LABEL unit SOURCES unit/flow_grid.cpp LIBRARIES ocublast_flow_grid)

foreach(name shock_tube smooth invariants viscous strong open_ends)
  ocublast_test(NAME test_flow_${name} LABEL verification SOURCES verification/flow_${name}.cpp
                LIBRARIES ocublast_flow_core TIMEOUT 120)
  target_include_directories(test_flow_${name} PRIVATE ${CMAKE_SOURCE_DIR})
endforeach()

ocublast_test(NAME test_flow_blast LABEL verification LONG SOURCES verification/flow_blast.cpp
              LIBRARIES ocublast_flow_core TIMEOUT 180)
target_include_directories(test_flow_blast PRIVATE ${CMAKE_SOURCE_DIR})

if(TARGET ocublast_flow_step)
  ocublast_test(NAME test_flow_cut_lines LABEL verification SOURCES verification/flow_cut_lines.cpp
                LIBRARIES ocublast_flow_step TIMEOUT 120)
  target_include_directories(test_flow_cut_lines PRIVATE ${CMAKE_SOURCE_DIR})
endif()

foreach(precision "" _single)
  add_executable(flow_speed${precision} bench/flow_speed.cpp)
  target_include_directories(flow_speed${precision} PRIVATE ${CMAKE_SOURCE_DIR})
  target_link_libraries(flow_speed${precision} PRIVATE ocublast_flow_step${precision} ocublast_warnings)
endforeach()
ocublast_test(NAME test_flow_case LABEL unit SOURCES unit/flow_case.cpp LIBRARIES ocublast_flow)
ocublast_test(NAME test_flow_probes LABEL unit SOURCES unit/flow_probes.cpp LIBRARIES ocublast_flow)
ocublast_test(NAME test_flow_burst LABEL unit SOURCES unit/flow_burst.cpp LIBRARIES ocublast_flow_sources)
ocublast_test(NAME test_flow_case_runs LABEL verification SOURCES verification/flow_case_runs.cpp
              LIBRARIES ocublast_flow TIMEOUT 120)

# The flow on several ranks against one.
add_executable(flow_ranks_run verification/flow_ranks_run.cpp)
target_link_libraries(flow_ranks_run PRIVATE ocublast_flow ocublast_warnings)
ocublast_test(NAME test_flow_ranks LABEL verification SOURCES verification/flow_ranks.cpp
              LIBRARIES ocublast_hdf5 TIMEOUT 120)
target_include_directories(test_flow_ranks PRIVATE ${CMAKE_SOURCE_DIR})
target_compile_definitions(test_flow_ranks PRIVATE FLOW_RANKS_RUN="$<TARGET_FILE:flow_ranks_run>"
                           FLOW_SOLVER="$<TARGET_FILE:flow_solver>")
add_dependencies(test_flow_ranks flow_ranks_run flow_solver)
ocublast_test(NAME test_flow_border_weights LABEL unit SOURCES unit/flow_border_weights.cpp unit/flow_rank_blocks.cpp
              LIBRARIES ocublast_flow_core)

# Both precisions in one program: their names lie in namespaces of their own.
foreach(precision "" _single)
  add_library(flow_precision_run${precision} OBJECT verification/flow_precision_run.cpp)
  target_include_directories(flow_precision_run${precision} PRIVATE ${CMAKE_SOURCE_DIR})
  target_link_libraries(flow_precision_run${precision} PUBLIC ocublast_flow_step${precision} PRIVATE ocublast_warnings)
endforeach()
ocublast_test(NAME test_flow_precision LABEL verification
              SOURCES verification/flow_precision.cpp $<TARGET_OBJECTS:flow_precision_run>
                      $<TARGET_OBJECTS:flow_precision_run_single>
              LIBRARIES ocublast_flow_step ocublast_flow_step_single TIMEOUT 120)
target_include_directories(test_flow_precision PRIVATE ${CMAKE_SOURCE_DIR})

# The lanes of every instruction set, whichever of them the kernels are built for.
set(lanes_of_sets)
foreach(precision "" _single)
  foreach(set baseline avx2 avx512)
    set(lanes flow_lanes_${set}${precision})
    add_library(${lanes} OBJECT unit/flow_lanes_check.cpp)
    target_include_directories(${lanes} PRIVATE ${CMAKE_SOURCE_DIR})
    target_compile_definitions(${lanes} PRIVATE OCU_ISA=isa_${set} $<$<BOOL:${precision}>:OCU_SINGLE>)
    target_compile_options(${lanes} PRIVATE ${kernel_flags_${set}} -Wno-maybe-uninitialized -Wno-uninitialized
                           -Wno-ignored-attributes)
    target_link_libraries(${lanes} PRIVATE ocublast_warnings ocublast_kernel_flags)
    list(APPEND lanes_of_sets $<TARGET_OBJECTS:${lanes}>)
  endforeach()
endforeach()
ocublast_test(NAME test_flow_lanes LABEL unit SOURCES unit/flow_lanes.cpp ${lanes_of_sets} LIBRARIES ocublast_base)
