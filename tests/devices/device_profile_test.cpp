// Tests the shipped device profiles, and the error messages for invalid profile files.
#include "devices/device_profile.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <set>

#include "devices/device_writer.hpp"
#include "devices/sim/sim_device.hpp"
#include "tests/support/markdown_table.hpp"
#include "tests/support/source_path.hpp"

namespace tandem::devices {
namespace {

using testing::AllOf;
using testing::HasSubstr;

const std::vector<DeviceProfile>& shipped() {
  static const std::vector<DeviceProfile> profiles = load_device_profiles(shipped_device_profiles());
  return profiles;
}

std::vector<SourcedLimit> values_of(const DeviceProfile& p) {
  std::vector<SourcedLimit> values{p.spec.force_maximum_n,
                                   p.stiffness_maximum_n_per_m,
                                   p.damping_maximum_n_s_per_m,
                                   p.apparent_mass_kg,
                                   p.apparent_inertia_kg_m2,
                                   p.physical_damping_n_s_per_m,
                                   p.physical_damping_n_m_s_per_rad,
                                   p.position_step_m,
                                   p.rotation_step_rad,
                                   {p.spec.force_limit_n, p.limits_source},
                                   {p.workspace_m.x(), p.workspace_source}};
  if (p.has_torque()) {
    values.push_back(p.spec.torque_maximum_n_m);
    values.push_back(p.stiffness_maximum_n_m_per_rad);
    values.push_back(p.damping_maximum_n_m_s_per_rad);
  }
  return values;
}

TEST(ShippedProfiles, AreTheDocumentedProfiles) {
  std::set<std::string> names;
  for (const DeviceProfile& profile : shipped()) names.insert(profile.name);
  for (const char* name : {"sim", "phantom-premium-1.5-6dof", "phantom-premium-1.5-hf", "touch", "touch-x", "falcon",
                           "omega.3", "omega.6", "omega.7", "sigma.7", "inverse3", "virtuose-6d"}) {
    EXPECT_TRUE(names.contains(name)) << name;
    EXPECT_EQ(find_device_profile(name).name, name);
  }
}

TEST(ShippedProfiles, StateTheSourceOfEveryValue) {
  for (const DeviceProfile& profile : shipped()) {
    for (const SourcedLimit& value : values_of(profile)) EXPECT_GE(value.source.size(), 10U) << profile.name;
  }
}

TEST(ShippedProfiles, LimitByVerifiedMaximaOnly) {
  for (const DeviceProfile& profile : shipped()) {
    const DeviceSpec& spec = profile.spec;
    const double most_n = is_verified(spec.force_maximum_n) ? spec.force_maximum_n.value : 2.0;
    const double most_n_m = is_verified(spec.torque_maximum_n_m) ? spec.torque_maximum_n_m.value : 0.1;
    EXPECT_GT(spec.force_limit_n, 0) << profile.name;
    EXPECT_LE(spec.force_limit_n, most_n) << profile.name;
    EXPECT_LE(spec.torque_limit_n_m, profile.has_torque() ? most_n_m : 0) << profile.name;
  }
}

TEST(ShippedProfiles, AreAcceptedByTheDeviceWriter) {
  for (const DeviceProfile& profile : shipped()) {
    SimDevice device(profile.spec, holding({}, profile), named_hand_path("rest"), 1);
    EXPECT_NO_THROW(DeviceWriter{device}) << profile.name;
  }
}

TEST(ShippedProfiles, SimIsTheDefaultSimulatedDevice) {
  const DeviceProfile sim = find_device_profile("sim");
  const DeviceSpec expected = SimDevice::default_spec();
  EXPECT_EQ(sim.spec.name, expected.name);
  EXPECT_EQ(sim.spec.actuated_rotations, expected.actuated_rotations);
  EXPECT_EQ(sim.spec.force_maximum_n, expected.force_maximum_n);
  EXPECT_EQ(sim.spec.torque_maximum_n_m, expected.torque_maximum_n_m);
  EXPECT_EQ(sim.spec.force_limit_n, expected.force_limit_n);
  EXPECT_EQ(sim.spec.torque_limit_n_m, expected.torque_limit_n_m);
  EXPECT_EQ(sim.spec.reach_m, expected.reach_m);
  EXPECT_EQ(sim.spec.speed_limit_m_per_s, expected.speed_limit_m_per_s);
  EXPECT_EQ(sim.spec.slew_limit_n_per_s, expected.slew_limit_n_per_s);
  EXPECT_EQ(sim.spec.slew_limit_n_m_per_s, expected.slew_limit_n_m_per_s);
  // An ideal device must leave the parameters of the hand unchanged.
  const HandParameters hand;
  EXPECT_EQ(holding(hand, sim).mass_kg, hand.mass_kg);
  EXPECT_EQ(holding(hand, sim).damping_n_s_per_m, hand.damping_n_s_per_m);
  EXPECT_EQ(holding(hand, sim).encoder_step_m, 0);
}

TEST(IsVerified, SeesThroughBlanksAndCapitals) {
  for (const char* source :
       {"", " ", "unverified", "Unverified: a guess", "UNVERIFIED", " \t\n unverified: heard of"}) {
    EXPECT_FALSE(is_verified({1, source})) << "\"" << source << '"';
  }
  for (const char* source : {"its data sheet", " table A.1", "verified: measured, not unverified", "unverif", "u"}) {
    EXPECT_TRUE(is_verified({1, source})) << "\"" << source << '"';
  }
  EXPECT_FALSE(is_verified({std::numeric_limits<double>::quiet_NaN(), "its data sheet"}));
}

TEST(ShippedProfiles, HaveAFitOverARangeOfMassesOrNone) {
  for (const DeviceProfile& profile : shipped()) {
    if (!profile.adaptive) continue;
    EXPECT_LT(profile.adaptive->mass_low_kg, profile.adaptive->mass_high_kg)
        << profile.name << ": one mass is no calibration";
    EXPECT_EQ(profile.adaptive->inertia_high_kg_m2 > 0, profile.has_torque()) << profile.name;
  }
}

/// Returns the expected entry in the README's device table: "yes" or "no" for an adaptive coupling, and the cap of the
/// stiffness for a device without a verified maximum.
std::string calibrated_text(const DeviceProfile& profile) {
  const bool is_capped = !is_verified(profile.stiffness_maximum_n_per_m);
  const auto cap = std::to_string(std::lround(coupling_bounds(profile).stiffness_n_per_m));
  return std::string(profile.adaptive ? "yes" : "no") + (is_capped ? ", capped at " + cap + " N/m" : "");
}

TEST(ShippedProfiles, StayWithinTheirStiffnessWhereTheyAreCalibrated) {
  for (const DeviceProfile& profile : shipped()) {
    if (!profile.adaptive) continue;
    const haptics::CouplingParameters most = coupling_bounds(profile);
    EXPECT_EQ(profile.adaptive_source, "tandem-lab calibrate --device " + profile.name);
    for (const double mass_kg : {0.001, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 10.0}) {
      const haptics::CouplingParameters c = haptics::adapted(*profile.adaptive, mass_kg, 1e-4, most);
      EXPECT_GT(c.stiffness_n_per_m, 0) << profile.name << ", " << mass_kg << " kg";
      EXPECT_LE(c.stiffness_n_per_m, most.stiffness_n_per_m) << profile.name << ", " << mass_kg << " kg";
      EXPECT_LE(c.damping_n_s_per_m, most.damping_n_s_per_m) << profile.name << ", " << mass_kg << " kg";
      EXPECT_LE(c.stiffness_n_m_per_rad, most.stiffness_n_m_per_rad) << profile.name;
      EXPECT_LE(c.damping_n_m_s_per_rad, most.damping_n_m_s_per_rad) << profile.name;
    }
  }
}

TEST(ShippedProfiles, AreThoseOfTheReadme) {
  const auto rows = test::table_under(test::source_path("devices/PROFILES.md").string(), "## The profiles");
  ASSERT_EQ(rows.size(), shipped().size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const DeviceProfile& profile = shipped()[i];
    const auto in_table = [&](const char* column) { return rows[i].at(column); };
    const auto number = [](double value) {
      std::ostringstream text;
      text << value;
      return text.str();
    };
    const auto maximum = [&](const SourcedLimit& limit) {
      return limit.source.empty() ? "–" : number(limit.value) + (is_verified(limit) ? "" : " ?");
    };
    EXPECT_EQ(in_table("profile"), "`" + profile.name + "`");
    EXPECT_EQ(in_table("device"), profile.title);
    EXPECT_EQ(in_table("axes"), std::to_string(3 + profile.spec.actuated_rotations)) << profile.name;
    EXPECT_EQ(in_table("force [N]"), maximum(profile.spec.force_maximum_n)) << profile.name;
    EXPECT_EQ(in_table("limit [N]"), number(profile.spec.force_limit_n)) << profile.name;
    EXPECT_EQ(in_table("torque [N·m]"), maximum(profile.spec.torque_maximum_n_m)) << profile.name;
    EXPECT_EQ(in_table("stiffness [N/m]"), maximum(profile.stiffness_maximum_n_per_m)) << profile.name;
    EXPECT_EQ(in_table("step [µm]"), maximum({profile.position_step_m.value * 1e6, profile.position_step_m.source}))
        << profile.name;
    EXPECT_EQ(in_table("calibrated"), calibrated_text(profile)) << profile.name;
  }
}

TEST(CouplingBounds, OfTheSimulatedDeviceAreThoseWithoutAProfile) {
  const haptics::CouplingParameters bounds = coupling_bounds(find_device_profile("sim"));
  EXPECT_EQ(bounds.stiffness_n_per_m, 3000);
  EXPECT_EQ(bounds.damping_n_s_per_m, 20);
  EXPECT_EQ(bounds.stiffness_n_m_per_rad, 3);
  EXPECT_EQ(bounds.damping_n_m_s_per_rad, 0.05);
  EXPECT_EQ(bounds.force_limit_n, 7) << "the writer's, below the maximum";
  EXPECT_EQ(bounds.torque_limit_n_m, 0.17);
}

TEST(CouplingBounds, AnUnverifiedMaximumCanLowerThemButNotRaise) {
  DeviceProfile profile = find_device_profile("omega.6");
  EXPECT_EQ(coupling_bounds(profile).stiffness_n_per_m, 5000);
  profile.stiffness_maximum_n_per_m.source = "unverified: a guess";
  EXPECT_EQ(coupling_bounds(profile).stiffness_n_per_m, 400);
  profile.stiffness_maximum_n_per_m.value = 50;
  EXPECT_EQ(coupling_bounds(profile).stiffness_n_per_m, 50);
  profile.spec.force_maximum_n.source = "";
  EXPECT_EQ(coupling_bounds(profile).force_limit_n, 2);
}

TEST(Holding, AddsMassAndDampingAndTakesTheCoarserStep) {
  const DeviceProfile falcon = find_device_profile("falcon");
  HandParameters hand;
  const HandParameters held = holding(hand, falcon);
  EXPECT_DOUBLE_EQ(held.mass_kg, hand.mass_kg + falcon.apparent_mass_kg.value);
  EXPECT_DOUBLE_EQ(held.inertia_kg_m2, hand.inertia_kg_m2 + falcon.apparent_inertia_kg_m2.value);
  EXPECT_DOUBLE_EQ(held.damping_n_s_per_m, hand.damping_n_s_per_m + falcon.physical_damping_n_s_per_m.value);
  EXPECT_DOUBLE_EQ(held.encoder_step_m, 6.35e-5);
  EXPECT_EQ(held.stiffness_n_per_m, hand.stiffness_n_per_m) << "a device has no spring";
  hand.encoder_step_m = 1e-3;
  EXPECT_EQ(holding(hand, falcon).encoder_step_m, 1e-3);
}

/// Returns a valid profile file in which the substring `piece` is replaced.
std::string file_with(const std::string& piece, const std::string& replacement) {
  std::string text = R"({"profiles": [{"name": "mine", "title": "My device", "force_axes": 3,
    "force_maximum_n": {"value": 5, "source": "its data sheet"},
    "limits": {"force_n": 4, "speed_m_per_s": 3, "slew_n_per_s": 4000, "slew_n_m_per_s": 200, "rate_hz": 1000,
      "source": "ours"},
    "workspace_m": {"value": [0.1, 0.1, 0.1], "source": "measured"},
    "stiffness_maximum_n_per_m": {"value": 1000, "source": "measured"},
    "damping_maximum_n_s_per_m": {"value": 10, "source": "measured"},
    "apparent_mass_kg": {"value": 0.1, "source": "measured"},
    "apparent_inertia_kg_m2": {"value": 1e-4, "source": "measured"},
    "physical_damping_n_s_per_m": {"value": 0.1, "source": "measured"},
    "physical_damping_n_m_s_per_rad": {"value": 1e-4, "source": "measured"},
    "position_step_m": {"value": 1e-5, "source": "its data sheet"},
    "rotation_step_rad": {"value": 1e-3, "source": "its data sheet"},
    "adaptive": {"source": "by hand", "mass_kg": [0.02, 1], "stiffness_n_per_m": [100, 300, 0, 0],
      "damping_n_s_per_m": [1, 0.01, 0, 0]}}]})";
  if (!piece.empty()) text.replace(text.find(piece), piece.size(), replacement);
  return text;
}

std::string complaint(const std::string& text) {
  try {
    parse_device_profiles(text, "mine.json");
    return "accepted";
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
}

TEST(ProfileFile, OfOnesOwnIsRead) {
  const auto profiles = parse_device_profiles(file_with("", ""), "mine.json");
  ASSERT_EQ(profiles.size(), 1U);
  EXPECT_EQ(profiles[0].spec.force_limit_n, 4);
  EXPECT_EQ(profiles[0].spec.torque_limit_n_m, 0);
  ASSERT_TRUE(profiles[0].adaptive);
  EXPECT_DOUBLE_EQ(haptics::adapted(*profiles[0].adaptive, 0.5, 0, {}).stiffness_n_per_m, 250);
}

TEST(ProfileFile, AMistakeIsNamedWithFileProfileFieldValueAndRemedy) {
  const struct {
    const char* piece;
    const char* replacement;
    std::vector<const char*> words;
  } cases[] = {
      {"\"value\": 5,", "\"value\": -5,", {"mine.json", "profiles[mine].force_maximum_n.value", "-5", "0 to 1000"}},
      {"\"value\": 5,", "\"value\": 1e999,", {"mine.json"}},
      {"\"value\": 5,", "\"value\": \"much\",", {"profiles[mine].force_maximum_n.value", "much", "number"}},
      {"its data sheet", "", {"profiles[mine].force_maximum_n.source", "text"}},
      {"\"its data sheet\"", "3", {"profiles[mine].force_maximum_n.source", "text"}},
      {"\"force_n\": 4", "\"force_n\": 6", {"profiles[mine].limits", "force_limit_n", "at most 5"}},
      {"its data sheet", "unverified: heard of", {"profiles[mine].limits", "at most 2", "unverified"}},
      {"\"force_axes\": 3", "\"force_axes\": 4", {"profiles[mine].force_axes", "4", "3 or 6"}},
      {"\"force_axes\": 3", "\"force_axes\": 6", {"profiles[mine].torque_maximum_n_m", "missing", "value"}},
      {"\"mine\"", "\"Mine!\"", {"profiles[0].name", "Mine!", "a-z"}},
      {"[0.1, 0.1, 0.1]", "[0.1, 0.1]", {"profiles[mine].workspace_m.value", "three"}},
      {"[0.1, 0.1, 0.1]", "[0.1, 0.1, 0]", {"profiles[mine].workspace_m.value", "above 0"}},
      {"apparent_mass_kg", "aparent_mass_kg", {"profiles[mine].apparent_mass_kg", "missing"}},
      {"\"name\"", "\"colour\": \"red\", \"name\"", {"profiles[mine].colour", "no such field"}},
      {"[0.02, 1]", "[1, 0.02]", {"profiles[mine].adaptive.mass_kg", "low <= high"}},
      {"[100, 300, 0, 0]", "[100, -300, 0, 0]", {"profiles[mine].adaptive.stiffness_n_per_m", "above 0"}},
      {"[100, 300, 0, 0]", "[100, 300]", {"profiles[mine].adaptive.stiffness_n_per_m", "four"}},
      {"[1, 0.01, 0, 0]", "[-9, 0.01, 0, 0]", {"profiles[mine].adaptive.damping_n_s_per_m", "0 to 10000"}},
      {"[1, 0.01, 0, 0]", "[2e4, 0, 0, 0]", {"profiles[mine].adaptive.damping_n_s_per_m", "0 to 10000"}},
      {"[100, 300, 0, 0]", "[2e5, 0, 0, 0]", {"profiles[mine].adaptive.stiffness_n_per_m", "at most 100000"}},
      {"{\"profiles\": [", "{\"profiles\": [7, ", {"profiles[0]", "object"}},
      {"{\"profiles\": [", "{\"profiles\": 7, \"x\": [", {"profiles", "list"}},
  };
  for (const auto& one : cases) {
    const std::string answer = complaint(file_with(one.piece, one.replacement));
    for (const char* word : one.words) EXPECT_THAT(answer, HasSubstr(word)) << one.piece << " → " << one.replacement;
  }
}

TEST(ProfileFile, CutOffAnywhereIsAnErrorNotACrash) {
  const std::string text = file_with("", "");
  for (std::size_t length = 0; length < text.size(); length += 7) {
    EXPECT_NE(complaint(text.substr(0, length)), "accepted") << length;
  }
}

TEST(ProfileFile, EveryShippedProfileReadsBackToTheLastBit) {
  const std::string text = device_profiles_text(shipped());
  EXPECT_EQ(device_profiles_text(parse_device_profiles(text, "text")), text);
  std::ifstream file(shipped_device_profiles());
  const std::string as_shipped{std::istreambuf_iterator<char>(file), {}};
  EXPECT_EQ(device_profiles_text(parse_device_profiles(as_shipped, "file")), text);
}

TEST(FindDeviceProfile, ListsTheKnownProfilesForAnUnknownName) {
  try {
    find_device_profile("wand");
    FAIL() << "there is no wand";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("wand"), HasSubstr("omega.6"), HasSubstr("sim"), HasSubstr(".json")));
  }
}

TEST(FindDeviceProfile, AcceptsAFileWithOneProfile) {
  const std::string file = testing::TempDir() + "one_device.json";
  std::ofstream(file) << file_with("", "");
  EXPECT_EQ(find_device_profile(file).name, "mine");
  EXPECT_THROW(find_device_profile(file + "x.json"), std::invalid_argument);
  EXPECT_THROW(find_device_profile(shipped_device_profiles().string()), std::invalid_argument) << "it holds many";
}

TEST(FindDeviceProfile, SearchesTheFolderThatTheEnvironmentNames) {
  const std::string file = testing::TempDir() + "other_devices.json";
  std::ofstream(file) << file_with("", "");
  setenv("TANDEM_DEVICE_PROFILES", file.c_str(), 1);
  EXPECT_EQ(find_device_profile("mine").name, "mine");
  setenv("TANDEM_DEVICE_PROFILES", "/nonexistent/devices.json", 1);
  try {
    find_device_profile("sim");
    ADD_FAILURE() << "found, though the environment names another place";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("/nonexistent/devices.json"), HasSubstr("TANDEM_DEVICE_PROFILES")));
  }
  unsetenv("TANDEM_DEVICE_PROFILES");
}

}  // namespace
}  // namespace tandem::devices
