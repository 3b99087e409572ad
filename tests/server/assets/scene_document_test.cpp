// scene.proto, shapes.proto and goals.proto are the manual of the scene file. These tests compare the ranges and
// defaults in their comments with the ranges and defaults that the loader uses. They detect a manual that is out of
// date.
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <regex>
#include <set>

#include "proto/scene_ranges.hpp"
#include "tests/common/physics/scene_support.hpp"
#include "tests/support/source_path.hpp"

namespace tandem::server {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

/// Calls `visit` with each line of the schemas of a scene file.
template <class Visit>
void for_each_line(const Visit& visit) {
  for (const char* const name : {"proto/tandem/shapes.proto", "proto/tandem/goals.proto", "proto/tandem/scene.proto"}) {
    std::ifstream file(test::source_path(name));
    EXPECT_TRUE(file.good()) << test::source_path(name) << " cannot be read";
    for (std::string line; std::getline(file, line);) visit(line);
  }
}

/// Returns the default that is stated in the comment of each field. The key is "Message.field", the value the number
/// after "default". The value is empty if words describe the default ("default: …").
std::map<std::string, std::string> documented_defaults() {
  static const std::regex kMessage(R"(message (\w+) \{.*)");
  static const std::regex kField(R"(.* (\w+) = \d+; *//.*default(?: ([-+.0-9a-z ]+)|:).*)");
  std::map<std::string, std::string> defaults;
  std::string message;
  for_each_line([&](const std::string& line) {
    std::smatch match;
    if (std::regex_match(line, match, kMessage)) message = match[1];
    if (std::regex_match(line, match, kField)) defaults[message + "." + std::string(match[1])] = match[2];
  });
  return defaults;
}

/// Compares the range in each field's comment, such as "0..1", with the loader's table of ranges.
TEST(SceneDocument, RangesBesideTheFieldsAreThoseOfTheTable) {
  static const std::regex kMessage(R"(message (\w+) \{.*)");
  static const std::string kNumber = R"((-?\d+(?:\.\d+)?(?:e[-+]?\d+)?))";
  static const std::regex kField(R"(.*?(\w+) = \d+;(?: \})? *//.*?)" + kNumber + R"(\.\.)" + kNumber + R"(\b.*)");
  std::string message;
  // The ranges of these fields are stated once, above their message.
  std::set<std::string> documented{"Sphere.radius_m",
                                   "Box.size_m",
                                   "Cylinder.radius_m",
                                   "Cylinder.length_m",
                                   "Capsule.radius_m",
                                   "Capsule.length_m",
                                   "AdaptiveFit.stiffness_n_per_m",
                                   "AdaptiveFit.damping_n_s_per_m",
                                   "AdaptiveFit.stiffness_n_m_per_rad",
                                   "AdaptiveFit.damping_n_m_s_per_rad"};
  for_each_line([&](const std::string& line) {
    std::smatch match;
    if (std::regex_match(line, match, kMessage)) message = match[1];
    if (!std::regex_match(line, match, kField)) return;
    const proto::SceneRange& range = proto::scene_range(message + "." + std::string(match[1]));
    EXPECT_EQ(std::stod(match[2]), range.low) << line;
    EXPECT_EQ(std::stod(match[3]), range.high) << line;
    documented.insert(std::string(range.field));
  });
  for (const proto::SceneRange& range : proto::scene_ranges()) {
    if (range.field.starts_with("MassProperties.")) continue;
    EXPECT_TRUE(documented.contains(std::string(range.field))) << range.field << " has no range beside it";
  }
}

std::string number_in(const Message& message, const FieldDescriptor& field) {
  const google::protobuf::Reflection& values = *message.GetReflection();
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_BOOL:
      return values.GetBool(message, &field) ? "true" : "false";
    case FieldDescriptor::CPPTYPE_UINT32:
      return number_text(values.GetUInt32(message, &field));
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return number_text(values.GetDouble(message, &field));
    default:
      return "neither a number nor a bool";
  }
}

/// Returns a value in the notation of scene.proto, where blanks separate the numbers of an array.
std::string value_in(const Message& message, const FieldDescriptor& field) {
  if (!field.is_repeated()) return number_in(message, field);
  std::string text;
  for (int i = 0; i < message.GetReflection()->FieldSize(message, &field); ++i) {
    text += (i > 0 ? " " : "") + number_text(message.GetReflection()->GetRepeatedDouble(message, &field, i));
  }
  return text;
}

void expect_defaults_documented(const std::map<std::string, std::string>& documented, const Message& loaded) {
  for (int i = 0; i < loaded.GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor& field = *loaded.GetDescriptor()->field(i);
    const std::string name = loaded.GetDescriptor()->name() + "." + field.name();
    const auto found = documented.find(name);
    if (found == documented.end()) {
      EXPECT_FALSE(field.has_optional_keyword()) << name << " has no default beside it";
    } else if (!found->second.empty()) {
      EXPECT_EQ(found->second, value_in(loaded, field)) << name;
    }
  }
}

TEST(SceneDocument, DefaultsBesideTheFieldsAreThoseOfTheLoader) {
  const std::map<std::string, std::string> documented = documented_defaults();
  // A scene that contains only the mandatory fields.
  const auto loaded = physics::load_parts(
      {.coupling = "",
       .rest = R"("molecular_field": {}, "soft_bodies": [{"name": "s", "block": {"size_m": [1, 1, 1]}}])"});
  const wire::Scene& scene = loaded->description;
  expect_defaults_documented(documented, scene);
  expect_defaults_documented(documented, scene.bodies(0));
  expect_defaults_documented(documented, scene.bodies(0).placement());
  expect_defaults_documented(documented, scene.tools(0));
  expect_defaults_documented(documented, scene.tools(0).workspace());
  expect_defaults_documented(documented, scene.coupling());
  expect_defaults_documented(documented, scene.molecular_field());
  expect_defaults_documented(documented, scene.limits());
  expect_defaults_documented(documented, scene.soft_bodies(0));
  expect_defaults_documented(documented, scene.soft_bodies(0).block());
}

TEST(SceneDocument, DefaultsOfAnAnchorAreThoseOfTheLoader) {
  const auto loaded = physics::load_parts(
      {.bodies = R"({"name": "b", "shapes": [{"sphere": {"radius_m": 1}}], "mass_kg": 1, "anchor": {}})"});
  expect_defaults_documented(documented_defaults(), loaded->description.bodies(0).anchor());
}

TEST(SceneDocument, DefaultsOfEffectsAreThoseOfTheLoader) {
  const std::map<std::string, std::string> documented = documented_defaults();
  const auto loaded = physics::load_parts(
      {.bodies = R"({"name": "b", "shapes": [{"sphere": {"radius_m": 1}}], "effects": [{"texture": {}}]})",
       .rest = R"("effects": [{"viscosity": {}}, {"magnet": {}}, {"vibration": {}}, {"stick_slip": {}}])"});
  const auto& effects = loaded->description.effects();
  expect_defaults_documented(documented, effects[0]);
  expect_defaults_documented(documented, effects[0].viscosity());
  expect_defaults_documented(documented, effects[1].magnet());
  expect_defaults_documented(documented, effects[2].vibration());
  expect_defaults_documented(documented, effects[3].stick_slip());
  expect_defaults_documented(documented, loaded->description.bodies(0).effects(0).texture());
}

TEST(SceneDocument, DefaultsOfAGameAreThoseOfTheLoader) {
  const std::map<std::string, std::string> documented = documented_defaults();
  const auto loaded = physics::load_parts(
      {.bodies = R"({"name": "b", "shapes": [{"sphere": {"radius_m": 1}}], "mass_kg": 1, "graspable": true})",
       .rest = R"("game": {"won": {}, "levels": [{"name": "a", "goals": [{"name": "g", "conditions": [
         {"in_region": {"body": "b", "region": {"sphere": {"radius_m": 1}}}}, {"at_pose": {"body": "b"}},
         {"held": {"body": "b"}}, {"slower": {"body": "b"}},
         {"silhouette": {"pieces": [{"body": "b", "points_m": [0, 0, 1, 0, 0, 1]}],
                         "figure_m": [0, 0, 1, 0, 0, 1]}}]}]}]})"});
  const wire::Game& game = loaded->description.game();
  const wire::Goal& goal = game.levels(0).goals(0);
  expect_defaults_documented(documented, game);
  expect_defaults_documented(documented, game.won());
  expect_defaults_documented(documented, game.levels(0));
  expect_defaults_documented(documented, goal);
  expect_defaults_documented(documented, goal.conditions(0).in_region());
  expect_defaults_documented(documented, goal.conditions(1).at_pose());
  expect_defaults_documented(documented, goal.conditions(2).held());
  expect_defaults_documented(documented, goal.conditions(3).slower());
  expect_defaults_documented(documented, goal.conditions(4).silhouette());
}

}  // namespace
}  // namespace tandem::server
