#include "solid_solver/io/case_materials.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "solid_solver/materials/law_factory.hpp"

namespace ocublast::solid {
namespace {

// Outside these a number is taken for a unit mistake: aerogel is 100 kg/m^3, osmium 22 600.
constexpr double smallest_density = 100.0;
constexpr double largest_density = 3e4;

std::size_t read_law(Section& entry, const std::vector<MaterialLaw>& laws) {
  std::size_t law = 0;  // where it is missing, the other keys are read as those of neo_hookean
  std::vector<std::pair<std::string_view, std::size_t>> words;
  for (std::size_t i = 0; i < laws.size(); ++i) {
    words.emplace_back(laws[i].name, i);
    if (laws[i].name == "neo_hookean") law = i;
  }
  entry.choice("law", law, std::span<const std::pair<std::string_view, std::size_t>>(words),
               {.required = true, .help = "material law"});
  return law;
}

void read_constant(Section& entry, const LawConstant& constant, double& value) {
  if (!std::isnan(constant.fallback)) value = constant.fallback;
  entry.real(constant.key, value,
             {.unit = constant.unit,
              .min = constant.min,
              .max = constant.max,
              .above_min = constant.above_min,
              .required = std::isnan(constant.fallback),
              .help = constant.help,
              .advice = "for a liquid take law liquid, or a shear modulus of 1 to 10 Pa"});
}

/// K from the speed of pressure waves; the shear modulus must not depend on K.
void use_sound_speed(const MaterialLaw& law, double sound_speed, std::size_t bulk,
                     Material& material) {
  const double shear = law.moduli(material.constants.data()).shear;
  material.constants[bulk] = material.density * sound_speed * sound_speed - 4.0 / 3.0 * shear;
}

/// Constants of the chosen law; when listing, of every law.
void read_constants(Section& entry, const std::vector<MaterialLaw>& laws, Material& material) {
  double sound_speed = 0.0;
  std::vector<std::string> listed;
  for (std::size_t i = 0; i < laws.size(); ++i) {
    if (!entry.listing() && i != material.law) continue;
    const auto& law = laws[i];
    material.constants.assign(law.constants.size(), 0.0);
    std::size_t bulk = law.constants.size();
    for (std::size_t k = 0; k < law.constants.size(); ++k) {
      const auto& constant = law.constants[k];
      if (std::find(listed.begin(), listed.end(), constant.key) != listed.end()) continue;
      listed.emplace_back(constant.key);
      const bool by_speed = std::string_view(constant.key) == "bulk_modulus_Pa";
      const bool given_by_speed = by_speed && !entry.listing() && entry.has("sound_speed_m_s");
      // Only what was given is kept, so that the effective case can be read again.
      if (by_speed && (entry.listing() || given_by_speed))
        entry.real("sound_speed_m_s", sound_speed,
                   {.unit = "m/s",
                    .min = 0.0,
                    .above_min = true,
                    .help = "instead of bulk_modulus_Pa: K = rho c^2 - 4 G / 3"});
      if (given_by_speed && entry.has(constant.key))
        entry.fault("sound_speed_m_s", "given together with bulk_modulus_Pa; give one of them");
      if (!given_by_speed || entry.has(constant.key))
        read_constant(entry, constant, material.constants[k]);
      else
        bulk = k;
    }
    if (bulk < law.constants.size()) use_sound_speed(law, sound_speed, bulk, material);
  }
}

/// Rate dependence, which every law may have.
void read_rates(Section& entry, Material& material) {
  entry.reals("prony_ratios", material.prony_ratios,
              {.unit = "1", .help = "parts of the isochoric stress that relax, e.g. [0.5, 0.2]"});
  entry.reals("prony_times_s", material.prony_times,
              {.unit = "s", .help = "their relaxation times"});
  entry.real("viscosity_Pa_s", material.viscosity,
             {.unit = "Pa s", .min = 0.0, .help = "Newtonian shear viscosity"});
  entry.real("stiffness_damping_s", material.stiffness_damping,
             {.unit = "s", .min = 0.0, .help = "damping stress over the rate of the elastic one"});
  if (entry.listing()) return;
  double sum = 0.0;
  for (const double g : material.prony_ratios) {
    if (!(g > 0.0)) entry.fault("prony_ratios", fmt::format("{} is not positive", g));
    sum += g;
  }
  for (const double t : material.prony_times)
    if (!(t > 0.0)) entry.fault("prony_times_s", fmt::format("{} s is not positive", t));
  if (material.prony_ratios.size() != material.prony_times.size()) {
    entry.fault("prony_times_s", fmt::format("{} times for {} ratios", material.prony_times.size(),
                                             material.prony_ratios.size()));
    material.prony_times.assign(material.prony_ratios.size(), 1.0);
  }
  if (sum >= 1.0)
    entry.fault("prony_ratios",
                fmt::format("sum is {}, accepted below 1: what is left carries static loads", sum));
}

void check_units(Section& entry, const Material& material) {
  if (material.density > 0.0 &&
      (material.density < smallest_density || material.density > largest_density))
    entry.fault("density_kg_m3",
                fmt::format("{} kg/m^3 is no density of a tissue, accepted [{}, {}]; tissues have "
                            "about 1000 (is it in g/cm^3?)",
                            material.density, smallest_density, largest_density));
  if (material.moduli.shear < 0.0)
    entry.fault("law", fmt::format("shear modulus at zero strain is {:.6g} Pa, accepted positive",
                                   material.moduli.shear));
  if (material.moduli.shear > 0.0 && material.moduli.bulk < material.moduli.shear)
    entry.fault("bulk_modulus_Pa",
                fmt::format("bulk modulus {:.6g} Pa is below the shear modulus {:.6g} Pa; tissues "
                            "have a bulk modulus of about 2.5e9 Pa (is the sound speed in m/s?)",
                            material.moduli.bulk, material.moduli.shear));
}

}  // namespace

MaterialKeys read_materials(Section& solid) {
  MaterialKeys keys;
  const auto laws = make_laws();
  solid.tables("material", "what tissues are made of", [&](Section& entry, std::size_t) {
    Material material;
    std::vector<std::string> tissues;
    entry.text("name", material.name, {.required = true, .help = "name of the material"});
    entry.texts("tissues", tissues, {.required = true, .help = "tissues of the mesh it is for"});
    entry.real(
        "density_kg_m3", material.density,
        {.unit = "kg/m^3", .min = 0.0, .above_min = true, .required = true, .help = "density"});
    material.law = read_law(entry, laws);
    read_constants(entry, laws, material);
    read_rates(entry, material);
    if (!entry.listing()) {
      material.moduli = laws[material.law].moduli(material.constants.data());
      check_units(entry, material);
    }
    keys.materials.push_back(std::move(material));
    keys.tissues.push_back(std::move(tissues));
  });
  return keys;
}

std::vector<std::int32_t> assign_materials(Section& solid, const MaterialKeys& keys,
                                           const std::vector<std::string>& tissues) {
  std::vector<std::int32_t> assigned(tissues.size(), -1);
  for (std::size_t m = 0; m < keys.materials.size(); ++m)
    for (const auto& name : keys.tissues[m]) {
      const auto found = std::find(tissues.begin(), tissues.end(), name);
      if (found == tissues.end()) {
        solid.fault("material",
                    fmt::format("material {}: the mesh has no tissue '{}'; it has {}",
                                keys.materials[m].name, name, fmt::join(tissues, ", ")));
        continue;
      }
      auto& slot = assigned[static_cast<std::size_t>(found - tissues.begin())];
      if (slot >= 0)
        solid.fault("material", fmt::format("tissue '{}' has two materials, {} and {}", name,
                                            keys.materials[static_cast<std::size_t>(slot)].name,
                                            keys.materials[m].name));
      slot = static_cast<std::int32_t>(m);
    }
  for (std::size_t t = 0; t < tissues.size(); ++t)
    if (assigned[t] < 0)
      solid.fault(
          "material",
          fmt::format("tissue '{}' of the mesh has no material; add it to a [[solid.material]]",
                      tissues[t]));
  return assigned;
}

void check_fibres(Section& solid, const std::vector<Material>& materials,
                  std::span<const std::int32_t> material_of_tissue, const SolidMesh& mesh) {
  constexpr double rounding = 1e-6;  // of lengths that went through single precision
  const auto laws = make_laws();
  std::vector<std::size_t> bad(mesh.tissues.size(), 0);
  std::vector<std::string> first(mesh.tissues.size());
  for (std::size_t c = 0; c < mesh.n_cells(); ++c) {
    const auto cell = mesh.cell(c);
    const auto tissue = static_cast<std::size_t>(cell.tissue);
    const auto material = material_of_tissue[tissue];
    if (material < 0) continue;
    const std::size_t n = laws[materials[static_cast<std::size_t>(material)].law].n_fields;
    if (n == 0) continue;
    bool unit = !mesh.fibres.empty();
    for (std::size_t k = 0; unit && k < n; k += 3) {
      const double* f = &mesh.fibres[n * c + k];
      unit = std::abs(std::hypot(f[0], f[1], f[2]) - 1.0) < rounding;
    }
    if (unit) continue;
    if (bad[tissue]++ == 0) first[tissue] = fmt::format("{} {}", info(cell.shape).name, cell.index);
  }
  for (std::size_t t = 0; t < bad.size(); ++t)
    if (bad[t] > 0)
      solid.fault(
          "mesh",
          fmt::format("law {} of tissue '{}' needs two unit vectors per cell in "
                      "fibres/SHAPE [n, 6]; {} cells have none (the first is {})",
                      laws[materials[static_cast<std::size_t>(material_of_tissue[t])].law].name,
                      mesh.tissues[t], bad[t], first[t]));
}

}  // namespace ocublast::solid
