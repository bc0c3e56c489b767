# Tests of this part; see ocublast_test in CMakeLists.txt.
find_package(Python3 REQUIRED COMPONENTS Interpreter)
# A python3 found first in PATH may lack Debian's modules (h5py, meshio): take the system's.
set(OCU_PYTHON /usr/bin/python3)
if(NOT EXISTS ${OCU_PYTHON})
  set(OCU_PYTHON ${Python3_EXECUTABLE})
endif()

find_program(SHELLCHECK shellcheck)
if(SHELLCHECK)
  add_test(NAME cases_shell_scripts COMMAND ${SHELLCHECK} ${CMAKE_SOURCE_DIR}/cases/setup ${CMAKE_SOURCE_DIR}/cases/run
           ${CMAKE_SOURCE_DIR}/tests/run ${CMAKE_SOURCE_DIR}/.ci/run)
  set_tests_properties(cases_shell_scripts PROPERTIES LABELS unit TIMEOUT 60)
endif()

# ocublast_python_test(name folder label timeout): runs tests/<folder>/<name>.py, unittest style.
function(ocublast_python_test name folder label timeout)
  add_test(NAME ${name} COMMAND ${OCU_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/${folder}/${name}.py)
  set_tests_properties(${name} PROPERTIES LABELS ${label} TIMEOUT ${timeout}
                       ENVIRONMENT "OCUBLAST_BIN=${CMAKE_RUNTIME_OUTPUT_DIRECTORY}")
endfunction()

ocublast_python_test(cases_mesh unit unit 120)
ocublast_python_test(cases_convert unit unit 120)
ocublast_python_test(cases_launcher unit unit 180)
ocublast_python_test(cases_report unit unit 120)
ocublast_python_test(bench_runner unit unit 60)

find_program(DOCKER_COMPOSE docker-compose)
if(DOCKER_COMPOSE)
  add_test(NAME cases_compose_file COMMAND ${DOCKER_COMPOSE} -f ${CMAKE_SOURCE_DIR}/docker/compose.yaml
           config -q)
  set_tests_properties(cases_compose_file PROPERTIES LABELS unit TIMEOUT 60)
endif()

# Whole cases need all three programs.
if(TARGET flow_solver AND TARGET solid_solver AND TARGET coupler)
  ocublast_python_test(cases_alone verification verification 300)
  ocublast_python_test(cases_coupled coupled coupled 600)
  ocublast_python_test(cases_flow_ranks coupled long 600)
  ocublast_python_test(flow_precision coupled coupled 180)
endif()
