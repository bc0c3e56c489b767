#pragma once

#include <array>
#include <cstddef>

namespace ocublast::solid {

/// Shapes of cells a mesh may hold, nodes in VTK order; quad4 lies in the plane z = 0.
enum class Shape : std::size_t { hex8, tet4, tet10, wedge6, quad4 };
inline constexpr std::size_t n_shapes = 5;

struct ShapeInfo {
  Shape shape;
  const char* name;  ///< in mesh files: cells/NAME, tissue/NAME
  std::size_t n_nodes;
  const char* xdmf;             ///< topology type
  const char* default_element;  ///< where a case names none
};
inline constexpr std::array<ShapeInfo, n_shapes> shapes{
    {{Shape::hex8, "hex8", 8, "Hexahedron", "hex8_q1p0"},
     {Shape::tet4, "tet4", 4, "Tetrahedron", "tet4_anp"},
     {Shape::tet10, "tet10", 10, "Tetrahedron_10", "tet10"},
     {Shape::wedge6, "wedge6", 6, "Wedge", "wedge6"},
     {Shape::quad4, "quad4", 4, "Quadrilateral", "quad4_plane_strain"}}};

inline constexpr const ShapeInfo& info(Shape shape) {
  return shapes[static_cast<std::size_t>(shape)];
}
inline constexpr std::size_t most_nodes = 10;  ///< of any shape

}  // namespace ocublast::solid
