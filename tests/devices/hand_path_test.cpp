#include "devices/sim/hand_path.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

namespace tandem::devices {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

HandPath straight_move() {
  WayPoint from;
  from.at = seconds(1);
  WayPoint to;
  to.at = seconds(3);
  to.X_DH = {Vec3(0.1, 0, -0.2), quaternion_of({0, 0, std::numbers::pi / 2})};
  return HandPath({from, to});
}

TEST(HandPath, MovesByMinimumJerk) {
  const HandPath path = straight_move();
  // Exact values of the minimum-jerk profile s(u) = 10 u³ − 15 u⁴ + 6 u⁵, with u = t/T and T = 2 s: s(¼) = 0.103515625
  // and s(½) = ½. Its derivative is s'(½) = 15/8.
  EXPECT_NEAR(path.pose_at(milliseconds(1500)).p.x(), 0.1 * 0.103515625, 1e-15);
  EXPECT_NEAR(path.pose_at(milliseconds(2000)).p.z(), -0.2 * 0.5, 1e-15);
  EXPECT_NEAR(path.twist_at(milliseconds(2000)).v.x(), 0.1 * 1.875 / 2, 1e-15);
  EXPECT_NEAR(rotation_vector(path.pose_at(milliseconds(2000)).q).z(), std::numbers::pi / 4, 1e-12);
  EXPECT_NEAR(path.twist_at(milliseconds(2000)).w.z(), std::numbers::pi / 2 * 1.875 / 2, 1e-12);
}

TEST(HandPath, TwistIsTheDerivativeOfThePose) {
  const HandPath path = straight_move();
  const double h_s = 1e-4;
  for (int i = 1; i < 40; ++i) {
    const Duration time = seconds(1) + milliseconds(50) * i;
    const Pose before = path.pose_at(time - from_seconds(h_s));
    const Pose after = path.pose_at(time + from_seconds(h_s));
    const Twist twist = path.twist_at(time);
    // A central difference with the step h has an error of at most h²/6 times the third derivative. Here |x‴| ≤
    // 60/T³·|Δ| < 2 m/s³, with the duration T and the displacement Δ.
    EXPECT_LT((twist.v - (after.p - before.p) / (2 * h_s)).norm(), h_s * h_s) << i;
    EXPECT_LT((twist.w - rotation_vector(after.q * before.q.conjugate()) / (2 * h_s)).norm(), 10 * h_s * h_s) << i;
  }
}

TEST(HandPath, RestsOutsideAndAtEachWayPoint) {
  const HandPath path = straight_move();
  for (const Duration time : {Duration(-seconds(1)), Duration(0), Duration(seconds(1))}) {
    EXPECT_EQ(path.pose_at(time).p, Vec3::Zero());
    EXPECT_EQ(path.twist_at(time).v, Vec3::Zero());
  }
  for (const Duration time : {Duration(seconds(3)), Duration(seconds(100))}) {
    EXPECT_EQ(path.pose_at(time).p, Vec3(0.1, 0, -0.2));
    EXPECT_EQ(path.twist_at(time).v, Vec3::Zero());
  }
}

TEST(HandPath, ReadsTheFileAndUsesDefaultsForMissingFields) {
  const HandPath path = parse_hand_path(R"({"points": [
      {"t_s": 0.5, "position_m": [1, 2, 3], "phase": "approach"},
      {"t_s": 1, "rotation_xyz_deg": [90, 0, 90], "buttons": ["grab", "clutch"]},
      {"t_s": 2, "position_m": [4, 5, 6], "phase": "hold"},
      {"t_s": 3, "buttons": [], "phase": "approach"}]})",
                                        "file.json");
  EXPECT_EQ(path.pose_at(seconds(1)).p, Vec3(1, 2, 3));
  // The pose is first rotated by 90° about the fixed x axis, which turns y to z and leaves x unchanged. It is then
  // rotated by 90° about the fixed z axis, which leaves z unchanged and turns x to y.
  EXPECT_LT((path.pose_at(seconds(1)).q * Vec3::UnitY() - Vec3::UnitZ()).norm(), 1e-12);
  EXPECT_LT((path.pose_at(seconds(1)).q * Vec3::UnitX() - Vec3::UnitY()).norm(), 1e-12);
  EXPECT_EQ(path.pose_at(seconds(2)).p, Vec3(4, 5, 6));
  EXPECT_EQ(path.buttons_at(milliseconds(900)), 0U);
  EXPECT_EQ(path.buttons_at(milliseconds(2500)), 3U);
  EXPECT_EQ(path.buttons_at(seconds(9)), 0U);
  EXPECT_THAT(path.phases(), testing::ElementsAre("approach", "hold"));
  EXPECT_EQ(path.phase_at(milliseconds(400)), -1);
  EXPECT_EQ(path.phase_at(milliseconds(1500)), 0);
  EXPECT_EQ(path.phase_at(seconds(2)), 1);
  EXPECT_EQ(path.phase_at(seconds(9)), 0);
}

TEST(HandPath, RelaxesFromAWayPointUntilALaterOneChangesIt) {
  const HandPath path = parse_hand_path(R"({"points": [
      {"t_s": 0.5, "position_m": [1, 2, 3]},
      {"t_s": 1, "relaxed": true},
      {"t_s": 2, "position_m": [1, 2, 4]},
      {"t_s": 3, "relaxed": false}]})",
                                        "file.json");
  EXPECT_FALSE(path.is_relaxed_at(seconds(0)));
  EXPECT_FALSE(path.is_relaxed_at(milliseconds(999)));
  EXPECT_TRUE(path.is_relaxed_at(seconds(1)));
  EXPECT_TRUE(path.is_relaxed_at(milliseconds(2500)));
  EXPECT_FALSE(path.is_relaxed_at(seconds(3)));
  EXPECT_FALSE(path.is_relaxed_at(seconds(9)));
}

TEST(HandPath, NamesTheErrorInAFile) {
  struct Case {
    const char* json;
    const char* message;
  };
  const Case cases[] = {
      {"[]", "p.json: the file is []; it must be an object { … }"},
      {"{}", "p.json: points is missing; it must be a list of 1 to 10000 objects"},
      {R"({"points": []})", "p.json: points is []; it must be a list of 1 to 10000 objects"},
      {R"({"points": [7]})", "p.json: points[0] is 7; it must be an object { … }"},
      {R"({"points": [{}]})", "p.json: points[0].t_s is missing; it must be a number from 0 to 86400"},
      {R"({"points": [{"t_s": -1}]})", "p.json: points[0].t_s is -1; it must be a number from 0 to 86400"},
      {R"({"points": [{"t_s": 1e999}]})", "p.json: points[0].t_s is null; it must be a number from 0 to 86400"},
      {R"({"points": [{"t_s": 1}, {"t_s": 1}]})", "p.json: points[1].t_s is 1; it must be later than the point before"},
      {R"({"points": [{"t_s": 0, "position_m": [1, 2]}]})",
       "p.json: points[0].position_m is [1, 2]; it must be three numbers [x, y, z]"},
      {R"({"points": [{"t_s": 0, "position_m": [1, "2", 3]}]})",
       "p.json: points[0].position_m[1] is \"2\"; it must be a number from -10 to 10"},
      {R"({"points": [{"t_s": 0, "rotation_xyz_deg": [361, 0, 0]}]})",
       "p.json: points[0].rotation_xyz_deg[0] is 361; it must be a number from -360 to 360"},
      {R"({"points": [{"t_s": 0, "buttons": ["fire"]}]})",
       R"(p.json: points[0].buttons is ["fire"]; it must be a list of "grab" and "clutch")"},
      {R"({"points": [{"t_s": 0, "phase": 3}]})", "p.json: points[0].phase is 3; it must be a text in quotes"},
      {R"({"points": [{"t_s": 0, "positon_m": [0, 0, 0]}]})",
       "p.json: points[0].positon_m is [0, 0, 0]; there is no such field here; known: buttons, phase, position_m, "
       "relaxed, rotation_xyz_deg, t_s"},
      {"{\"points\": [\n  {\"t_s\": 0},,]}",
       "p.json: line 2, column 14: syntax error; it must be one valid JSON value"},
      {R"({"points": [{"t_s": 0}]} x)",
       "p.json: line 1, column 26: text after the end of the JSON value; it must be one valid JSON value"},
  };
  for (const Case& each : cases) {
    try {
      parse_hand_path(each.json, "p.json");
      ADD_FAILURE() << "accepted " << each.json;
    } catch (const std::invalid_argument& error) {
      EXPECT_STREQ(error.what(), each.message) << each.json;
    }
  }
}

TEST(HandPath, NamesAMissingFile) {
  EXPECT_THAT([] { load_hand_path("/nowhere/p.json"); },
              testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr("/nowhere/p.json: cannot be read")));
}

TEST(HandPath, RefusesWayPointsThatAreNoPath) {
  EXPECT_THROW(HandPath({}), std::invalid_argument);
  WayPoint later;
  later.at = seconds(1);
  EXPECT_THROW(HandPath({later, later}), std::invalid_argument);
  WayPoint broken;
  broken.X_DH.p.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(HandPath({broken}), std::invalid_argument);
  WayPoint unnormalised;
  unnormalised.X_DH.q.w() = 2;
  EXPECT_THROW(HandPath({unnormalised}), std::invalid_argument);
}

TEST(HandPath, EveryNamedPathStartsWhereTheHandRestsAndHasAHoldPhase) {
  for (const std::string_view name : hand_path_names()) {
    const HandPath path = named_hand_path(name);
    EXPECT_EQ(path.pose_at(Duration(0)).p, Vec3::Zero()) << name;
    EXPECT_THAT(path.phases(), testing::Contains("hold")) << name;
  }
}

SineComponent sine(const Vec3& axis, double frequency_hz, double amplitude_m, double phase_rad) {
  return {axis, frequency_hz, amplitude_m, phase_rad};
}

/// A path with two waypoints and a multisine from 4 s to 10 s. The multisine has a circle of 10 mm and a sine of 5 Hz,
/// both faded in and out within 0.5 s.
HandPath shaken_move() {
  std::vector<WayPoint> points(2);
  points[1].at = seconds(12);
  points[1].X_DH.p = Vec3(0.1, 0, 0);
  const double quarter = std::numbers::pi / 2;
  return HandPath(std::move(points), {seconds(4),
                                      seconds(10),
                                      milliseconds(500),
                                      {sine(Vec3::UnitX(), 1, 0.01, 0), sine(Vec3::UnitY(), 1, 0.01, quarter),
                                       sine(Vec3::UnitZ(), 5, 0.002, 0.3)}});
}

TEST(Multisine, AddsItsSinesToTheWayPointsBetweenItsFades) {
  const HandPath path = shaken_move();
  const HandPath alone(path.points());
  for (int i = 0; i <= 50; ++i) {
    const Duration time = milliseconds(4500) + milliseconds(100) * i;
    const double t_s = to_seconds(time) - 4;
    const double angle = 2 * std::numbers::pi * t_s;
    const Vec3 expected(0.01 * std::sin(angle), 0.01 * std::cos(angle), 0.002 * std::sin(5 * angle + 0.3));
    EXPECT_LT((path.pose_at(time).p - alone.pose_at(time).p - expected).norm(), 1e-14) << t_s;
  }
}

TEST(Multisine, OfTwoSinesAQuarterTurnApartIsACircleAtASteadySpeed) {
  const HandPath path = shaken_move();
  const HandPath alone(path.points());
  for (int i = 0; i <= 50; ++i) {
    const Duration time = milliseconds(4500) + milliseconds(100) * i;
    const Vec3 v = path.twist_at(time).v - alone.twist_at(time).v;
    EXPECT_NEAR(std::hypot(v.x(), v.y()), 2 * std::numbers::pi * 0.01, 1e-14);
  }
}

TEST(Multisine, TwistIsTheDerivativeOfThePoseAlsoInTheFades) {
  const HandPath path = shaken_move();
  const double h_s = 1e-4;
  for (int i = 1; i < 240; ++i) {
    const Duration time = milliseconds(50) * i;
    const Vec3 slope =
        (path.pose_at(time + from_seconds(h_s)).p - path.pose_at(time - from_seconds(h_s)).p) / (2 * h_s);
    // A central difference with the step h has an error of at most h²/6 times the third derivative. The sine of 2 mm at
    // 5 Hz has a third derivative of 0.002 (2π 5)³ = 62 m/s³. Its fade within 0.5 s adds 0.002 · 60/0.5³ = 1 m/s³.
    EXPECT_LT((path.twist_at(time).v - slope).norm(), 20 * h_s * h_s) << to_seconds(time);
  }
}

TEST(Multisine, IsNotThereBeforeAndAfter) {
  const HandPath path = shaken_move();
  const HandPath alone(path.points());
  for (const Duration time : {Duration(0), Duration(seconds(4)), Duration(seconds(10)), Duration(seconds(20))}) {
    EXPECT_EQ(path.pose_at(time).p, alone.pose_at(time).p);
    EXPECT_EQ(path.twist_at(time).v, alone.twist_at(time).v);
  }
  // At 1 ns after its start and before its end, the multisine must not yet change position or velocity, so that the
  // path does not jump.
  for (const Duration time : {Duration(seconds(4)) + Duration(1), Duration(seconds(10)) - Duration(1)}) {
    EXPECT_LT((path.pose_at(time).p - alone.pose_at(time).p).norm(), 1e-15);
    EXPECT_LT((path.twist_at(time).v - alone.twist_at(time).v).norm(), 1e-12);
  }
}

TEST(Multisine, IsReadFromAFileAndLengthensThePath) {
  const HandPath path = parse_hand_path(R"({"points": [{"t_s": 0, "phase": "hold"}], "multisine": {
      "from_s": 1, "to_s": 5, "fade_s": 1, "components": [
        {"axis": [0, 0, -0.5], "frequency_hz": 0.25, "amplitude_m": 0.02, "phase_rad": 1.5},
        {"frequency_hz": 3, "amplitude_m": 0.001}]}})",
                                        "file.json");
  EXPECT_EQ(path.length(), seconds(5));
  ASSERT_EQ(path.multisine().components.size(), 2U);
  EXPECT_EQ(path.multisine().components[1].axis, Vec3(Vec3::UnitX()));
  // At 2 s after the start, the second component (along x) has made six whole periods and is zero. The first component
  // has made half a period from its phase 1.5, so it is 0.02 sin(π + 1.5) along −z.
  const Vec3 p = path.pose_at(seconds(3)).p;
  EXPECT_NEAR(p.z(), 0.02 * std::sin(1.5), 1e-15);
  EXPECT_NEAR(p.x(), 0, 1e-15);
}

TEST(Multisine, NamesTheErrorInAFile) {
  const std::pair<const char*, const char*> cases[] = {
      {R"({"to_s": 1})", "p.json: multisine.from_s is missing"},
      {R"({"from_s": 2, "to_s": 1})", "p.json: multisine.to_s is 1; it must be later than from_s"},
      {R"({"from_s": 0, "to_s": 1, "fade_s": 0.6})", "p.json: multisine.fade_s is 0.6; it must be at most half"},
      {R"({"from_s": 0, "to_s": 1})", "p.json: multisine.components is missing"},
      {R"({"from_s": 0, "to_s": 1, "components": []})", "p.json: multisine.components is []"},
      {R"({"from_s": 0, "to_s": 1, "components": [{"amplitude_m": 1}]})",
       "p.json: multisine.components[0].frequency_hz is missing"},
      {R"({"from_s": 0, "to_s": 1, "components": [{"frequency_hz": 51, "amplitude_m": 1}]})",
       "p.json: multisine.components[0].frequency_hz is 51"},
      {R"({"from_s": 0, "to_s": 1, "components": [{"frequency_hz": 1, "amplitude_m": -1}]})",
       "p.json: multisine.components[0].amplitude_m is -1"},
      {R"({"from_s": 0, "to_s": 1, "components": [{"axis": [0, 0, 0], "frequency_hz": 1, "amplitude_m": 1}]})",
       "p.json: multisine.components[0].axis is [0, 0, 0]; it must have a direction"},
  };
  for (const auto& [multisine, message] : cases) {
    const std::string file = R"({"points": [{"t_s": 0}], "multisine": )" + std::string(multisine) + "}";
    EXPECT_THAT([&] { parse_hand_path(file, "p.json"); },
                testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr(message)))
        << multisine;
  }
}

TEST(Multisine, RefusesInvalidMovements) {
  const std::vector<WayPoint> rest(1);
  const auto refuses = [&](const Multisine& multisine) {
    EXPECT_THROW(HandPath(rest, multisine), std::invalid_argument);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refuses({seconds(1), seconds(1), Duration(0), {sine(Vec3::UnitX(), 1, 1, 0)}});
  refuses({seconds(0), seconds(1), seconds(1), {sine(Vec3::UnitX(), 1, 1, 0)}});
  refuses({seconds(0), seconds(1), -seconds(1), {sine(Vec3::UnitX(), 1, 1, 0)}});
  refuses({seconds(0), seconds(1), Duration(0), {sine(Vec3(1, 1, 0), 1, 1, 0)}});
  refuses({seconds(0), seconds(1), Duration(0), {sine(Vec3::UnitX(), nan, 1, 0)}});
  refuses({seconds(0), seconds(1), Duration(0), {sine(Vec3::UnitX(), 1, nan, 0)}});
}

TEST(NamedPaths, ShakeHasSinesFromHalfToFiveHertzOverTwoWholePeriods) {
  const HandPath path = named_hand_path("shake");
  const Multisine& shaking = path.multisine();
  const double full_s = to_seconds(shaking.to - shaking.from - 2 * shaking.fade);
  double lowest = 100;
  double highest = 0;
  for (const SineComponent& each : shaking.components) {
    lowest = std::min(lowest, each.frequency_hz);
    highest = std::max(highest, each.frequency_hz);
    EXPECT_NEAR(std::remainder(each.frequency_hz * full_s / 2, 1), 0, 1e-12) << each.frequency_hz;
  }
  EXPECT_EQ(lowest, 0.5);
  EXPECT_EQ(highest, 5);
  // The user holds the button during the whole multisine. When the multisine ends, the path is in the phase "hold".
  for (Duration time = shaking.from; time <= shaking.to; time += milliseconds(10)) {
    EXPECT_EQ(path.buttons_at(time), 1U);
  }
  EXPECT_EQ(path.phases().at(static_cast<std::size_t>(path.phase_at(shaking.to))), "hold");
}

TEST(HandPath, ListsTheNamesWhenOneIsUnknown) {
  EXPECT_THAT([] { named_hand_path("peg-middle"); },
              testing::ThrowsMessage<std::invalid_argument>(testing::AllOf(
                  testing::HasSubstr("\"peg-middle\" is not known"), testing::HasSubstr("peg-left, peg-right"))));
}

}  // namespace
}  // namespace tandem::devices
