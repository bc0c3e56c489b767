#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tests/support/solid_runs.hpp"

namespace ocublast::solid {
namespace {

using namespace test;

/// A column along z held at its sides; the lower half is another tissue.
void check_reflection(const Material& above, const Material& below) {
  constexpr int cells = 400;
  auto mesh = make_block({.cells = {1, 1, cells}, .size = {0.01, 0.01, 1.0}});
  mesh.tissues = {"above", "below"};
  for (int k = 0; k < cells; ++k)
    mesh.of(Shape::hex8).tissue[static_cast<std::size_t>(k)] = k < cells / 2 ? 1 : 0;
  auto setup = make_setup(mesh, above);
  setup.materials.push_back(below);
  setup.material_of_tissue = {0, 1};
  for (const char* side : {"x0", "x1"})
    setup.fixed.push_back(fixed_set(*setup.mesh, side, {true, false, false}));
  for (const char* side : {"y0", "y1"})
    setup.fixed.push_back(fixed_set(*setup.mesh, side, {false, true, false}));
  const double pressure = 1e-5 * above.moduli.bulk;  // strain 1e-5: linear
  const double c1 = above.sound_speed();
  const double c2 = below.sound_speed();
  // A ramp over 20 cells' passage: a jump rings on any mesh.
  setup.pressures.push_back({.facets = setup.mesh->face_sets.at("z1"),
                             .pressure = {{0.0, 20.0 / cells / c1}, {0.0, pressure}}});
  SolidRun solid(setup);
  // The front has come back half way in the upper tissue, or nearly reached the lower end.
  const double end = 0.5 / c1 + std::min(0.3 / c1, 0.45 / c2);
  const double error = run(solid, end, 40, [](double) {});
  CellResults stress;
  solid.assembly().evaluate(solid.state().displacement, stress);
  const double reach = end - 0.5 / c1 - 20.0 / cells / c1;  // s since the ramp's end met the face
  const auto mean = [&](double low, double high) {
    double sum = 0.0;
    int n = 0;
    for (int k = 0; k < cells; ++k) {
      const double z = (k + 0.5) / cells;
      if (z < low || z > high) continue;
      sum -= stress[static_cast<std::size_t>(k) * n_evaluated + stress_zz];
      ++n;
    }
    return sum / n;
  };
  const double reflected = mean(0.51, 0.5 + 0.7 * c1 * reach) / pressure - 1.0;
  const double transmitted = mean(0.5 - 0.7 * c2 * reach, 0.49) / pressure;
  const double Z1 = above.density * c1;
  const double Z2 = below.density * c2;
  const double R = (Z2 - Z1) / (Z2 + Z1);
  std::printf("%s to %s: reflected %+.5f of %+.5f, transmitted %.5f of %.5f, energy error %.1e\n",
              above.name.c_str(), below.name.c_str(), reflected, R, transmitted, 1.0 + R, error);
  EXPECT_NEAR(reflected, R, 0.01);  // of the incident wave
  EXPECT_NEAR(transmitted, 1.0 + R, 0.01);
  EXPECT_LT(error, 1e-3);
}

TEST(TissueInterface, ReflectsByTheRatioOfImpedances) {
  const auto tissue = [](const char* name, double shear, double bulk, double density) {
    auto material = make_material("neo_hookean", shear, bulk, density);
    material.name = name;
    return material;
  };
  const auto fat = tissue("fat", 500.0, 1.988e9, 930.0);
  const auto bone = tissue("bone", 5.423e9, 1.175e10, 1860.0);
  const auto sclera = tissue("sclera", 1.82e6, 2.806e9, 1070.0);
  check_reflection(fat, bone);     // +0.63
  check_reflection(sclera, fat);   // -0.12
  check_reflection(bone, sclera);  // -0.55
}

}  // namespace
}  // namespace ocublast::solid
