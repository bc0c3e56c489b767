#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <ostream>

#include "solid_solver/step.hpp"
#include "tests/support/solid_materials.hpp"
#include "tests/support/solid_meshes.hpp"

namespace ocublast::solid {

/// What a test over all elements calls its parameter.
inline void PrintTo(const ElementType& type, std::ostream* out) {
  *out << type.name;
}

}  // namespace ocublast::solid

namespace ocublast::solid::test {

inline constexpr double pi = 3.14159265358979323846;

/// Set-up of one material without bulk viscosity.
inline SolidSetup make_setup(SolidMesh mesh, Material material) {
  SolidSetup setup;
  setup.mesh = std::make_shared<const SolidMesh>(std::move(mesh));
  setup.materials = {std::move(material)};
  setup.material_of_tissue.assign(setup.mesh->tissues.size(), 0);
  setup.assembly.instruction_set = best_instruction_set();
  setup.assembly.viscosity = {.linear = 0.0, .quadratic = 0.0};
  return setup;
}

/// The same for one element type.
inline SolidSetup make_setup(SolidMesh mesh, Material material, const std::string& element) {
  auto setup = make_setup(std::move(mesh), std::move(material));
  setup.assembly.element_of_tissue.assign(setup.mesh->tissues.size(), element);
  return setup;
}

inline FixedNodes fixed_set(const SolidMesh& mesh, const std::string& set,
                            std::array<bool, 3> directions) {
  return {.nodes = mesh.node_sets.at(set), .directions = directions};
}

/// Runs to `end` in equal windows and calls `look` after each; returns the largest energy error
/// seen, which must stay below a thousandth of the peak in every dynamic case.
inline double run(SolidRun& solid, double end, int windows,
                  const std::function<void(double)>& look) {
  CellResults cells;
  double worst = 0.0;
  const double begin = solid.state().time;
  for (int w = 1; w <= windows; ++w) {
    solid.advance({.t_begin = solid.state().time, .t_end = begin + (end - begin) * w / windows});
    solid.assembly().evaluate(solid.state().displacement, cells);
    worst = std::max(worst, std::abs(solid.compute_energies(cells).error));
    look(solid.state().time);
  }
  EXPECT_LT(worst, 1e-3);
  return worst;
}

/// Frequency (Hz) of a signal sampled at `step` s, from the mean distance of its rising crossings
/// of its mean, by linear interpolation.
inline double frequency_of(const std::vector<double>& signal, double step) {
  double mean = 0.0;
  for (const double s : signal) mean += s / static_cast<double>(signal.size());
  double first = -1.0;
  double last = 0.0;
  int count = 0;
  for (std::size_t i = 1; i < signal.size(); ++i) {
    const double a = signal[i - 1] - mean;
    const double b = signal[i] - mean;
    if (!(a < 0.0 && b >= 0.0)) continue;
    last = (static_cast<double>(i) - b / (b - a)) * step;
    if (first < 0.0)
      first = last;
    else
      ++count;
  }
  return count > 0 ? count / (last - first) : 0.0;
}

/// Frequency (Hz) of the strongest line between low and high, Hann window, 1000 trial frequencies.
inline double strongest_frequency(const std::vector<double>& signal, double step, double low,
                                  double high) {
  const auto n = static_cast<double>(signal.size());
  double mean = 0.0;
  for (const double s : signal) mean += s / n;
  double best = 0.0;
  double found = low;
  for (int k = 0; k <= 1000; ++k) {
    const double f = low + (high - low) * k / 1000.0;
    double re = 0.0;
    double im = 0.0;
    for (std::size_t i = 0; i < signal.size(); ++i) {
      const auto t = static_cast<double>(i);
      const double w = (signal[i] - mean) * (1.0 - std::cos(2.0 * pi * t / n));
      re += w * std::cos(2.0 * pi * f * step * t);
      im += w * std::sin(2.0 * pi * f * step * t);
    }
    if (re * re + im * im > best) {
      best = re * re + im * im;
      found = f;
    }
  }
  return found;
}

}  // namespace ocublast::solid::test
