# Tests of this part; see ocublast_test in CMakeLists.txt.
