// Charges in whole 3-D runs of the program: a height of burst over a plane of symmetry against two
// charges without it, and a prescribed wave against the curves it was made from.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "flow_solver/io/run.hpp"
#include "flow_solver/sources/kingery_bulmash.hpp"

namespace ocublast::flow {
namespace {

std::string axis(char name, double low, double high, double spacing) {
  std::ostringstream text;
  text << "[flow.grid." << name << "]\nmin_m = " << std::showpoint << low << "\nmax_m = " << high
       << "\nspacing_m = " << spacing << "\n";
  return text.str();
}

struct Sample {
  double t = 0.0, overpressure = 0.0;
};

/// Runs a case text; the history at its one probe.
std::vector<Sample> run(const std::string& text, double end) {
  const auto folder =
      std::filesystem::temp_directory_path() / ("ocublast_charge_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "case.toml")
      << "[case]\nname = \"charges\"\ntitle = \"charges\"\n[time]\nend_s = " << std::showpoint
      << end
      << "\n[ambient]\npressure_Pa = 101325.0\ntemperature_K = "
         "288.15\n[flow.gas]\nheat_capacity_ratio = 1.4\n"
         "gas_constant_J_per_kgK = 287.05\nviscosity = \"none\"\n[flow.numerics]\nskip_quiescent = "
         "false\n"
      << text;
  std::vector<std::string> words = {"flow_solver", folder / "case.toml", "--out", folder / "out",
                                    "--quiet",     "--threads",          "1"};
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  EXPECT_EQ(run_flow_solver(static_cast<int>(words.size()), argv.data()), 0);
  std::vector<Sample> history;
  std::ifstream in(folder / "out" / "probes.csv");
  std::string line, word;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::stringstream row(line);
    Sample s;
    std::getline(row, word, ',');
    s.t = std::stod(word);
    std::getline(row, word, ',');
    s.overpressure = std::stod(word);
    history.push_back(s);
  }
  std::filesystem::remove_all(folder);
  return history;
}

/// Overpressure behind the front continued to its arrival: the straight line through the logarithm
/// of the decay in the millisecond after the largest sample, at the time when half of that was
/// reached.
double front_overpressure(const std::vector<Sample>& history) {
  const auto largest = std::max_element(
      history.begin(), history.end(),
      [](const Sample& a, const Sample& b) { return a.overpressure < b.overpressure; });
  const auto arrival = std::find_if(history.begin(), history.end(), [&](const Sample& s) {
    return s.overpressure > .5 * largest->overpressure;
  });
  double n = 0, st = 0, sy = 0, stt = 0, sty = 0;
  for (auto s = largest; s != history.end() && s->t < largest->t + 1e-3; ++s) {
    const double t = s->t - arrival->t, y = std::log(s->overpressure);
    n += 1;
    st += t;
    sy += y;
    stt += t * t;
    sty += t * y;
  }
  const double slope = (n * sty - st * sy) / (n * stt - st * st);
  return std::exp((sy - slope * st) / n);
}

std::string ball(const char* name, double z) {
  std::ostringstream text;
  text << "[[flow.charge]]\nname = \"" << name << "\"\nsource = \"ball\"\ncenter_m = [0.5, 0.5, "
       << std::showpoint << z
       << "]\nmass_kg = 0.01\nenergy_J = 2.0e4\nradius_m = 0.05\nstart_radius_m = 0.15\n";
  return text.str();
}

std::string faces(const char* z_min) {
  return std::string(
             "[flow.boundary]\nx_min = \"outflow\"\nx_max = \"outflow\"\ny_min = "
             "\"outflow\"\ny_max = \"outflow\"\n"
             "z_min = \"") +
         z_min + "\"\nz_max = \"outflow\"\n";
}

TEST(ChargeRuns, AChargeOverTheGroundIsOneOfTwoChargesInTheAir) {
  const double h = 1.0 / 24, end = 5e-4;
  const std::string rest = axis('x', 0, 1, h) + axis('y', 0, 1, h);
  const std::string probe = "[[flow.probe]]\nname = \"near\"\nposition_m = [0.5, 0.75, 0.1]\n";
  const auto over_ground =
      run(rest + axis('z', 0, 1, h) + faces("symmetry") + ball("one", .3) + probe, end);
  const auto pair = run(
      rest + axis('z', -1, 1, h) + faces("outflow") + ball("one", .3) + ball("two", -.3) + probe,
      end);
  ASSERT_EQ(over_ground.size(), pair.size());
  ASSERT_GT(pair.size(), 20U);
  double off = 0.0, peak = 0.0;
  for (std::size_t n = 0; n < pair.size(); ++n) {
    off = std::max(off, std::abs(over_ground[n].overpressure - pair[n].overpressure));
    peak = std::max(peak, pair[n].overpressure);
  }
  std::printf(
      "charge 0.3 m over the ground, %zu steps: overpressure beside it to %.1f kPa, off that of "
      "two charges by "
      "%.1e of it\n",
      pair.size(), peak * 1e-3, off / peak);
  EXPECT_GT(peak, 1e4);
  // Rounding, amplified by fronts in some tens of steps; the tables hold nine digits.
  EXPECT_LT(off / peak, 1e-7);
}

struct Received {
  double front = 0.0, peak = 0.0;  ///< over the curve, less one
  double impulse = 0.0;            ///< the same
};

/// The wave of 1 kg of TNT 5 m away, prescribed at the faces of a grid whose nearest one is 4 m
/// away and which is `width` wide.
Received receive_prescribed_wave(double h, double width = 1.0) {
  const double low = .5 - .5 * width, high = .5 + .5 * width;
  const auto history = run(axis('x', 0, 2, h) + axis('y', low, high, h) + axis('z', low, high, h) +
                               faces("outflow") +
                               "[[flow.charge]]\nsource = \"kingery_bulmash\"\ncenter_m = [-4.0, "
                               "0.5, 0.5]\nmass_kg = 1.0\n"
                               "[[flow.probe]]\nname = \"near\"\nposition_m = [1.0, 0.5, 0.5]\n",
                           7e-3);
  double peak = 0.0, impulse = 0.0;
  for (std::size_t n = 1; n < history.size(); ++n) {
    peak = std::max(peak, history[n].overpressure);
    const double p =
        .5 * (std::max(history[n].overpressure, 0.0) + std::max(history[n - 1].overpressure, 0.0));
    impulse += p * (history[n].t - history[n - 1].t);
  }
  const double p_curve =
      kingery_bulmash(BurstKind::free_air, BlastQuantity::incident_pressure, 5.0);
  const double i_curve = kingery_bulmash(BurstKind::free_air, BlastQuantity::incident_impulse, 5.0);
  return {front_overpressure(history) / p_curve - 1, peak / p_curve - 1, impulse / i_curve - 1};
}

TEST(ChargeRuns, APrescribedWaveTendsToItsCurvesInsideTheGrid) {
  const double coarse_h = .0625, fine_h = .04;
  const Received coarse = receive_prescribed_wave(coarse_h), fine = receive_prescribed_wave(fine_h);
  const double limit = fine.front - (coarse.front - fine.front) / (coarse_h - fine_h) * fine_h;
  std::printf(
      "prescribed wave of 1 kg at 5 m, a metre inside a 3-D grid of %.0f / %.0f mm: front "
      "continued to arrival %+.1f / "
      "%+.1f %% of the curve (towards %+.1f %%), largest sample %+.1f / %+.1f %%, impulse %+.1f / "
      "%+.1f %%\n",
      1e3 * coarse_h, 1e3 * fine_h, 100 * coarse.front, 100 * fine.front, 100 * limit,
      100 * coarse.peak, 100 * fine.peak, 100 * coarse.impulse, 100 * fine.impulse);
  const Received wide = receive_prescribed_wave(coarse_h, 2.0);
  std::printf(
      "  on twice the width, cells of %.0f mm: front %+.1f %%, largest sample %+.1f %%, impulse "
      "%+.1f %%\n",
      1e3 * coarse_h, 100 * wide.front, 100 * wide.peak, 100 * wide.impulse);
  // The faces along the front's way have a part in what it loses: on twice the width it keeps more,
  // on a line with one face (IncidentWaves) its largest value is 3 % low at 40 mm. In proportion to
  // the cell all the same: the aim for charges, 5 %, is asked of the limit; of the impulse 10 %.
  EXPECT_LT(std::abs(limit), .05);
  EXPECT_LT(std::abs(wide.front), std::abs(coarse.front));
  EXPECT_LT(std::abs(fine.front), std::abs(coarse.front));
  EXPECT_LT(std::abs(fine.impulse), .10);
}

}  // namespace
}  // namespace ocublast::flow
