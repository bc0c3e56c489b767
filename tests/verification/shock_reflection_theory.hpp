#pragma once

// Reflection of a planar shock at a wedge, by von Neumann's two- and three-shock theories (Ben-Dor,
// Shock Wave Reflection Phenomena, 2nd ed. 2007, chapter 1): straight shocks and uniform states
// around the point where they meet, in its frame. Gas ahead: p = rho = 1.

#include <cmath>
#include <numbers>

namespace ocublast::flow::testing {

/// What an oblique shock at angle `phi` to a stream of Mach number M does.
struct ObliqueShock {
  double pressure_ratio = 1.0;
  double deflection = 0.0;  ///< rad, towards the shock
  double mach = 0.0;        ///< behind it
};

inline ObliqueShock oblique_shock(double M, double phi, double gamma) {
  const double m2 = std::pow(M * std::sin(phi), 2);
  const double compression = (gamma + 1) * m2 / ((gamma - 1) * m2 + 2);
  const double deflection = phi - std::atan(std::tan(phi) / compression);
  return {.pressure_ratio = 1 + 2 * gamma / (gamma + 1) * (m2 - 1),
          .deflection = deflection,
          .mach = std::sqrt((1 + .5 * (gamma - 1) * m2) / (gamma * m2 - .5 * (gamma - 1))) /
                  std::sin(phi - deflection)};
}

struct RegularReflection {
  double p = 0.0;      ///< at the wall behind the point of reflection
  double angle = 0.0;  ///< rad, between wall and reflected shock
  double mach = 0.0;   ///< behind, relative to the point; above 1 the state is uniform there
  bool exists = false;
};

/// Shock of Mach number Ms on a wedge of angle theta (rad): the weak solution.
inline RegularReflection regular_reflection(double Ms, double theta, double gamma) {
  const ObliqueShock incident =
      oblique_shock(Ms / std::cos(theta), .5 * std::numbers::pi - theta, gamma);
  const double M = incident.mach;
  double low = std::asin(1 / M);
  // The weak branch ends at the largest deflection.
  double high = low;
  const double step = 1e-4;
  while (high + step < .5 * std::numbers::pi && oblique_shock(M, high + step, gamma).deflection >
                                                    oblique_shock(M, high, gamma).deflection) {
    high += step;
  }
  RegularReflection r;
  r.exists = oblique_shock(M, high, gamma).deflection >= incident.deflection;
  for (int n = 0; n < 60; ++n) {
    const double phi = .5 * (low + high);
    (oblique_shock(M, phi, gamma).deflection < incident.deflection ? low : high) = phi;
  }
  const ObliqueShock reflected = oblique_shock(M, low, gamma);
  r.p = incident.pressure_ratio * reflected.pressure_ratio;
  r.angle = low - incident.deflection;
  r.mach = reflected.mach;
  return r;
}

struct MachReflection {
  double chi = 0.0;  ///< rad, between the wedge and the path of the triple point
  double p = 0.0;    ///< behind the stem
};

/// With a stem straight and square to the wedge, which closes the theory.
inline MachReflection mach_reflection(double Ms, double theta, double gamma) {
  const double right = .5 * std::numbers::pi;
  struct State {
    double residual, p;
  };
  const auto meet = [&](double chi) -> State {
    const double M = Ms / std::cos(theta + chi);
    const ObliqueShock incident = oblique_shock(M, right - theta - chi, gamma);
    const ObliqueShock stem = oblique_shock(M, right - chi, gamma);
    // Equal pressures on both sides of the slip line fix the reflected shock's strength.
    const double m2 =
        1 + (gamma + 1) / (2 * gamma) * (stem.pressure_ratio / incident.pressure_ratio - 1);
    const double sine = std::sqrt(m2) / incident.mach;
    if (sine >= 1.0) return {NAN, NAN};
    const ObliqueShock reflected = oblique_shock(incident.mach, std::asin(sine), gamma);
    return {incident.deflection - reflected.deflection - stem.deflection, stem.pressure_ratio};
  };
  // The first change of sign from grazing paths upward.
  MachReflection r;
  double before = NAN, chi_before = 0.0;
  const double step = 1e-3;
  for (double chi = step; chi < right - theta - step; chi += step) {
    const double now = meet(chi).residual;
    if (now * before < 0.0) {
      double low = chi_before, high = chi;
      for (int n = 0; n < 60; ++n) {
        const double middle = .5 * (low + high);
        (meet(middle).residual * before > 0.0 ? low : high) = middle;
      }
      r.chi = low;
      break;
    }
    before = now;
    chi_before = chi;
  }
  r.p = meet(r.chi).p;
  return r;
}

}  // namespace ocublast::flow::testing
