// Construction of the flow: memory, tables, masks, boundaries; what it tells of itself.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "coupler/base/errors.hpp"
#include "flow_solver/boundary/domain_ghosts.hpp"
#include "flow_solver/flow_core.hpp"
#include "flow_solver/grid/make_grid.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

struct KernelSet {
  std::string_view name;
  bool present;  ///< whether this processor has the instructions
  const Kernels* kernels;
  const MusclKernels* muscl;
  const RadialKernels* radial;
};

/// Compiled sets, best last.
std::vector<KernelSet> kernel_sets() {
  std::vector<KernelSet> sets;
#ifdef OCU_HAS_baseline
  sets.push_back({"baseline", true, &isa_baseline::kernels(), &isa_baseline::muscl_kernels(),
                  &isa_baseline::radial_kernels()});
#endif
#ifdef OCU_HAS_avx2
  sets.push_back({"avx2", __builtin_cpu_supports("x86-64-v3") != 0, &isa_avx2::kernels(),
                  &isa_avx2::muscl_kernels(), &isa_avx2::radial_kernels()});
#endif
#ifdef OCU_HAS_avx512
  sets.push_back({"avx512", __builtin_cpu_supports("x86-64-v4") != 0, &isa_avx512::kernels(),
                  &isa_avx512::muscl_kernels(), &isa_avx512::radial_kernels()});
#endif
  return sets;
}

KernelSet choose_kernels(const std::string& wanted) {
  KernelSet best{};
  std::string offered;
  for (const KernelSet& set : kernel_sets()) {
    if (!set.present) continue;
    offered += fmt::format(" {}", set.name);
    if (wanted.empty() || wanted == set.name) best = set;
  }
  if (best.kernels == nullptr) {
    throw CaseError(
        fmt::format("instruction set \"{}\": offered here are{}; leave it out for the best one",
                    wanted, offered));
  }
  return best;
}

// Spectral radius by h^2 of the compact derivative of sixth-order slopes: 3.04 with compact 6, 3.17
// with compact 8; between walls with their one-sided closures 5.69 (eigenvalues of the operator, 16
// and 32 nodes).
constexpr double nodal_radius = 3.2;
constexpr double nodal_radius_at_walls = 5.8;

LaneEnd lane_end(const Boundary& b) {
  if (b.kind == BoundaryKind::symmetry) return LaneEnd::mirrored_slip;
  if (b.kind == BoundaryKind::wall)
    return b.wall.slip ? LaneEnd::held_slip_wall : LaneEnd::held_wall;
  return LaneEnd::domain_ghost;
}

/// Metric at a wall: slope per index, inwards, of the position, by the one-sided formula that the
/// kernels use for the values there.
double wall_inverse_spacing(const Axis& axis, bool low) {
  const auto x = [&](int m) { return axis.x(low ? m : axis.n - 1 - m); };
  return 1.0 / (wall_slope[0] * (low ? axis.min : axis.max) + wall_slope[1] * x(0) +
                wall_slope[2] * x(1) + wall_slope[3] * x(2));
}

WallEnd wall_end(const Boundary& b, const Axis& axis, bool low) {
  WallEnd end;
  if (b.kind != BoundaryKind::wall) return end;
  for (std::size_t a = 0; a < 3; ++a) end.velocity[a] = static_cast<Real>(b.wall.velocity[a]);
  end.temperature = b.wall.temperature;
  end.inverse_spacing = wall_inverse_spacing(axis, low);
  return end;
}

void set_view(LineView& view, const StoredTable& t) {
  view.n = t.n;
  view.face_begin = t.face_begin;
  view.face_end = t.face_end;
  view.periodic = t.periodic;
  view.flux = t.flux.data() + table_offset * flux_row_size;
  view.filter = t.filter.data() + table_offset * filter_row_size;
  view.flux_wrap = t.flux_wrap.data();
  view.filter_wrap = t.filter_wrap.data();
  view.flux_wrap_last = t.flux_wrap_last;
  view.flux_wrap_scale = t.flux_wrap_scale;
  view.filter_wrap_last = t.filter_wrap_last;
  view.filter_wrap_scale = t.filter_wrap_scale;
}

}  // namespace

LineEnd line_end(BoundaryKind kind) {
  switch (kind) {
    case BoundaryKind::symmetry:
      return LineEnd::mirrored_slip;
    case BoundaryKind::wall:
      return LineEnd::held_wall;
    case BoundaryKind::periodic:
      return LineEnd::periodic;
    case BoundaryKind::neighbour:
      return LineEnd::known;
    case BoundaryKind::outflow:
    case BoundaryKind::fixed_state:
    case BoundaryKind::subsonic_inflow:
    case BoundaryKind::reservoir:
      break;
  }
  return LineEnd::ghosted;
}

Flow::Core::Core(Grid grid_in, Boundaries boundaries_in, const FlowOptions& options_in,
                 const Ranks* all_ranks)
    : grid(std::move(grid_in)), boundaries(boundaries_in), options(options_in) {
  if (!grid.axis[0].present) throw CaseError("flow: the x direction must be present");
  for (std::size_t a = 0; a < 3; ++a) {
    const bool low = boundaries[2 * a].kind == BoundaryKind::periodic;
    const bool high = boundaries[2 * a + 1].kind == BoundaryKind::periodic;
    if (grid.axis[a].present && low != high) {
      throw CaseError(
          fmt::format("flow: only one face of direction {} is periodic; make both so", "xyz"[a]));
    }
  }
  if (all_ranks != nullptr && !all_ranks->alone()) set_ranks(*all_ranks);
  if (options.threads < 1) options.threads = 1;
  options.active_tolerance = std::max(options.active_tolerance, least_active_tolerance);
  clock.on = options.time_passes;
  const KernelSet set = choose_kernels(options.instruction_set);
  kernels = set.kernels;
  radial_kernels = set.radial;
  if (options.scheme == Scheme::muscl) {
    muscl = set.muscl;
    options.artificial_diffusivity = false;
    options.filter = false;
  }
  if (options.viscosity != Viscosity::none &&
      (muscl != nullptr || grid.geometry != Geometry::cartesian)) {
    throw CaseError(
        fmt::format("flow.gas.viscosity: {} computes inviscid gas only; take viscosity = \"none\"",
                    muscl != nullptr ? "the scheme muscl" : "a radial grid"));
  }
  const bool nodal_stress =
      options.viscosity != Viscosity::none ||
      (options.artificial_diffusivity && options.diffusivity_form == DiffusivityForm::paper);
  if (nodal_stress && grid.geometry != Geometry::cartesian) {
    throw CaseError(
        "flow.numerics.diffusivity_form: paper needs flow.grid.geometry = \"cartesian\"");
  }
  ctx.nodal_stress = nodal_stress;
  W = FieldMemory(grid, nodal_stress ? n_stage_fields : n_stage_fields - 1, true);
  R = FieldMemory(grid, n_primitive, true);
  // Beyond the borders between ranks lie the neighbours' states.
  Q = FieldMemory(grid, n_primitive, ranks != nullptr);
  A = FieldMemory(grid, n_primitive, ranks != nullptr);
  if (nodal_stress) G = FieldMemory(grid, n_stresses, true);
  set_tables();
  set_context();
  set_masks_without_bodies();
  set_box({0, 0, 0}, {ctx.n[0], ctx.n[1], ctx.n[2]});
  Grid plane = grid;
  plane.axis[2] = make_absent_axis();
  for (int t = 0; t < options.threads; ++t) {
    scratch.emplace_back(kernels->scratch_size(ctx));
    plane_scratch.emplace_back(plane, n_primitive, false);
  }
  // Each thread touches its own scratch and its part of the fields first.
#pragma omp parallel for schedule(static, 1) num_threads(options.threads)
  for (int t = 0; t < options.threads; ++t) {
    for (const FieldMemory* m :
         {&scratch[static_cast<std::size_t>(t)], &plane_scratch[static_cast<std::size_t>(t)]}) {
      std::fill(m->all().begin(), m->all().end(), Real{0});
    }
  }
  for (const FieldMemory* m : {&W, &R, &Q, &A, &G}) {
    const std::span<Real> all = m->all();
    const auto count = static_cast<std::ptrdiff_t>(all.size());
#pragma omp parallel for schedule(static) num_threads(options.threads)
    for (std::ptrdiff_t i = 0; i < count; ++i) all[static_cast<std::size_t>(i)] = Real{0};
  }
}

void Flow::Core::set_tables() {
  const LineScheme scheme{.eighth_order = options.scheme == Scheme::compact8,
                          .filter_alpha = options.filter_alpha};
  for (std::size_t a = 0; a < 3; ++a) {
    metric[a] = stored(make_line_metric(grid.axis[a]));
    const LineEnd low = line_end(boundaries[2 * a].kind),
                  high = line_end(boundaries[2 * a + 1].kind);
    const int n = grid.axis[a].n;
    LineTable plain = make_line_table(n, low, high, scheme);
    if (a == 0) set_radial(plain);
    table[a] = stored(std::move(plain));
    table_from_ghost[a] =
        stored(make_line_table(n + 8, LineEnd::ghosted, LineEnd::ghosted, scheme));
    const LineEnd mirror = low == LineEnd::held_wall ? low : LineEnd::mirrored_slip;
    table_from_mirror[a] = stored(make_line_table(n + 8, mirror, LineEnd::ghosted, scheme));
    if (low == LineEnd::known) {
      LineTable t = make_line_table(n + 8, LineEnd::known, LineEnd::ghosted, scheme);
      // Segments walk from face -3 on: up to the first solved row, all hand on the value they start
      // with.
      const auto repeat = [](std::vector<double>& rows, int size) {
        for (int j = 0; j < table_offset; ++j)
          std::copy_n(rows.begin() + table_offset * size, size, rows.begin() + j * size);
      };
      repeat(t.flux, flux_row_size);
      repeat(t.filter, filter_row_size);
      table_from_known[a] = stored(std::move(t));
    }
  }
  ctx.flux_end = make_flux_end_rows(scheme);
  ctx.filter_end = make_filter_end_rows(scheme);
}

void Flow::Core::set_radial(const LineTable& plain) {
  if (grid.geometry == Geometry::cartesian) return;
  const Axis& r = grid.axis[0];
  const bool one_dimensional = grid.geometry != Geometry::axisymmetric;
  if (grid.axis[2].present || grid.axis[1].present == one_dimensional) {
    throw CaseError(
        "flow.grid.geometry: cylindrical and spherical need x (the radius) alone, axisymmetric "
        "needs x (the radius) and y (along the axis)");
  }
  if (r.min < 0.0 ||
      (r.min == 0.0) != (boundaries[0].kind == BoundaryKind::symmetry && r.min < 1e-300)) {
    throw CaseError(
        fmt::format("flow.grid.x: the radius starts at {} m; accepted are 0 with boundary "
                    "x_min = \"symmetry\", or more than 0",
                    r.min));
  }
  if (boundaries[0].kind == BoundaryKind::periodic) {
    throw CaseError("flow.boundary.x_min: a radius cannot be periodic");
  }
  const auto mirrored = [&](std::size_t face) {
    return lane_end(boundaries[face]) != LaneEnd::domain_ghost;
  };
  radial = stored(make_radial_metric(grid, mirrored(0), mirrored(1)));
  radial_table = stored(make_radial_table(plain, radial.power, r.min == 0.0));
}

void Flow::Core::set_context() {
  ctx.W = W.block();
  ctx.R = R.block();
  ctx.Q = Q.block();
  ctx.A = A.block();
  ctx.G = G.block();
  for (std::size_t a = 0; a < 3; ++a) {
    ctx.n[a] = grid.axis[a].n;
    ctx.present[a] = grid.axis[a].present;
    LineView& view = ctx.line[a];
    set_view(view, table[a]);
    set_view(ctx.from_ghost[a], table_from_ghost[a]);
    set_view(ctx.from_mirror[a], table_from_mirror[a]);
    if (!table_from_known[a].flux.empty()) set_view(ctx.from_known[a], table_from_known[a]);
    view.inverse_face_spacing = metric[a].inverse_face_spacing.data() + table_offset;
    view.face_jacobian = metric[a].face_jacobian.data() + table_offset;
    view.inverse_jacobian = metric[a].inverse_jacobian.data() + table_offset;
    view.jacobian = metric[a].jacobian.data() + table_offset;
    view.filter_inverse_jacobian = view.inverse_jacobian;
    view.low = lane_end(boundaries[2 * a]);
    view.high = lane_end(boundaries[2 * a + 1]);
    const Boundaries& ends = ranks ? ranks->part.whole_boundaries : boundaries;
    const bool walled =
        ends[2 * a].kind == BoundaryKind::wall || ends[2 * a + 1].kind == BoundaryKind::wall;
    ctx.nodal_radius[a] = walled ? nodal_radius_at_walls : nodal_radius;
    view.wall_low = wall_end(boundaries[2 * a], grid.axis[a], true);
    view.wall_high = wall_end(boundaries[2 * a + 1], grid.axis[a], false);
  }
  if (radial.power > 0) {
    ctx.radial = {.power = radial.power,
                  .from_axis = grid.axis[0].min == 0.0,
                  .flux = radial_table.flux.data() + table_offset * flux_row_size,
                  .node_weight = radial.node_weight.data() + table_offset,
                  .inverse_volume = radial.inverse_volume.data() + table_offset,
                  .face_area = radial.face_area.data() + table_offset,
                  .power_over_r = radial.power_over_r.data() + table_offset};
    ctx.line[0].face_jacobian = radial.filter_face.data() + table_offset;
    ctx.line[0].filter_inverse_jacobian = ctx.radial.inverse_volume;
  }
  ctx.tiles = (ctx.n[0] + tile_width - 1) / tile_width;
  ctx.row_groups = (ctx.n[1] + tile_width - 1) / tile_width;
  ctx.mask_rows = ctx.n[1];
  ctx.mask_tiles = ctx.tiles;
  ctx.mask_groups = ctx.row_groups;
  ctx.gamma = options.gas.heat_capacity_ratio;
  ctx.gas_constant = options.gas.gas_constant;
  ctx.sutherland = options.viscosity == Viscosity::sutherland;
  const bool viscous = options.viscosity != Viscosity::none;
  ctx.mu0 = viscous ? options.dynamic_viscosity : 0.0;
  ctx.sutherland_T0 = options.sutherland_reference;
  ctx.sutherland_S = options.sutherland_temperature;
  ctx.heat_per_viscosity = ctx.gamma * ctx.gas_constant / ((ctx.gamma - 1.0) * options.prandtl);
  ctx.bulk = options.artificial_diffusivity;
  ctx.eighth_order = options.scheme == Scheme::compact8;
  ctx.filter = options.filter;
  if (options.artificial_diffusivity) {
    ctx.C_beta = options.C_beta;
    ctx.C_kappa = options.C_kappa;
    ctx.C_mu = options.C_mu;
  }
  ctx.paper = options.artificial_diffusivity && options.diffusivity_form == DiffusivityForm::paper;
  ctx.strain_sensor = options.sensor == Sensor::strain;
  ctx.need_strain = options.artificial_diffusivity &&
                    (ctx.strain_sensor || (ctx.nodal_stress && options.C_mu > 0.0));
  // What does not fit the caches anyway: 25 doubles per node against a few MiB.
  ctx.stream = grid.n_cells() > 40'000;
  ctx.floor_rho = options.floor_density;
  ctx.floor_p = options.floor_pressure;
  if (ranks) set_known_ends();
}

void Flow::Core::set_masks_without_bodies() {
  const auto n1 = static_cast<std::size_t>(ctx.n[1]), n2 = static_cast<std::size_t>(ctx.n[2]);
  const auto tiles = static_cast<std::size_t>(ctx.tiles),
             groups = static_cast<std::size_t>(ctx.row_groups);
  fluid.assign(n2 * n1 * tiles, static_cast<LaneBits>(all_lanes));
  const int rest = ctx.n[0] % tile_width;
  if (rest != 0) {
    for (std::size_t row = 0; row < n1 * n2; ++row) {
      fluid[row * tiles + tiles - 1] = static_cast<LaneBits>((1 << rest) - 1);
    }
  }
  const std::size_t sizes[3] = {n2 * groups, n2 * tiles, n1 * tiles};
  for (std::size_t a = 0; a < 3; ++a) {
    cut[a].assign(sizes[a], 0);
    line_marked[a].assign(sizes[a], 0);
    ctx.cut[a] = cut[a].data();
    ctx.line_marked[a] = line_marked[a].data();
  }
  const std::size_t nodes = n2 * n1 * tiles * tile_width;
  mark.resize(nodes, 0);
  failed.resize(nodes, 0);
  ctx.fluid = fluid.data();
  ctx.mark = mark.data();
  ctx.failed = failed.data();
  ctx.bodies = false;
}

Flow::Flow(Grid grid, Boundaries boundaries, const FlowOptions& options, const Ranks* ranks)
    : core_(std::make_unique<Core>(std::move(grid), boundaries, options, ranks)) {}
Flow::~Flow() = default;
Flow::Flow(Flow&&) noexcept = default;
Flow& Flow::operator=(Flow&&) noexcept = default;

const Grid& Flow::grid() const {
  return core_->ranks ? core_->ranks->part.whole : core_->grid;
}
const FlowOptions& Flow::options() const {
  return core_->options;
}
const Boundaries& Flow::boundaries() const {
  return core_->ranks ? core_->ranks->part.whole_boundaries : core_->boundaries;
}

NodeBox Flow::owned() const {
  const Core& c = *core_;
  NodeBox box{};
  for (std::size_t a = 0; a < 3; ++a) {
    box.lo[a] = c.ranks ? c.ranks->part.begin[a] : 0;
    box.hi[a] = box.lo[a] + c.ctx.n[a];
  }
  return box;
}

std::vector<NodeBox> Flow::owned_by_rank() const {
  if (!core_->ranks) return {owned()};
  const RankBlocks& blocks = core_->ranks->part.blocks;
  std::vector<NodeBox> boxes;
  for (int r = 0; r < core_->ranks->ranks().size(); ++r) {
    const std::array<int, 3> block = blocks.block_of(r);
    NodeBox box{};
    for (std::size_t a = 0; a < 3; ++a) {
      box.lo[a] = blocks.begin[a][static_cast<std::size_t>(block[a])];
      box.hi[a] = blocks.begin[a][static_cast<std::size_t>(block[a]) + 1];
    }
    boxes.push_back(box);
  }
  return boxes;
}

std::array<int, 3> Flow::rank_blocks() const {
  return core_->ranks ? core_->ranks->part.blocks.parts : std::array<int, 3>{1, 1, 1};
}

std::array<double, 2> Flow::rank_traffic() const {
  const Core& c = *core_;
  if (!c.ranks) return {};
  const Traffic t = c.ranks->step_traffic(c.ctx.nodal_stress,
                                          c.options.artificial_diffusivity || c.ctx.nodal_stress);
  return {t.messages, t.bytes};
}

std::string_view Flow::instruction_set() const {
  // The table carries the name of its namespace, isa_NAME.
  return std::string_view(core_->kernels->name).substr(4);
}

static_assert(artificial_pressure_field == field_bulk);
FieldsView<Real> Flow::Core::view_of(const Block& b, bool with_bulk) const {
  // Indices are those of the whole grid.
  const std::array<int, 3> first = ranks ? ranks->part.begin : std::array<int, 3>{};
  return {b.data - (first[0] + first[1] * b.sj + first[2] * b.sk), b.sf, b.sj, b.sk, with_bulk};
}

FieldsView<Real> Flow::primitives() {
  return core_->view_of(core_->ctx.W, core_->ctx.bulk);
}
FieldsView<const Real> Flow::primitives() const {
  return core_->view_of(core_->ctx.W, core_->ctx.bulk);
}
FieldsView<Real> Flow::conserved() {
  return core_->view_of(core_->ctx.Q, false);
}
FieldsView<const Real> Flow::conserved() const {
  return core_->view_of(core_->ctx.Q, false);
}

}  // namespace ocublast::flow
