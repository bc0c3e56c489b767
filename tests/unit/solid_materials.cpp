#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstdio>

#include "tests/support/solid_runs.hpp"

// Properties every law has; they run over all laws the program was built with.

namespace ocublast::solid {

void PrintTo(const MaterialLaw& law, std::ostream* out) {
  *out << law.name;
}

namespace {

using namespace test;
using RowMatrix = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

/// Constants by the law's examples, then its fields (two fibre directions).
std::vector<double> values_of(const MaterialLaw& law) {
  auto values = make_example(law, 1000.0).constants;
  const auto fibres = make_fibres(1);
  values.insert(values.end(), fibres.begin(), fibres.begin() + static_cast<long>(law.n_fields));
  return values;
}

const RowMatrix deformation =
    (RowMatrix() << 0.11, -0.07, 0.05, 0.02, -0.13, 0.08, -0.04, 0.06, 0.09).finished();

double stress(const MaterialLaw& law, const RowMatrix& H, RowMatrix& P) {
  return law.kernels[static_cast<std::size_t>(best_instruction_set())].point(values_of(law).data(),
                                                                             H.data(), P.data());
}

class EachLaw : public ::testing::TestWithParam<MaterialLaw> {};
INSTANTIATE_TEST_SUITE_P(Laws, EachLaw, ::testing::ValuesIn(make_laws()),
                         [](const auto& law) { return law.param.name; });

TEST_P(EachLaw, StressIsTheDerivativeOfTheEnergy) {
  const auto& law = GetParam();
  const double scale = 1e5;  // the shear modulus of the examples
  for (const double sign : {1.0, -1.0}) {
    const RowMatrix H = sign * deformation;
    RowMatrix P;
    EXPECT_GT(stress(law, H, P), 0.0);
    double worst = 0.0;
    for (int i = 0; i < 9; ++i) {
      const double h = 1e-4;
      RowMatrix unused;
      const auto at = [&](double s) {
        RowMatrix moved = H;
        moved.data()[i] += s;
        return stress(law, moved, unused);
      };
      const double slope = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
      const double error = std::abs(slope - P.data()[i]) / scale;
      worst = error <= worst ? worst : error;  // keeps what is not a number
    }
    std::printf("stress against energy slope %.1e G\n", worst);
    EXPECT_LT(worst, 1e-8);  // fourth-order difference, step 1e-4: (1e-4)^4 and rounding
  }
}

TEST_P(EachLaw, IsObjectiveAndItsCauchyStressSymmetric) {
  const auto& law = GetParam();
  if (!law.finite_strain) GTEST_SKIP() << "small strain";
  const Eigen::Matrix3d R =
      Eigen::AngleAxisd(1.3, Eigen::Vector3d(3, -1, 2).normalized()).toRotationMatrix();
  RowMatrix P, Q;
  const RowMatrix F = deformation + Eigen::Matrix3d::Identity();
  const RowMatrix turned = R * F - Eigen::Matrix3d::Identity();
  const double energy = stress(law, deformation, P);
  const double energy_turned = stress(law, turned, Q);
  const Eigen::Matrix3d tau = P * F.transpose();
  std::printf("turned stress %.1e, energy %.1e, asymmetry %.1e\n", (Q - R * P).norm() / P.norm(),
              energy_turned / energy - 1.0, (tau - tau.transpose()).norm() / tau.norm());
  // Round-off of some hundred operations with cancellation of strains of 0.1 against 1.
  EXPECT_LT((Q - R * P).norm(), 1e-12 * P.norm());
  EXPECT_NEAR(energy, energy_turned, 1e-12 * energy);
  EXPECT_LT((tau - tau.transpose()).norm(), 1e-12 * tau.norm());
}

TEST_P(EachLaw, HasTheModuliItNames) {
  // Small strains: uniaxial stress change K + 4G/3 and shear change G. With fibres they are bounds.
  const auto& law = GetParam();
  const auto moduli = law.moduli(values_of(law).data());
  const double e = 1e-6;
  RowMatrix P;
  RowMatrix H = RowMatrix::Zero();
  H(0, 0) = e;
  stress(law, H, P);
  const double wave = P(0, 0) / e;
  H.setZero();
  H(0, 1) = e;
  stress(law, H, P);
  const double shear = P(0, 1) / e;
  const double expected = moduli.bulk + 4.0 / 3.0 * moduli.shear;
  std::printf("P-wave modulus %.6g of %.6g Pa, shear %.6g of %.6g Pa\n", wave, expected, shear,
              moduli.shear);
  if (law.n_fields > 0) {
    EXPECT_LE(wave, expected * (1.0 + 1e-4));
    EXPECT_LE(shear, moduli.shear * (1.0 + 1e-4));
    EXPECT_GT(shear, 0.0);
  } else {  // second-order terms are of relative size e times the ratio of the moduli
    EXPECT_NEAR(wave, expected, 1e-4 * expected);
    EXPECT_NEAR(shear, moduli.shear, 1e-4 * moduli.bulk);
  }
}

TEST_P(EachLaw, ResistsSquashing) {
  // Stress turns compressive without end as a body is squashed evenly (so that it cannot invert);
  // the linear laws have no such barrier and say so.
  const auto& law = GetParam();
  RowMatrix P;
  const RowMatrix H = -0.5 * RowMatrix::Identity();
  stress(law, H, P);
  EXPECT_LT(P(0, 0), 0.0);
  EXPECT_TRUE(std::isfinite(P(0, 0)));
}

TEST(Liquid, CavitatesAtItsCutOff) {
  const auto laws = make_laws();
  for (const auto& law : laws) {
    if (law.name != "liquid") continue;
    const double values[2] = {2e9, 1e5};
    RowMatrix P;
    const auto point = law.kernels[static_cast<std::size_t>(best_instruction_set())].point;
    RowMatrix H = 1e-3 * RowMatrix::Identity();
    point(values, H.data(), P.data());
    EXPECT_NEAR(P(0, 0), 1e5 * 1.001 * 1.001, 1.0);  // cut off, times the cofactor
    H = -1e-6 * RowMatrix::Identity();
    point(values, H.data(), P.data());
    EXPECT_NEAR(P(0, 0), -6e3, 0.1);  // 3e-6 of K, to second order
  }
}

/// Shear stress (Pa) over time of a cube sheared suddenly by `shear` and then held.
struct Relaxation {
  std::vector<double> stress;
  double elastic = 0.0;
};
Relaxation relax(const Material& material, double shear, double dt, int steps) {
  const auto mesh = make_block({.cells = {1, 1, 1}});
  Assembly assembly(mesh, {material}, {0},
                    {.instruction_set = best_instruction_set(), .viscosity = {0.0, 0.0}});
  AlignedVector<double> d(4 * mesh.n_nodes()), f(d.size());
  for (std::size_t n = 0; n < mesh.n_nodes(); ++n) d[4 * n] = shear * mesh.nodes[3 * n + 2];
  const auto top = [&] {
    double sum = 0.0;
    for (const auto n : mesh.node_sets.at("z1")) sum += f[4 * static_cast<std::size_t>(n)];
    return sum;
  };
  Relaxation result;
  assembly.compute_force(d, f, 0.0);
  result.elastic = top();
  for (int k = 0; k < steps; ++k) {
    assembly.compute_force(d, f, 1.0 / dt);
    result.stress.push_back(top());
  }
  return result;
}

TEST(Viscoelasticity, RelaxesByItsPronySeriesOverEveryFiniteStrainLaw) {
  for (const auto& law : make_laws()) {
    if (law.moduli(values_of(law).data()).shear == 0.0 || law.n_fields > 0) continue;
    auto material = make_example(law, 1000.0);
    material.prony_ratios = {0.5, 0.2};
    material.prony_times = {1e-3, 1e-2};
    const double dt = 1e-5;
    const auto r = relax(material, 1e-4, dt, 500);
    double worst = 0.0;
    for (std::size_t k = 0; k < r.stress.size(); ++k) {
      // The jump falls into the first step, whose middle is the time of the load.
      const double t = dt * (static_cast<double>(k) + 0.5);
      const double exact = 0.3 + 0.5 * std::exp(-t / 1e-3) + 0.2 * std::exp(-t / 1e-2);
      const double error = std::abs(r.stress[k] / r.elastic - exact);
      worst = error <= worst ? worst : error;
    }
    std::printf("%s: relaxation error %.1e of the instantaneous stress\n", law.name.c_str(), worst);
    // The recursion is exact for a jump at the middle of a step; what is left are the volumetric
    // second-order stresses of a shear of 1e-4.
    EXPECT_LT(worst, 1e-6) << law.name;
  }
}

TEST(Viscosity, GivesTheNewtonianShearStress) {
  auto material = make_material("liquid", 1e9, 1e9, 1000.0);
  material.constants = {1e9, 1e9};
  material.moduli = {.shear = 0.0, .bulk = 1e9};
  material.viscosity = 0.7;
  const double rate = 10.0;
  const double dt = 1e-6;
  const auto r = relax(material, rate * dt, dt, 2);
  std::printf("shear stress %.9f of %.9f Pa, then %.1e Pa\n", r.stress[0], 0.7 * rate, r.stress[1]);
  EXPECT_NEAR(r.stress[0], 0.7 * rate, 1e-4 * 0.7 * rate);  // second order in the shear of 1e-5
  EXPECT_NEAR(r.stress[1], 0.0, 1e-9);
}

TEST(Viscoelasticity, RigidRotationLeavesNoRateStress) {
  auto material = make_material("neo_hookean", 1e5, 1e7, 1000.0);
  material.prony_ratios = {0.5};
  material.prony_times = {1e-3};
  material.viscosity = 1.0;
  const auto mesh = make_block({.cells = {2, 2, 2}, .distortion = 0.2});
  Assembly assembly(mesh, {material}, {0},
                    {.instruction_set = best_instruction_set(), .viscosity = {0.0, 0.0}});
  AlignedVector<double> d(4 * mesh.n_nodes()), f(d.size());
  double worst = 0.0;
  for (int step = 1; step <= 48; ++step) {
    const Eigen::Matrix3d R =
        Eigen::AngleAxisd(step * pi / 12.0, Eigen::Vector3d(1, 2, 3).normalized())
            .toRotationMatrix();
    for (std::size_t n = 0; n < mesh.n_nodes(); ++n) {
      const Eigen::Vector3d X(mesh.nodes[3 * n], mesh.nodes[3 * n + 1], mesh.nodes[3 * n + 2]);
      const Eigen::Vector3d u = R * X - X;
      for (std::size_t i = 0; i < 3; ++i) d[4 * n + i] = u[static_cast<int>(i)];
    }
    assembly.compute_force(d, f, 1e5);
    for (const double value : f) worst = std::max(worst, std::abs(value));
  }
  std::printf("largest force %.1e of %.1e N\n", worst, 1e5 * 0.25);
  // Rates of strain of round-off, 1e-16 times 1e5 per s; G of 1e5 Pa on areas of 1/4 m^2.
  EXPECT_LT(worst, 1e-9 * 1e5 * 0.25);
}

}  // namespace
}  // namespace ocublast::solid
