# Tests of the protocol, the link library and the coupler; see ocublast_test in CMakeLists.txt.

# Two tiny real participants: a gas column and a piston on a spring, with an exact solution.
add_executable(coupler_gas_column coupled/coupler_gas_column.cpp)
add_executable(coupler_spring coupled/coupler_spring.cpp)
foreach(toy coupler_gas_column coupler_spring)
  target_link_libraries(${toy} PRIVATE ocublast_link ocublast_base fmt::fmt ocublast_warnings)
endforeach()

ocublast_test(NAME test_coupler_message LABEL unit SOURCES unit/coupler_message.cpp
              LIBRARIES ocublast_link ocublast_proto)
ocublast_test(NAME test_coupler_window LABEL unit SOURCES unit/coupler_window.cpp
              LIBRARIES ocublast_coupler)
ocublast_test(NAME test_coupler_recording LABEL unit SOURCES unit/coupler_recording.cpp
              LIBRARIES ocublast_coupler)

# Tests that run the whole coupler; in Python, one ctest entry per class.
function(ocublast_coupler_test name label file class timeout)
  add_test(NAME ${name} COMMAND /usr/bin/python3 -W ignore ${CMAKE_CURRENT_SOURCE_DIR}/${file} -v ${class})
  set_tests_properties(${name} PROPERTIES TIMEOUT ${timeout} LABELS ${label}
    ENVIRONMENT "OCU_BUILD=${CMAKE_BINARY_DIR}")
endfunction()
foreach(class Piston Replay Resume Ways)
  ocublast_coupler_test(coupler_${class} coupled coupled/coupler_piston.py ${class} 120)
endforeach()
ocublast_coupler_test(coupler_Solvers coupled coupled/coupler_solvers.py Solvers 180)
ocublast_coupler_test(coupler_Schemes coupled coupled/coupler_schemes.py Schemes 120)
foreach(class Death Silence Strangers BadMessages)
  ocublast_coupler_test(coupler_${class} faults faults/coupler_faults.py ${class} 180)
endforeach()
