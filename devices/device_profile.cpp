// Reads and writes profile files. People edit these files, so each error message names the profile and the remedy.
#include "devices/device_profile.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <set>
#include <sstream>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "common/base/folders.hpp"
#include "common/base/json_fields.hpp"
#include "common/base/json_pretty.hpp"
#include "devices/device_writer.hpp"

namespace tandem::devices {
namespace {

namespace fs = std::filesystem;
namespace json = boost::json;

constexpr std::size_t kMaxProfiles = 1000;
constexpr std::size_t kCoefficients = 4;
// Bounds that are used if the values of a device are unverified. They are those of the softest devices with and without
// torque in the device table of CHAI3D 3.2 (PHANTOM Premium 1.5 6DOF and Touch).
constexpr haptics::CouplingParameters kUnverifiedBounds{.stiffness_n_per_m = 400,
                                                        .damping_n_s_per_m = 4,
                                                        .stiffness_n_m_per_rad = 0.3,
                                                        .damping_n_m_s_per_rad = 0.004,
                                                        .force_limit_n = 2.0,
                                                        .torque_limit_n_m = 0.1};

// Bounds of the parameters for the shape of the force curve: the largest permitted values. The scene chooses the shape,
// and a device does not restrict it.
constexpr haptics::CouplingParameters kShapes{.saturation_softness = 1.0, .curve_sharpness = 10.0};

/// A field of a profile file that has a value and its source: {"value": 3.3, "source": "…"}.
struct ValueField {
  const char* name;
  SourcedLimit DeviceProfile::*member;
  double high;
  bool is_of_torque;  ///< true: the value applies only to devices with torque
};
constexpr std::array kValues{
    ValueField{"stiffness_maximum_n_per_m", &DeviceProfile::stiffness_maximum_n_per_m, 1e6, false},
    ValueField{"stiffness_maximum_n_m_per_rad", &DeviceProfile::stiffness_maximum_n_m_per_rad, 1e4, true},
    ValueField{"damping_maximum_n_s_per_m", &DeviceProfile::damping_maximum_n_s_per_m, 1e4, false},
    ValueField{"damping_maximum_n_m_s_per_rad", &DeviceProfile::damping_maximum_n_m_s_per_rad, 100, true},
    ValueField{"apparent_mass_kg", &DeviceProfile::apparent_mass_kg, 20, false},
    ValueField{"apparent_inertia_kg_m2", &DeviceProfile::apparent_inertia_kg_m2, 1, false},
    ValueField{"physical_damping_n_s_per_m", &DeviceProfile::physical_damping_n_s_per_m, 1000, false},
    ValueField{"physical_damping_n_m_s_per_rad", &DeviceProfile::physical_damping_n_m_s_per_rad, 10, false},
    ValueField{"position_step_m", &DeviceProfile::position_step_m, 0.01, false},
    ValueField{"rotation_step_rad", &DeviceProfile::rotation_step_rad, 0.1, false},
};
// Ratio of reach_m to the diagonal of the workspace, for two reasons above 1. The origin of the base frame may be
// anywhere in the workspace, and the reachable space is often larger than the workspace.
constexpr double kReachOfWorkspace = 1.5;
constexpr double kMaxForce_n = 1000;
constexpr double kMaxTorque_n_m = 100;

SourcedLimit sourced(JsonFields& profile, const char* name, double high) {
  if (!profile.has(name)) profile.fail(name, R"(it must be {"value": number, "source": "where from"})");
  JsonFields field = profile.object(name);
  SourcedLimit result{field.required_number("value", 0, high), field.required_text("source")};
  field.finish();
  return result;
}

void read_limits(JsonFields& profile, DeviceProfile& result) {
  JsonFields limits = profile.object("limits");
  DeviceSpec& spec = result.spec;
  spec.force_limit_n = limits.required_number("force_n", 0, kMaxForce_n);
  spec.torque_limit_n_m = limits.number("torque_n_m", 0, 0, kMaxTorque_n_m);
  spec.speed_limit_m_per_s = limits.required_number("speed_m_per_s", 0.01, 100);
  spec.slew_limit_n_per_s = limits.required_number("slew_n_per_s", 1, 1e6);
  spec.slew_limit_n_m_per_s = limits.required_number("slew_n_m_per_s", 0.01, 1e5);
  result.rate_hz = limits.required_number("rate_hz", 100, 20000);
  result.limits_source = limits.required_text("source");
  limits.finish();
}

void read_workspace(JsonFields& profile, DeviceProfile& result) {
  JsonFields workspace = profile.object("workspace_m");
  result.workspace_m = workspace.vector("value", Vec3::Zero(), 10);
  if (!(result.workspace_m.minCoeff() > 0)) workspace.fail("value", "it must be three widths above 0");
  result.spec.reach_m = kReachOfWorkspace * result.workspace_m.norm();
  result.workspace_source = workspace.required_text("source");
  workspace.finish();
}

std::pair<double, double> range_of(JsonFields& fit, const char* name, double high) {
  const std::vector<double> ends = fit.numbers(name, 0, high);
  if (ends.size() != 2 || !(ends[0] > 0) || ends[1] < ends[0]) {
    fit.fail(name, "it must be [low, high], 0 < low <= high");
  }
  return {ends[0], ends[1]};
}

haptics::Cubic cubic_of(JsonFields& fit, const char* name) {
  const std::vector<double> coefficients = fit.numbers(name, -haptics::kMaxFitPolynomial, haptics::kMaxFitPolynomial);
  if (coefficients.size() != kCoefficients) fit.fail(name, "it must be four numbers [c0, c1, c2, c3]");
  haptics::Cubic result;
  std::copy(coefficients.begin(), coefficients.end(), result.c.begin());
  return result;
}

std::string text_of(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

/// A cubic polynomial of a fit, with its name for messages and the largest permitted value.
struct FittedCubic {
  const char* name;
  const haptics::Cubic& cubic;
  double most;
};

/// Refuses a stiffness and a damping polynomial if one of them is negative or too large anywhere in the range. The
/// check is made here, because later code uses the fit without checks.
void check_pair(const JsonFields& fit, const std::pair<double, double>& range, const FittedCubic& stiffness,
                const FittedCubic& damping) {
  constexpr int kStiffnessSamples = haptics::kFitSamples;
  for (int i = 0; i <= kStiffnessSamples; ++i) {
    const double k = stiffness.cubic(range.first + (range.second - range.first) * i / kStiffnessSamples);
    if (!(k > 0 && k <= stiffness.most)) {
      fit.fail(stiffness.name,
               "it must give a stiffness above 0, at most " + text_of(stiffness.most) + ", over the whole range");
    }
    const double b = damping.cubic(k);
    if (!(b >= 0 && b <= damping.most)) {
      fit.fail(damping.name, "it must give a damping of 0 to " + text_of(damping.most) + " over the whole range");
    }
  }
}

haptics::AdaptiveFit fit_of(JsonFields fit, std::string& source) {
  haptics::AdaptiveFit result;
  source = fit.required_text("source");
  const auto mass = range_of(fit, "mass_kg", 1000);
  std::tie(result.mass_low_kg, result.mass_high_kg) = mass;
  result.stiffness_n_per_m = cubic_of(fit, "stiffness_n_per_m");
  result.damping_n_s_per_m = cubic_of(fit, "damping_n_s_per_m");
  check_pair(fit, mass, {"stiffness_n_per_m", result.stiffness_n_per_m, haptics::kMaxFitStiffness_n_per_m},
             {"damping_n_s_per_m", result.damping_n_s_per_m, haptics::kMaxFitDamping_n_s_per_m});
  if (fit.has("inertia_kg_m2")) {
    const auto inertia = range_of(fit, "inertia_kg_m2", 1000);
    std::tie(result.inertia_low_kg_m2, result.inertia_high_kg_m2) = inertia;
    result.stiffness_n_m_per_rad = cubic_of(fit, "stiffness_n_m_per_rad");
    result.damping_n_m_s_per_rad = cubic_of(fit, "damping_n_m_s_per_rad");
    check_pair(fit, inertia,
               {"stiffness_n_m_per_rad", result.stiffness_n_m_per_rad, haptics::kMaxFitStiffness_n_m_per_rad},
               {"damping_n_m_s_per_rad", result.damping_n_m_s_per_rad, haptics::kMaxFitDamping_n_m_s_per_rad});
  }
  fit.finish();
  return result;
}

bool is_plain_name(std::string_view name) {
  return !name.empty() && name.size() <= 64 && std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-' || c == '.';
  });
}

DeviceProfile profile_of(JsonFields profile, const std::string& origin) {
  DeviceProfile result;
  result.name = profile.required_text("name");
  result.title = profile.required_text("title");
  result.spec.name = result.name;
  const auto force_axes = profile.whole_number("force_axes", 0, 6);
  if (force_axes != 3 && force_axes != 6) profile.fail("force_axes", "it must be 3 or 6");
  result.spec.actuated_rotations = static_cast<int>(force_axes) - 3;
  result.spec.force_maximum_n = sourced(profile, "force_maximum_n", kMaxForce_n);
  if (result.has_torque()) result.spec.torque_maximum_n_m = sourced(profile, "torque_maximum_n_m", kMaxTorque_n_m);
  read_limits(profile, result);
  read_workspace(profile, result);
  for (const ValueField& field : kValues) {
    if (field.is_of_torque && !result.has_torque()) continue;
    result.*field.member = sourced(profile, field.name, field.high);
  }
  if (profile.has("adaptive")) result.adaptive = fit_of(profile.object("adaptive"), result.adaptive_source);
  profile.finish();
  try {
    check_device_spec(result.spec);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(origin + ": profiles[" + result.name + "].limits: " + error.what());
  }
  return result;
}

/// Returns the path of a profile within its file for messages: it contains the profile's name. Fails if the name is
/// missing or invalid.
std::string path_of(const json::value& profile, std::size_t index, const std::string& origin) {
  const std::string by_index = "profiles[" + std::to_string(index) + "]";
  JsonFields fields(profile, origin, by_index);
  const std::string name = fields.required_text("name");
  if (!is_plain_name(name)) fields.fail("name", "it must be of a-z, 0-9, '-' and '.', at most 64 of them");
  return "profiles[" + name + "]";
}

std::string value_text(const SourcedLimit& limit) {
  return compact_json(json::object{{"value", limit.value}, {"source", limit.source}});
}

json::array array_of(const haptics::Cubic& cubic) {
  return {cubic.c[0], cubic.c[1], cubic.c[2], cubic.c[3]};
}

std::string fit_text(const haptics::AdaptiveFit& fit, const std::string& source) {
  json::object result{{"source", source},
                      {"mass_kg", {fit.mass_low_kg, fit.mass_high_kg}},
                      {"stiffness_n_per_m", array_of(fit.stiffness_n_per_m)},
                      {"damping_n_s_per_m", array_of(fit.damping_n_s_per_m)}};
  if (fit.inertia_high_kg_m2 > 0) {
    result["inertia_kg_m2"] = {fit.inertia_low_kg_m2, fit.inertia_high_kg_m2};
    result["stiffness_n_m_per_rad"] = array_of(fit.stiffness_n_m_per_rad);
    result["damping_n_m_s_per_rad"] = array_of(fit.damping_n_m_s_per_rad);
  }
  return compact_json(result);
}

std::string limits_text(const DeviceProfile& profile) {
  const DeviceSpec& spec = profile.spec;
  return compact_json(json::object{{"force_n", spec.force_limit_n},
                                   {"torque_n_m", spec.torque_limit_n_m},
                                   {"speed_m_per_s", spec.speed_limit_m_per_s},
                                   {"slew_n_per_s", spec.slew_limit_n_per_s},
                                   {"slew_n_m_per_s", spec.slew_limit_n_m_per_s},
                                   {"rate_hz", profile.rate_hz},
                                   {"source", profile.limits_source}});
}

std::string profile_text(const DeviceProfile& profile) {
  std::string text;
  const auto add = [&text](const char* name, const std::string& value) {
    text.append(text.empty() ? "" : ",\n").append("    \"").append(name).append("\": ").append(value);
  };
  add("name", compact_json(json::value(profile.name)));
  add("title", compact_json(json::value(profile.title)));
  add("force_axes", profile.has_torque() ? "6" : "3");
  add("force_maximum_n", value_text(profile.spec.force_maximum_n));
  if (profile.has_torque()) add("torque_maximum_n_m", value_text(profile.spec.torque_maximum_n_m));
  add("limits", limits_text(profile));
  const Vec3& size = profile.workspace_m;
  add("workspace_m",
      compact_json(json::object{{"value", {size.x(), size.y(), size.z()}}, {"source", profile.workspace_source}}));
  for (const ValueField& field : kValues) {
    if (!field.is_of_torque || profile.has_torque()) add(field.name, value_text(profile.*field.member));
  }
  if (profile.adaptive) add("adaptive", fit_text(*profile.adaptive, profile.adaptive_source));
  return "  {\n" + text + "\n  }";
}

double verified_or(const SourcedLimit& limit, double otherwise) {
  return is_verified(limit) ? limit.value : std::min(otherwise, limit.value);
}

}  // namespace

std::vector<DeviceProfile> parse_device_profiles(std::string_view text, const std::string& origin) {
  const json::value value = parse_json(text, origin);
  JsonFields file(value, origin);
  // Only the number and type of the entries are checked here. The loop below reads the profiles, so that error messages
  // contain their names.
  static_cast<void>(file.objects("profiles", 1, kMaxProfiles));
  file.finish();
  std::vector<DeviceProfile> result;
  std::set<std::string> names;
  for (const json::value& one : value.at("profiles").as_array()) {
    const std::string path = path_of(one, result.size(), origin);
    JsonFields fields(one, origin, path);
    if (!names.insert(fields.required_text("name")).second) fields.fail("name", "each profile needs a name of its own");
    result.push_back(profile_of(JsonFields(one, origin, path), origin));
  }
  return result;
}

std::vector<DeviceProfile> load_device_profiles(const fs::path& file) {
  return parse_device_profiles(read_text_file(file), file.string());
}

std::string device_profiles_text(const std::vector<DeviceProfile>& profiles) {
  std::string text = "{\"profiles\": [\n";
  for (const DeviceProfile& profile : profiles) {
    text.append(&profile == &profiles.front() ? "" : ",\n").append(profile_text(profile));
  }
  return text + "\n]}\n";
}

fs::path shipped_device_profiles() {
  const char* const chosen = std::getenv("TANDEM_DEVICE_PROFILES");
  const bool is_chosen = chosen != nullptr && *chosen != '\0';
  const fs::path file = is_chosen ? fs::path(chosen) : data_folder() / "devices" / "profiles.json";
  std::error_code error;
  if (fs::is_regular_file(file, error)) return file;
  throw std::invalid_argument("device profiles: no file at " + file.string() +
                              "; name one with the environment variable TANDEM_DEVICE_PROFILES");
}

DeviceProfile find_device_profile(std::string_view name) {
  if (name.ends_with(".json")) {
    const fs::path file(name);
    std::vector<DeviceProfile> profiles = load_device_profiles(file);
    if (profiles.size() == 1) return std::move(profiles.front());
    throw std::invalid_argument(file.string() + ": profiles has " + std::to_string(profiles.size()) +
                                " of them; a file named as a device must hold one");
  }
  std::string known;
  for (DeviceProfile& profile : load_device_profiles(shipped_device_profiles())) {
    if (profile.name == name) return std::move(profile);
    known += (known.empty() ? "" : ", ") + profile.name;
  }
  throw std::invalid_argument("device \"" + std::string(name) + "\" is not known; use FILE.json or one of: " + known);
}

HandParameters holding(const HandParameters& hand, const DeviceProfile& profile) {
  HandParameters result = hand;
  result.mass_kg += profile.apparent_mass_kg.value;
  result.damping_n_s_per_m += profile.physical_damping_n_s_per_m.value;
  result.inertia_kg_m2 += profile.apparent_inertia_kg_m2.value;
  result.damping_n_m_s_per_rad += profile.physical_damping_n_m_s_per_rad.value;
  result.encoder_step_m = std::max(hand.encoder_step_m, profile.position_step_m.value);
  result.encoder_step_rad = std::max(hand.encoder_step_rad, profile.rotation_step_rad.value);
  return result;
}

haptics::CouplingParameters coupling_bounds(const DeviceProfile& profile) {
  const haptics::CouplingParameters& soft = kUnverifiedBounds;
  haptics::CouplingParameters bounds = kShapes;
  bounds.stiffness_n_per_m = verified_or(profile.stiffness_maximum_n_per_m, soft.stiffness_n_per_m);
  bounds.damping_n_s_per_m = verified_or(profile.damping_maximum_n_s_per_m, soft.damping_n_s_per_m);
  // The bound must not exceed the software limit of the device. Otherwise the coupling would pull the tool with a force
  // that the hand does not feel, because DeviceWriter clamps it.
  bounds.force_limit_n =
      std::min(verified_or(profile.spec.force_maximum_n, soft.force_limit_n), profile.spec.force_limit_n);
  // On a device without torque, the three values below act only on the tool, which the coupling pulls; the hand feels
  // nothing of them.
  bounds.stiffness_n_m_per_rad = soft.stiffness_n_m_per_rad;
  bounds.damping_n_m_s_per_rad = soft.damping_n_m_s_per_rad;
  bounds.torque_limit_n_m = soft.torque_limit_n_m;
  if (!profile.has_torque()) return bounds;
  bounds.stiffness_n_m_per_rad = verified_or(profile.stiffness_maximum_n_m_per_rad, soft.stiffness_n_m_per_rad);
  bounds.damping_n_m_s_per_rad = verified_or(profile.damping_maximum_n_m_s_per_rad, soft.damping_n_m_s_per_rad);
  bounds.torque_limit_n_m =
      std::min(verified_or(profile.spec.torque_maximum_n_m, soft.torque_limit_n_m), profile.spec.torque_limit_n_m);
  return bounds;
}

}  // namespace tandem::devices
