#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "tests/support/solid_runs.hpp"

namespace ocublast::solid {
namespace {

using namespace test;
using Field = AlignedVector<double>;

SolidMesh distorted(bool tets) {
  auto mesh = make_block({.cells = {4, 4, 4}, .size = {1.0, 1.0, 1.0}, .distortion = 0.2});
  return tets ? to_tets(mesh) : mesh;
}

Assembly make_assembly(const SolidMesh& mesh, const Material& material, InstructionSet isa,
                       int threads = 1) {
  return Assembly(
      mesh, {material}, {0},
      {.threads = threads, .instruction_set = isa, .viscosity = {0.0, 0.0}, .chunk_elements = 16});
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

class EachElement : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(HexAndTet, EachElement, ::testing::Bool(),
                         [](const auto& element) { return element.param ? "tet4_anp" : "hex8_q1p0"; });

TEST_P(EachElement, PassesThePatchTest) {
  const auto mesh = distorted(GetParam());
  Eigen::Matrix3d H;
  H << 0.01, 0.02, -0.03, 0.015, -0.02, 0.01, 0.005, 0.03, 0.02;
  const auto d = linear_field(mesh, H);
  for (const char* law : {"neo_hookean", "linear_elastic"}) {
    auto assembly =
        make_assembly(mesh, make_material(law, 1e5, 1e6, 1000.0), best_instruction_set());
    Field f(d.size());
    assembly.compute_force(d, f, 0.0);
    CellResults cells;
    assembly.evaluate(d, cells);
    double gradient_error = 0.0;
    double stress_spread = 0.0;
    for (std::size_t c = 0; c < mesh.n_cells(); ++c) {
      for (int i = 0; i < 9; ++i)
        gradient_error =
            std::max(gradient_error,
                     std::abs(cells[c * n_evaluated + gradient_00 + static_cast<std::size_t>(i)] -
                              H(i / 3, i % 3)));
      for (std::size_t k = 0; k < 6; ++k)
        stress_spread = std::max(stress_spread, std::abs(cells[c * n_evaluated + k] - cells[k]));
    }
    double largest = 0.0;
    double inner = 0.0;
    for (std::size_t n = 0; n < mesh.n_nodes(); ++n) {
      bool inside = true;
      for (std::size_t i = 0; i < 3; ++i)
        inside = inside && mesh.nodes[3 * n + i] > 1e-9 && mesh.nodes[3 * n + i] < 1.0 - 1e-9;
      for (std::size_t i = 0; i < 3; ++i)
        (inside ? inner : largest) = std::max(inside ? inner : largest, std::abs(f[4 * n + i]));
    }
    std::printf("%s: grad u %.1e, stress %.1e Pa, inner force %.1e of %.1e N\n", law,
                gradient_error, stress_spread, inner, largest);
    // Round-off: gradients of order 0.03 / h = 0.1 by some 30 operations; stress scale K * 0.01 =
    // 1e4 Pa.
    EXPECT_LT(gradient_error, 1e-12);
    EXPECT_LT(stress_spread, 1e-12 * 1e6);
    EXPECT_LT(inner, 1e-12 * largest);
  }
}

TEST_P(EachElement, LumpsAllTheMassAndNoMore) {
  const auto mesh = distorted(GetParam());
  const auto assembly =
      make_assembly(mesh, make_material("neo_hookean", 1e5, 1e6, 1070.0), InstructionSet::baseline);
  const auto& mass = assembly.nodal_mass();
  const double sum = std::accumulate(mass.begin(), mass.end(), 0.0);
  std::printf("mass error %.1e\n", sum / 1070.0 - 1.0);
  // 64 or 384 cells add up with random rounding: sqrt(384) * 1.1e-16 = 2e-15.
  EXPECT_NEAR(sum, 1070.0, 1e-14 * 1070.0);
  for (const double m : mass) EXPECT_GT(m, 0.0);
}

TEST_P(EachElement, RigidRotationOfTwoTurnsLeavesNoStress) {
  const auto mesh = distorted(GetParam());
  auto assembly =
      make_assembly(mesh, make_material("neo_hookean", 1e5, 1e8, 1000.0), best_instruction_set());
  double worst = 0.0;
  for (int step = 1; step <= 48; ++step) {  // 720 degrees in steps of 15
    const Eigen::Matrix3d R =
        Eigen::AngleAxisd(step * pi / 12.0, Eigen::Vector3d(1, 2, 3).normalized())
            .toRotationMatrix();
    CellResults cells;
    assembly.evaluate(linear_field(mesh, R - Eigen::Matrix3d::Identity()), cells);
    for (std::size_t c = 0; c < mesh.n_cells(); ++c)
      for (std::size_t k = 0; k < 6; ++k)
        worst = std::max(worst, std::abs(cells[c * n_evaluated + k]));
  }
  std::printf("largest stress %.1e G (K/G = 1000)\n", worst / 1e5);
  // J - 1 keeps an error of some 1e-16 * |H|^3 = 1e-15; times K = 1000 G.
  EXPECT_LT(worst, 1e-10 * 1e5);
}

TEST_P(EachElement, ForcesAreTheDerivativeOfTheEnergy) {
  const auto mesh = distorted(GetParam());
  for (const char* law : {"neo_hookean", "linear_elastic"}) {
    auto assembly =
        make_assembly(mesh, make_material(law, 1e5, 1e7, 1000.0), best_instruction_set());
    Field d(4 * mesh.n_nodes());
    Field direction(d.size());
    for (std::size_t i = 0; i < d.size(); ++i) {
      if (i % 4 == 3) continue;
      d[i] = 0.02 * std::sin(3.0 * static_cast<double>(i));
      direction[i] = std::cos(7.0 * static_cast<double>(i));
    }
    const auto energy = [&](double s) {
      Field moved(d);
      for (std::size_t i = 0; i < d.size(); ++i) moved[i] += s * direction[i];
      CellResults cells;
      assembly.evaluate(moved, cells);
      double sum = 0.0;
      for (std::size_t c = 0; c < mesh.n_cells(); ++c)
        sum += cells[c * n_evaluated + strain_energy];
      return sum;
    };
    Field f(d.size());
    assembly.compute_force(d, f, 0.0);
    double power = 0.0;
    for (std::size_t i = 0; i < d.size(); ++i) power += f[i] * direction[i];
    // Fourth-order difference: h^4 E^(5)/30 against rounding eps E/h; both below 1e-8 at h = 1e-4.
    const double h = 1e-4;
    const double slope =
        (8.0 * (energy(h) - energy(-h)) - (energy(2.0 * h) - energy(-2.0 * h))) / (12.0 * h);
    std::printf("%s: f.d = %.12g, dE = %.12g\n", law, power, slope);
    EXPECT_NEAR(power, slope, 1e-8 * std::abs(power));
  }
}

TEST_P(EachElement, GivesTheSameBitsForAnyThreadsAndInstructionSet) {
  const auto mesh = distorted(GetParam());
  Field d(4 * mesh.n_nodes());
  for (std::size_t i = 0; i < d.size(); ++i)
    if (i % 4 != 3) d[i] = 0.02 * std::sin(3.0 * static_cast<double>(i));
  Field reference(d.size());
  const auto material = make_material("neo_hookean", 1e5, 1e8, 1000.0);
  make_assembly(mesh, material, InstructionSet::baseline).compute_force(d, reference, 0.0);
  for (int isa = 0; isa <= static_cast<int>(best_instruction_set()); ++isa)
    for (const int threads : {1, 2, 3}) {
      Field f(d.size());
      make_assembly(mesh, material, static_cast<InstructionSet>(isa), threads)
          .compute_force(d, f, 0.0);
      EXPECT_EQ(f, reference) << "instruction set " << isa << ", threads " << threads;
    }
}

TEST_P(EachElement, ReportsAnInvertedElement) {
  const auto mesh = distorted(GetParam());
  auto assembly =
      make_assembly(mesh, make_material("neo_hookean", 1e5, 1e8, 1000.0), best_instruction_set());
  Field d(4 * mesh.n_nodes());
  Field f(d.size());
  EXPECT_FALSE(assembly.compute_force(d, f, 0.0).bad);
  d[4 * 62] += 2.0;  // the middle node of 5^3 leaves its cells
  EXPECT_TRUE(assembly.compute_force(d, f, 0.0).bad);
  EXPECT_LT(assembly.find_worst(d).jacobian, 0.0);
  d[4 * 62] = std::nan("");
  EXPECT_TRUE(assembly.compute_force(d, f, 0.0).bad);
}

TEST_P(EachElement, UndeformedBodyHasExactlyZeroForce) {
  const auto mesh = distorted(GetParam());
  auto assembly =
      make_assembly(mesh, make_material("neo_hookean", 1e5, 1e9, 1000.0), best_instruction_set());
  Field f(4 * mesh.n_nodes(), 1.0);
  assembly.compute_force(Field(f.size()), f, 1e6);
  for (const double value : f) EXPECT_EQ(value, 0.0);
}

TEST(MaterialLaws, StressIsTheDerivativeOfTheEnergyForEveryLaw) {
  for (const auto& law : make_laws()) {
    std::vector<double> constants(law.constants.size(), 2e5);
    constants.back() = 3e6;
    const auto& point = law.kernels[0].point;
    double H[9] = {0.11, -0.07, 0.05, 0.02, -0.13, 0.08, -0.04, 0.06, 0.09};
    double P[9];
    const double energy = point(constants.data(), H, P);
    EXPECT_GT(energy, 0.0) << law.name;
    double worst = 0.0;
    for (int i = 0; i < 9; ++i) {
      const double h = 1e-4;
      double unused[9];
      const auto at = [&](double s) {
        double moved[9];
        std::copy(H, H + 9, moved);
        moved[i] += s;
        return point(constants.data(), moved, unused);
      };
      const double slope = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
      worst = std::max(worst, std::abs(slope - P[i]) / 1e5);
    }
    std::printf("%s: stress against energy slope %.1e G\n", law.name.c_str(), worst);
    EXPECT_LT(worst, 1e-8)
        << law.name;  // fourth-order difference, step 1e-4: (1e-4)^4 and rounding
  }
}

TEST(MaterialLaws, FiniteStrainLawsAreObjectiveAndTheirStressSymmetric) {
  const Eigen::Matrix3d R =
      Eigen::AngleAxisd(1.3, Eigen::Vector3d(3, -1, 2).normalized()).toRotationMatrix();
  for (const auto& law : make_laws()) {
    if (law.name == "linear_elastic") continue;
    std::vector<double> constants(law.constants.size(), 2e5);
    constants.back() = 3e6;
    Eigen::Matrix<double, 3, 3, Eigen::RowMajor> H, P, Q;
    H << 0.11, -0.07, 0.05, 0.02, -0.13, 0.08, -0.04, 0.06, 0.09;
    const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> F = H + Eigen::Matrix3d::Identity();
    const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> turned = R * F - Eigen::Matrix3d::Identity();
    const double energy = law.kernels[0].point(constants.data(), H.data(), P.data());
    const double energy_turned = law.kernels[0].point(constants.data(), turned.data(), Q.data());
    const Eigen::Matrix3d tau = P * F.transpose();
    EXPECT_LT((Q - R * P).norm(), 1e-12 * P.norm()) << law.name;
    EXPECT_NEAR(energy, energy_turned, 1e-12 * energy) << law.name;
    EXPECT_LT((tau - tau.transpose()).norm(), 1e-12 * tau.norm()) << law.name;
  }
}

}  // namespace
}  // namespace ocublast::solid
