#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <utility>
#include <vector>

#include "coupler/base/errors.hpp"
#include "coupler/coupling_state.hpp"
#include "coupler/link/checkpoint_place.hpp"
#include "coupler/predictor.hpp"
#include "coupler/time_window.hpp"

using namespace ocublast;
using namespace ocublast::coupler;

namespace {

struct Prediction {
  double x, v;
};

Prediction predict(double x, double v, double v_before, double width_before, int order,
                   double width) {
  const std::array<double, 1> xs{x}, vs{v}, before{v_before};
  std::array<double, 1> x_star{}, v_star{};
  predict_wall(
      {.position = xs, .velocity = vs, .velocity_before = before, .width_before = width_before},
      order, width, x_star, v_star);
  return {x_star[0], v_star[0]};
}

}  // namespace

TEST(Predictor, EqualWindowsGiveTheTwoPointFormula) {
  // x + w (3/2 v(n) - 1/2 v(n-1)) and 2 v(n) - v(n-1), with numbers exact in binary.
  const Prediction p = predict(1.0, 4.0, 2.0, 0.5, 2, 0.5);
  EXPECT_EQ(p.x, 1.0 + 0.5 * (6.0 - 1.0));
  EXPECT_EQ(p.v, 6.0);
}

TEST(Predictor, ConstantAccelerationIsExactForWindowsOfAnyWidth) {
  const double a = -3.0, v0 = 2.0, x0 = 0.25;
  for (const double width_before : {0.5, 0.125, 2.0})
    for (const double width : {0.25, 1.0, 0.0625}) {
      const double t = width;  // time counts from the end of the last window
      const Prediction p = predict(x0, v0, v0 - a * width_before, width_before, 2, width);
      // A few operations of round-off: 4 eps of the largest term.
      EXPECT_NEAR(p.x, x0 + v0 * t + 0.5 * a * t * t, 4e-16 * 8);
      EXPECT_NEAR(p.v, v0 + a * t, 4e-16 * 8);
    }
}

TEST(Predictor, ErrorOfOrderTwoFallsWithTheCubeOfTheWindow) {
  const auto error = [](double w) {
    const double t = 0.7;
    const Prediction p = predict(std::sin(t), std::cos(t), std::cos(t - 0.6 * w), 0.6 * w, 2, w);
    return std::abs(p.x - std::sin(t + w));
  };
  const double order = std::log2(error(0.02) / error(0.01));
  std::printf("order of the position predicted over windows of changing width: %.3f\n", order);
  EXPECT_NEAR(order, 3.0, 0.05);  // local error w^3; next term w / 3 relative at w = 0.02
}

TEST(Predictor, FirstWindowAndLowerOrdersUseWhatThereIs) {
  EXPECT_EQ(predict(1.0, 2.0, 0.0, 0.0, 2, 0.5).x, 2.0);
  EXPECT_EQ(predict(1.0, 2.0, 9.0, 0.5, 1, 0.5).x, 2.0);
  EXPECT_EQ(predict(1.0, 2.0, 9.0, 0.5, 0, 0.5).x, 1.0);
  EXPECT_EQ(predict(1.0, 2.0, 9.0, 0.5, 0, 0.5).v, 2.0);
}

TEST(Predictor, SaysWhetherAllItMadeIsFinite) {
  // 21 numbers: two blocks of eight lanes and a rest. Whatever is wrong at any place of any array
  // must show.
  constexpr std::size_t n = 21;
  const double inf = std::numeric_limits<double>::infinity();
  for (const int order : {0, 1, 2})
    for (const bool accelerated : {false, true}) {
      std::array<double, n> x{}, v{}, before{}, a{}, x_star{}, v_star{};
      x.fill(1.0);
      v.fill(2.0);
      WallHistory history{
          .position = x, .velocity = v, .velocity_before = before, .width_before = 0.5};
      if (accelerated) history.acceleration = a;
      const auto finite = [&] { return predict_wall(history, order, 0.5, x_star, v_star); };
      EXPECT_TRUE(finite());
      std::vector<std::array<double, n>*> read{&x, &v};
      if (accelerated && order == 2) read.push_back(&a);
      for (auto* values : read)
        for (std::size_t i = 0; i < n; ++i)
          for (const double bad : {inf, -inf, std::nan("")}) {
            const double kept = std::exchange((*values)[i], bad);
            EXPECT_FALSE(finite()) << "order " << order << ", number " << i << " is " << bad;
            (*values)[i] = kept;
          }
    }
}

TEST(Predictor, MakesUpForAShareOfWhatThePositionMisses) {
  // Sent to 1 m, 2 m/s; predicted 3.5 m, 4 m/s half a second later: on the path 1 + 0.5 * 3 = 2.5
  // m.
  const std::array<double, 1> x{1.5}, v{4.0};
  const std::array<double, 2> sent{1.0, 2.0};
  for (const int order : {1, 2})  // constant velocity: both orders are exact in binary
    for (const double share : {0.0, 0.25, 1.0}) {
      std::array<double, 1> x_star{}, v_star{};
      predict_wall({.position = x, .velocity = v, .velocity_before = v, .width_before = 0.25},
                   order, 0.5, x_star, v_star, {.motion = sent, .width = 0.5, .share = share});
      EXPECT_EQ(x_star[0], 2.5 + share);
      EXPECT_EQ(v_star[0], 4.0);
    }
}

TEST(TimeWindow, TheLastOneEndsExactlyAtTheEndAndNoneIsASliver) {
  const WindowChoice choice{.rule = WindowRule::subcycle, .max_solid_steps = 10, .end_time = 1.0};
  for (const double stable : {0.3, 0.1, 0.0999999, 1.0 / 7.0, 0.013}) {
    double t = 0.0;
    std::uint64_t n = 0;
    double shortest = 1.0;
    while (t < choice.end_time) {
      const TimeWindow w = next_window(choice, n, t, stable, stable / 3.0);
      EXPECT_EQ(w.t_begin, t);
      EXPECT_LE(w.width(), stable * (1 + 1e-8));
      EXPECT_EQ(w.number, ++n);
      shortest = std::min(shortest, w.width());
      t = w.t_end;
    }
    EXPECT_EQ(t, 1.0);
    EXPECT_GT(shortest, 0.5 * stable) << stable;
    EXPECT_EQ(n, static_cast<std::uint64_t>(std::ceil(1.0 / stable * (1 - 1e-9)))) << stable;
  }
}

TEST(TimeWindow, SolidStepsAreLimitedByAShorterWindow) {
  const WindowChoice choice{.rule = WindowRule::subcycle, .max_solid_steps = 10, .end_time = 1e9};
  const TimeWindow few = next_window(choice, 0, 0.0, 1.0, 0.25);
  EXPECT_EQ(few.steps_flow, 1U);
  EXPECT_EQ(few.steps_solid, 4U);
  const TimeWindow many = next_window(choice, 0, 0.0, 1.0, 0.01);
  EXPECT_EQ(many.steps_solid, 10U);
  EXPECT_NEAR(many.width(), 0.1, 1e-9);
}

TEST(TimeWindow, LockstepTakesTheSmallerStepOnceOnBothSides) {
  const WindowChoice choice{.rule = WindowRule::lockstep, .end_time = 10.0};
  const TimeWindow w = next_window(choice, 0, 0.0, 1.0, 0.25);
  EXPECT_EQ(w.t_end, 0.25);
  EXPECT_EQ(w.steps_flow, 1U);
  EXPECT_EQ(w.steps_solid, 1U);
}

TEST(TimeWindow, FixedWidthSubcyclesBothSides) {
  const WindowChoice choice{.rule = WindowRule::fixed, .fixed_width = 0.5, .end_time = 10.0};
  const TimeWindow w = next_window(choice, 0, 0.0, 0.2, 0.1);
  EXPECT_EQ(w.steps_flow, 3U);
  EXPECT_EQ(w.steps_solid, 5U);
}

TEST(TimeWindow, AStepTooShortToAdvanceIsAnError) {
  const WindowChoice choice{.rule = WindowRule::subcycle, .end_time = 2.0};
  EXPECT_THROW(static_cast<void>(next_window(choice, 0, 1.0, 1e-18, 1e-18)), NumericsError);
}

TEST(CouplingState, ComesBackFromItsFileBitForBit) {
  const auto directory =
      std::filesystem::temp_directory_path() / ("ocublast_state_" + std::to_string(getpid()));
  std::filesystem::create_directories(directory);
  CouplingState s;
  s.window = 17;
  s.time = 0.1 + 0.2;
  s.stable_flow = 1.0 / 3.0;
  s.width_before = 1e-7;
  s.zero_loads = 6;
  s.position = SharedValues::from({0.1, 0.2, 0.3});
  s.velocity = SharedValues::from({-0.1, 1e-300, 5.0});
  s.velocity_before = SharedValues::from({7.0, 8.0, -9.0});
  s.balance.add(1.0 / 7.0, 1.0 / 9.0, {1, 2, 3}, {4, 5, 6});
  write_state(directory, s, 11, 12);
  const StoredState back = read_state(directory);
  EXPECT_EQ(back.case_hash, 11U);
  EXPECT_EQ(back.mesh_hash, 12U);
  EXPECT_EQ(back.state.time, s.time);
  EXPECT_EQ(back.state.balance, s.balance);
  EXPECT_EQ(back.state.zero_loads, 6U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(back.state.position.values[i], s.position.values[i]);
    EXPECT_EQ(back.state.velocity.values[i], s.velocity.values[i]);
    EXPECT_EQ(back.state.velocity_before.values[i], s.velocity_before.values[i]);
  }
  std::filesystem::resize_file(directory / "coupler.state", 60);
  EXPECT_THROW(static_cast<void>(read_state(directory)), LinkError);
  std::filesystem::remove_all(directory);
}

TEST(Checkpoint, OnlyCompleteOnesAreFoundAndTwoAreKept) {
  const auto run =
      std::filesystem::temp_directory_path() / ("ocublast_checkpoints_" + std::to_string(getpid()));
  std::filesystem::remove_all(run);
  EXPECT_FALSE(link::find_checkpoint(run));
  for (const std::uint64_t window : {5, 10, 15}) {
    static_cast<void>(begin_checkpoint(run, window));
    complete_checkpoint(run, window, 2);
  }
  static_cast<void>(begin_checkpoint(run, 20));
  EXPECT_EQ(link::require_checkpoint(run).window, 15U);
  EXPECT_FALSE(std::filesystem::exists(link::checkpoint_directory(run, 5)));
  EXPECT_TRUE(std::filesystem::exists(link::checkpoint_directory(run, 10)));
  EXPECT_EQ(link::require_checkpoint(link::checkpoint_directory(run, 10)).window, 10U);
  std::filesystem::remove_all(run);
}
