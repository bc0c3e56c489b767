#include <gtest/gtest.h>

#include <string>

namespace ocublast::flow {
#define OCU_DECLARE(set)            \
  namespace double_precision::set { \
  std::string check_lanes();        \
  }                                 \
  namespace single_precision::set { \
  std::string check_lanes();        \
  }
inline namespace double_precision {}
OCU_DECLARE(isa_baseline)
OCU_DECLARE(isa_avx2)
OCU_DECLARE(isa_avx512)

namespace {

TEST(Lanes, ActAsSingleValuesInEveryInstructionSet) {
  EXPECT_EQ(double_precision::isa_baseline::check_lanes(), "");
  EXPECT_EQ(single_precision::isa_baseline::check_lanes(), "");
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
    EXPECT_EQ(double_precision::isa_avx2::check_lanes(), "");
    EXPECT_EQ(single_precision::isa_avx2::check_lanes(), "");
  }
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq")) {
    EXPECT_EQ(double_precision::isa_avx512::check_lanes(), "");
    EXPECT_EQ(single_precision::isa_avx512::check_lanes(), "");
  }
}

}  // namespace
}  // namespace ocublast::flow
