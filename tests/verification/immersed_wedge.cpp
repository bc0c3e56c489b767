// A planar shock on a wedge, immersed at an angle to the grid, against von Neumann's theories and
// against the same wedge lying along a wall of the domain (there the floor before it is immersed).
#include <gtest/gtest.h>

#include <memory>

#include "tests/verification/immersed_rig.hpp"
#include "tests/verification/shock_reflection_theory.hpp"

namespace ocublast::flow {
namespace {

using namespace testing;
using P2 = std::array<double, 2>;

constexpr double degree = std::numbers::pi / 180;

/// The wedge's corner, its faces' directions and the shock in the frame of a grid.
struct Setting {
  double Ms = 0.0, theta = 0.0;  ///< theta in rad
  bool aligned = false;          ///< the wedge along x
  P2 corner{};
  double start = .05;  ///< distance of the shock before the corner at the start
  double h = 0.0;
  flow::State behind;  ///< moving along the floor

  Setting(double Ms_, double theta_, bool aligned_, const P2& corner_, double h_)
      : Ms(Ms_),
        theta(theta_),
        aligned(aligned_),
        corner(corner_),
        h(h_),
        behind(behind_shock(Ms_)) {
    const double speed = behind.u;
    behind.u = speed * floor()[0];
    behind.v = speed * floor()[1];
  }
  [[nodiscard]] P2 floor() const {
    return aligned ? P2{std::cos(theta), -std::sin(theta)} : P2{1, 0};
  }
  [[nodiscard]] P2 wedge() const {
    return aligned ? P2{1, 0} : P2{std::cos(theta), std::sin(theta)};
  }
  /// Point at distance s along the wedge and n above it.
  [[nodiscard]] P2 at(double s, double n) const {
    const P2 w = wedge();
    return {corner[0] + s * w[0] - n * w[1], corner[1] + s * w[1] + n * w[0]};
  }
  [[nodiscard]] double travelled(double t) const { return Ms * std::sqrt(g) * t - start; }
  [[nodiscard]] flow::State state(double t, double x, double y) const {
    const double along = (x - corner[0]) * floor()[0] + (y - corner[1]) * floor()[1];
    return shock_state(along - travelled(t), h, behind);
  }
};

class MovingShock final : public IncomingGas {
 public:
  explicit MovingShock(const Setting& setting) : setting_(setting) {}
  [[nodiscard]] State at(double t, double x, double y, double) const override {
    return setting_.state(t, x, y);
  }

 private:
  Setting setting_;
};

/// What is read when the shock (the reflection's point, or the foot of the undisturbed one) has run
/// `length` along the wedge.
struct Reflection {
  std::vector<double> s, p;  ///< along the wedge, overpressure + 1
  double p2 = 0.0;           ///< mean over the last quarter before the front
  double angle = 0.0;        ///< rad, of the reflected shock to the wedge
  double chi = 0.0;          ///< rad, of the triple point's path to the wedge
  RunCounts counts;
};

constexpr double length = .6;

class WedgeRun {
 public:
  WedgeRun(double Ms, double degrees, int cells, bool aligned)
      : WedgeRun(make_setting(Ms, degrees * degree, cells, aligned)) {}

  Reflection run_to_end() {
    const double t_end =
        (setting_.start + length * std::cos(setting_.theta)) / (setting_.Ms * std::sqrt(g));
    Reflection r;
    r.counts = run(flow_, bodies_, t_end, nothing_before, nothing_after);
    t_ = t_end;
    read_wall(r);
    const double h = setting_.h;
    int count = 0;
    for (std::size_t m = 0; m < r.s.size(); ++m) {
      if (r.s[m] < .75 * length || r.s[m] > length - 8 * h) continue;
      r.p2 += r.p[m];
      ++count;
    }
    r.p2 /= count;
    return r;
  }

  /// Slope of the line on which the pressure passes the middle between p1 and p2.
  double reflection_angle(double p2) const {
    const auto height = [&](double s) {
      const double middle = .5 * (setting_.behind.p + p2);
      double n = 0.0;
      while (pressure_near(setting_.at(s, n + .1 * setting_.h)) > middle) n += .1 * setting_.h;
      return n;
    };
    const double near = length - .08, far = length - .2;
    return std::atan((height(far) - height(near)) / (near - far));
  }

  /// Where the stem, leaning ahead of the incident shock, meets it.
  double triple_point_angle() const {
    // The front's lead over the undisturbed shock falls with the height, linearly near the meeting.
    double s1 = 0, sn = 0, sd = 0, snn = 0, snd = 0;
    double foot_lead = 0.0;
    for (double n = setting_.h; n < .4; n += setting_.h) {
      const double undisturbed =
          (setting_.travelled(t_) + n * std::sin(setting_.theta)) / std::cos(setting_.theta);
      double s = undisturbed + .5 * length;
      while (pressure_near(setting_.at(s, n)) < .5 * (1 + setting_.behind.p)) s -= .1 * setting_.h;
      const double lead = s - undisturbed;
      foot_lead = std::max(foot_lead, lead);
      if (lead > .7 * foot_lead) continue;
      if (lead < .2 * foot_lead) break;
      s1 += 1;
      sn += n;
      sd += lead;
      snn += n * n;
      snd += n * lead;
    }
    const double slope = (s1 * snd - sn * sd) / (s1 * snn - sn * sn);
    const double n = (sn - sd / slope) / s1;
    return std::atan(n * std::cos(setting_.theta) /
                     (setting_.travelled(t_) + n * std::sin(setting_.theta)));
  }

 private:
  struct Parts {
    Setting setting;
    Grid grid;
    std::vector<P2> solid;
  };
  explicit WedgeRun(const Parts& parts)
      : setting_(parts.setting),
        flow_(parts.grid, boundaries(parts.setting), unit_gas_options()),
        bodies_(parts.grid, unit_gas_options().gas,
                {{.name = "wedge", .surface = make_prism(parts.solid, -1, 2)}}, {}) {
    flow_.set_state([&](double x, double y, double) { return setting_.state(0.0, x, y); });
    immerse(flow_, bodies_);
  }
  static Parts make_setting(double Ms, double theta, int cells, bool aligned) {
    // Room for the reflected shock over the wedge and for what runs back along the floor.
    const double h = length / cells, c = std::cos(theta), s = std::sin(theta);
    const double back = .25, ahead = .12, above = .36;
    const P2 size = aligned ? P2{back * c + length + ahead, above + back * s}
                            : P2{back + (length + ahead) * c, (length + ahead) * s + above * c};
    const P2 corner = {aligned ? back * c + .37 * h : back + .37 * h, 0};
    const Grid grid{
        {make_uniform_axis(0, h * std::ceil(size[0] / h), static_cast<int>(std::ceil(size[0] / h))),
         make_uniform_axis(0, h * std::ceil(size[1] / h), static_cast<int>(std::ceil(size[1] / h))),
         make_absent_axis()}};
    Setting setting(Ms, theta, aligned, corner, h);
    // The inclined face in pieces of a cell; it leaves the grid at both ends.
    std::vector<P2> solid;
    const double reach = 2.0;
    const int below = 8, n = static_cast<int>(reach / h);
    if (aligned) {
      for (int q = n; q >= -below; --q) solid.push_back({corner[0] - q * h * c, q * h * s});
      std::reverse(solid.begin(), solid.end());
      solid.push_back({corner[0] - n * h * c, -below * h * s});
    } else {
      for (int q = n; q >= -below; --q) solid.push_back({corner[0] + q * h * c, q * h * s});
      solid.push_back({corner[0] + n * h * c, -below * h * s});
    }
    return {setting, grid, solid};
  }
  static Boundaries boundaries(const Setting& setting) {
    Boundaries b = walls_all_round();
    const auto incoming = std::make_shared<MovingShock>(setting);
    for (const std::size_t face : {0, 1, 3}) {
      if (face != 3 || setting.aligned)
        b[face] = {.kind = BoundaryKind::fixed_state, .incoming = incoming};
    }
    return b;
  }

  void read_wall(Reflection& r) const {
    if (setting_.aligned) {
      for (int i = 0; i < flow_.grid().axis[0].n; ++i) {
        const double s = flow_.grid().axis[0].x(i) - setting_.corner[0];
        if (s < 0 || s > length) continue;
        r.s.push_back(s);
        r.p.push_back((9 * pressure_at(flow_, i, 0) - pressure_at(flow_, i, 1)) /
                      8);  // even about the wall
      }
      return;
    }
    const std::size_t n = bodies_.position(0).size() / 3;
    std::vector<double> p(n);
    bodies_.read_overpressure(flow_.primitives(), 0, 0.0, p);
    for (std::size_t v = 0; v < n; ++v) {
      const P2 x = {bodies_.position(0)[3 * v], bodies_.position(0)[3 * v + 1]};
      if (bodies_.position(0)[3 * v + 2] > 0) continue;  // both ends of the prism read the same
      const double s = (x[0] - setting_.corner[0]) / std::cos(setting_.theta);
      if (s < 0 || s > length || std::abs(x[1] - s * std::sin(setting_.theta)) > .1 * setting_.h)
        continue;
      r.s.push_back(s);
      r.p.push_back(p[v]);
    }
    // From the corner upward.
    if (r.s.front() > r.s.back()) {
      std::reverse(r.s.begin(), r.s.end());
      std::reverse(r.p.begin(), r.p.end());
    }
  }

  /// Bilinear over the fluid nodes around x.
  double pressure_near(const P2& x) const {
    const Grid& grid = flow_.grid();
    const double a = x[0] / setting_.h - .5, b = x[1] / setting_.h - .5;
    const int i = static_cast<int>(std::floor(a)), j = static_cast<int>(std::floor(b));
    double sum = 0.0, weight = 0.0;
    for (int q = 0; q < 4; ++q) {
      const int m = std::clamp(i + (q & 1), 0, grid.axis[0].n - 1), n = std::max(j + (q >> 1), 0);
      if (n >= grid.axis[1].n ||
          bodies_.tags()[static_cast<std::size_t>(n * grid.axis[0].n + m)] != tag_fluid)
        continue;
      const double w = ((q & 1) != 0 ? a - i : 1 - a + i) * ((q >> 1) != 0 ? b - j : 1 - b + j);
      sum += w * pressure_at(flow_, m, n);
      weight += w;
    }
    return weight > 0 ? sum / weight : 1e9;
  }

  Setting setting_;
  Flow flow_;
  ImmersedBoundary bodies_;
  double t_ = 0.0;
};

struct Difference {
  double mean = 0.0, largest = 0.0;
  double where = 0.0;  ///< s of the largest
};

/// Of the wall pressures from the corner to eight cells behind `front`, relative.
Difference compare(const Reflection& a, const Reflection& b, double front) {
  Difference d;
  int count = 0;
  for (std::size_t m = 0; m < a.s.size(); ++m) {
    if (a.s[m] > front) break;
    const auto at = std::upper_bound(b.s.begin(), b.s.end(), a.s[m]);
    if (at == b.s.begin() || at == b.s.end()) continue;
    const auto k = at - b.s.begin();
    const double share = (a.s[m] - b.s[k - 1]) / (b.s[k] - b.s[k - 1]);
    const double off = std::abs(a.p[m] / (b.p[k - 1] + share * (b.p[k] - b.p[k - 1])) - 1);
    d.mean += off;
    if (off > d.largest) d.where = a.s[m];
    d.largest = std::max(d.largest, off);
    ++count;
  }
  d.mean /= count;
  return d;
}

#ifdef OCU_LONG_TESTS
constexpr std::array resolutions = {200};
#else
constexpr std::array resolutions = {100};
#endif

TEST(ImmersedWedge, ReflectsAShockRegularlyAsTwoShockTheorySays) {
  for (const auto& [Ms, degrees] : {P2{1.5, 60}, P2{2.0, 60}}) {
    const RegularReflection theory = regular_reflection(Ms, degrees * degree, g);
    for (const int cells : resolutions) {
      WedgeRun immersed(Ms, degrees, cells, false), along_wall(Ms, degrees, cells, true);
      const Reflection r = immersed.run_to_end(), a = along_wall.run_to_end();
      const double angle = immersed.reflection_angle(theory.p) / degree;
      const double aligned_angle = along_wall.reflection_angle(theory.p) / degree;
      const Difference d = compare(r, a, length - 16 * length / cells);
      std::printf(
          "Ms %.1f on a wedge of %.0f degrees, %d cells along it: p2 %.4f immersed, %.4f "
          "body-aligned "
          "(theory %.4f: %+.2f %%, %+.2f %%), reflected shock at %.2f and %.2f degrees (%.2f), "
          "wall "
          "pressures differ by %.2f %% in the mean, %.2f %% at most (%.3f from the corner); %d "
          "steps, %d redone\n",
          Ms, degrees, cells, r.p2, a.p2, theory.p, 100 * (r.p2 / theory.p - 1),
          100 * (a.p2 / theory.p - 1), angle, aligned_angle, theory.angle / degree, 100 * d.mean,
          100 * d.largest, d.where, r.counts.steps, r.counts.redone);
      ASSERT_TRUE(theory.exists);
      EXPECT_NEAR(r.p2 / theory.p, 1, .01);
      EXPECT_NEAR(angle, theory.angle / degree, 1.0);
      EXPECT_LT(d.mean, .01);
      // Nearer to the front than 16 cells both runs still ring, each in its own way.
      EXPECT_LT(d.largest, .02);
    }
  }
}

TEST(ImmersedWedge, ReflectsAShockWithAStemAsThreeShockTheorySays) {
  for (const auto& [Ms, degrees] : {P2{2.0, 30}}) {
    const MachReflection theory = mach_reflection(Ms, degrees * degree, g);
    for (const int cells : resolutions) {
      WedgeRun immersed(Ms, degrees, cells, false), along_wall(Ms, degrees, cells, true);
      const Reflection r = immersed.run_to_end(), a = along_wall.run_to_end();
      const double chi = immersed.triple_point_angle() / degree,
                   aligned_chi = along_wall.triple_point_angle() / degree;
      const Difference d = compare(r, a, length);
      std::printf(
          "Ms %.1f on a wedge of %.0f degrees, %d cells along it: triple point at %.2f degrees "
          "immersed, "
          "%.2f body-aligned (three-shock theory %.2f), behind the stem %.3f and %.3f (%.3f), wall "
          "pressures differ by %.2f %% in the mean, %.2f %% at most (%.3f from the corner); %d "
          "steps, %d redone\n",
          Ms, degrees, cells, chi, aligned_chi, theory.chi / degree, r.p.back(), a.p.back(),
          theory.p, 100 * d.mean, 100 * d.largest, d.where, r.counts.steps, r.counts.redone);
      EXPECT_NEAR(chi, aligned_chi, .5);
      EXPECT_NEAR(chi, theory.chi / degree, 1.5);
      EXPECT_LT(d.mean, .01);
      // Ten cells behind the front both runs still ring, each in its own way.
      EXPECT_LT(d.largest, .03);
    }
  }
}

}  // namespace
}  // namespace ocublast::flow
