#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "solid_solver/mesh/cell_geometry.hpp"
#include "tests/support/solid_runs.hpp"

// Properties every element has, over all elements the program was built with and all laws.

namespace ocublast::solid {

namespace {

using namespace test;
using Field = AlignedVector<double>;

/// A distorted block of the element's cells; rings about y lie at x of 1 to 2.
SolidMesh distorted(const ElementType& type) {
  const bool plane = type.shape == Shape::quad4;
  auto mesh = make_block_of(type.shape,
                            {.cells = {4, 4, plane ? 1 : 4},
                             .size = {1.0, 1.0, plane ? 0.25 : 1.0},
                             .distortion = plane ? 0.0 : 0.2},
                            type.axisymmetric ? 1.0 : 0.0);
  if (plane)  // inner nodes only, in the plane
    for (std::size_t n = 0; n < mesh.n_nodes(); ++n) {
      const double x = mesh.nodes[3 * n] - (type.axisymmetric ? 1.0 : 0.0);
      const double y = mesh.nodes[3 * n + 1];
      if (x < 0.1 || x > 0.9 || y < 0.1 || y > 0.9) continue;
      mesh.nodes[3 * n] += 0.04 * std::sin(17.0 * static_cast<double>(n));
      mesh.nodes[3 * n + 1] += 0.04 * std::cos(13.0 * static_cast<double>(n));
    }
  mesh.fibres = make_fibres(mesh.n_cells());
  return mesh;
}

Assembly make_assembly(const SolidMesh& mesh, const Material& material, const ElementType& type,
                       InstructionSet isa = best_instruction_set(), int threads = 1) {
  return Assembly(mesh, {material}, {0},
                  {.threads = threads,
                   .instruction_set = isa,
                   .viscosity = {0.0, 0.0},
                   .chunk_elements = 16,
                   .element_of_tissue = {type.name}});
}

Field linear_field(const SolidMesh& mesh, const Eigen::Matrix3d& H) {
  Field d(4 * mesh.n_nodes());
  for (std::size_t n = 0; n < mesh.n_nodes(); ++n)
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        d[4 * n + static_cast<std::size_t>(i)] +=
            H(i, j) * mesh.nodes[3 * n + static_cast<std::size_t>(j)];
  return d;
}

Field wavy_field(const SolidMesh& mesh, const ElementType& type, double amplitude) {
  Field d(4 * mesh.n_nodes());
  for (std::size_t i = 0; i < d.size(); ++i)
    if (i % 4 < (type.planar ? 2u : 3u)) d[i] = amplitude * std::sin(3.0 * static_cast<double>(i));
  return d;
}

class EachElement : public ::testing::TestWithParam<ElementType> {};
INSTANTIATE_TEST_SUITE_P(Elements, EachElement, ::testing::ValuesIn(make_elements()),
                         [](const auto& element) { return element.param.name; });

TEST_P(EachElement, PassesThePatchTest) {
  const auto& type = GetParam();
  const auto mesh = distorted(type);
  Eigen::Matrix3d H;
  H << 0.01, 0.02, -0.03, 0.015, -0.02, 0.01, 0.005, 0.03, 0.02;
  if (type.planar) H.row(2).setZero(), H.col(2).setZero();
  if (type.axisymmetric) {  // u = (a r, b z): the one homogeneous field of a ring
    H(0, 1) = H(1, 0) = 0.0;
  }
  auto expected = H;
  if (type.axisymmetric) expected(2, 2) = H(0, 0);
  const auto d = linear_field(mesh, H);
  for (const auto& law : make_laws()) {
    auto assembly = make_assembly(mesh, make_example(law, 1000.0), type);
    Field f(d.size());
    const auto report = assembly.compute_force(d, f, 0.0);
    CellResults cells;
    assembly.evaluate(d, cells);
    double gradient_error = 0.0;
    double stress_spread = 0.0;
    for (std::size_t c = 0; c < mesh.n_cells(); ++c) {
      for (int i = 0; i < 9; ++i)
        gradient_error =
            std::max(gradient_error,
                     std::abs(cells[c * n_evaluated + gradient_00 + static_cast<std::size_t>(i)] -
                              expected(i / 3, i % 3)));
      for (std::size_t k = 0; k < 6; ++k)
        stress_spread = std::max(stress_spread, std::abs(cells[c * n_evaluated + k] - cells[k]));
    }
    // Inside the body and off the axis the forces balance; a ring's do for equal radial and hoop
    // stress only, which the field above gives.
    double largest = 0.0;
    double inner = 0.0;
    const double x0 = type.axisymmetric ? 1.0 : 0.0;
    for (std::size_t n = 0; n < mesh.n_nodes(); ++n) {
      bool inside = true;
      for (std::size_t i = 0; i < (type.planar ? 2u : 3u); ++i) {
        const double x = mesh.nodes[3 * n + i] - (i == 0 ? x0 : 0.0);
        inside = inside && x > 1e-9 && x < 1.0 - 1e-9;
      }
      for (std::size_t i = 0; i < 3; ++i) {
        auto& worst = inside ? inner : largest;
        worst = std::max(worst, std::abs(f[4 * n + i]));
      }
    }
    std::printf("%s: grad u %.1e, stress %.1e Pa, inner force %.1e of %.1e N, hourglass %.1e J\n",
                law.name.c_str(), gradient_error, stress_spread, inner, largest,
                report.hourglass_energy);
    // Round-off: gradients of order 0.03 by some 30 operations; stresses of K = 3e6 Pa times a
    // strain of 0.01 = 3e4 Pa.
    EXPECT_LT(gradient_error, 1e-12);
    EXPECT_LT(stress_spread, 1e-12 * 3e6);
    // Fibres in the plane give the ring no hoop symmetry; its inner forces do not vanish then.
    if (!type.axisymmetric || law.n_fields == 0) {
      EXPECT_LT(inner, 1e-12 * largest);
    }
    EXPECT_LT(report.hourglass_energy, 1e-24 * 3e6);
  }
}

TEST_P(EachElement, LumpsAllTheMassAndNoMore) {
  const auto& type = GetParam();
  const auto mesh = distorted(type);
  const auto assembly = make_assembly(mesh, make_material("neo_hookean", 1e5, 1e6, 1070.0), type);
  const auto& mass = assembly.nodal_mass();
  const double sum = std::accumulate(mass.begin(), mass.end(), 0.0);
  // A ring of section 1 x 1 m with its centre at 1.5 m: Pappus.
  const double exact = 1070.0 * (type.axisymmetric ? 3.0 * pi : 1.0);
  std::printf("mass error %.1e\n", sum / exact - 1.0);
  // Up to 384 cells add up with random rounding: sqrt(384) * 1.1e-16 = 2e-15.
  EXPECT_NEAR(sum, exact, 1e-14 * exact);
  for (const double m : mass) EXPECT_GT(m, 0.0);
}

TEST_P(EachElement, RigidRotationOfTwoTurnsLeavesNoStress) {
  const auto& type = GetParam();
  if (type.axisymmetric) GTEST_SKIP() << "a ring has no rigid rotation in its plane";
  const auto mesh = distorted(type);
  auto assembly = make_assembly(mesh, make_material("neo_hookean", 1e5, 1e8, 1000.0), type);
  const Eigen::Vector3d axis =
      type.planar ? Eigen::Vector3d(0, 0, 1) : Eigen::Vector3d(1, 2, 3).normalized();
  double worst = 0.0;
  double hourglass = 0.0;
  for (int step = 1; step <= 48; ++step) {  // 720 degrees in steps of 15
    const Eigen::Matrix3d R = Eigen::AngleAxisd(step * pi / 12.0, axis).toRotationMatrix();
    CellResults cells;
    const auto d = linear_field(mesh, R - Eigen::Matrix3d::Identity());
    assembly.evaluate(d, cells);
    for (std::size_t c = 0; c < mesh.n_cells(); ++c) {
      for (std::size_t k = 0; k < 6; ++k)
        worst = std::max(worst, std::abs(cells[c * n_evaluated + k]));
      hourglass = std::max(hourglass, cells[c * n_evaluated + hourglass_energy]);
    }
  }
  std::printf("largest stress %.1e G (K/G = 1000), hourglass energy %.1e G V\n", worst / 1e5,
              hourglass / (1e5 / 64.0));
  // J - 1 keeps an error of some 1e-16 * |H|^3 = 1e-15; times K = 1000 G.
  EXPECT_LT(worst, 1e-10 * 1e5);
  EXPECT_LT(hourglass, 1e-24 * 1e5);
}

TEST_P(EachElement, ForcesAreTheDerivativeOfTheEnergyForEveryLaw) {
  const auto& type = GetParam();
  const auto mesh = distorted(type);
  for (const auto& law : make_laws()) {
    auto assembly = make_assembly(mesh, make_example(law, 1000.0), type);
    auto d = wavy_field(mesh, type, 0.002);
    if (law.n_fields > 0) {  // fibres pull everywhere: where they begin to, the energy has a kink
      const Eigen::Vector3d stretch(type.axisymmetric ? -0.05 : 0.05, 0.25, 0.0);
      const auto stretched = linear_field(mesh, stretch.asDiagonal().toDenseMatrix());
      for (std::size_t i = 0; i < d.size(); ++i) d[i] += stretched[i];
    }
    Field direction(d.size());
    for (std::size_t i = 0; i < d.size(); ++i)
      if (i % 4 < (type.planar ? 2u : 3u)) direction[i] = std::cos(7.0 * static_cast<double>(i));
    const auto energy = [&](double s) {
      Field moved(d);
      for (std::size_t i = 0; i < d.size(); ++i) moved[i] += s * direction[i];
      CellResults cells;
      assembly.evaluate(moved, cells);
      double sum = 0.0;
      for (std::size_t c = 0; c < mesh.n_cells(); ++c)
        sum += cells[c * n_evaluated + strain_energy] + cells[c * n_evaluated + hourglass_energy];
      return sum;
    };
    Field f(d.size());
    assembly.compute_force(d, f, 0.0);
    double power = 0.0;
    double scale = 0.0;
    for (std::size_t i = 0; i < d.size(); ++i) {
      power += f[i] * direction[i];
      scale += std::abs(f[i] * direction[i]);
    }
    // Fourth-order difference: h^4 E^(5)/30 against rounding eps E/h; both below 1e-8 at h = 3e-5.
    const double h = 3e-5;
    const double slope =
        (8.0 * (energy(h) - energy(-h)) - (energy(2.0 * h) - energy(-2.0 * h))) / (12.0 * h);
    std::printf("%s: f.d = %.12g, dE = %.12g\n", law.name.c_str(), power, slope);
    EXPECT_NEAR(power, slope, 1e-8 * scale) << law.name;
  }
}

TEST_P(EachElement, GivesTheSameBitsForAnyThreadsAndTheSameForcesByAnyInstructionSet) {
  const auto& type = GetParam();
  const auto mesh = distorted(type);
  const auto d = wavy_field(mesh, type, 0.002);
  for (const auto& law : make_laws()) {
    const auto material = make_example(law, 1000.0);
    Field best(d.size());
    make_assembly(mesh, material, type).compute_force(d, best, 0.0);
    const double scale = std::abs(*std::max_element(
        best.begin(), best.end(), [](double a, double b) { return std::abs(a) < std::abs(b); }));
    for (const auto isa :
         {InstructionSet::baseline, InstructionSet::avx2, InstructionSet::avx512}) {
      if (!has_instruction_set(isa)) continue;
      Field one(d.size());
      Field three(d.size());
      make_assembly(mesh, material, type, isa, 1).compute_force(d, one, 0.0);
      make_assembly(mesh, material, type, isa, 3).compute_force(d, three, 0.0);
      EXPECT_EQ(one, three) << law.name << ", instruction set " << static_cast<int>(isa);
      // Fused multiply-adds round once where the others round twice: some hundred roundings of
      // terms that the bulk modulus makes ten to a hundred times the sum.
      for (std::size_t i = 0; i < one.size(); ++i)
        EXPECT_NEAR(one[i], best[i], 1e-12 * scale) << law.name << static_cast<int>(isa);
    }
  }
}

TEST_P(EachElement, ReportsAnInvertedElement) {
  const auto& type = GetParam();
  const auto mesh = distorted(type);
  auto assembly = make_assembly(mesh, make_material("neo_hookean", 1e5, 1e8, 1000.0), type);
  Field d(4 * mesh.n_nodes());
  Field f(d.size());
  EXPECT_FALSE(assembly.compute_force(d, f, 0.0).bad);
  const std::size_t middle = type.planar ? 12 : 62;  // of 5^2 or 5^3 nodes: leaves its cells
  d[4 * middle] += 2.0;
  EXPECT_TRUE(assembly.compute_force(d, f, 0.0).bad);
  EXPECT_LT(assembly.find_worst(d).jacobian, 0.0);
  d[4 * middle] = std::nan("");
  EXPECT_TRUE(assembly.compute_force(d, f, 0.0).bad);
}

TEST_P(EachElement, UndeformedBodyHasExactlyZeroForceWithEveryLaw) {
  const auto& type = GetParam();
  const auto mesh = distorted(type);
  for (const auto& law : make_laws()) {
    Assembly assembly(mesh, {make_example(law, 1000.0)}, {0},
                      {.instruction_set = best_instruction_set(),
                       .element_of_tissue = {type.name},
                       .skip_undeformed = false});
    Field f(4 * mesh.n_nodes(), 1.0);
    assembly.compute_force(Field(f.size()), f, 1e6);
    for (const double value : f) EXPECT_EQ(value, 0.0) << law.name;
  }
}

TEST_P(EachElement, LeavingOutUndeformedChunksChangesNoBit) {
  const auto& type = GetParam();
  const auto mesh = distorted(type);
  std::array<Field, 2> forces;
  std::size_t active = 0;
  std::size_t all = 0;
  for (const bool skip : {false, true}) {
    Assembly assembly(mesh, {make_material("neo_hookean", 1e5, 1e8, 1000.0)}, {0},
                      {.instruction_set = best_instruction_set(),
                       .chunk_elements = type.shape == Shape::quad4 ? 2u : 8u,
                       .element_of_tissue = {type.name},
                       .skip_undeformed = skip});
    Field d(4 * mesh.n_nodes());
    d[4] = 0.01;
    auto& f = forces[skip ? 1 : 0];
    f.resize(d.size());
    assembly.compute_force(d, f, 1e6);
    active = assembly.n_active_chunks();
    all = assembly.n_chunks();
  }
  std::printf("%zu of %zu chunks computed\n", active, all);
  EXPECT_EQ(forces[0], forces[1]);
  EXPECT_LT(active, all);
}

}  // namespace
}  // namespace ocublast::solid
