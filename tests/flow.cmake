# Tests of the flow core; see ocublast_test in CMakeLists.txt.
ocublast_test(NAME test_flow_grid LABEL unit SOURCES unit/flow_grid.cpp LIBRARIES ocublast_flow_grid)
ocublast_test(NAME test_flow_burst LABEL unit SOURCES unit/flow_burst.cpp LIBRARIES ocublast_flow_sources)
ocublast_test(NAME test_flow_shock_tube LABEL verification SOURCES verification/flow_shock_tube.cpp
              LIBRARIES ocublast_flow_core)
target_include_directories(test_flow_shock_tube PRIVATE ${CMAKE_SOURCE_DIR})
