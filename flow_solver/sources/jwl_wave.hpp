#pragma once

#include "flow_solver/grid/precision.hpp"
#include "flow_solver/sources/radial_wave.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// Explosive with products after Jones, Wilkins and Lee: p = A (1 - w/(R1 V)) exp(-R1 V) + B (1 -
/// w/(R2 V)) exp(-R2 V) + w E/V, V = rho0/rho, E per initial volume. Values for TNT (with an E0
/// of 4.29 MJ/kg).
struct Jwl {
  double density = 1630.0;  ///< kg/m^3, rho0
  double A = 527.28e9;      ///< Pa
  double B = 6.300e9;       ///< Pa
  double R1 = 4.71;
  double R2 = 1.07;
  double omega = 0.29;
  double energy = 7.0e9;             ///< J/m^3, E0
  double detonation_speed = 6985.0;  ///< m/s
};

struct JwlResolution {
  int charge_cells = 40;
  double air_growth = 0.006;  ///< thickness of the air cells by distance from the charge
};

/// Spherical wave of a charge lit at its centre: Lagrangian cells of products and air with
/// artificial viscosity (von Neumann and Richtmyer 1950), in the predictor-corrector form that
/// keeps the total energy to round-off (Caramana et al. 1998, J. Comput. Phys. 146:227); programmed
/// burn with the detonation speed. Products and air do not mix; no afterburning.
class JwlWave final : public SteppedWave {
 public:
  /// `mass` [kg] of explosive; air up to `r_max` [m].
  JwlWave(const Gas& gas, const State& ambient, const Jwl& jwl, double mass, double r_max,
          const JwlResolution& resolution = {});
  [[nodiscard]] RadialTotals totals() const override;
  /// Energy above ambient [J] and mass [kg] that the charge had at the start.
  [[nodiscard]] RadialTotals charged() const { return charged_; }
  /// Distance [m] of the surface between products and air.
  [[nodiscard]] double contact() const { return r_[static_cast<std::size_t>(n_charge_)]; }

 protected:
  void step() override;

 private:
  struct Cell {
    double mass = 0.0;  ///< kg
    double e = 0.0;     ///< J/kg
    double p = 0.0;     ///< Pa with artificial viscosity apart
    double q = 0.0;     ///< Pa
    double c = 0.0;     ///< m/s
  };
  void close(std::vector<Cell>& cells, const std::vector<double>& r, const std::vector<double>& u,
             double t) const;
  [[nodiscard]] double stable_step() const;
  void record(double t);

  Jwl jwl_;
  int n_charge_ = 0;
  std::vector<double> r_, u_, node_mass_, light_time_;
  std::vector<Cell> cells_;
  RadialTotals charged_;
};

}  // namespace ocublast::flow
