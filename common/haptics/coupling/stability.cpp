#include "common/haptics/coupling/stability.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdio>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>

namespace tandem::haptics {
namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();
/// Stiffness of a contact that practically fixes the tool, for translation [N/m] and rotation [N·m/rad]. Both values
/// are our choice. The rotational stiffness is that of the translational contact at a lever arm of 5 cm. Like the
/// coupling, the stiffnesses are given in the scale of the world and converted to that of the device.
constexpr double kStiffContact = 1e6;
constexpr double kStiffContactRotation = 2500;

constexpr std::array kHands{
    CheckedHand{"nobody", "the device alone", 0, 0, 0, 0, 0, 0},
    CheckedHand{"relaxed", "typical trial of Scientific Reports 5, 18004 (2015), fig. 3; rotation: ours", 0.554, 6.45,
                135, 4e-4, 0.012, 0.3},
    CheckedHand{"light grip", "as the simulated hand, sim_device.hpp", 0.3, 5.8, 200, 4e-4, 0.02, 0.8},
    CheckedHand{"firm grip", "ours: five times as stiff, damping ratio 0.4", 0.5, 18, 1000, 6e-4, 0.039, 4},
};

/// Arguments of a check, as one object. The search for a remedy evaluates copies of it with other stiffness or damping.
struct Setup {
  CouplingParameters parameters;
  double tool_mass_kg = 0;
  double tool_inertia_kg_m2 = 0;
  LoopDevice device;
  double slope_factor = 1;
  CouplingParameters requested;  ///< coefficients in the scene; used only for the text
};

/// Members and names of the parameters of either translation or rotation, so that the same code checks both.
struct Axis {
  bool is_rotation;
  double CouplingParameters::*stiffness;
  double CouplingParameters::*damping;
  const char* stiffness_name;
  const char* damping_name;
  const char* device_damping_name;
  const char* stiffness_unit;
  const char* damping_unit;
};
constexpr Axis kTranslation{false,
                            &CouplingParameters::stiffness_n_per_m,
                            &CouplingParameters::damping_n_s_per_m,
                            "coupling.stiffness_n_per_m",
                            "coupling.damping_n_s_per_m",
                            "device.damping_n_s_per_m",
                            "N/m",
                            "N·s/m"};
constexpr Axis kRotation{true,
                         &CouplingParameters::stiffness_n_m_per_rad,
                         &CouplingParameters::damping_n_m_s_per_rad,
                         "coupling.stiffness_n_m_per_rad",
                         "coupling.damping_n_m_s_per_rad",
                         "device.damping_n_m_s_per_rad",
                         "N·m/rad",
                         "N·m·s/rad"};

LoopModel loop_model(const Axis& axis, const Setup& setup, const CheckedHand& hand, bool is_touching) {
  LoopModel m;
  m.period_s = setup.device.period_s;
  const double scale = axis.is_rotation ? setup.device.rotational_coupling_scale : setup.device.coupling_scale;
  m.stiffness = setup.parameters.*axis.stiffness * setup.slope_factor * scale;
  m.damping = setup.parameters.*axis.damping * scale;
  m.velocity_window = axis.is_rotation ? setup.device.rotational_velocity_window : setup.device.velocity_window;
  m.delay_periods = setup.device.delay_periods;
  m.tool_mass = (axis.is_rotation ? setup.tool_inertia_kg_m2 : setup.tool_mass_kg) * scale;
  m.device_mass = axis.is_rotation ? setup.device.inertia_kg_m2 : setup.device.mass_kg;
  m.device_damping = axis.is_rotation ? setup.device.damping_n_m_s_per_rad : setup.device.damping_n_s_per_m;
  m.hand_mass = axis.is_rotation ? hand.inertia_kg_m2 : hand.mass_kg;
  m.hand_stiffness = axis.is_rotation ? hand.stiffness_n_m_per_rad : hand.stiffness_n_per_m;
  m.hand_damping = axis.is_rotation ? hand.damping_n_m_s_per_rad : hand.damping_n_s_per_m;
  if (is_touching) m.contact_stiffness = (axis.is_rotation ? kStiffContactRotation : kStiffContact) * scale;
  return m;
}

bool has_own_mass(const Axis& axis, const Setup& setup) {
  const double mass = axis.is_rotation ? setup.device.inertia_kg_m2 : setup.device.mass_kg;
  return !(mass == 0);
}
bool is_verified(const Axis& axis, const Setup& setup) {
  return axis.is_rotation ? setup.device.is_rotation_verified : setup.device.is_verified;
}
bool is_nobody(const CheckedHand& hand) {
  return &hand == &kHands.front();
}

void add_loops(const Axis& axis, const Setup& setup, std::vector<CheckedLoop>& loops) {
  for (const CheckedHand& hand : kHands) {
    if (is_nobody(hand) && !has_own_mass(axis, setup)) continue;
    for (const bool is_touching : {false, true}) {
      const LoopModel model = loop_model(axis, setup, hand, is_touching);
      loops.push_back({axis.is_rotation, hand.name, is_touching, model, spectral_radius(model)});
    }
  }
}

CheckedLoop worst_loop(const Axis& axis, const Setup& setup) {
  std::vector<CheckedLoop> loops;
  add_loops(axis, setup, loops);
  return *std::max_element(loops.begin(), loops.end(), [](const CheckedLoop& a, const CheckedLoop& b) {
    return a.spectral_radius < b.spectral_radius;
  });
}

bool is_stable(const Axis& axis, const Setup& setup) {
  return std::all_of(kHands.begin(), kHands.end(), [&](const CheckedHand& hand) {
    if (is_nobody(hand) && !has_own_mass(axis, setup)) return true;
    return spectral_radius(loop_model(axis, setup, hand, true)) < 1 &&
           spectral_radius(loop_model(axis, setup, hand, false)) < 1;
  });
}

/// Rounds to three significant digits, towards the safe side, so that the value is easy to type.
double rounded(double value, bool is_up) {
  if (!(value > 0)) return value;
  const double unit = std::pow(10, std::floor(std::log10(value)) - 2);
  const double count = value / unit;
  return unit * (is_up ? std::ceil(count - 1e-9) : std::floor(count + 1e-9));
}

using Holds = std::function<bool(const Setup&)>;

/// Returns the acceptable value nearest to `bad`, in the direction `is_up`. The search halves or doubles the value at
/// most 20 times, and returns empty if no value was acceptable.
std::optional<double> nearest_good(double bad, bool is_up, const std::function<bool(double)>& is_good) {
  const double factor = is_up ? 2 : 0.5;
  double good = bad * factor;
  for (int i = 1; i < 20 && !is_good(good); ++i) {
    bad = good;
    good *= factor;
  }
  if (!is_good(good)) return std::nullopt;
  while (std::abs(good - bad) > 1e-4 * good) {
    const double middle = (good + bad) / 2;
    (is_good(middle) ? good : bad) = middle;
  }
  const double value = rounded(good, is_up);
  return is_good(value) ? value : good;
}

std::optional<double> nearest_good(Setup setup, double CouplingParameters::*field, double start, bool is_up,
                                   const Holds& holds) {
  return nearest_good(start, is_up, [&](double value) {
    setup.parameters.*field = value;
    return holds(setup);
  });
}

std::string number(double value) {
  std::array<char, 32> text{};
  // Values from 1,000 on are printed without an exponent: 1000, not 1e+03.
  std::snprintf(text.data(), text.size(), std::abs(value) >= 1e3 && std::abs(value) < 1e7 ? "%.0f" : "%.4g", value);
  return text.data();
}

std::string circumstances(const CheckedLoop& loop) {
  const std::string hand = loop.hand == kHands.front().name ? "when the device is not held"
                                                            : "in the hand \"" + std::string(loop.hand) + "\"";
  return hand + (loop.is_touching ? " and the tool is in stiff contact" : " and the tool is in the air");
}

void name_remedy(StabilityFinding& finding, const char* parameter, double value, double remedy) {
  finding.parameter = parameter;
  finding.value = finding.rendered_value = value;
  finding.remedy = remedy;
}

// Smallest stiffness that is proposed as a remedy, as a fraction of the requested one. If the check needs a lower
// stiffness, a change of the damping is proposed instead, because such a soft coupling would feel entirely different.
constexpr double kMinPartOfStiffness = 0.02;

/// Searches for a smaller stiffness or, if that fails, a smaller damping with which the check passes. Stores the result
/// in `finding`. Returns the remedy as text; empty if neither suffices.
std::string find_smaller(const Axis& axis, const Setup& setup, const Holds& holds, StabilityFinding& finding) {
  const double stiffness = setup.parameters.*axis.stiffness;
  const double damping = setup.parameters.*axis.damping;
  const auto softer = nearest_good(setup, axis.stiffness, stiffness, false, holds);
  if (softer && *softer >= kMinPartOfStiffness * stiffness) {
    name_remedy(finding, axis.stiffness_name, stiffness, *softer);
    return "at most " + number(*softer) + " " + axis.stiffness_unit + " would do";
  }
  if (const auto less = nearest_good(setup, axis.damping, damping, false, holds)) {
    name_remedy(finding, axis.damping_name, damping, *less);
    return "at most " + number(*less) + " " + axis.damping_unit + " would do";
  }
  return {};
}

// Searches for a softer spring together with a matching damping, at least k T for a spring k. Sampling the spring with
// the period T creates energy; a damping of k T dissipates twice as much.
std::string find_softer_pair(const Axis& axis, Setup setup, const Holds& holds, StabilityFinding& finding) {
  const double stiffness = setup.parameters.*axis.stiffness;
  const double damping = setup.parameters.*axis.damping;
  const double share = damping / std::max(stiffness, std::numeric_limits<double>::min());
  const double sampling = setup.device.period_s * setup.slope_factor;
  const auto damping_for = [&](double softer) { return softer * std::max(share, sampling); };
  const auto softer = nearest_good(stiffness, false, [&](double value) {
    setup.parameters.*axis.stiffness = value;
    setup.parameters.*axis.damping = damping_for(value);
    return holds(setup);
  });
  const double nan = std::numeric_limits<double>::quiet_NaN();
  name_remedy(finding, axis.stiffness_name, stiffness, softer.value_or(nan));
  if (!softer) return "no stiffness and damping would do on this device";
  finding.remedy_damping = damping_for(*softer);
  return "at most " + number(*softer) + " " + axis.stiffness_unit + " together with " + number(finding.remedy_damping) +
         " " + axis.damping_unit + " of damping would do";
}

std::string find_stable(const Axis& axis, const Setup& setup, StabilityFinding& finding) {
  const Holds holds = [&axis](const Setup& changed) { return is_stable(axis, changed); };
  if (std::string text = find_smaller(axis, setup, holds, finding); !text.empty()) return text;
  const double damping = setup.parameters.*axis.damping;
  // Without damping, the search begins at a small value, 1/500 of k T/2. k T/2 is the damping that compensates the
  // energy created by sampling.
  const double least = 1e-3 * setup.device.period_s * setup.parameters.*axis.stiffness * setup.slope_factor;
  if (const auto more = nearest_good(setup, axis.damping, std::max(damping, least), true, holds)) {
    name_remedy(finding, axis.damping_name, damping, *more);
    return "at least " + number(*more) + " " + axis.damping_unit + " would do";
  }
  return find_softer_pair(axis, setup, holds, finding);
}

std::optional<StabilityFinding> find_bad_number(const Axis& axis, const Setup& setup) {
  const std::array<std::pair<const char*, double>, 4> numbers{
      {{axis.stiffness_name, setup.parameters.*axis.stiffness},
       {axis.damping_name, setup.parameters.*axis.damping},
       {axis.is_rotation ? "tool inertia" : "tool mass",
        axis.is_rotation ? setup.tool_inertia_kg_m2 : setup.tool_mass_kg},
       {axis.device_damping_name,
        axis.is_rotation ? setup.device.damping_n_m_s_per_rad : setup.device.damping_n_s_per_m}}};
  for (const auto& [name, value] : numbers) {
    if (std::isfinite(value) && value >= 0) continue;
    StabilityFinding finding;
    finding.verdict = StabilityVerdict::kUnstable;
    finding.spectral_radius = kUnbounded;
    name_remedy(finding, name, value, 0);
    finding.text = std::string(name) + " is " + number(value) + "; it must be a number, 0 or more";
    return finding;
  }
  return std::nullopt;
}

/// Returns a text with the parameter's name and value, and with the scene's value if it differs.
std::string name_value(const Axis& axis, const Setup& setup, StabilityFinding& finding) {
  if (finding.parameter == axis.stiffness_name) finding.value = setup.requested.*axis.stiffness;
  if (finding.parameter == axis.damping_name) finding.value = setup.requested.*axis.damping;
  const std::string unit = finding.parameter == axis.stiffness_name ? axis.stiffness_unit : axis.damping_unit;
  std::string text = finding.parameter + " is " + number(finding.value) + " " + unit;
  if (finding.value == finding.rendered_value) return text;
  return text + " in the scene, " + number(finding.rendered_value) + " " + unit + " on this device";
}

std::optional<StabilityFinding> find_instability(const Axis& axis, const Setup& setup) {
  const CheckedLoop worst = worst_loop(axis, setup);
  if (worst.spectral_radius < 1) return std::nullopt;
  StabilityFinding finding;
  finding.verdict = StabilityVerdict::kUnstable;
  finding.spectral_radius = worst.spectral_radius;
  if (!std::isfinite(worst.spectral_radius)) {
    name_remedy(finding, "device", setup.device.mass_kg, std::numeric_limits<double>::quiet_NaN());
    finding.text = "the device cannot be checked: its mass, period, velocity window or delay is out of range";
    return finding;
  }
  const std::string remedy = find_stable(axis, setup, finding);
  finding.text = name_value(axis, setup, finding) + ": unstable at " + number(1 / setup.device.period_s) + " Hz " +
                 circumstances(worst) + " (spectral radius " + number(worst.spectral_radius) + "); " + remedy;
  return finding;
}

/// Returns the damping that the device's mechanism must have at the frequency θ [rad per period], for the loop with its
/// tool:
///   T/2 · Re{(1 − e^(−jθ)) H} / (1 − cos θ), with the period T and the coupling force H per handle position.
double needed_at(const LoopModel& m, double theta) {
  const std::complex<double> back = std::polar(1.0, -theta);  // z⁻¹
  const std::complex<double> rate = (1.0 - back) / m.period_s;
  const std::complex<double> handle = std::pow(back, m.delay_periods);
  const std::complex<double> handle_velocity =
      handle * (1.0 - std::pow(back, m.velocity_window)) / (m.velocity_window * m.period_s);
  const std::complex<double> coupling = m.stiffness + m.damping * rate;
  const std::complex<double> on_tool_held = m.stiffness * handle + m.damping * handle_velocity;
  const std::complex<double> tool = on_tool_held / (m.tool_mass * rate * rate + coupling + m.contact_stiffness);
  return m.period_s / 2 * ((1.0 - back) * (on_tool_held - coupling * tool)).real() / (1 - std::cos(theta));
}

/// Returns the damping that the device's mechanism must have. It is the largest of two kinds of bounds: Colgate and
/// Schenkel's for a coupling whose tool is held fast, and needed_at() for movable tools.
double needed_damping(const Axis& axis, const Setup& setup) {
  constexpr int kFrequencies = 256;
  const LoopModel wall = loop_model(axis, setup, kHands.front(), true);
  double needed = wall.stiffness * wall.period_s * (0.5 + wall.delay_periods) + wall.damping;
  for (const bool is_touching : {false, true}) {
    const LoopModel model = loop_model(axis, setup, kHands.front(), is_touching);
    for (int i = 1; i <= kFrequencies; ++i) {
      needed = std::max(needed, needed_at(model, std::numbers::pi * i / kFrequencies));
    }
  }
  return needed;
}

std::optional<StabilityFinding> find_activity(const Axis& axis, const Setup& setup) {
  const double own = axis.is_rotation ? setup.device.damping_n_m_s_per_rad : setup.device.damping_n_s_per_m;
  const Holds holds = [&axis, own](const Setup& changed) { return own >= needed_damping(axis, changed); };
  if (holds(setup)) return std::nullopt;
  StabilityFinding finding;
  finding.verdict = StabilityVerdict::kNotPassive;
  finding.spectral_radius = worst_loop(axis, setup).spectral_radius;
  const double needed = needed_damping(axis, setup);
  std::string remedy = find_smaller(axis, setup, holds, finding);
  if (remedy.empty()) {
    name_remedy(finding, axis.device_damping_name, own, rounded(needed, true));
    remedy = "neither less stiffness nor less damping alone would do";
  }
  finding.text = name_value(axis, setup, finding) + ": some hands can take energy from it, for it needs " +
                 number(needed) + " " + axis.damping_unit + " of friction in the mechanism (k T/2 + b), which has " +
                 number(own) + "; " + remedy;
  return finding;
}

void check_axis(const Axis& axis, const Setup& setup, std::vector<StabilityFinding>& findings) {
  auto finding = find_bad_number(axis, setup);
  if (!finding) finding = find_instability(axis, setup);
  if (!finding && has_own_mass(axis, setup)) finding = find_activity(axis, setup);
  if (!finding) return;
  finding->is_rotation = axis.is_rotation;
  if (has_own_mass(axis, setup) && !is_verified(axis, setup)) {
    finding->text += "; this depends on unverified values of the device: its mass and friction";
  }
  findings.push_back(std::move(*finding));
}

}  // namespace

std::span<const CheckedHand> checked_hands() noexcept {
  return kHands;
}

std::vector<CheckedLoop> checked_loops(const CouplingParameters& parameters, double tool_mass_kg,
                                       double tool_inertia_kg_m2, const LoopDevice& device, double slope_factor) {
  const Setup setup{parameters, tool_mass_kg, tool_inertia_kg_m2, device, slope_factor, parameters};
  std::vector<CheckedLoop> loops;
  add_loops(kTranslation, setup, loops);
  if (device.has_torque) add_loops(kRotation, setup, loops);
  return loops;
}

std::vector<StabilityFinding> check_coupling(const CouplingParameters& parameters, double tool_mass_kg,
                                             double tool_inertia_kg_m2, const LoopDevice& device, double slope_factor,
                                             const CouplingParameters* requested) {
  const Setup setup{parameters, tool_mass_kg, tool_inertia_kg_m2,
                    device,     slope_factor, requested == nullptr ? parameters : *requested};
  std::vector<StabilityFinding> findings;
  check_axis(kTranslation, setup, findings);
  if (device.has_torque) check_axis(kRotation, setup, findings);
  return findings;
}

bool is_stable_coupling(const CouplingParameters& parameters, double tool_mass_kg, double tool_inertia_kg_m2,
                        const LoopDevice& device, double slope_factor) {
  const Setup setup{parameters, tool_mass_kg, tool_inertia_kg_m2, device, slope_factor, parameters};
  const auto is_good = [&](const Axis& axis) { return !find_bad_number(axis, setup) && is_stable(axis, setup); };
  return is_good(kTranslation) && (!device.has_torque || is_good(kRotation));
}

}  // namespace tandem::haptics
