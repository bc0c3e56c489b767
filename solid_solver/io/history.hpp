#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "solid_solver/io/case_keys.hpp"
#include "solid_solver/io/sample_table.hpp"
#include "solid_solver/step.hpp"

namespace ocublast::solid {

/// One figure of the summary.
struct Quantity {
  std::string name;
  double value = 0.0;
  std::string unit;
};

/// The two tables of a run: globals (energies, momenta, mean motion) and probes (histories). Every
/// rank holds the same rows.
class History {
 public:
  History(const SolidRun& run, const SolidCase& from);

  /// One row in each table from the current state and cell results. Collective.
  void sample(SolidRun& run, const CellResults& cells);
  void write(const std::filesystem::path& out);
  /// Peaks and running means for the summary.
  [[nodiscard]] std::vector<Quantity> quantities() const;

  [[nodiscard]] SampleTable& globals() { return globals_; }
  [[nodiscard]] SampleTable& probes() { return probes_; }

 private:
  struct Item {
    HistoryKeys keys;
    std::vector<std::size_t> cells;   ///< tissue: its cells; position: the nearest one; those here
    std::vector<double> volumes;      ///< m^3, reference
    std::vector<std::int32_t> nodes;  ///< of the set, those that count here
    double n_nodes = 0.0;             ///< of the set, on all ranks
    std::size_t column = 0;           ///< first of its columns
  };
  [[nodiscard]] static std::vector<std::string> probe_columns(std::vector<Item>& items);
  [[nodiscard]] static std::vector<Item> make_items(const SolidRun& run, const SolidCase& from);
  void sample_cells(const Item& item, const Team& team, const CellResults& cells,
                    std::vector<double>& row) const;
  void sample_nodes(const Item& item, const SolidRun& run, std::vector<double>& row) const;
  void add_quantities(const Item& item, std::vector<Quantity>& list) const;

  double running_mean_;
  std::vector<Item> items_;
  SampleTable globals_;
  SampleTable probes_;
};

}  // namespace ocublast::solid
