#include "flow_solver/io/run.hpp"

int main(int argc, char** argv) {
  return ocublast::flow::run_flow_solver(argc, argv);
}
