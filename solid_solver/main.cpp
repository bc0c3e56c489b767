#include "coupler/base/ranks.hpp"
#include "solid_solver/program.hpp"

int main(int argc, char** argv) {
  return ocublast::run_on_ranks("solid_solver", [&](const ocublast::Ranks& ranks) {
    return ocublast::solid::run_program(argc, argv, ranks);
  });
}
