# Solid solver.
add_executable(solid_speed bench/solid_speed.cpp)
target_include_directories(solid_speed PRIVATE ${CMAKE_SOURCE_DIR})
target_link_libraries(solid_speed PRIVATE ocublast_solid_core ocublast_warnings)
ocublast_test(NAME test_solid_elements LABEL unit SOURCES unit/solid_elements.cpp LIBRARIES ocublast_solid)
ocublast_test(NAME test_solid_dynamics LABEL verification SOURCES verification/solid_dynamics.cpp
              LIBRARIES ocublast_solid TIMEOUT 120)
