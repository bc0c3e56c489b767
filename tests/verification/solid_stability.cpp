#include "tests/support/solid_stability.hpp"

#include <gtest/gtest.h>

namespace ocublast::solid {
namespace {

using namespace test;

TEST(StableStep, LiesBelowTheLimitFoundByBisection) {
  std::printf("| element | nu | distorted | limit | solver's choice | margin |\n");
  for (const auto& type : make_elements())
    if (type.name == "hex8_q1p0" || type.name == "hex8_one_point")
      for (const double nu : {0.3, 0.4995}) check_step_limit(type, nu, true, 1000);
}

}  // namespace
}  // namespace ocublast::solid
