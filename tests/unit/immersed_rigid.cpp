// Rigid motion: laws, tables, masses, and free bodies under known loads.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "coupler/base/errors.hpp"
#include "flow_solver/immersed/free_body.hpp"
#include "tests/unit/immersed_shapes.hpp"

namespace ocublast::flow {
namespace {

using namespace testing;

TEST(MotionTableSpline, FollowsASineToFourthOrderInTheInterior) {
  double error[2];
  for (const int level : {0, 1}) {
    const int n = 40 << level;
    std::vector<double> time;
    std::vector<MotionTable::Row> rows;
    for (int i = 0; i <= n; ++i) {
      // Non-uniform times; the sine's second derivative vanishes at both ends, as the spline's.
      const double s = static_cast<double>(i) / n;
      time.push_back(s + .02 * std::sin(6 * std::numbers::pi * s));
      const double y = std::sin(2 * std::numbers::pi * time.back());
      rows.push_back({y, -y, 0, 2 * y});
    }
    const MotionTable table(time, rows);
    error[level] = 0.0;
    for (int q = 0; q <= 1000; ++q) {
      const double t = q / 1000.0;
      error[level] = std::max(error[level],
                              std::abs(table.at(t).value[0] - std::sin(2 * std::numbers::pi * t)));
      EXPECT_NEAR(table.at(t).rate[3], 4 * std::numbers::pi * std::cos(2 * std::numbers::pi * t),
                  level == 0 ? 2e-2 : 3e-3);
    }
  }
  EXPECT_LT(error[1], error[0] / 12);  // 16 in the limit
  EXPECT_LT(error[0], 2e-5);
}

TEST(MotionTableFile, NamesTheLineThatIsWrong) {
  const auto file = std::filesystem::temp_directory_path() /
                    ("ocublast_motion_" + std::to_string(getpid()) + ".csv");
  const auto message = [&](const std::string& text) {
    std::ofstream(file) << text;
    try {
      static_cast<void>(read_motion_table(file));
    } catch (const CaseError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const std::string header = "time_s,x_m,y_m,z_m,angle_rad\n";
  EXPECT_EQ(message(header + "0,0,0,0,0\n1,1,0,0,0\n"), "");
  EXPECT_NE(message("t,x\n0,0\n").find(":1: header is 't,x'"), std::string::npos);
  EXPECT_NE(message(header + "0,0,0,0,0\n1,1,x,0,0\n").find(":3: expected five numbers"),
            std::string::npos);
  EXPECT_NE(message(header + "0,0,0,0,0\n").find("at least 2"), std::string::npos);
  EXPECT_NE(message(header + "0,0,0,0,0\n0,1,0,0,0\n").find("does not follow"), std::string::npos);
  std::filesystem::remove(file);
}

TEST(RigidPath, HasTheVelocitiesOfItsPositions) {
  RigidPath path{.velocity = {1, -2, .5},
                 .amplitude = {.1, .2, -.3},
                 .angular_frequency = 3.0,
                 .rotation_axis = {1, 2, -1},
                 .rotation_center = {.3, .1, 0},
                 .angular_velocity = 2.0,
                 .angle_amplitude = .7};
  path.table =
      MotionTable({0, .5, 1, 2}, {{0, 0, 0, 0}, {.1, 0, 0, .4}, {0, .3, 0, -.1}, {0, 0, 0, 0}});
  const BodySurface box = make_box({0, 0, 0}, {1, 1, 1});
  const Vec3 center{path.rotation_center};
  std::vector<double> x, v, x_low, x_high, unused;
  constexpr double dt = 1e-4;
  for (const double t : {.2, .77, 1.5}) {
    place_vertices(box.vertices, center, path.at(t), x, v);
    place_vertices(box.vertices, center, path.at(t - dt), x_low, unused);
    place_vertices(box.vertices, center, path.at(t + dt), x_high, unused);
    for (std::size_t n = 0; n < x.size(); ++n) {
      // Central difference: third derivatives of some 100/s^3 times dt^2 / 6.
      EXPECT_NEAR((x_high[n] - x_low[n]) / (2 * dt), v[n], 1e-6);
    }
    // Rigid: the box's diagonal keeps its length.
    const double length = norm(Vec3{{x[0] - x[21], x[1] - x[22], x[2] - x[23]}});
    const double rest =
        norm(Vec3{{box.vertices[0] - box.vertices[21], box.vertices[1] - box.vertices[22],
                   box.vertices[2] - box.vertices[23]}});
    EXPECT_NEAR(length, rest, 1e-14);
  }
}

TEST(RigidMass, OfABoxAndASphereIsExact) {
  const MassProperties box = mass_of_surface(make_box({1, 2, 3}, {2, 4, 6}, 3), 2.0);
  EXPECT_NEAR(box.mass, 12.0, 1e-13);
  EXPECT_NEAR(box.center[0], 1.5, 1e-14);
  EXPECT_NEAR(box.center[1], 3.0, 1e-14);
  EXPECT_NEAR(box.center[2], 4.5, 1e-14);
  EXPECT_NEAR(box.inertia[0], 12.0 * (4 + 9) / 12, 1e-12);
  EXPECT_NEAR(box.inertia[1], 12.0 * (1 + 9) / 12, 1e-12);
  EXPECT_NEAR(box.inertia[2], 12.0 * (1 + 4) / 12, 1e-12);
  for (std::size_t q = 3; q < 6; ++q) EXPECT_NEAR(box.inertia[q], 0.0, 1e-12);
  const MassProperties ball = mass_of_surface(make_sphere({5, 0, -2}, .5, 5), 1.0);
  // The inscribed polyhedron: 1 - O(edge^2 / R^2) of the sphere's mass.
  EXPECT_NEAR(ball.mass / (4.0 / 3 * std::numbers::pi * .125), 1.0, 2e-3);
  EXPECT_NEAR(ball.inertia[0] / (.4 * ball.mass * .25), 1.0, 2e-3);
  EXPECT_NEAR(ball.inertia[3] / ball.inertia[0], 0.0, 1e-12);
}

BodyLoad no_load() {
  return {};
}

TEST(FreeBody, TumblesWithoutLoadAndKeepsAngularMomentumAndEnergy) {
  // The axis of middle inertia: the motion is not steady (Dzhanibekov).
  const BodySurface box = make_box({0, 0, 0}, {1, 2, 3});
  double drift[2], error[2];
  for (const int level : {0, 1}) {
    FreeBody body(box, mass_of_surface(box, 1.0),
                  {.gravity = {}, .velocity = {{1, 0, 0}}, .angular_velocity = {{.05, 3.0, .02}}});
    body.start(no_load());
    const Vec3 L = body.angular_momentum();
    const double E = body.kinetic_energy();
    const int n = 2000 << level;
    const double dt = 10.0 / n;
    std::vector<double> x, v;
    drift[level] = error[level] = 0.0;
    double farthest = 0.0;
    for (int s = 0; s < n; ++s) {
      body.predict(dt, x, v);
      body.correct(dt, no_load());
      drift[level] = std::max(drift[level], norm(body.angular_momentum() - L) / norm(L));
      error[level] = std::max(error[level], std::abs(body.kinetic_energy() / E - 1.0));
      farthest = std::max(farthest, std::abs(body.state().angular_velocity[0]));
    }
    EXPECT_GT(farthest, 1.0);  // it did tumble
    EXPECT_NEAR(body.state().center[0], body.mass().center[0] + 10.0, 1e-11);
  }
  std::printf("tumbling box: angular momentum to %.1e, energy to %.1e, %.1e (order %.2f)\n",
              drift[1], error[0], error[1], std::log2(error[0] / error[1]));
  EXPECT_LT(drift[1], 1e-7);  // passes of the orientation leave their fourth power of the step
  EXPECT_LT(error[1], 1e-4);
  EXPECT_GT(std::log2(error[0] / error[1]), 1.8);
}

TEST(FreeBody, FallsAndTurnsUnderAConstantLoad) {
  const BodySurface box = make_box({-1, -1, -1}, {1, 1, 1});
  FreeBody body(box, mass_of_surface(box, .5),
                {.translates = {true, true, false},
                 .rotates = {false, false, true},
                 .gravity = {{0, -10, 0}}});
  // mass 4, I = 4 (4 + 4) / 12
  BodyLoad load;
  load.force = {8, 0, 5};
  std::vector<double> x, v;
  constexpr double dt = .01;
  for (int s = 0; s < 100; ++s) {
    // Moment 2 about the center, wherever it is.
    const Vec3 c = body.state().center;
    const auto moment = [&](const Vec3& at) { load.moment = {0, 0, 2.0 + at[0] * 0 - at[1] * 8}; };
    if (s == 0) {
      moment(c);
      body.start(load);
    }
    body.predict(dt, x, v);
    Vec3 middle;
    for (std::size_t n = 0; n < x.size(); ++n) middle.c[n % 3] += x[n] / 8;
    moment(middle);
    body.correct(dt, load);
  }
  const RigidState& s = body.state();
  EXPECT_NEAR(s.velocity[0], 2.0, 1e-12);
  EXPECT_NEAR(s.center[0], 1.0, 1e-12);
  EXPECT_NEAR(s.velocity[1], -10.0, 1e-11);
  EXPECT_NEAR(s.center[1], -5.0, 1e-11);
  EXPECT_EQ(s.center[2], body.mass().center[2]);  // locked
  EXPECT_NEAR(s.angular_velocity[2], 2.0 / (4.0 * 8 / 12), 1e-11);
  EXPECT_NEAR(2 * std::atan2(s.rotation.v[2], s.rotation.w), .5 * 2.0 / (4.0 * 8 / 12), 1e-11);
}

TEST(FreeBody, ContinuesFromWhatItSaved) {
  const BodySurface box = make_box({-1, -1, -1}, {1, 2, 1});
  const FreeBodyOptions options{
      .gravity = {{0, 0, -1}}, .velocity = {{1, 0, 0}}, .angular_velocity = {{.1, .2, .3}}};
  BodyLoad load;
  load.force = {1, 2, 3};
  load.moment = {.1, .2, -.3};
  for (std::size_t a = 0; a < 6; ++a) load.impedance[7 * a] = .5;
  FreeBody one(box, mass_of_surface(box, 1), options), two(box, mass_of_surface(box, 1), options);
  one.start(load);
  std::vector<double> x, v, y, w;
  for (int s = 0; s < 5; ++s) {
    one.predict(.1, x, v);
    one.correct(.1, load);
  }
  const auto saved = one.save();
  two.restore(saved);
  one.predict(.1, x, v);
  two.predict(.1, y, w);
  EXPECT_EQ(x, y);
  EXPECT_EQ(v, w);
  one.correct(.1, load);
  two.correct(.1, load);
  EXPECT_EQ(one.save(), two.save());
}

}  // namespace
}  // namespace ocublast::flow
