// Coefficients of Kingery and Bulmash (1984) in metric form, pieces in the order of Z. Checked
// against their conversion from the imperial ones (4e-6) and against the Rankine-Hugoniot relations
// (0.5 % in the shock speed for Z >= 1).

#include "flow_solver/sources/kingery_bulmash.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "coupler/base/errors.hpp"

namespace ocublast::flow {
namespace {

constexpr std::size_t most_terms = 15;

struct Piece {
  BurstKind burst;
  BlastQuantity quantity;
  double z_min, z_max;  ///< m/kg^(1/3)
  double k0, k1;
  std::array<double, most_terms> c;
};

using enum BurstKind;
using enum BlastQuantity;

// Pressures in kPa, impulses in kPa ms/kg^(1/3), times in ms/kg^(1/3), speeds in m/ms.
// clang-format off: a piece in three lines
constexpr Piece pieces[] = {
    {free_air,
     incident_pressure,
     0.0531,
     40,
     -0.214362789151,
     1.35034249993,
     {2.611368669, -1.69012801396, 0.00804973591951, 0.336743114941, -0.00516226351334,
      -0.0809228619888, -0.00478507266747, 0.00793030472242, 0.0007684469735}},
    {free_air,
     reflected_pressure,
     0.0531,
     40,
     -0.214362789151,
     1.35034249993,
     {3.22958031387, -2.21400538997, 0.035119031446, 0.657599992109, 0.0141818951887,
      -0.243076636231, -0.0158699803158, 0.0492741184234, 0.00227639644004, -0.00397126276058}},
    {free_air,
     incident_impulse,
     0.0531,
     0.792,
     2.34723921354,
     3.24299066475,
     {2.38830516757, -0.443749377691, 0.168825414684, 0.0348138030308, -0.010435192824}},
    {free_air,
     incident_impulse,
     0.792,
     40,
     -1.75305660315,
     2.30629231803,
     {1.55197227115, -0.40463292088, -0.0142721946082, 0.00912366316617, -0.0006750681404,
      -0.00800863718901, 0.00314819515931, 0.00152044783382, -0.0007470265899}},
    {free_air,
     reflected_impulse,
     0.0531,
     40,
     -0.204004553231,
     1.37882996018,
     {2.55875660396, -0.903118886091, 0.101771877942, -0.0242139751146}},
    {free_air,
     arrival_time,
     0.0531,
     40,
     -0.253273111999,
     1.37407043777,
     {0.0720707787637, 1.36456871214, -0.0570035692784, -0.182832224796, 0.0118851436014,
      0.0432648687627, -0.0007997367834, -0.00436073555033}},
    {free_air,
     positive_duration,
     0.147,
     0.888,
     2.26367268496,
     5.11588554305,
     {-0.686608550419, 0.164953518069, 0.127788499497, 0.00291430135946, 0.0018795744922,
      0.017341396254, 0.0026973975804, -0.00361976502798, -0.00100926577934}},
    {free_air,
     positive_duration,
     0.888,
     2.28,
     -1.33361206714,
     9.2996288611,
     {0.23031841078, -0.0297944268969, 0.0306329542941, 0.018340557407, -0.0173964666286,
      -0.00106321963576, 0.0056206003128, 0.0001618217499, -0.0006860188944}},
    {free_air,
     positive_duration,
     2.28,
     40,
     -3.13005805346,
     3.1524725364,
     {0.621036276475, 0.0967031995552, -0.00801302059667, 0.00482705779732, 0.00187587272287,
      -0.00246738509321, -0.000841116668, 0.0006193291052}},
    {free_air,
     shock_velocity,
     0.0531,
     40,
     -0.214362789151,
     1.35034249993,
     {-0.144615443471, -0.650507560471, 0.291320654009, 0.307916322787, -0.183361123489,
      -0.197740454538, 0.0909119559768, 0.0898926178054, -0.0287370990248, -0.0248730221702,
      0.00496311705671, 0.00372242076361, -0.0003533736952, -0.0002292913709}},
    {surface,
     incident_pressure,
     0.0674,
     40,
     -0.214362789151,
     1.35034249993,
     {2.78076916577, -1.6958988741, -0.154159376846, 0.514060730593, 0.0988534365274,
      -0.293912623038, -0.0268112345019, 0.109097496421, 0.00162846756311, -0.0214631030242,
      0.0001456723382, 0.00167847752266}},
    {surface,
     incident_impulse,
     0.0674,
     0.955,
     2.06761908721,
     3.0760329666,
     {2.52455620925, -0.502992763686, 0.171335645235, 0.0450176963051, -0.0118964626402}},
    {surface,
     incident_impulse,
     0.955,
     40,
     -1.94708846747,
     2.40697745406,
     {1.67281645863, -0.384519026965, -0.0260816706301, 0.00595798753822, 0.0145445261077,
      -0.00663289334734, -0.00284189327204, 0.0013644816227}},
    {surface,
     reflected_pressure,
     0.0674,
     40,
     -0.240657322658,
     1.36637719229,
     {3.40283217581, -2.21030870597, -0.218536586295, 0.895319589372, 0.24989009775,
      -0.569249436807, -0.11791682383, 0.224131161411, 0.0245620259375, -0.0455116002694,
      -0.00190930738887, 0.00361471193389}},
    {surface,
     reflected_impulse,
     0.0674,
     40,
     -0.246208804814,
     1.33422049854,
     {2.70588058103, -0.949516092853, 0.112136118689, -0.0250659183287}},
    {surface,
     arrival_time,
     0.0674,
     40,
     -0.202425716178,
     1.37784223635,
     {-0.0591634288046, 1.35706496258, 0.052492798645, -0.196563954086, -0.0601770052288,
      0.0696360270891, 0.0215297490092, -0.0161658930785, -0.00232531970294, 0.00147752067524}},
    {surface,
     positive_duration,
     0.178,
     1.01,
     1.92946154068,
     5.25099193925,
     {-0.614227603559, 0.130143717675, 0.134872511954, 0.0391574276906, -0.00475933664702,
      -0.00428144598008}},
    {surface,
     positive_duration,
     1.01,
     2.78,
     -2.12492525216,
     9.2996288611,
     {0.315409245784, -0.0297944268976, 0.030632954288, 0.0183405574086, -0.0173964666211,
      -0.00106321963633, 0.00562060030977, 0.0001618217499, -0.0006860188944}},
    {surface,
     positive_duration,
     2.78,
     40,
     -3.53626218091,
     3.46349745571,
     {0.686906642409, 0.0933035304009, -0.0005849420883, -0.00226884995013, -0.00295908591505,
      0.00148029868929}},
    {surface,
     shock_velocity,
     0.0674,
     40,
     -0.202425716178,
     1.37784223635,
     {-0.06621072854, -0.698029762594, 0.158916781906, 0.443812098136, -0.113402023921,
      -0.369887075049, 0.129230567449, 0.19857981197, -0.0867636217397, -0.0620391900135,
      0.0307482926566, 0.0102657234407, -0.00546533250772, -0.000693180974, 0.0003847494916}},
};
// clang-format on

/// Factor from the table's units to SI.
double to_si(BlastQuantity quantity) {
  switch (quantity) {
    case incident_pressure:
    case reflected_pressure:
      return 1e3;
    case incident_impulse:
    case reflected_impulse:
      return 1.0;
    case arrival_time:
    case positive_duration:
      return 1e-3;
    case shock_velocity:
      return 1e3;
  }
  return 1.0;
}

std::string_view name_of(BlastQuantity quantity) {
  constexpr std::string_view names[] = {
      "incident pressure", "reflected pressure", "incident impulse", "reflected impulse",
      "arrival time",      "positive duration",  "shock velocity"};
  return names[static_cast<std::size_t>(quantity)];
}

}  // namespace

ScaledRange kingery_bulmash_range(BurstKind burst, BlastQuantity quantity) {
  ScaledRange range{1e300, 0.0};
  for (const Piece& p : pieces) {
    if (p.burst != burst || p.quantity != quantity) continue;
    range.min = std::min(range.min, p.z_min);
    range.max = std::max(range.max, p.z_max);
  }
  return range;
}

double kingery_bulmash(BurstKind burst, BlastQuantity quantity, double scaled_distance) {
  for (const Piece& p : pieces) {
    if (p.burst != burst || p.quantity != quantity || scaled_distance < p.z_min ||
        scaled_distance > p.z_max)
      continue;
    const double U = p.k0 + p.k1 * std::log10(scaled_distance);
    double sum = 0.0;
    for (std::size_t i = most_terms; i > 0; --i) sum = sum * U + p.c[i - 1];
    return to_si(quantity) * std::pow(10.0, sum);
  }
  const ScaledRange range = kingery_bulmash_range(burst, quantity);
  throw CaseError(fmt::format(
      "Kingery-Bulmash: {} at a scaled distance of {:.4g} m/kg^(1/3), accepted [{}, {}]",
      name_of(quantity), scaled_distance, range.min, range.max));
}

double BlastWaveForm::overpressure(double t) const {
  if (t < arrival) return 0.0;
  const double s = (t - arrival) / duration;
  return peak * (1.0 - s) * std::exp(-decay * s);
}

double friedlander_decay(double peak, double duration, double impulse) {
  const double k = peak * duration / impulse;
  // k (b - 1 + exp(-b)) / b^2 falls from k/2 to 0: one root for k > 2, none (b = 0) below.
  if (!(k > 2.0)) return 0.0;
  double b = k;
  for (int n = 0; n < 100; ++n) {
    const double f = b * b - k * (b - 1.0 + std::exp(-b));
    const double next = b - f / (2.0 * b - k * (1.0 - std::exp(-b)));
    if (std::abs(next - b) < 1e-13 * b) return next;
    b = next > 0.0 ? next : 0.5 * b;
  }
  return b;
}

BlastWaveForm blast_wave_form(BurstKind burst, double charge_mass, double distance,
                              bool reflected) {
  const double scale = std::cbrt(charge_mass), Z = distance / scale;
  BlastWaveForm wave;
  wave.peak = kingery_bulmash(burst, reflected ? reflected_pressure : incident_pressure, Z);
  wave.arrival = scale * kingery_bulmash(burst, arrival_time, Z);
  wave.duration = scale * kingery_bulmash(burst, positive_duration, Z);
  wave.decay = friedlander_decay(
      wave.peak, wave.duration,
      scale * kingery_bulmash(burst, reflected ? reflected_impulse : incident_impulse, Z));
  return wave;
}

}  // namespace ocublast::flow
