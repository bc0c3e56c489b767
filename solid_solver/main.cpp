#include "coupler/base/errors.hpp"
#include "solid_solver/program.hpp"

int main(int argc, char** argv) {
  try {
    return ocublast::solid::run_program(argc, argv);
  } catch (...) {
    return ocublast::report_current_exception("solid_solver");
  }
}
