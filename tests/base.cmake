ocublast_test(NAME test_case_reader LABEL unit SOURCES unit/case_reader.cpp LIBRARIES ocublast_base)
ocublast_test(NAME test_hdf5_file LABEL unit SOURCES unit/hdf5_file.cpp LIBRARIES ocublast_hdf5)
