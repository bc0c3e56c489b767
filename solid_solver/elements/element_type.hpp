#pragma once

// How an element is written: a kernel template over lanes (ElementKernels), its reference geometry
// (ElementGeometry) and a header with a struct of static members
//   name, help, shape, volumetric, hourglass, planar, step_factor, cost, Kernels<W>, geometry().
// The header's name is added to OCU_SOLID_ELEMENTS in CMakeLists.txt, which compiles the kernels
// for every instruction set and puts the element into the list; every law works with it.

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "solid_solver/elements/instruction_set.hpp"
#include "solid_solver/elements/point_buffer.hpp"
#include "solid_solver/mesh/cell_shape.hpp"

namespace ocublast::solid {

/// Positions of a cell's nodes in VTK order, m.
using NodePositions = std::span<const std::array<double, 3>>;

/// How the reference data of one element are to be filled.
struct FillOptions {
  double scale = 1.0;              ///< of weights; next to nothing in filler lanes
  double hourglass_modulus = 0.0;  ///< Pa, coefficient included
};

/// Reference geometry of an element.
struct ElementGeometry {
  /// Writes n_reference numbers, batch_lanes apart.
  void (*fill)(NodePositions x, const FillOptions& options, double* out) = nullptr;
  /// Reference volume lumped at each node, m^3, all positive; their sum is the element's volume.
  void (*lump)(NodePositions x, std::span<double> volumes) = nullptr;
  /// Length of the step rule, m.
  double (*length)(NodePositions x) = nullptr;
  /// VTK node of each kernel node.
  std::span<const int> order;
};

/// An element as the assembly knows it.
struct ElementType {
  std::string name;
  std::string help;
  Shape shape = Shape::hex8;
  Volumetric volumetric = Volumetric::mean;
  bool hourglass = false;     ///< has hourglass stiffness, and energy in it
  bool planar = false;        ///< moves in the plane z = 0 only
  bool axisymmetric = false;  ///< about the y axis
  double step_factor = 0.7;   ///< safe part of length / sound speed (measured, see the bench)
  double cost = 1.0;          ///< time per update over that of hex8_q1p0 (measured): cuts by it
  std::size_t n_points = 1;
  std::size_t n_reference = 0;
  ElementGeometry geometry;
  std::array<ElementKernels, n_instruction_sets> kernels{};
};

/// All elements, in the order of OCU_SOLID_ELEMENTS.
[[nodiscard]] std::vector<ElementType> make_elements();

}  // namespace ocublast::solid
