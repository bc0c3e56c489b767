ocublast_test(NAME test_case_reader LABEL unit SOURCES unit/case_reader.cpp LIBRARIES ocublast_base)
ocublast_test(NAME test_hdf5_file LABEL unit SOURCES unit/background_writer.cpp unit/hdf5_file.cpp
              LIBRARIES ocublast_hdf5)
add_executable(ranks_probe unit/ranks_probe.cpp)
target_link_libraries(ranks_probe PRIVATE ocublast_ranks ocublast_warnings)
ocublast_test(NAME test_ranks LABEL unit SOURCES unit/ranks.cpp LIBRARIES ocublast_ranks)
target_compile_definitions(test_ranks PRIVATE RANKS_PROBE="$<TARGET_FILE:ranks_probe>")
add_dependencies(test_ranks ranks_probe)
