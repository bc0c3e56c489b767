// Whole runs of the program with bodies: a free body from case file to globals.csv, and every kind
// of input about bodies that must be refused.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "coupler/base/hdf5_file.hpp"
#include "flow_solver/io/run.hpp"
#include "tests/unit/immersed_shapes.hpp"

namespace ocublast::flow {
namespace {

using namespace testing;

const char* const head = R"(
[case]
name = "body"
title = "a body in the gas"
[time]
end_s = 1.0e-3
[ambient]
pressure_Pa = 1.0e5
temperature_K = 300.0
[flow.gas]
heat_capacity_ratio = 1.4
gas_constant_J_per_kgK = 287.05
viscosity = "none"
)";

const char* const box = R"(
[flow.grid.x]
min_m = 0.0
max_m = 1.0
spacing_m = 0.02
[flow.grid.y]
min_m = 0.0
max_m = 0.6
spacing_m = 0.02
[flow.boundary]
x_min = "slip_wall"
x_max = "slip_wall"
y_min = "slip_wall"
y_max = "slip_wall"
)";

class BodyRun : public ::testing::Test {
 protected:
  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("ocublast_body_" + std::to_string(getpid()));
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void write_surface(const BodySurface& surface) const {
    auto file = Hdf5File::create(folder_ / "body.h5");
    file.write_attribute("format", std::string("ocublast-mesh"));
    file.write_attribute("version", std::int64_t{1});
    file.write("nodes", surface.vertices, {surface.vertices.size() / 3, 3}, "m");
    file.write("cells/tri3", surface.triangles, {surface.triangles.size() / 3, 3}, "1");
    file.close();
  }
  int run(const std::string& text, const std::vector<std::string>& more = {}) {
    std::ofstream(folder_ / "case.toml") << head << text;
    const std::string file = folder_ / "case.toml", out = folder_ / "out";
    std::vector<std::string> words = {"flow_solver", file,        "--out", out,
                                      "--quiet",     "--threads", "1"};
    words.insert(words.end(), more.begin(), more.end());
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    return run_flow_solver(static_cast<int>(words.size()), argv.data());
  }
  void expect_refusal(const std::string& text, const std::string& reason,
                      const std::vector<std::string>& more = {}) {
    ::testing::internal::CaptureStderr();
    const int code = run(text, more);
    const std::string said = ::testing::internal::GetCapturedStderr();
    EXPECT_EQ(code, 2) << text;
    EXPECT_NE(said.find(reason), std::string::npos) << "expected '" << reason << "' in:\n" << said;
  }
  /// All columns of globals.csv by name.
  std::map<std::string, std::vector<double>> globals() const {
    std::ifstream in(folder_ / "out" / "globals.csv");
    std::map<std::string, std::vector<double>> columns;
    std::vector<std::string> names;
    std::string line, word;
    std::getline(in, line);
    std::stringstream header(line);
    while (std::getline(header, word, ',')) names.push_back(word);
    while (std::getline(in, line)) {
      std::stringstream row(line);
      for (std::size_t c = 0; std::getline(row, word, ','); ++c)
        columns[names.at(c)].push_back(std::stod(word));
    }
    return columns;
  }
};

std::string body(const std::string& keys) {
  return "[[flow.body]]\nname = \"brick\"\nsurface = \"body.h5\"\n" + keys;
}

/// A brick hit off its middle by the shock of a burst diaphragm flies and turns: what globals.csv
/// says of force, impulse, velocity and place must be one motion.
TEST_F(BodyRun, AFreeBrickFliesAndTurnsAsItsLoadsSay) {
  std::vector<std::array<double, 2>> corners;
  for (const auto& [x, y] :
       {std::array{-.1, -.06}, std::array{.1, -.06}, std::array{.1, .06}, std::array{-.1, .06}}) {
    const double c = std::cos(.4), s = std::sin(.4);
    corners.push_back({.5 + c * x - s * y, .3 + s * x + c * y});
  }
  std::vector<std::array<double, 2>> polygon;  // sides in pieces of a cell
  for (std::size_t e = 0; e < 4; ++e) {
    for (int q = 0; q < 10; ++q) {
      const auto &a = corners[e], &b = corners[(e + 1) % 4];
      polygon.push_back({a[0] + .1 * q * (b[0] - a[0]), a[1] + .1 * q * (b[1] - a[1])});
    }
  }
  write_surface(make_prism(polygon, 0.0, 1.0));
  const double mass = .024 * 20.0;  // 20 kg/m^3, one metre deep as the gas
  const double inertia = mass / 12 * (.2 * .2 + .12 * .12);
  const int code = run(std::string(box) +
                       "[flow.initial]\nkind = \"riemann\"\nposition_m = 0.25\n"
                       "[flow.initial.left]\npressure_Pa = 4e5\ntemperature_K = 300.0\n"
                       "[flow.initial.right]\npressure_Pa = 1e5\ntemperature_K = 300.0\n" +
                       body("motion = \"free\"\n[flow.body.free]\ndensity_kg_m3 = 20.0\n"));
  ASSERT_EQ(code, 0);
  const auto g = globals();
  const auto& t = g.at("time_s");
  const std::size_t last = t.size() - 1;
  double x = 0.0, turned = 0.0;
  for (std::size_t n = 1; n <= last; ++n) {
    const auto moment = [&](std::size_t m) {
      return g.at("brick_moment_z_N_m")[m] - g.at("brick_x_m")[m] * g.at("brick_force_y_N")[m] +
             g.at("brick_y_m")[m] * g.at("brick_force_x_N")[m];
    };
    const double dt = t[n] - t[n - 1];
    x += .5 * dt * (g.at("brick_u_m_s")[n] + g.at("brick_u_m_s")[n - 1]);
    turned += .5 * dt * (moment(n) + moment(n - 1));
  }
  const double u = g.at("brick_u_m_s")[last], v = g.at("brick_v_m_s")[last],
               w = g.at("brick_omega_z_rad_s")[last];
  const double impulse_x = g.at("brick_impulse_x_N_s")[last],
               impulse_y = g.at("brick_impulse_y_N_s")[last];
  std::printf(
      "free brick, %zu steps: velocity (%.2f, %.2f) m/s, impulse / mass (%.2f, %.2f), turning %.2f "
      "rad/s "
      "(integrated moment %.2f), shift %.5f m (integrated velocity %.5f), leaked mass %.1e of the "
      "gas\n",
      last, u, v, impulse_x / mass, impulse_y / mass, w, turned / inertia,
      g.at("brick_x_m")[last] - g.at("brick_x_m")[0], x,
      g.at("leaked_mass_kg")[last] / g.at("mass_kg")[0]);
  EXPECT_GT(u, 5.0);
  EXPECT_GT(std::abs(w), 5.0);
  // The body takes each load with the added mass and damping of the gas: the same to the order of
  // the step.
  EXPECT_NEAR(impulse_x / mass, u, .01 * u);
  EXPECT_NEAR(turned / inertia, w, .03 * std::abs(w));
  EXPECT_NEAR(g.at("brick_x_m")[last] - g.at("brick_x_m")[0], x, .01 * x);
  EXPECT_LT(std::abs(g.at("leaked_mass_kg")[last] / g.at("mass_kg")[0]), 5e-3);
}

TEST_F(BodyRun, RefusesFreeBodiesThatCannotBe) {
  write_surface(make_cylinder(.5, .3, .1, 40));
  const std::string free = box + body("motion = \"free\"\n[flow.body.free]\n");
  expect_refusal(free, "give either mass_kg or density_kg_m3");
  expect_refusal(free + "mass_kg = 1.0\ndensity_kg_m3 = 1.0\n",
                 "give either mass_kg or density_kg_m3");
  expect_refusal(free + "mass_kg = -1.0\n", "mass_kg");
  expect_refusal(free + "mass_kg = 1.0\nlocked = [\"turn\"]\n",
                 "'turn', accepted x, y, z, turn_x, turn_y, turn_z");
  expect_refusal(free + "mass_kg = 1.0\ninertia_kg_m2 = [1.0, 1.0]\n", "has 2 numbers, accepted 6");
  expect_refusal(free + "mass_kg = 1.0\ninertia_kg_m2 = [1.0, 1.0, 1.0, 2.0, 0.0, 0.0]\n",
                 "is not positive definite");
  expect_refusal(free + "mass_kg = 1.0\nspeed = 3.0\n", "no such key");
}

TEST_F(BodyRun, RefusesSurfacesThatCannotBe) {
  const std::string fixed = box + body("motion = \"fixed\"\n");
  expect_refusal(fixed, "body.h5");  // no such file
  BodySurface open = make_cylinder(.5, .3, .1, 40);
  open.triangles.resize(open.triangles.size() - 3);
  write_surface(open);
  expect_refusal(fixed, "body 'brick'");
  write_surface(make_cylinder(3.5, .3, .1, 40));
  expect_refusal(fixed, "it lies outside: move the body or the grid");
}

TEST_F(BodyRun, RefusesBodiesWhereTheNumericsCannotHaveThem) {
  write_surface(make_cylinder(.95, .3, .1, 40));
  const std::string fixed = body("motion = \"fixed\"\n");
  expect_refusal(
      box + fixed, "touches the stretched layer",
      {"--set", "flow.boundary.x_max=outflow", "--set", "flow.grid.x.stretch_high.cells=10"});
  write_surface(make_cylinder(.5, .05, .1, 40));
  expect_refusal(
      box + fixed, "periodic",
      {"--set", "flow.boundary.y_min=periodic", "--set", "flow.boundary.y_max=periodic"});
  expect_refusal(box + fixed + "slip = \"no_slip\"\n", "no_slip needs flow.gas.viscosity");
  expect_refusal(box + fixed + "[flow.numerics]\ncfl = 1.5\n", "cfl is 1.5, accepted (0, 1.2]");
  expect_refusal(box + fixed +
                     "[flow.numerics]\nskip_quiescent = true\n[[flow.body]]\nname = "
                     "\"brick\"\nmotion = \"fixed\"\nsurface = \"body.h5\"\n",
                 "'brick' is used twice");
}

}  // namespace
}  // namespace ocublast::flow
