#include "coupler/base/errors.hpp"
#include "coupler/commands.hpp"

int main(int argc, char** argv) {
  try {
    return ocublast::coupler::run_command_line(argc, argv);
  } catch (...) {
    return ocublast::report_current_exception("coupler");
  }
}
