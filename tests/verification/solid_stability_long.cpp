#include <gtest/gtest.h>

#include "tests/support/solid_stability.hpp"

namespace ocublast::solid {
namespace {

using namespace test;

TEST(StableStep, LiesBelowTheLimitForEveryElement) {
  std::printf("| element | nu | distorted | limit | solver's choice | margin |\n");
  for (const auto& type : make_elements()) {
    if (type.planar) continue;
    for (const double nu : {0.3, 0.49, 0.4995})
      for (const bool distorted : {false, true}) check_step_limit(type, nu, distorted, 2000);
  }
}

}  // namespace
}  // namespace ocublast::solid
