#include "solid_solver/elements/assembly.hpp"

#include <fmt/format.h>
#include <omp.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "solid_solver/mesh/cell_geometry.hpp"

namespace ocublast::solid {
namespace {

std::size_t index(std::int32_t n) {
  return static_cast<std::size_t>(n);
}

}  // namespace

std::string describe_cell(const SolidMesh& mesh, std::size_t cell) {
  const auto c = mesh.cell(cell);
  const auto x = cell_centre(mesh, cell);
  return fmt::format("{} {} of {} at ({:.4g}, {:.4g}, {:.4g}) m", info(c.shape).name, c.index,
                     mesh.tissues[index(c.tissue)], x[0], x[1], x[2]);
}

bool Assembly::moved(const Chunk& chunk, const double* displacement) const {
  if (chunk.active || !options_.skip_undeformed) return true;
  for (const auto n : chunk.block->row_nodes(*chunk.range)) {
    const double* d = displacement + row_stride * index(n);
    if (d[0] != 0.0 || d[1] != 0.0 || d[2] != 0.0) return true;
  }
  return false;
}

/// Whether a chunk must be computed: an undeformed one has no forces, exactly.
bool Assembly::deformed(const Chunk& chunk, const double* displacement) const {
  if (moved(chunk, displacement)) return true;
  if (chunk.block->type().volumetric != Volumetric::nodal) return false;
  // A pressure node may have got its pressure from the other side.
  const auto pressures = chunk.block->row_pressures(*chunk.range);
  const auto& change = chunk.block->nodal_volume_change();
  return std::any_of(pressures.begin(), pressures.end(),
                     [&](std::int32_t p) { return change[index(p)] != 0.0; });
}

/// Copies a chunk's rows of displacement and clears its sums.
void Assembly::fetch_rows(const Chunk& chunk, const double* displacement, Scratch& scratch) const {
  const auto nodes = chunk.block->row_nodes(*chunk.range);
  double* rows = scratch.rows.data();
  for (std::size_t k = 0; k < nodes.size(); ++k)
    std::memcpy(rows + row_stride * k, displacement + row_stride * index(nodes[k]),
                row_stride * sizeof(double));
  std::memset(scratch.forces.data(), 0, row_stride * nodes.size() * sizeof(double));
}

/// Asks for the rows of the chunk that comes next, if there is one.
void Assembly::prefetch_rows(std::size_t chunk, const double* displacement) const {
  if (chunk >= chunks_.size()) return;
  for (const auto n : chunks_[chunk].block->row_nodes(*chunks_[chunk].range))
    __builtin_prefetch(displacement + row_stride * index(n));
}

/// Inside a parallel region: adds the dilatations of tasks at their pressure nodes.
void Assembly::add_volumes(TaskShares& tasks, const double* displacement) {
  const int thread = omp_get_thread_num();
  auto& scratch = scratch_[static_cast<std::size_t>(thread)];
  for (std::size_t t = tasks.take(thread); t != TaskShares::none; t = tasks.take(thread))
    for (std::size_t k = tasks_[t].begin; k < tasks_[t].end; ++k) {
      const auto& chunk = chunks_[k];
      auto& block = *chunk.block;
      if (chunk.pressures == nullptr || !moved(chunk, displacement)) continue;
      fetch_rows(chunk, displacement, scratch);
      prefetch_rows(k + 1, displacement);
      element_kernels(block).add_volume(block.view(), scratch.rows.data(),
                                        block.law().finite_strain, chunk.range->begin,
                                        chunk.range->end, scratch.forces.data());
      const double* change = scratch.forces.data();
      for (const auto target : chunk.pressures->targets(chunk.pressure_use)) {
        *chunk.pressures->at(block.nodal_volume_change().data(), target) += *change;
        change += row_stride;
      }
    }
#pragma omp barrier
}

/// Inside a parallel region: dilatation and pressure at the nodes of elements that average there.
void Assembly::compute_nodal_pressures(const double* displacement, Exchange exchange) {
  for (auto& block : blocks_) {
    if (block.type().volumetric != Volumetric::nodal) continue;
    auto& change = block.nodal_volume_change();
#pragma omp for schedule(static)
    for (std::size_t a = 0; a < change.size(); ++a) change[a] = 0.0;
  }
  const auto collect = [&](TaskRows::Rows which) {
    auto rows = pressure_rows_.begin();
    for (auto& block : blocks_)
      if (block.type().volumetric == Volumetric::nodal)
        (rows++)->collect(block.nodal_volume_change().data(), which);
  };
  add_volumes(volume_shares_.border, displacement);
  collect(TaskRows::Rows::border);
  if (exchange == Exchange::all) {
#pragma omp master
    for (auto& [block, values] : shared_pressures_) values.start(block->nodal_volume_change());
  }
  add_volumes(volume_shares_.others, displacement);
  collect(TaskRows::Rows::others);
  if (exchange == Exchange::all) {
#pragma omp master
    for (auto& [block, values] : shared_pressures_) values.finish(block->nodal_volume_change());
#pragma omp barrier
  }
  for (auto& block : blocks_) {
    if (block.type().volumetric != Volumetric::nodal) continue;
    const auto n = static_cast<std::int64_t>(block.n_pressure_nodes());
#pragma omp for schedule(static)
    for (std::int64_t part = 0; part < (n + 1023) / 1024; ++part)
      law_kernels(block).nodal_pressure(block.view(), 1024 * part, std::min(n, 1024 * (part + 1)));
  }
}

/// Forces of a chunk's elements at its rows.
void Assembly::run_chunk(const Chunk& chunk, double inverse_step, Scratch& scratch,
                         KernelSums& sums) const {
  auto& block = *chunk.block;
  const auto& element = element_kernels(block);
  const auto& law = law_kernels(block);
  const auto view = block.view();
  auto& buffer = scratch.buffer;
  if (block.type().volumetric == Volumetric::nodal) {
    double* row = scratch.rows.data();
    for (const auto p : block.row_pressures(*chunk.range)) {
      row[3] = view.nodal_pressure[p];
      row += row_stride;
    }
  }
  for (auto b = chunk.range->begin; b < chunk.range->end; b += block.group()) {
    const auto last = std::min(chunk.range->end, b + block.group());
    element.gradients(view, scratch.rows.data(), b, last, buffer);
    law.stress(view, inverse_step, b, last, buffer, sums);
    element.forces(view, b, last, buffer, scratch.forces.data());
    if (!block.type().hourglass) continue;
    for (std::int64_t e = 0; e < last - b; ++e)
      for (int lane = 0; lane < batch_lanes; ++lane)
        sums.hourglass_energy += buffer.hourglass[e][lane];
  }
}

/// Inside a parallel region: forces of tasks.
void Assembly::run_tasks(TaskShares& tasks, bool border, const double* displacement, double* force,
                         double inverse_step) {
  const int thread = omp_get_thread_num();
  auto& scratch = scratch_[static_cast<std::size_t>(thread)];
  // MPI belongs to the thread that has started it.
  const bool polls = thread == 0 && !team_.alone() && !border;
  for (std::size_t t = tasks.take(thread); t != TaskShares::none; t = tasks.take(thread))
    for (std::size_t k = tasks_[t].begin; k < tasks_[t].end; ++k) {
      KernelSums sums;
      auto& chunk = chunks_[k];
      if (deformed(chunk, displacement)) {
        // Only steps in time leave a mark: probes of the stiffness move everything.
        chunk.active = chunk.active || inverse_step > 0.0;
        fetch_rows(chunk, displacement, scratch);
        prefetch_rows(k + 1, displacement);
        for (const auto target : force_rows_.targets(k))
          __builtin_prefetch(force_rows_.at(force, target), 1);
        run_chunk(chunk, inverse_step, scratch, sums);
        const double* row = scratch.forces.data();
        for (const auto target : force_rows_.targets(k)) {
          double* out = force_rows_.at(force, target);
          for (int i = 0; i < row_stride; ++i) out[i] += row[i];
          row += row_stride;
        }
      }
      sums_[k] = sums;
      if (polls) team_.forces()->poll();
    }
#pragma omp barrier
}

void Assembly::share_out_tasks() {
  for (auto* shares : {&volume_shares_, &force_shares_}) {
    shares->border.share_out(0, n_border_tasks_);
    shares->others.share_out(n_border_tasks_, tasks_.size());
  }
}

ForceReport Assembly::compute_force(std::span<const double> displacement, std::span<double> force,
                                    double inverse_step, const std::function<void()>& add_more) {
  share_out_tasks();
#pragma omp parallel num_threads(options_.threads)
  {
#pragma omp for schedule(static)
    for (std::size_t i = 0; i < force.size(); ++i) force[i] = 0.0;
    if (has_nodal_) compute_nodal_pressures(displacement.data(), Exchange::all);
    run_tasks(force_shares_.border, true, displacement.data(), force.data(), inverse_step);
    force_rows_.collect(force.data(), TaskRows::Rows::border);
    if (!team_.alone()) {
#pragma omp master
      {
        if (add_more) add_more();
        team_.forces()->start(force);
      }
#pragma omp barrier
    }
    run_tasks(force_shares_.others, false, displacement.data(), force.data(), inverse_step);
    force_rows_.collect(force.data(), TaskRows::Rows::others);
  }
  if (!team_.alone())
    team_.forces()->finish(force);
  else if (add_more)
    add_more();
  ForceReport report;
  for (const auto& sums : sums_) {
    report.viscous_work += sums.viscous_work;
    report.overlay_work += sums.overlay_work;
    report.hourglass_energy += sums.hourglass_energy;
    report.bad = report.bad || sums.bad > 0;
  }
  return report;
}

void Assembly::evaluate(std::span<const double> displacement, CellResults& results) {
  evaluate(displacement, results, Exchange::all);
}

void Assembly::evaluate(std::span<const double> displacement, CellResults& results,
                        Exchange exchange) {
  results.resize(mesh_.n_cells() * n_evaluated);
  share_out_tasks();
#pragma omp parallel num_threads(options_.threads)
  {
    if (has_nodal_) compute_nodal_pressures(displacement.data(), exchange);
    auto& scratch = scratch_[static_cast<std::size_t>(omp_get_thread_num())];
    std::memset(scratch.buffer.hourglass, 0, sizeof scratch.buffer.hourglass);
    AlignedVector<double> out(n_evaluated * batch_lanes);
#pragma omp for schedule(static)
    for (std::size_t k = 0; k < chunks_.size(); ++k) {
      fetch_rows(chunks_[k], displacement.data(), scratch);
      evaluate_chunk(chunks_[k], scratch, out, results);
    }
  }
}

void Assembly::evaluate_chunk(const Chunk& chunk, Scratch& scratch, std::span<double> out,
                              CellResults& results) const {
  auto& block = *chunk.block;
  auto view = block.view();
  if (block.type().volumetric == Volumetric::nodal) {
    const auto pressures = block.row_pressures(*chunk.range);
    for (std::size_t k = 0; k < pressures.size(); ++k) {
      const auto p = index(pressures[k]);
      scratch.rows[row_stride * k + 3] = view.nodal_pressure[p];
      scratch.forces[row_stride * k] = view.nodal_volume_change[p] / view.nodal_volume[p];
    }
    view.dilatation_rows = scratch.forces.data();
  }
  for (auto b = chunk.range->begin; b < chunk.range->end; ++b) {
    element_kernels(block).gradients(view, scratch.rows.data(), b, b + 1, scratch.buffer);
    law_kernels(block).evaluate(view, b, b + 1, scratch.buffer, out.data());
    for (std::size_t lane = 0; lane < batch_lanes; ++lane) {
      const std::int64_t cell = block.cell(static_cast<std::size_t>(b) * batch_lanes + lane);
      if (cell < 0) continue;
      for (std::size_t k = 0; k < n_evaluated; ++k)
        results[static_cast<std::size_t>(cell) * n_evaluated + k] = out[k * batch_lanes + lane];
    }
  }
}

ElementPlace Assembly::find_worst(std::span<const double> displacement) {
  CellResults results;
  evaluate(displacement, results, Exchange::none);  // the others may not be here
  ElementPlace place{.jacobian = std::numeric_limits<double>::infinity()};
  for (std::size_t cell = 0; cell < mesh_.n_cells(); ++cell) {
    const double jacobian = results[cell * n_evaluated + smallest_jacobian];
    const double mean = results[cell * n_evaluated + dilatation_mean];
    const bool lost = !(mean == mean);  // not a number is worse than any number
    if (!lost && !(jacobian < place.jacobian)) continue;
    place.cell = cell;
    place.jacobian = lost ? mean : jacobian;
    if (lost) break;
  }
  place.tissue = mesh_.tissues[index(mesh_.tissue_of(place.cell))];
  place.position = cell_centre(mesh_, place.cell, displacement.data());
  return place;
}

StepBound Assembly::element_step(std::span<const double> displacement) const {
  StepBound smallest{.step = std::numeric_limits<double>::infinity()};
  for (std::size_t number = 0; number < mesh_.n_cells(); ++number) {
    const auto cell = mesh_.cell(number);
    const auto& type = element_of(cell);
    const auto x = cell_positions(mesh_, cell.nodes, displacement.data());
    const double length = type.geometry.length(x.nodes());
    const double transit = length / material_of_cell(number).sound_speed();
    if (type.step_factor * transit >= smallest.step) continue;
    smallest = {
        .transit = transit, .step = type.step_factor * transit, .length = length, .cell = number};
  }
  return smallest;
}

double Assembly::viscous_damping_ratio(double omega) const {
  // Shear viscosity eta damps the highest mode of an element of length L by at most
  // 8 eta / (rho L^2) (largest eigenvalue of a hex's deviatoric operator, with a third to spare);
  // the ratio is half of that over omega.
  double largest = 0.0;
  for (std::size_t number = 0; number < mesh_.n_cells(); ++number) {
    const auto& material = material_of_cell(number);
    const double eta = material.shear_viscosity();
    if (eta == 0.0 && material.stiffness_damping == 0.0) continue;
    const auto cell = mesh_.cell(number);
    const double length =
        element_of(cell).geometry.length(cell_positions(mesh_, cell.nodes).nodes());
    largest = std::max(largest, 4.0 * eta / (material.density * length * length * omega) +
                                    0.5 * material.stiffness_damping * omega);
  }
  return largest;
}

void Assembly::wake_all() {
  for (auto& chunk : chunks_) chunk.active = true;
}

std::size_t Assembly::n_active_chunks() const {
  return static_cast<std::size_t>(
      std::count_if(chunks_.begin(), chunks_.end(), [](const Chunk& c) { return c.active; }));
}

std::size_t Assembly::bytes() const {
  std::size_t sum = 8 * mass_.size() + force_rows_.bytes();
  for (const auto& block : blocks_) sum += block.bytes();
  for (const auto& rows : pressure_rows_) sum += rows.bytes();
  return sum;
}

}  // namespace ocublast::solid
