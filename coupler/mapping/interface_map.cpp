#include "coupler/mapping/interface_map.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "coupler/base/errors.hpp"
#include "coupler/mapping/point_rows.hpp"
#include "coupler/mapping/surface_search.hpp"

namespace ocublast::coupler {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

/// A facet of the flow is cut into so many pieces along an edge at most. Coarser flow meshes than
/// that against the solid's leave single nodes without load.
constexpr int most_pieces = 16;
/// Eigenvalues below this share of the largest are directions in which the nodes have no extent.
constexpr double no_extent = 1e-10;
/// Offsets below this share of the surface's extent are rounding.
constexpr double rounding = 1e-13;

/// Inverse of a symmetric matrix on the directions that have an extent, 0 on the others.
Matrix3d inverse_where_possible(const Matrix3d& matrix) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(matrix);
  Vector3d inverse = eigen.eigenvalues();
  for (double& v : inverse) v = v > no_extent * eigen.eigenvalues()[2] ? 1.0 / v : 0.0;
  return eigen.eigenvectors() * inverse.asDiagonal() * eigen.eigenvectors().transpose();
}

void add_to(std::span<double> values, std::size_t vertex, const Vector3d& v) {
  for (std::size_t k = 0; k < 3; ++k) values[3 * vertex + k] += v[static_cast<Eigen::Index>(k)];
}

[[noreturn]] void refuse(const char* side, const link::InterfaceMesh& mesh, std::size_t vertex,
                         const char* other, const std::string& what) {
  const Vector3d x = point_of(mesh.vertices, vertex);
  throw LinkError(fmt::format(
      "the interface meshes of flow and solid do not lie on each other: vertex {} of the {}'s "
      "'{}' at ({:.6g}, {:.6g}, {:.6g}) m {} of the {}'s",
      vertex, side, mesh.name, x[0], x[1], x[2], what, other));
}

void require_near(const char* side, const link::InterfaceMesh& mesh, std::size_t vertex,
                  const char* other, const PointRow& row, const MappingOptions& options) {
  if (row.weights.empty())
    refuse(side, mesh, vertex, other, "has no facet that looks the same way");
  if (row.gap > options.largest_gap * row.size)
    refuse(side, mesh, vertex, other,
           fmt::format("is {:.3g} m away from the nearest facet, accepted {:.3g} m "
                       "(coupling.mapping_gap {} x facet "
                       "size {:.3g} m),",
                       row.gap, options.largest_gap * row.size, options.largest_gap, row.size));
}

}  // namespace

InterfaceMap::InterfaceMap(link::InterfaceMesh flow, link::InterfaceMesh solid,
                           const MappingOptions& options)
    : flow_(std::move(flow)), solid_(std::move(solid)) {
  if (flow_.triangles.empty())
    throw LinkError(
        fmt::format("the interface mesh '{}' of the flow has no triangles", flow_.name));
  const bool scattered = options.kind == MappingKind::radial_basis || solid_.triangles.empty();
  if (scattered && options.kind == MappingKind::nearest_projection)
    throw LinkError(fmt::format(
        "the interface mesh '{}' of the solid has no triangles: nearest projection needs them, "
        "coupling.mapping = \"radial-basis\" does not",
        solid_.name));
  method_ = scattered ? "radial basis" : "nearest projection";
  const auto finder = scattered ? make_radial_basis(solid_) : make_projection(solid_);
  build_motion(*finder, options);
  build_pressure(options);
  build_force(*finder);
  build_fit();
}

void InterfaceMap::build_motion(const PointFinder& finder, const MappingOptions& options) {
  const auto normals = vertex_normals(flow_);
  double extent = 0.0;
  for (const double x : solid_.vertices) extent = std::max(extent, std::abs(x));
  bool apart = false;
  for (std::size_t v = 0; v < n_flow(); ++v) {
    const Vector3d x = point_of(flow_.vertices, v);
    const PointRow row = finder.row(x, normals[v]);
    require_near("flow", flow_, v, "solid", row, options);
    Vector3d offset = x;
    for (const auto& [node, weight] : row.weights) {
      motion_.column.push_back(node);
      motion_.weight.push_back(weight);
      offset -= weight * point_of(solid_.vertices, static_cast<std::size_t>(node));
    }
    motion_.begin.push_back(motion_.column.size());
    offset_.push_back(offset);
    gap_ = std::max(gap_, row.gap);
    apart = apart || offset.norm() > rounding * extent;
  }
  if (!apart) offset_.clear();
}

/// Interpolation on the flow's triangles; also finds parts of the solid that the flow does not
/// cover.
void InterfaceMap::build_pressure(const MappingOptions& options) {
  const auto on_flow = make_projection(flow_);
  auto normals = vertex_normals(solid_);
  for (std::size_t v = 0; v < n_solid(); ++v) {
    const Vector3d x = point_of(solid_.vertices, v);
    PointRow row;
    if (!solid_.triangles.empty()) {
      row = on_flow->row(x, normals[v]);
    } else {  // a node without a normal: the nearest facet, whichever way it looks
      for (int k = 0; k < 6; ++k) {
        const PointRow one = on_flow->row(x, (k % 2 == 0 ? 1.0 : -1.0) * Vector3d::Unit(k / 2));
        if (!one.weights.empty() && (row.weights.empty() || one.gap < row.gap)) row = one;
      }
    }
    require_near("solid", solid_, v, "flow", row, options);
    gap_ = std::max(gap_, row.gap);
    for (const auto& [node, weight] : row.weights) {
      pressure_.column.push_back(node);
      pressure_.weight.push_back(weight);
    }
    pressure_.begin.push_back(pressure_.column.size());
  }
}

/// For each facet of the flow: integral over it of (corner's shape function) x (solid node's), over
/// its area.
void InterfaceMap::build_force(const PointFinder& finder) {
  const auto areas = area_vectors(flow_.vertices, flow_.triangles);
  share_.assign(n_solid(), 0.0);
  facet_begin_.push_back(0);
  double whole = 0.0;
  for (std::size_t t = 0; t < areas.size(); ++t) {
    std::array<Vector3d, 3> corner;
    for (std::size_t k = 0; k < 3; ++k)
      corner[k] = point_of(flow_.vertices, static_cast<std::size_t>(flow_.triangles[3 * t + k]));
    const Vector3d normal = areas[t].normalized();
    const double longest = std::max({(corner[1] - corner[0]).norm(), (corner[2] - corner[1]).norm(),
                                     (corner[0] - corner[2]).norm()});
    const double size = finder.row((corner[0] + corner[1] + corner[2]) / 3.0, normal).size;
    const int pieces =
        size > 0.0 ? std::clamp(static_cast<int>(std::ceil(longest / size)), 1, most_pieces) : 1;
    std::map<std::int32_t, std::array<double, 3>> sums;
    // Three points per piece, exact for quadratics; pieces upright and, from the second row on,
    // upside down.
    const double step = 1.0 / pieces, weight = step * step / 3.0;
    const auto add_piece = [&](double u, double v, double sign) {
      for (std::size_t q = 0; q < 3; ++q) {
        const double a = u + sign * step * (q == 1 ? 4.0 : 1.0) / 6.0,
                     b = v + sign * step * (q == 2 ? 4.0 : 1.0) / 6.0;
        const std::array<double, 3> N{1.0 - a - b, a, b};
        const PointRow row =
            finder.row(N[0] * corner[0] + N[1] * corner[1] + N[2] * corner[2], normal);
        if (row.weights.empty())
          refuse("flow", flow_, static_cast<std::size_t>(flow_.triangles[3 * t]), "solid",
                 "belongs to a facet that no facet faces the same way");
        for (const auto& [node, w] : row.weights)
          for (std::size_t k = 0; k < 3; ++k) sums[node][k] += weight * w * N[k];
      }
    };
    for (int j = 0; j < pieces; ++j)
      for (int i = 0; i + j < pieces; ++i) {
        add_piece(i * step, j * step, 1.0);
        if (i + j + 1 < pieces) add_piece((i + 1) * step, (j + 1) * step, -1.0);
      }
    for (const auto& [node, c] : sums) {
      facet_share_.push_back({node, c});
      share_[static_cast<std::size_t>(node)] += areas[t].norm() * (c[0] + c[1] + c[2]);
    }
    facet_begin_.push_back(facet_share_.size());
    whole += areas[t].norm();
  }
  // Interpolation by radial bases has small negative weights; a share is none.
  for (double& s : share_) s = std::max(s, 0.0) / whole;
}

/// Weighted least squares: gradient of the linear field nearest to values at the solid's nodes.
void InterfaceMap::build_fit() {
  if (offset_.empty()) return;
  double total = 0.0;
  Vector3d center = Vector3d::Zero();
  for (std::size_t j = 0; j < n_solid(); ++j) {
    total += share_[j];
    center += share_[j] * point_of(solid_.vertices, j);
  }
  center /= total;
  Matrix3d moment = Matrix3d::Zero();
  for (std::size_t j = 0; j < n_solid(); ++j) {
    const Vector3d r = point_of(solid_.vertices, j) - center;
    moment += share_[j] * r * r.transpose();
  }
  const Matrix3d inverse = inverse_where_possible(moment);
  Vector3d mean = Vector3d::Zero();
  for (std::size_t j = 0; j < n_solid(); ++j) {
    fit_.emplace_back(share_[j] * inverse * (point_of(solid_.vertices, j) - center));
    mean += fit_.back();
  }
  // A constant has no gradient, to the last bit that rounding allows.
  for (std::size_t j = 0; j < n_solid(); ++j) fit_[j] -= share_[j] / total * mean;
}

void InterfaceMap::map_vectors(std::span<const double> solid, std::span<double> flow) const {
  Matrix3d gradient = Matrix3d::Zero();  // [component, direction]
  for (std::size_t j = 0; j < fit_.size(); ++j)
    gradient += point_of(solid, j) * fit_[j].transpose();
  for (std::size_t v = 0; v < n_flow(); ++v) {
    std::array<double, 3> sum{};
    for (std::size_t e = motion_.begin[v]; e < motion_.begin[v + 1]; ++e) {
      const double* u = solid.data() + 3 * static_cast<std::size_t>(motion_.column[e]);
      for (std::size_t k = 0; k < 3; ++k) sum[k] += motion_.weight[e] * u[k];
    }
    std::copy(sum.begin(), sum.end(), flow.begin() + static_cast<long>(3 * v));
    if (!offset_.empty()) add_to(flow, v, gradient * offset_[v]);
  }
}

void InterfaceMap::map_position(std::span<const double> solid, std::span<double> flow) const {
  std::vector<double> moved(solid.begin(), solid.end());
  for (std::size_t i = 0; i < moved.size(); ++i) moved[i] -= solid_.vertices[i];
  map_vectors(moved, flow);
  for (std::size_t i = 0; i < flow.size(); ++i) flow[i] += flow_.vertices[i];
}

void InterfaceMap::map_pressure(std::span<const double> overpressure,
                                std::span<double> solid) const {
  for (std::size_t v = 0; v < n_solid(); ++v) {
    double sum = 0.0;
    for (std::size_t e = pressure_.begin[v]; e < pressure_.begin[v + 1]; ++e)
      sum += pressure_.weight[e] * overpressure[static_cast<std::size_t>(pressure_.column[e])];
    solid[v] = sum;
  }
}

void InterfaceMap::map_force(std::span<const double> overpressure, std::span<const double> x_flow,
                             std::span<const double> x_solid, std::span<double> force) const {
  std::fill(force.begin(), force.end(), 0.0);
  Vector3d total = Vector3d::Zero(), moment = Vector3d::Zero();
  for (std::size_t t = 0; t + 1 < facet_begin_.size(); ++t) {
    std::array<Vector3d, 3> x;
    std::array<double, 3> p{};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto v = static_cast<std::size_t>(flow_.triangles[3 * t + k]);
      x[k] = point_of(x_flow, v);
      p[k] = overpressure[v];
    }
    if (p[0] == 0.0 && p[1] == 0.0 && p[2] == 0.0) continue;
    const Vector3d push = -0.5 * (x[1] - x[0]).cross(x[2] - x[0]);  // pressure pushes inward
    const double sum = p[0] + p[1] + p[2];
    total += sum / 3.0 * push;
    // Integral of (linear x) x (linear p): sum over corners of x_a p_b (1 + [a = b]) / 12.
    moment +=
        ((x[0] + x[1] + x[2]) * sum + x[0] * p[0] + x[1] * p[1] + x[2] * p[2]).cross(push) / 12.0;
    for (std::size_t e = facet_begin_[t]; e < facet_begin_[t + 1]; ++e) {
      const auto& [node, c] = facet_share_[e];
      add_to(force, static_cast<std::size_t>(node),
             (c[0] * p[0] + c[1] * p[1] + c[2] * p[2]) * push);
    }
  }
  balance_force(total, moment, x_solid, force);
}

void InterfaceMap::balance_force(const Vector3d& force, const Vector3d& moment_about_origin,
                                 std::span<const double> x_solid, std::span<double> nodal) const {
  double total = 0.0;
  Vector3d center = Vector3d::Zero(), sum = Vector3d::Zero();
  for (std::size_t j = 0; j < n_solid(); ++j) {
    const Vector3d x = point_of(x_solid, j);
    total += share_[j];
    center += share_[j] * x;
    sum += point_of(nodal, j);
  }
  center /= total;
  Matrix3d inertia = Matrix3d::Zero();
  Vector3d moment = moment_about_origin - center.cross(force);
  for (std::size_t j = 0; j < n_solid(); ++j) {
    const Vector3d r = point_of(x_solid, j) - center;
    inertia += share_[j] * (r.squaredNorm() * Matrix3d::Identity() - r * r.transpose());
    moment -= r.cross(point_of(nodal, j));
  }
  const Vector3d a = (force - sum) / total, b = inverse_where_possible(inertia) * moment;
  for (std::size_t j = 0; j < n_solid(); ++j)
    add_to(nodal, j, share_[j] * (a + b.cross(point_of(x_solid, j) - center)));
}

}  // namespace ocublast::coupler
