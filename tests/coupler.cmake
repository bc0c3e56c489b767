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
ocublast_test(NAME test_coupler_mapping LABEL unit SOURCES unit/coupler_mapping.cpp
              LIBRARIES ocublast_coupler Eigen3::Eigen)
ocublast_test(NAME test_coupler_recording LABEL unit SOURCES unit/coupler_recording.cpp
              LIBRARIES ocublast_coupler)

ocublast_test(NAME test_coupler_relaxation LABEL unit SOURCES unit/coupler_relaxation.cpp
              LIBRARIES ocublast_coupler)
ocublast_test(NAME test_coupler_memory LABEL unit SOURCES unit/coupler_memory.cpp
              LIBRARIES ocublast_link)

# Tests that run the whole coupler; in Python, one ctest entry per class.
function(ocublast_coupler_test name label file class timeout)
  add_test(NAME ${name} COMMAND /usr/bin/python3 -W ignore ${CMAKE_CURRENT_SOURCE_DIR}/${file} -v ${class})
  set_tests_properties(${name} PROPERTIES TIMEOUT ${timeout} LABELS ${label}
    ENVIRONMENT "OCU_BUILD=${CMAKE_BINARY_DIR}")
endfunction()
foreach(class Piston Replay Resume Ways)
  ocublast_coupler_test(coupler_${class} coupled coupled/coupler_piston.py ${class} 600)
endforeach()
ocublast_coupler_test(coupler_Install coupled coupled/coupler_install.py Install 600)
ocublast_coupler_test(coupler_Solvers coupled coupled/coupler_solvers.py Solvers 600)
ocublast_coupler_test(coupler_SolverRanks coupled coupled/coupler_solver_ranks.py SolverRanks 600)
ocublast_coupler_test(coupler_Several coupled coupled/coupler_several.py Several 600)
ocublast_coupler_test(coupler_Mapped coupled coupled/coupler_mapped.py Mapped 600)
ocublast_coupler_test(coupler_Schemes coupled coupled/coupler_schemes.py Schemes 600)
foreach(class Death Silence Strangers BadMessages)
  ocublast_coupler_test(coupler_${class} faults faults/coupler_faults.py ${class} 600)
endforeach()
ocublast_coupler_test(coupler_Matrix faults faults/coupler_matrix.py Matrix 600)
ocublast_coupler_test(coupler_Soak faults faults/coupler_soak.py Soak 600)
add_test(NAME coupler_Soak_200 COMMAND /usr/bin/python3 -W ignore ${CMAKE_CURRENT_SOURCE_DIR}/faults/coupler_soak.py -v Soak)
set_tests_properties(coupler_Soak_200 PROPERTIES TIMEOUT 900 LABELS "faults;long"
  ENVIRONMENT "OCU_BUILD=${CMAKE_BINARY_DIR};OCU_SOAK_RUNS=200")

# What comes from outside, torn apart; tests/faults/fuzz runs the same with libFuzzer.
add_executable(coupler_fuzz faults/coupler_fuzz.cpp faults/coupler_fuzz_main.cpp)
target_link_libraries(coupler_fuzz PRIVATE ocublast_coupler ocublast_warnings)
add_test(NAME coupler_fuzz COMMAND coupler_fuzz ${CMAKE_CURRENT_SOURCE_DIR}/faults/corpus 20000)
set_tests_properties(coupler_fuzz PROPERTIES TIMEOUT 60 LABELS faults)

# Solvers of other people: what the conformance program says of ours and of the Python twin.
function(ocublast_conformance name)
  add_test(NAME conformance_${name} COMMAND /usr/bin/python3 -W ignore ${CMAKE_CURRENT_SOURCE_DIR}/coupled/conformance
           --build ${CMAKE_BINARY_DIR} ${ARGN})
  set_tests_properties(conformance_${name} PROPERTIES TIMEOUT 120 LABELS coupled)
endfunction()
ocublast_conformance(spring --case ${CMAKE_CURRENT_SOURCE_DIR}/coupled/recordings/toy_piston.toml --width 0.01 --pressure 1e-6
  -- $<TARGET_FILE:coupler_spring>)
# Debian's dolfinx may be absent where only ours is wanted.
execute_process(COMMAND /usr/bin/python3 -c "import importlib.util as u, sys; sys.exit(u.find_spec('dolfinx') is None)"
                RESULT_VARIABLE NO_DOLFINX OUTPUT_QUIET ERROR_QUIET)
if(NOT NO_DOLFINX)
  ocublast_conformance(python_fenicsx --case ${CMAKE_SOURCE_DIR}/cases/panel/case.toml --width 1e-6 --pressure 1e5
    -- /usr/bin/python3 ${CMAKE_SOURCE_DIR}/coupler/link/python/examples/fenicsx_panel.py)
endif()
ocublast_coupler_test(coupler_Ranks faults faults/coupler_ranks.py Ranks 600)
foreach(class FullDisk Network Tools)
  ocublast_coupler_test(coupler_${class} faults faults/coupler_system.py ${class} 600)
endforeach()
