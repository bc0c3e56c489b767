#include "flow_solver/sources/charge.hpp"

#include <algorithm>
#include <cmath>

#include "flow_solver/grid/make_grid.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

constexpr TntCalibration calibration;
/// Sub-points per direction of a cell in the mean of a wave's state.
constexpr int sub_points = 6;

using Point = std::array<double, 3>;

/// Part of a ball about `center` that the planes of symmetry through it leave.
double share_of(const Grid& grid, const Point& center) {
  double share = 1.0;
  for (std::size_t a = 0; a < 3; ++a) {
    const Axis& axis = grid.axis[a];
    if (!axis.present || (a == 0 && grid.geometry != Geometry::cartesian)) continue;
    const double near = 1e-9 * (axis.max - axis.min);
    if (std::abs(center[a] - axis.min) <= near || std::abs(center[a] - axis.max) <= near)
      share *= 0.5;
  }
  return share;
}

struct CellMean {
  std::array<double, 5> change{};
};

class Sampler {
 public:
  Sampler(const Grid& grid, const SteppedWave& wave, const Point& center)
      : grid_(&grid),
        wave_(&wave),
        center_(center),
        t_(wave.time()),
        energy0_(wave.ambient().p / (wave.gas().heat_capacity_ratio - 1.0)) {}

  [[nodiscard]] CellMean mean(int i, int j, int k) const {
    const int at[3] = {i, j, k};
    int n[3];
    for (std::size_t a = 0; a < 3; ++a) n[a] = grid_->axis[a].present ? sub_points : 1;
    CellMean cell;
    double weights = 0.0;
    for (int c = 0; c < n[2]; ++c)
      for (int b = 0; b < n[1]; ++b)
        for (int a = 0; a < n[0]; ++a) {
          const int s[3] = {a, b, c};
          Point x;
          for (std::size_t d = 0; d < 3; ++d) {
            const Axis& axis = grid_->axis[d];
            x[d] = axis.x(at[d]) + axis.h(at[d]) * ((s[d] + 0.5) / n[d] - 0.5);
          }
          const double weight = grid_->geometry == Geometry::cartesian
                                    ? 1.0
                                    : std::pow(std::abs(x[0]), grid_->radial_power());
          add(x, weight, cell);
          weights += weight;
        }
    for (double& v : cell.change) v /= weights;
    return cell;
  }

 private:
  void add(const Point& x, double weight, CellMean& cell) const {
    const double r = distance_from(*grid_, center_, x);
    const RadialState s = wave_->at(r, t_);
    cell.change[0] += weight * (s.rho - wave_->ambient().rho);
    for (std::size_t a = 0; a < 3; ++a) {
      if (grid_->axis[a].present && r > 0.0)
        cell.change[1 + a] += weight * s.rho * s.u * (x[a] - center_[a]) / r;
    }
    cell.change[4] += weight * (s.internal_energy + 0.5 * s.rho * s.u * s.u - energy0_);
  }

  const Grid* grid_;
  const SteppedWave* wave_;
  Point center_;
  double t_, energy0_;
};

/// Scales mass and energy within the front so that their sums are those asked for.
void correct_sums(const Grid& grid, const SteppedWave& wave,
                  const std::vector<std::uint8_t>& touched, const RadialTotals& asked,
                  WaveOnGrid& out) {
  const double rho0 = wave.ambient().rho,
               e0 = wave.ambient().p / (wave.gas().heat_capacity_ratio - 1.0);
  RadialTotals sum, whole;
  std::vector<double> volume(touched.size(), 0.0);
  std::size_t cell = 0;
  for (int k = 0; k < grid.axis[2].n; ++k)
    for (int j = 0; j < grid.axis[1].n; ++j)
      for (int i = 0; i < grid.axis[0].n; ++i, ++cell) {
        if (touched[cell] == 0) continue;
        volume[cell] = cell_volume(grid, i, j, k);
        sum.mass += volume[cell] * out.change[cell][0];
        sum.energy += volume[cell] * out.change[cell][4];
        whole.mass += volume[cell] * (rho0 + out.change[cell][0]);
        whole.energy += volume[cell] * (e0 + out.change[cell][4]);
      }
  const double mass_factor = (asked.mass - sum.mass) / whole.mass;
  const double energy_factor = (asked.energy - sum.energy) / whole.energy;
  for (cell = 0; cell < touched.size(); ++cell) {
    if (touched[cell] == 0) continue;
    auto& change = out.change[cell];
    change[0] += mass_factor * (rho0 + change[0]);
    for (std::size_t a = 1; a < 4; ++a) change[a] *= 1.0 + mass_factor;
    change[4] += energy_factor * (e0 + change[4]);
    out.report.mass += volume[cell] * change[0];
    out.report.energy += volume[cell] * change[4];
  }
}

}  // namespace

double mirrored_tnt_mass(double mass, BurstKind burst) {
  return burst == BurstKind::surface ? 2.0 * calibration.surface_share * mass : mass;
}

BallStart tnt_ball(double mass, BurstKind burst) {
  const double whole = mirrored_tnt_mass(mass, burst);
  return {.energy = calibration.energy * whole,
          .radius = calibration.radius * std::cbrt(whole),
          .mass = calibration.mass * whole};
}

double tnt_delay(double mass, BurstKind burst) {
  return calibration.delay * std::cbrt(mirrored_tnt_mass(mass, burst));
}

double distance_from(const Grid& grid, const Point& center, const Point& x) {
  double sum = 0.0;
  for (std::size_t a = 0; a < 3; ++a)
    if (grid.axis[a].present) sum += (x[a] - center[a]) * (x[a] - center[a]);
  return std::sqrt(sum);
}

WaveOnGrid make_wave_on_grid(const Grid& grid, const SteppedWave& wave, const Point& center) {
  WaveOnGrid out;
  out.change.assign(grid.n_cells(), {});
  out.report.time = wave.time();
  out.report.front = wave.front_radius(wave.time());
  std::vector<std::uint8_t> touched(grid.n_cells(), 0);
  const Sampler sampler(grid, wave, center);
  const int n0 = grid.axis[0].n, n1 = grid.axis[1].n, n2 = grid.axis[2].n;
#pragma omp parallel for schedule(dynamic) collapse(2)
  for (int k = 0; k < n2; ++k)
    for (int j = 0; j < n1; ++j)
      for (int i = 0; i < n0; ++i) {
        const int at[3] = {i, j, k};
        Point x;
        double reach = 0.0;
        for (std::size_t a = 0; a < 3; ++a) {
          x[a] = grid.axis[a].x(at[a]);
          if (grid.axis[a].present) reach += 0.25 * grid.axis[a].h(at[a]) * grid.axis[a].h(at[a]);
        }
        if (distance_from(grid, center, x) - std::sqrt(reach) > out.report.front) continue;
        const auto cell = static_cast<std::size_t>((k * n1 + j) * n0 + i);
        touched[cell] = 1;
        out.change[cell] = sampler.mean(i, j, k).change;
      }
  const double share = share_of(grid, center);
  const RadialTotals whole = wave.totals();
  out.report.mass_asked = share * whole.mass;
  out.report.energy_asked = share * whole.energy;
  correct_sums(grid, wave, touched, {share * whole.mass, share * whole.energy}, out);
  return out;
}

void IncidentWaves::cover(double begin, double end) {
  for (const PlacedWave& w : waves_)
    w.wave->cover(begin + start_ - w.delay, end + start_ - w.delay);
}

State IncidentWaves::at(double t, double x, double y, double z) const {
  State sum = ambient_;
  for (const PlacedWave& w : waves_) {
    const Point d{x - w.center[0], y - w.center[1], z - w.center[2]};
    const double r = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    const RadialState s = w.wave->at(r, t + start_ - w.delay);
    sum.rho += s.rho - ambient_.rho;
    sum.u += s.u * d[0] / r;
    sum.v += s.u * d[1] / r;
    sum.w += s.u * d[2] / r;
    sum.p += s.p - ambient_.p;
  }
  // Overlapping tails may sum to less than nothing.
  sum.rho = std::max(sum.rho, 0.05 * ambient_.rho);
  sum.p = std::max(sum.p, 0.05 * ambient_.p);
  return sum;
}

PrescribedWave::PrescribedWave(const Gas& gas, const State& ambient, BurstKind burst, double mass,
                               double r_min, double r_max)
    : gas_(gas), ambient_(ambient), r_min_(r_min) {
  // Curves are smooth in log r: steps of 1 % leave an interpolation error below 1e-4.
  constexpr double ratio = 1.01;
  step_ = std::log(ratio);
  for (double r = r_min; r < r_max * ratio * ratio; r *= ratio)
    forms_.push_back(blast_wave_form(burst, mass, r, false));
}

BlastWaveForm PrescribedWave::form(double r) const {
  const double s =
      std::clamp(std::log(r / r_min_) / step_, 0.0, static_cast<double>(forms_.size()) - 1.001);
  const auto i = static_cast<std::size_t>(s);
  const double f = s - static_cast<double>(i);
  const auto mix = [f](double a, double b) { return (1.0 - f) * a + f * b; };
  const BlastWaveForm &a = forms_[i], &b = forms_[i + 1];
  return {mix(a.peak, b.peak), mix(a.arrival, b.arrival), mix(a.duration, b.duration),
          mix(a.decay, b.decay)};
}

RadialState PrescribedWave::at(double r, double t) const {
  const double gamma = gas_.heat_capacity_ratio;
  const BlastWaveForm wave = form(r);
  RadialState s{ambient_.rho, 0.0, ambient_.p, ambient_.p / (gamma - 1.0)};
  if (t < wave.arrival) return s;
  const double jump = wave.peak / ambient_.p;
  const double mach = std::sqrt(1.0 + (gamma + 1.0) / (2.0 * gamma) * jump);
  const double c0 = std::sqrt(gamma * ambient_.p / ambient_.rho);
  const double u_front = wave.peak / (ambient_.rho * mach * c0);
  const double rho_front = ambient_.rho * mach * c0 / (mach * c0 - u_front);
  const double over = wave.overpressure(t);
  s.p = std::max(ambient_.p + over, 0.05 * ambient_.p);
  s.u = u_front * over / wave.peak;
  s.rho = rho_front * std::pow(s.p / (ambient_.p + wave.peak), 1.0 / gamma);
  s.internal_energy = s.p / (gamma - 1.0);
  return s;
}

double PrescribedWave::front_radius(double t) const {
  std::size_t i = 0;
  while (i < forms_.size() && forms_[i].arrival < t) ++i;
  return r_min_ * std::exp(step_ * static_cast<double>(i));
}

}  // namespace ocublast::flow
