#pragma once

#include <array>
#include <filesystem>
#include <vector>

#include "flow_solver/boundary/boundary.hpp"
#include "flow_solver/gas/gas.hpp"

namespace ocublast::flow {

/// Gas at one instant of an inflow.
struct InflowPoint {
  double time = 0.0;         ///< s
  double pressure = 0.0;     ///< Pa
  double temperature = 0.0;  ///< K
  double speed = 0.0;        ///< m/s along the normal, positive into the domain
};

/// The same gas over a whole face, in time between the points of a table: linear in pressure,
/// temperature and speed, constant before the first and behind the last.
class InflowTable : public IncomingGas {
 public:
  /// `inwards`: unit normal of the face into the domain. Throws CaseError for a table that is
  /// empty, out of order, or holds a pressure or temperature that is not above 0.
  InflowTable(std::vector<InflowPoint> points, const Gas& gas,
              const std::array<double, 3>& inwards);
  [[nodiscard]] State at(double t, double x, double y, double z) const override;
  [[nodiscard]] const std::vector<InflowPoint>& points() const { return points_; }

 private:
  std::vector<InflowPoint> points_;
  Gas gas_;
  std::array<double, 3> inwards_;
};

/// Reads a CSV file with the columns time_s, pressure_Pa, temperature_K, speed_m_s and a header
/// line that names them in this order. Throws CaseError with the line of the fault.
[[nodiscard]] std::vector<InflowPoint> read_inflow_points(const std::filesystem::path& file);

}  // namespace ocublast::flow
