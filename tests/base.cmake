ocublast_test(NAME test_case_reader LABEL unit SOURCES unit/case_reader.cpp LIBRARIES ocublast_base)
ocublast_test(NAME test_hdf5_file LABEL unit SOURCES unit/background_writer.cpp unit/hdf5_file.cpp
              LIBRARIES ocublast_hdf5)
add_executable(ranks_probe unit/ranks_probe.cpp)
target_link_libraries(ranks_probe PRIVATE ocublast_ranks ocublast_warnings)
ocublast_test(NAME test_ranks LABEL unit SOURCES unit/ranks.cpp LIBRARIES ocublast_ranks)
target_compile_definitions(test_ranks PRIVATE RANKS_PROBE="$<TARGET_FILE:ranks_probe>")
add_dependencies(test_ranks ranks_probe)

# Formatting is what clang-format makes of it; another version makes something else of it.
find_program(CLANG_FORMAT clang-format-14)
if(CLANG_FORMAT)
  add_test(NAME base_format COMMAND sh -c
           "find coupler flow_solver proto solid_solver tests -name '*.[ch]pp' -print0 | xargs -0 -P 2 -n 40 ${CLANG_FORMAT} --dry-run -Werror"
           WORKING_DIRECTORY ${CMAKE_SOURCE_DIR})
  set_tests_properties(base_format PROPERTIES LABELS unit TIMEOUT 300)
endif()
