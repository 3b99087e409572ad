#include "proto/scene_ranges.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>
#include <stdexcept>

#include "common/haptics/coupling/adaptive.hpp"
#include "common/haptics/coupling/coupling_ranges.hpp"
#include "common/physics/world_description.hpp"
#include "proto/signals.hpp"
#include "proto/state.hpp"

namespace tandem::proto {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

constexpr double kMaxLength_m = 100;
constexpr double kMaxMass_kg = 1e4;
constexpr double kMaxFriction = 10;
constexpr double kMaxGravity_m_per_s2 = 1e3;
/// Default contact stiffness; our choice. Example: if a plane and a tool's ball of 5 mm radius have this stiffness, a
/// force of 5 N presses the ball 0.25 mm into the plane.
constexpr double kDefaultContactStiffness_n_per_m3 = 1e10;
/// Maximum scale of a mesh: it enlarges a mesh of the size of an atom (1e-10) to the largest length in a scene (100 m).
constexpr double kMaxMeshScale = 1e12;
/// Minimum of the two molecular scales. It is below the natural ones: 1e-10 m/Å for lengths, and 7e-11 N per kcal/mol/Å
/// for forces.
constexpr double kMinMolecularScale = 1e-12;
constexpr double kMaxMolecularEnergy = 1e6;

using Table = std::vector<SceneRange>;
using Text = std::string_view;

/// Minimum of two kinds of numbers: divisors, and quantities that a user could not perceive if they were smaller. It is
/// far above the smallest positive double, so that quotients do not overflow.
constexpr double kMin = 1e-6;

SceneRange length(Text field, int count = 1) {
  return {field, "m", kMin, kMaxLength_m, {}, count};
}

SceneRange friction(Text field) {
  return {field, "", 0, kMaxFriction, {0.5}};
}

/// Range of the contact stiffness. The lower end is soft rubber a few millimetres thick. The upper end is the highest
/// stiffness that double precision resolves at 1 kHz.
SceneRange contact_stiffness(Text field) {
  return {field, "N/m³", 1e5, 1e13, {kDefaultContactStiffness_n_per_m3}};
}

SceneRange color(Text field, const std::vector<double>& fallback) {
  return {field, "", 0, 1, fallback, 3};
}

/// Returns the range and the default of a coefficient of the coupling. The coefficients of anchors use the same ranges
/// and defaults, which give a perceptible and well damped anchor.
SceneRange coupling(Text field, Text unit, double haptics::CouplingParameters::*value) {
  const auto found = std::ranges::find(haptics::kCouplingRanges, value, &haptics::CouplingRange::value);
  return {field, unit, found->low, found->high, {haptics::CouplingParameters{}.*value}};
}

SceneRange polynomial(Text field) {
  return {field, "", -haptics::kMaxFitPolynomial, haptics::kMaxFitPolynomial, {}, 0};
}

void add(Table& table, const Table& rows) {
  table.insert(table.end(), rows.begin(), rows.end());
}

void add_shapes(Table& table) {
  add(table, {{"Placement.position_m", "m", -kMaxLength_m, kMaxLength_m, {0, 0, 0}, 3},
              {"Placement.rotation_xyz_deg", "°", -360, 360, {0, 0, 0}, 3},
              length("Sphere.radius_m"),
              length("Box.size_m", 3),
              length("Cylinder.radius_m"),
              length("Cylinder.length_m"),
              length("Capsule.radius_m"),
              length("Capsule.length_m"),
              {"Mesh.scale", "", 1 / kMaxMeshScale, kMaxMeshScale, {}, 1, "1, or the scale for largest_size_m"},
              {"Mesh.largest_size_m", "m", kMin, kMaxLength_m, {}, 1, "as given by scale"},
              {"Mesh.sheet_thickness_m", "m", 2e-4, 0.1, {1e-3}}});
}

void add_effects(Table& table) {
  const physics::Viscosity viscosity;
  const physics::Magnet magnet;
  const physics::Vibration vibration;
  const physics::Texture texture;
  const physics::StickSlip stick_slip;
  const physics::EffectSettings settings;
  add(table, {{"Viscosity.damping_n_s_per_m", "N·s/m", 0, 1000, {viscosity.damping_n_s_per_m}},
              {"Viscosity.damping_n_m_s_per_rad", "N·m·s/rad", 0, 10, {viscosity.damping_n_m_s_per_rad}},
              {"ConstantField.force_n", "N", -100, 100, {0, 0, 0}, 3},
              {"Magnet.peak_force_n", "N", kMin, 100, {magnet.peak_force_n}},
              {"Magnet.range_m", "m", 5e-4, 1, {magnet.range_m}},
              {"Magnet.core_size_m", "m", 0, 10, {0, 0, 0}, 3},
              {"Vibration.frequency_hz", "Hz", 1, 400, {vibration.frequency_hz}},
              {"Vibration.amplitude_n", "N", kMin, 100, {vibration.amplitude_n}},
              {"Vibration.decay_s", "s", 0, 10, {vibration.decay_s}},
              {"Vibration.direction", "", -1, 1, {0, 0, 1}, 3},
              {"Texture.height_m", "m", kMin, 0.01, {texture.height_m}},
              {"Texture.period_x_m", "m", 1e-4, 1, {texture.period_x_m}},
              {"Texture.period_y_m", "m", 1e-4, 1, {texture.period_y_m}, 1, "no waves along y"},
              {"StickSlip.stiffness_n_per_m", "N/m", 1, 1e5, {stick_slip.stiffness_n_per_m}},
              {"StickSlip.breakaway_force_n", "N", kMin, 100, {stick_slip.breakaway_force_n}},
              {"StickSlip.slip_force_n", "N", 0, 100, {}},
              {"Effect.fade_m", "m", 1e-4, 1, {settings.fade_m}},
              {"Effect.full_contact_n", "N", 1e-3, 100, {settings.full_contact_n}},
              {"Effect.force_limit_n", "N", 1e-3, 100, {settings.force_limit_n}},
              {"Effect.torque_limit_n_m", "N·m", 1e-4, 10, {settings.torque_limit_n_m}}});
}

void add_bodies(Table& table) {
  using Parameters = haptics::CouplingParameters;
  add(table, {coupling("Anchor.stiffness_n_per_m", "N/m", &Parameters::stiffness_n_per_m),
              coupling("Anchor.damping_n_s_per_m", "N·s/m", &Parameters::damping_n_s_per_m),
              coupling("Anchor.stiffness_n_m_per_rad", "N·m/rad", &Parameters::stiffness_n_m_per_rad),
              coupling("Anchor.damping_n_m_s_per_rad", "N·m·s/rad", &Parameters::damping_n_m_s_per_rad),
              {"Body.mass_kg", "kg", kMin, kMaxMass_kg, {}, 1, "static"},
              friction("Body.friction"),
              {"Body.restitution", "", 0, 1, {0}},
              {"Body.linear_damping_per_s", "1/s", 0, 1000, {0}},
              {"Body.angular_damping_per_s", "1/s", 0, 1000, {0}},
              // The colour is used for display only. The default is medium grey, because the true colour is unknown.
              color("Body.color_rgb", {0.7, 0.7, 0.7}),
              contact_stiffness("Body.contact_stiffness_n_per_m3")});
}

void add_coupling(Table& table) {
  using Parameters = haptics::CouplingParameters;
  add(table, {{"AdaptiveFit.mass_range_kg", "kg", 0, haptics::kMaxFitMass_kg, {}, 0},
              polynomial("AdaptiveFit.stiffness_n_per_m"),
              polynomial("AdaptiveFit.damping_n_s_per_m"),
              {"AdaptiveFit.inertia_range_kg_m2", "kg·m²", 0, haptics::kMaxFitInertia_kg_m2, {}, 0},
              polynomial("AdaptiveFit.stiffness_n_m_per_rad"),
              polynomial("AdaptiveFit.damping_n_m_s_per_rad"),
              coupling("Coupling.stiffness_n_per_m", "N/m", &Parameters::stiffness_n_per_m),
              coupling("Coupling.damping_n_s_per_m", "N·s/m", &Parameters::damping_n_s_per_m),
              coupling("Coupling.stiffness_n_m_per_rad", "N·m/rad", &Parameters::stiffness_n_m_per_rad),
              coupling("Coupling.damping_n_m_s_per_rad", "N·m·s/rad", &Parameters::damping_n_m_s_per_rad),
              coupling("Coupling.force_limit_n", "N", &Parameters::force_limit_n),
              coupling("Coupling.torque_limit_n_m", "N·m", &Parameters::torque_limit_n_m),
              coupling("Coupling.saturation_softness", "", &Parameters::saturation_softness),
              coupling("Coupling.curve_sharpness", "", &Parameters::curve_sharpness)});
}

void add_tools_and_settings(Table& table) {
  const physics::WorldDescription world;
  const physics::WorldLimits& limits = world.limits;
  const auto users = static_cast<double>(kMaxUsers);
  add(table, {{"Workspace.position_scale", "", kMin, 1e3, {1}},
              {"Workspace.force_scale", "", kMin, 1e3, {1}},
              {"Tool.mass_kg", "kg", kMin, kMaxMass_kg, {0.05}},
              friction("Tool.friction"),
              contact_stiffness("Tool.contact_stiffness_n_per_m3"),
              {"MolecularField.metres_per_angstrom", "m/Å", kMinMolecularScale, 1, {world.metres_per_angstrom}},
              {"MolecularField.newtons_per_kcal_per_mol_angstrom",
               "N/(kcal/mol/Å)",
               kMinMolecularScale,
               1000,
               {0},
               1,
               "found"},
              {"MolecularField.force_limit_n", "N", kMin, 1000, {world.molecular_force_limit_n}},
              {"MolecularField.cutoff_angstrom",
               "Å",
               docking::kMinCutoffAngstrom,
               docking::kMaxCutoffAngstrom,
               {0},
               1,
               "none"},
              {"MolecularField.zero_area_kt", "kT", 0, 1000, {0}},
              {"MolecularField.knee_kcal_per_mol", "kcal/mol", -kMaxMolecularEnergy, kMaxMolecularEnergy, {0}},
              {"MolecularField.minimum_kcal_per_mol", "kcal/mol", -kMaxMolecularEnergy, kMaxMolecularEnergy, {0}},
              {"Limits.manipulators", "", 1, users, {}},
              {"Limits.observers", "", 0, users - 1, {}},
              {"Limits.body_speed_m_per_s", "m/s", kMin, 1000, {limits.body_speed_m_per_s}},
              {"Limits.grab_reach_m", "m", 0, 10, {limits.grab_reach_m}},
              {"Limits.contact_points", "", 256, 65536, {static_cast<double>(limits.contact_points)}},
              {"Limits.contact_pairs", "", 1, 256, {static_cast<double>(limits.contact_pairs)}},
              {"Limits.atom_pairs", "", 1, 2e9, {static_cast<double>(limits.atom_pairs)}},
              {"Limits.bounds_m", "m", 0.1, 0.95 * kMaxPositionM, {}},
              {"Limits.reset_after_s", "s", 0, 86400, {limits.reset_after_s}}});
}

void add_soft_bodies_and_scene(Table& table) {
  add(table, {length("SoftBlock.size_m", 3),
              {"SoftBlock.spacing_m", "m", 1e-4, kMaxLength_m, {}},
              {"SoftBody.mass_kg", "kg", kMin, kMaxMass_kg, {0.2}},
              // The stiffness must be positive. With stiffness 0 the nodes would not be linked, and the body would fall
              // apart.
              {"SoftBody.stiffness", "", 1e-3, 1, {0.5}},
              {"SoftBody.damping", "", 0, 1, {0.1}},
              {"SoftBody.volume_stiffness", "", 0, 1, {0.5}},
              friction("SoftBody.friction"),
              color("SoftBody.color_rgb", {0.8, 0.5, 0.5}),
              {"Scene.gravity_m_per_s2", "m/s²", -kMaxGravity_m_per_s2, kMaxGravity_m_per_s2, {0, 0, -9.81}, 3},
              {"Scene.step_rate_hz", "Hz", 60, 4000, {1000}},
              {"Scene.soft_step_rate_hz", "Hz", 30, 1000, {60}}});
}

/// Adds the ranges of goals. Default tolerances and speeds are our choice, such that a user reaches them without
/// effort.
void add_goals(Table& table) {
  constexpr double kMaxScore = 1e6, kMaxTime_s = 86400, kMaxOutline_m = 10;
  const auto users = static_cast<double>(kMaxUsers);
  add(table, {{"AtPose.position_tolerance_m", "m", kMin, 10, {0.005}},
              {"AtPose.angle_tolerance_deg", "°", 0.1, 180, {10}},
              {"Held.hands", "", 1, users, {1}},
              {"Slower.speed_m_per_s", "m/s", kMin, 10, {0.01}},
              {"Slower.turn_deg_per_s", "°/s", 1e-3, 36000, {30}},
              {"Outline.points_m", "m", -kMaxOutline_m, kMaxOutline_m, {}, 0},
              {"Silhouette.figure_m", "m", -kMaxOutline_m, kMaxOutline_m, {}, 0},
              {"Silhouette.covered_percent", "%", 50, 100, {95}},
              {"Silhouette.outside_percent", "%", 0, 50, {5}},
              {"SignalCondition.above", "", -kMaxSignalValue, kMaxSignalValue, {-kMaxSignalValue}},
              {"SignalCondition.below", "", -kMaxSignalValue, kMaxSignalValue, {kMaxSignalValue}},
              color("Say.color_rgb", {0.9, 0.9, 0.9}),
              {"Goal.at_least", "", 1, 16, {}},
              {"Goal.hold_s", "s", 0, 600, {0}},
              {"Goal.score", "", -kMaxScore, kMaxScore, {1}},
              {"Goal.score_per_s", "", 0, kMaxScore, {0}},
              {"Goal.time_limit_s", "s", 0, kMaxTime_s, {0}},
              {"SignalState.above", "", -kMaxSignalValue, kMaxSignalValue, {-kMaxSignalValue}},
              {"SignalState.below", "", -kMaxSignalValue, kMaxSignalValue, {kMaxSignalValue}},
              {"GameSignal.max_age_s", "s", 0.1, 600, {5}},
              {"GameSignal.min_confidence", "", 0, 1, {0}},
              {"LevelTable.high_score", "", -1e9, 1e9, {0}},
              {"LevelTable.dominant_percent", "%", 1, 99, {50}},
              {"StateLimit.limit_s", "s", 0.1, kMaxTime_s, {60}},
              {"SolvedBody.position_m", "m", -kMaxOutline_m, kMaxOutline_m, {0, 0}, 2},
              {"SolvedBody.angle_deg", "°", -360, 360, {0}},
              {"LevelParameter.value", "", 0, 1e5, {0}},
              {"Level.time_limit_s", "s", 0, kMaxTime_s, {0}},
              {"Level.gravity_m_per_s2", "m/s²", -kMaxGravity_m_per_s2, kMaxGravity_m_per_s2, {}, 3},
              {"Game.players", "", 1, users, {1}},
              {"Game.time_limit_s", "s", 0, kMaxTime_s, {0}}});
}

/// Adds the ranges of mass properties. A principal moment of inertia is a divisor, so its lower bound is far above the
/// smallest positive double. The pose of the centre is checked by find_mass_problem().
void add_mass(Table& table) {
  add(table, {{"MassProperties.mass_kg", "kg", kMin, kMaxMass_kg, {}, 1, "static"},
              {"MassProperties.centre", "m", -kMaxLength_m, kMaxLength_m, {}, 0},
              {"MassProperties.principal_inertia_kg_m2", "kg·m²", 1e-15, 1e8, {}, 0}});
}

Table make_table() {
  Table table;
  add_shapes(table);
  add_effects(table);
  add_bodies(table);
  add_coupling(table);
  add_tools_and_settings(table);
  add_soft_bodies_and_scene(table);
  add_goals(table);
  add_mass(table);
  return table;
}

const Table& table() {
  static const Table table = make_table();
  return table;
}

/// Returns the range of a field; null if the field is not numeric.
const SceneRange* range_of(const FieldDescriptor& field) {
  static const auto by_name = [] {
    std::map<std::string_view, const SceneRange*> rows;
    for (const SceneRange& row : table()) rows.emplace(row.field, &row);
    return rows;
  }();
  const auto found = by_name.find(field.containing_type()->name() + "." + field.name());
  return found != by_name.end() ? found->second : nullptr;
}

double number_of(const Message& message, const FieldDescriptor& field) {
  const Reflection& values = *message.GetReflection();
  return field.cpp_type() == FieldDescriptor::CPPTYPE_UINT32 ? values.GetUInt32(message, &field)
                                                             : values.GetDouble(message, &field);
}

void set_fallback(Message& message, const FieldDescriptor& field, const SceneRange& range) {
  const Reflection& values = *message.GetReflection();
  if (range.fallback.empty()) return;
  if (field.is_repeated()) {
    if (values.FieldSize(message, &field) > 0) return;
    for (const double number : range.fallback) values.AddDouble(&message, &field, number);
  } else if (!field.has_presence() || values.HasField(message, &field)) {
    return;
  } else if (field.cpp_type() == FieldDescriptor::CPPTYPE_UINT32) {
    values.SetUInt32(&message, &field, static_cast<std::uint32_t>(range.fallback.front()));
  } else {
    values.SetDouble(&message, &field, range.fallback.front());
  }
}

/// Returns a value outside the range as text. It has six digits, or more if it could not be distinguished from the
/// violated bound otherwise.
std::string text_outside(double value, const SceneRange& range) {
  const std::string text = number_text(value);
  if (text != number_text(range.low) && text != number_text(range.high)) return text;
  std::array<char, 32> exact{};
  std::snprintf(exact.data(), exact.size(), "%.17g", value);
  return exact.data();
}

std::string with_unit(const std::string& number, const SceneRange& range) {
  return range.unit.empty() ? number : number + " " + std::string(range.unit);
}

std::string check(double value, const SceneRange& range, const std::string& path) {
  if (range.accepts(value)) return {};
  const std::string high = with_unit(number_text(range.high), range);
  const std::string zero = range.zero_is.empty() ? "" : ", or 0 (" + std::string(range.zero_is) + ")";
  return path + " is " + with_unit(text_outside(value, range), range) + "; it must be from " + number_text(range.low) +
         " to " + high + zero;
}

std::string check_numbers(const Message& message, const FieldDescriptor& field, const SceneRange& range,
                          const std::string& path) {
  const Reflection& values = *message.GetReflection();
  if (!field.is_repeated()) {
    if (!field.has_presence() || values.HasField(message, &field)) return check(number_of(message, field), range, path);
    return path + " is absent; the server must fill it in";
  }
  const int count = values.FieldSize(message, &field);
  const bool may_be_absent = !range.fallback.empty();
  if (range.count > 0 && count != range.count && !(may_be_absent && count == 0)) {
    const char* const meaning = range.count == 2                     ? " (x, y)"
                                : range.field.ends_with("color_rgb") ? " (red, green, blue)"
                                                                     : " (x, y, z)";
    return path + " has " + std::to_string(count) + " numbers; it must have " + std::to_string(range.count) + meaning;
  }
  for (int i = 0; i < count; ++i) {
    const double value = values.GetRepeatedDouble(message, &field, i);
    if (std::string text = check(value, range, path + "[" + std::to_string(i) + "]"); !text.empty()) return text;
  }
  return {};
}

/// Calls `visit(message, path)` for each present sub-message of `field`. Stops at the first call that returns a
/// non-empty text, and returns this text.
template <typename Visit>
std::string visit_messages(const Message& message, const FieldDescriptor& field, const std::string& path,
                           const Visit& visit) {
  const Reflection& values = *message.GetReflection();
  if (!field.is_repeated()) {
    return values.HasField(message, &field) ? visit(values.GetMessage(message, &field), path) : std::string();
  }
  for (int i = 0; i < values.FieldSize(message, &field); ++i) {
    const std::string element = path + "[" + std::to_string(i) + "]";
    if (std::string text = visit(values.GetRepeatedMessage(message, &field, i), element); !text.empty()) return text;
  }
  return {};
}

}  // namespace

bool SceneRange::accepts(double value) const {
  return (value >= low && value <= high) || (value == 0 && !zero_is.empty());
}

std::span<const SceneRange> scene_ranges() {
  return table();
}

const SceneRange& scene_range(std::string_view field) {
  for (const SceneRange& row : table()) {
    if (row.field == field) return row;
  }
  throw std::out_of_range("no range of " + std::string(field));
}

void complete_numbers(Message& message) {
  const Reflection& values = *message.GetReflection();
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor& field = *message.GetDescriptor()->field(i);
    if (const SceneRange* range = range_of(field)) {
      set_fallback(message, field, *range);
    } else if (field.cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) {
      continue;
    } else if (field.is_repeated()) {
      for (int k = 0; k < values.FieldSize(message, &field); ++k) {
        complete_numbers(*values.MutableRepeatedMessage(&message, &field, k));
      }
    } else if (values.HasField(message, &field)) {
      complete_numbers(*values.MutableMessage(&message, &field));
    }
  }
}

std::string find_range_problem(const Message& message, const std::string& path) {
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor& field = *message.GetDescriptor()->field(i);
    const std::string name = path + (path.empty() ? "" : ".") + field.name();
    std::string problem;
    if (const SceneRange* range = range_of(field)) {
      problem = check_numbers(message, field, *range, name);
    } else if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
      problem = visit_messages(message, field, name,
                               [](const Message& part, const std::string& at) { return find_range_problem(part, at); });
    }
    if (!problem.empty()) return problem;
  }
  return {};
}

std::string number_text(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g", value);
  return text.data();
}

}  // namespace tandem::proto
