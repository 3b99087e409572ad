// Tests that every number in a scene has one range: scene files and the wire format must accept the same values.
// Therefore the test links both server and client.
#include "proto/scene_ranges.hpp"

#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <set>

#include "client/model/local_world.hpp"
#include "client/session/scene_from_wire.hpp"
#include "server/assets/scene_checks.hpp"
#include "server/assets/scene_file.hpp"

namespace tandem::proto {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Returns a scene with every message type that a scene can contain. Each number in it can be set to both ends of its
/// range without breaking another rule. The shapes are small, so that they are built quickly.
std::string sample_json() {
  // The maximum number of conditions of a goal, so that at_least can have its largest value.
  std::string conditions =
      R"({"in_region": {"body": "moving", "region": {"sphere": {"radius_m": 0.1}}}}, {"at_pose": {"body": "moving"}},
         {"held": {"body": "moving"}},
         {"silhouette": {"pieces": [{"body": "moving", "points_m": [0, -10, 5, 5, -5, 5]}],
                         "figure_m": [0, -10, 5, 5, -5, 5]}})";
  conditions += R"(, {"signal": {"name": "s", "required": true}})";
  for (int i = 5; i < 16; ++i) conditions += R"(, {"slower": {"body": "moving"}})";
  std::string tools;
  for (std::size_t i = 0; i < kMaxUsers; ++i) {
    tools += (i > 0 ? ", " : "") + (R"({"name": "t)" + std::to_string(i)) +
             R"(", "workspace": {}, "shapes": [{"sphere": {"radius_m": 0.001}}]})";
  }
  return R"({"name": "all", "bodies": [
    {"name": "shapes", "shapes": [{"placement": {}, "sphere": {"radius_m": 0.001}},
      {"box": {"size_m": [0.002, 0.002, 0.002]}}, {"cylinder": {"radius_m": 0.001, "length_m": 0.002}},
      {"capsule": {"radius_m": 0.001, "length_m": 0.002}},
      {"mesh": {"file": "t.obj"}}],
     "effects": [{"texture": {}}, {"viscosity": {}}, {"constant_field": {"force_n": [1, 1, 0]}}, {"magnet": {}},
      {"vibration": {"frequency_hz": 20}}, {"stick_slip": {"breakaway_force_n": 100, "slip_force_n": 0}}]},
    {"name": "moving", "mass_kg": 0.1, "graspable": true, "anchor": {}, "shapes": [{"sphere": {"radius_m": 0.001}}]}],
   "tools": [)" +
         tools + R"(],
   "coupling": {"law": "adaptive", "adaptive": {"mass_range_kg": [1, 10000], "stiffness_n_per_m": [100],
     "damping_n_s_per_m": [1], "inertia_range_kg_m2": [1, 10000], "stiffness_n_m_per_rad": [1],
     "damping_n_m_s_per_rad": [0.01]}},
   "game": {"won": {}, "signals": [{"name": "s", "states": [{"name": "calm"}]}], "state_limit": {"signal": "s", "state": "calm"},
     "levels": [{"name": "a", "next": {"rows": [{"level": "a"}]},
       "solutions": [{"name": "one", "bodies": [{"body": "moving"}]}], "law": "stable-dynamic", "gravity_m_per_s2": [0, 0, -1], "parameters": [{"name": "coupling.stiffness_n_per_m"}],
     "goals": [{"name": "g", "time_limit_s": 1, "conditions": [)" +
         conditions + R"(]}]}]},
   "molecular_field": {}, "limits": {"manipulators": 1, "contact_pairs": 16},
   "soft_bodies": [{"name": "soft", "block": {"size_m": [0.001, 0.001, 0.001], "spacing_m": 100}}]})";
}

/// Returns the message and the field name of a range.
std::pair<std::string, std::string> names_of(const SceneRange& range) {
  const std::size_t dot = range.field.find('.');
  return {std::string(range.field.substr(0, dot)), std::string(range.field.substr(dot + 1))};
}

/// Returns the first message of `type` that is set in `message`, which may be `message` itself.
Message* find_message(Message& message, const std::string& type) {
  if (message.GetDescriptor()->name() == type) return &message;
  const Reflection& values = *message.GetReflection();
  std::vector<const FieldDescriptor*> fields;
  values.ListFields(message, &fields);
  for (const FieldDescriptor* field : fields) {
    if (field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) continue;
    const int count = field->is_repeated() ? values.FieldSize(message, field) : 1;
    for (int i = 0; i < count; ++i) {
      Message& part = field->is_repeated() ? *values.MutableRepeatedMessage(&message, field, i)
                                           : *values.MutableMessage(&message, field);
      if (Message* found = find_message(part, type)) return found;
    }
  }
  return nullptr;
}

/// Sets the first occurrence of the range's field in `root`.
void set(Message& root, const SceneRange& range, double value) {
  const auto [type, name] = names_of(range);
  Message* message = find_message(root, type);
  ASSERT_NE(message, nullptr) << range.field << " is nowhere in the sample";
  const Reflection& values = *message->GetReflection();
  const FieldDescriptor* field = message->GetDescriptor()->FindFieldByName(name);
  if (!field->is_repeated() && field->cpp_type() == FieldDescriptor::CPPTYPE_UINT32) {
    values.SetUInt32(message, field, static_cast<std::uint32_t>(value));
  } else if (!field->is_repeated()) {
    values.SetDouble(message, field, value);
  } else {
    if (values.FieldSize(*message, field) == 0) {
      for (const double number : range.fallback) values.AddDouble(message, field, number);
    }
    values.SetRepeatedDouble(message, field, 0, value);
  }
}

bool is_of_a_file(const SceneRange& range) {
  return !range.field.starts_with("MassProperties.");
}

/// Returns whether a range belongs to a primitive shape. Such ranges need care: sampling the surface of a shape of 100
/// m would take minutes.
bool is_of_a_primitive(const SceneRange& range) {
  const std::string type = names_of(range).first;
  return type == "Sphere" || type == "Box" || type == "Cylinder" || type == "Capsule";
}

bool is_whole(const SceneRange& range) {
  const auto [type, name] = names_of(range);
  const auto* message =
      google::protobuf::DescriptorPool::generated_pool()->FindMessageTypeByName("tandem.wire." + type);
  return message->FindFieldByName(name)->cpp_type() == FieldDescriptor::CPPTYPE_UINT32;
}

/// Returns the values next to the range: one ulp below and above it, or 1 below and above for integers. An unsigned
/// range that starts at 0 has no value below.
std::vector<double> just_outside(const SceneRange& range) {
  const double below = std::nextafter(range.low, -kInfinity);
  if (!is_whole(range)) return {below, std::nextafter(range.high, kInfinity)};
  if (range.low > 0) return {range.low - 1, range.high + 1};
  return {range.high + 1};
}

std::vector<double> just_inside(const SceneRange& range) {
  std::vector<double> values{range.low, range.high};
  if (!range.zero_is.empty()) values.push_back(0);
  return values;
}

class SceneRanges : public ::testing::Test {
 protected:
  SceneRanges() : folder_(std::filesystem::path(::testing::TempDir()) / "tandem_scene_ranges") {
    std::filesystem::create_directories(folder_);
    std::ofstream(folder_ / "t.obj") << "v 0 0 0\nv 2e-3 0 0\nv 0 2e-3 0\nv 0 0 2e-3\n"
                                     << "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    const auto scene = server::load_scene_text(sample_json(), "test.json", folder_);
    *joined_.mutable_scene() = scene->description;
    joined_.set_user(1);
    joined_.set_role(wire::ROLE_MANIPULATOR);
    for (const auto& body : scene->world.bodies) fill(body.mass, *joined_.add_body_masses());
    for (const auto& tool : scene->world.tools) fill(tool.mass, *joined_.add_tool_masses());
    // Swaps the two bodies, because set() changes the first mass that it finds, and this must be the mass of a moving
    // body.
    joined_.mutable_body_masses()->SwapElements(0, 1);
    joined_.mutable_scene()->mutable_bodies()->SwapElements(0, 1);
    for (const server::Asset& asset : scene->assets) assets_[asset.sha256] = asset.bytes;
  }
  ~SceneRanges() override { std::filesystem::remove_all(folder_); }

  static void fill(const MassProperties& mass, wire::MassProperties& out) {
    out.set_mass_kg(mass.mass_kg);
    if (mass.mass_kg <= 0) return;
    const Pose& X = mass.X_BC;
    for (const double number : {X.p.x(), X.p.y(), X.p.z(), X.q.w(), X.q.x(), X.q.y(), X.q.z()}) out.add_centre(number);
    for (const double number : mass.principal_inertia_kg_m2) out.add_principal_inertia_kg_m2(number);
  }

  static wire::Scene sample_with(const SceneRange& range, double value) {
    wire::Scene scene;
    EXPECT_TRUE(google::protobuf::util::JsonStringToMessage(sample_json(), &scene).ok());
    set(scene, range, value);
    return scene;
  }
  /// Reads the scene as the text of a scene file. Returns the error message, or an empty text if the scene is accepted.
  std::string refusal_from_file(const wire::Scene& scene) const {
    google::protobuf::util::JsonPrintOptions options;
    options.preserve_proto_field_names = true;
    options.always_print_primitive_fields = true;
    std::string json;
    EXPECT_TRUE(google::protobuf::util::MessageToJsonString(scene, &json, options).ok());
    try {
      server::load_scene_text(json, "test.json", folder_);
    } catch (const server::SceneError& error) {
      return error.what();
    }
    return "";
  }
  /// Checks the scene without building its meshes, which takes long. Returns the error message, or an empty text if the
  /// scene is accepted.
  static std::string refusal_of_numbers(wire::Scene scene) {
    try {
      server::complete_and_check(scene, server::SceneField("test.json"));
    } catch (const server::SceneError& error) {
      return error.what();
    }
    return "";
  }
  std::string refusal_from_wire(const std::function<void(wire::Joined&)>& change) const {
    wire::Joined joined = joined_;
    change(joined);
    client::HapticScene haptic;
    if (std::string problem = client::fill_haptic_scene(joined, haptic); !problem.empty()) return problem;
    try {
      client::ContactShapes shapes;
      client::make_local_world(joined, assets_, shapes);
    } catch (const std::exception& error) {
      return error.what();
    }
    return "";
  }

  std::filesystem::path folder_;
  wire::Joined joined_;
  client::AssetMap assets_;
};

void collect_numbers(const Descriptor& message, std::set<std::string>& fields) {
  for (int i = 0; i < message.field_count(); ++i) {
    const FieldDescriptor& field = *message.field(i);
    const auto type = field.cpp_type();
    if (type == FieldDescriptor::CPPTYPE_MESSAGE) {
      collect_numbers(*field.message_type(), fields);
    } else if (type != FieldDescriptor::CPPTYPE_STRING && type != FieldDescriptor::CPPTYPE_BOOL &&
               type != FieldDescriptor::CPPTYPE_ENUM) {
      fields.insert(message.name() + "." + field.name());
    }
  }
}

TEST_F(SceneRanges, AreThoseOfEveryNumberThatASceneHas) {
  std::set<std::string> fields, rows;
  collect_numbers(*wire::Scene::descriptor(), fields);
  collect_numbers(*wire::MassProperties::descriptor(), fields);
  for (const SceneRange& range : scene_ranges()) {
    EXPECT_TRUE(rows.insert(std::string(range.field)).second) << range.field << " is there twice";
    EXPECT_LT(range.low, range.high) << range.field;
    EXPECT_TRUE(std::isfinite(range.low) && std::isfinite(range.high)) << range.field;
    for (const double number : range.fallback) EXPECT_TRUE(range.accepts(number)) << range.field;
  }
  EXPECT_EQ(rows, fields);
}

TEST_F(SceneRanges, TheSampleIsAcceptedFromAFileAndFromTheWire) {
  EXPECT_NO_THROW(server::load_scene_text(sample_json(), "test.json", folder_));
  EXPECT_EQ(refusal_from_wire([](wire::Joined&) {}), "");
}

TEST_F(SceneRanges, WhatIsJustOutsideIsRefusedFromAFileAndFromTheWire) {
  for (const SceneRange& range : scene_ranges()) {
    const std::string name = names_of(range).second;
    std::vector<double> values = just_outside(range);
    if (!is_whole(range)) values.insert(values.end(), {kInfinity, -kInfinity, std::nan("")});
    for (const double value : values) {
      SCOPED_TRACE(std::string(range.field) + " = " + std::to_string(value));
      const auto names_all = AllOf(HasSubstr(name), HasSubstr(" is "), HasSubstr("; it must be "),
                                   HasSubstr(number_text(range.high) + (range.unit.empty() ? "" : " ")),
                                   HasSubstr(std::string(range.unit)));
      EXPECT_THAT(refusal_from_wire([&](wire::Joined& joined) { set(joined, range, value); }), names_all);
      if (is_of_a_file(range)) {
        EXPECT_THAT(refusal_from_file(sample_with(range, value)), AllOf(HasSubstr("test.json: "), names_all));
      }
    }
  }
}

TEST_F(SceneRanges, WhatIsJustInsideIsAcceptedFromAFileAndFromTheWire) {
  for (const SceneRange& range : scene_ranges()) {
    for (const double value : just_inside(range)) {
      SCOPED_TRACE(std::string(range.field) + " = " + std::to_string(value));
      const bool takes_minutes = is_of_a_primitive(range) && value == range.high;
      if (takes_minutes) {
        wire::Joined joined = joined_;
        set(joined, range, value);
        EXPECT_EQ(find_range_problem(joined.scene()), "");
      } else {
        EXPECT_EQ(refusal_from_wire([&](wire::Joined& joined) { set(joined, range, value); }), "");
      }
      if (!is_of_a_file(range)) continue;
      const std::string refusal = refusal_of_numbers(sample_with(range, value));
      // The coefficients of the polynomials in an adaptive fit have two limits: their own range, and the range of the
      // resulting values. A coefficient at the end of its own range gives values out of range.
      const bool is_polynomial = range.field.starts_with("AdaptiveFit") && range.low < 0;
      EXPECT_THAT(refusal, is_polynomial ? HasSubstr(" gives ") : HasSubstr(""));
      EXPECT_EQ(refusal.empty(), !is_polynomial) << refusal;
    }
  }
}

TEST_F(SceneRanges, ANumberThatAServerLeavesOutIsRefused) {
  EXPECT_EQ(refusal_from_wire([](wire::Joined& joined) { joined.mutable_scene()->mutable_tools(0)->clear_friction(); }),
            "scene.tools[0].friction is absent; the server must fill it in");
  EXPECT_EQ(refusal_from_wire([](wire::Joined& joined) { joined.mutable_scene()->clear_limits(); }),
            "scene.limits is absent");
}

TEST_F(SceneRanges, AnEffectOfAKindThatThisClientDoesNotKnowIsRefused) {
  const auto forget_kind = [](wire::Joined& joined) {
    joined.mutable_scene()->mutable_bodies(1)->mutable_effects(0)->clear_kind();
  };
  EXPECT_THAT(refusal_from_wire(forget_kind), HasSubstr("scene.bodies[1].effects[0] has no kind; it must have one of"));
}

TEST_F(SceneRanges, AMassThatLacksAPartIsRefused) {
  const auto refusal = [this](const std::function<void(wire::MassProperties&)>& change) {
    return refusal_from_wire([&change](wire::Joined& joined) { change(*joined.mutable_tool_masses(0)); });
  };
  EXPECT_EQ(refusal([](wire::MassProperties& mass) { mass.clear_centre(); }),
            "tool_masses[0].centre has 0 numbers; it must have 7");
  EXPECT_EQ(refusal([](wire::MassProperties& mass) { mass.mutable_principal_inertia_kg_m2()->RemoveLast(); }),
            "tool_masses[0].principal_inertia_kg_m2 has 2 numbers; it must have 3");
  EXPECT_EQ(refusal([](wire::MassProperties& mass) { mass.set_centre(3, 2); }),
            "tool_masses[0].centre has a quaternion of length 2; it must be 1");
}

}  // namespace
}  // namespace tandem::proto
