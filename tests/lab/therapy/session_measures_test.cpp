#include "lab/therapy/session_measures.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <numbers>

#include "common/base/random.hpp"
#include "lab/therapy/measures_json.hpp"
#include "server/recording/room_recorder.hpp"
#include "tests/lab/therapy/made_recording.hpp"
#include "tests/lab/therapy/minimum_jerk.hpp"
#include "tests/server/goals/game_room.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::lab {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

/// A folder that is removed at the end of the test.
class SessionMeasuresTest : public testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path file(const std::string& name) const { return folder_ / name; }
  fs::path written(MadeRecording& recording) const {
    recording.write(file("a.mcap"));
    return file("a.mcap");
  }
  template <class Call>
  static std::string error_of(const Call& call) {
    try {
      call();
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "no error";
  }

  fs::path folder_ = fs::temp_directory_path() / ("tandem_therapy_" + std::to_string(::getpid()));
};

Vec3 at_rest(double) {
  return {0, 0, 0.1};
}

/// Returns the position as a function of time: a movement of `length_m` along x within the second that begins at
/// `begin_s`.
auto reach(double begin_s, double length_m) {
  return [=](double t_s) { return Vec3(length_m * minimum_jerk(t_s - begin_s), 0, 0.1); };
}

using Event = wire::GameEvent;

TEST_F(SessionMeasuresTest, HaveLevelsAndGoalsWithTheirTimes) {
  MadeRecording made(42);
  made.level("first", {"pick", "put"}).set_in_order(true);
  made.level("second", {"both"});
  made.run(0.5, at_rest);  // half a second without a user
  made.join(0, "anna");
  made.run(1, at_rest);
  made.event(Event::STARTED, 0);
  made.event(Event::LEVEL_STARTED, 0);
  made.force_n = {3, 0, 4};
  made.run(2, reach(1.5, 0.1));
  made.event(Event::GOAL_REACHED, 0, 0, 10);
  made.held_body = 2;
  made.force_n = {0, 0, 9};
  made.run(1, reach(3.5, 0.0));
  made.held_body = 0;
  made.run(1, [](double) { return Vec3(0, 0, 0.1); });
  made.held_body = 3;
  made.run(1, [](double) { return Vec3(0, 0, 0.1); });
  made.event(Event::GOAL_REACHED, 0, 1, 15);
  made.event(Event::LEVEL_REACHED, 0, 0, 15);
  made.event(Event::LEVEL_STARTED, 1, 0, 15);
  made.held_body = 0;
  made.run(2, at_rest);
  made.event(Event::GOAL_FAILED, 1, 0, 15);
  made.event(Event::LEVEL_FAILED, 1, 0, 15);
  made.event(Event::LOST, 1, 0, 15);
  made.run(1, at_rest);
  const SessionMeasures session = measure_session(written(made), "");

  EXPECT_EQ(session.recording, 42U);
  EXPECT_EQ(session.scene, "made");
  EXPECT_THAT(session.begun_utc, testing::StartsWith("2026-11-"));
  EXPECT_FALSE(session.is_cut);
  ASSERT_EQ(session.parts.size(), 6U);
  const PartMeasures& whole = session.whole();
  EXPECT_EQ(whole.outcome, PartOutcome::kFailed);
  EXPECT_NEAR(whole.time_s, 9, 0.02);
  EXPECT_EQ(whole.score, 15);
  EXPECT_EQ(whole.grasps, 2U);
  EXPECT_EQ(whole.objects, 2U);
  EXPECT_EQ(session.count(PartKind::kLevel, PartOutcome::kReached), 1U);

  const auto expect = [&](std::size_t i, PartKind kind, const std::string& name, PartOutcome outcome, double begin_s,
                          double time_s, double score) {
    const PartMeasures& part = session.parts.at(i);
    EXPECT_EQ(part.name, name);
    EXPECT_EQ(part.kind, kind) << name;
    EXPECT_EQ(part.outcome, outcome) << name;
    EXPECT_NEAR(part.begin_s, begin_s, 0.02) << name;
    EXPECT_NEAR(part.time_s, time_s, 0.02) << name;
    EXPECT_EQ(part.score, score) << name;
  };
  expect(1, PartKind::kLevel, "first", PartOutcome::kReached, 1, 5, 15);
  expect(2, PartKind::kGoal, "pick", PartOutcome::kReached, 1, 2, 10);
  expect(3, PartKind::kGoal, "put", PartOutcome::kReached, 3, 3, 5);
  expect(4, PartKind::kLevel, "second", PartOutcome::kFailed, 6, 2, 0);
  expect(5, PartKind::kGoal, "both", PartOutcome::kFailed, 6, 2, 0);
  EXPECT_EQ(session.parts[2].force_peak_n, 5) << "the norm of (3, 0, 4)";
  EXPECT_EQ(session.parts[2].force_mean_n, 5);
  EXPECT_EQ(session.parts[2].movements, 1U);
  EXPECT_NEAR(session.parts[2].path_m, 0.1, 0.001);
  EXPECT_NEAR(session.parts[2].smoothness, arc_length_of(minimum_jerk_spectrum), 0.03);
  EXPECT_EQ(session.parts[3].force_peak_n, 9);
}

TEST_F(SessionMeasuresTest, CountOnlyTheTimeInWhichTheUserIsInTheRoom) {
  MadeRecording made;
  made.level("long", {"goal"});
  made.event(Event::LEVEL_STARTED, 0);
  made.run(3, at_rest);
  made.join(0, "anna");
  made.run(4, at_rest);
  made.leave(0);
  made.run(3, at_rest);
  made.event(Event::LEVEL_REACHED, 0, 0, 1);
  made.run(1, at_rest);
  const SessionMeasures session = measure_session(written(made), "anna");
  ASSERT_EQ(session.parts.size(), 2U);
  for (const PartMeasures& part : session.parts) {
    EXPECT_EQ(part.begin_s, 0);
    EXPECT_NEAR(part.time_s, 4, 0.02);
  }
}

TEST_F(SessionMeasuresTest, UseTheClientsClockWhereTheNetworkHasJitter) {
  std::vector<double> smoothness;
  for (const bool has_client_clock : {true, false}) {
    MadeRecording made;
    made.has_client_clock = has_client_clock;
    made.join(0, "anna");
    made.run(0.5, at_rest);
    for (int i = 0; i < 1000; ++i) {
      made.network_delay_ns = static_cast<std::uint64_t>(20e6 * (1 + std::sin(2 * std::numbers::pi * 5e-3 * i)));
      made.run(0.001, reach(0.5, 0.2));
    }
    made.network_delay_ns = 0;
    made.run(0.5, [](double) { return Vec3(0.2, 0, 0.1); });
    smoothness.push_back(measure_session(written(made), "").whole().smoothness);
  }
  EXPECT_NEAR(smoothness[0], arc_length_of(minimum_jerk_spectrum), 0.03);
  EXPECT_GT(smoothness[0], smoothness[1] + 0.1) << "times of arrival have the jitter";
}

TEST_F(SessionMeasuresTest, AreThoseOfTheNamedUser) {
  MadeRecording made;
  made.join(0, "anna");
  made.join(1, "ben");
  made.join(2, "a watcher", wire::ROLE_OBSERVER);
  made.run(2, reach(0.5, 0.1));
  const fs::path recording = written(made);
  EXPECT_EQ(measure_session(recording, "anna").whole().movements, 1U);
  EXPECT_THAT(error_of([&] { measure_session(recording, ""); }),
              AllOf(HasSubstr("a.mcap has the users anna, ben"), HasSubstr("name one of them by --user")));
  EXPECT_THAT(error_of([&] { measure_session(recording, "carl"); }),
              AllOf(HasSubstr("--user carl: "), HasSubstr("a.mcap has the users anna, ben; name one")));
  EXPECT_THAT(error_of([&] { measure_session(recording, "ben"); }),
              AllOf(HasSubstr("a.mcap: inputs of the user ben have no valid position"), HasSubstr("with a device")));
}

TEST_F(SessionMeasuresTest, CalibrationIsTheRangeOfTheFirstSeconds) {
  MadeRecording made;
  made.join(0, "anna");
  made.run(1, at_rest);
  made.run(2, [](double t) { return Vec3(t < 2 ? -0.1 : 0.3, 0, 0.1); });
  made.run(2, [](double) { return Vec3(0.9, 0, 0.1); });
  const fs::path recording = written(made);
  const MotionRange first = measure_session(recording, "", 3.0).calibration.value(),
                    all = measure_calibration(recording, "");
  EXPECT_FALSE(measure_session(recording, "").calibration);
  EXPECT_NEAR(first.reach_m()[0], 0.1, 1e-9);
  EXPECT_NEAR(first.reach_m()[1], 0.3, 1e-9);
  EXPECT_NEAR(all.reach_m()[1], 0.9, 1e-9);
  EXPECT_THAT(error_of([&] { measure_session(recording, "", 0.5); }),
              AllOf(HasSubstr("a.mcap: the calibration has less than 1 s"), HasSubstr("record the hand")));
}

TEST_F(SessionMeasuresTest, OfADamagedRecordingAreThoseOfItsReadablePart) {
  MadeRecording made;
  made.join(0, "anna");
  made.run(2, reach(0.5, 0.1));
  made.begin_chunk();
  made.run(2, at_rest);
  const fs::path recording = written(made);
  const auto middle = static_cast<std::streamoff>(made.bytes_until_chunk() + 200);
  std::fstream(recording, std::ios::in | std::ios::out | std::ios::binary).seekp(middle).put('\x55').put('\xaa');
  const SessionMeasures session = measure_session(recording, "");
  EXPECT_TRUE(session.is_cut);
  EXPECT_NEAR(session.whole().time_s, 2, 0.02);
}

TEST_F(SessionMeasuresTest, HostileValuesAreNotMeasured) {
  Random random(test::test_seed(20261206));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (int run = 0; run < 20; ++run) {
    MadeRecording made;
    made.level("<b>" + std::string(200, 'x'), {"=goal()"});
    made.join(0, "anna");
    for (int i = 0; i < 300; ++i) {
      const double odd = std::array{nan, 1e308, -1e308, 1e-320, 5.0}.at(random.next_u32() % 5);
      made.force_n = {odd, 0, 1};
      made.held_body = random.next_u32();
      if (random.next_u32() % 10 == 0) {
        made.event(static_cast<Event::Kind>(random.next_u32() % 12), random.next_u32() % 3 * 0x7fffffffU,
                   random.next_u32(), odd);
      }
      made.network_delay_ns = random.next_u32() % 20 == 0 ? random.next_u64() >> 22U : 0;
      made.run(0.01, [&](double t) { return Vec3(random.next_u32() % 7 == 0 ? odd : 0.1 * t, 0, 0); });
    }
    made.network_delay_ns = 0;
    const SessionMeasures session = measure_session(written(made), "");
    for (const PartMeasures& part : session.parts) {
      EXPECT_GE(part.time_s, 0);
      EXPECT_TRUE(std::isfinite(part.path_m) && part.path_m >= 0);
      EXPECT_FALSE(part.force_peak_n > 1e6);
      EXPECT_LE(part.name.size(), 70U);
    }
    const auto stored = to_json(session);
    EXPECT_EQ(to_json(session_from_json(stored, "x.json")), stored);
  }
}

TEST_F(SessionMeasuresTest, AMessageThatCannotBeReadIsNamed) {
  MadeRecording made;
  made.join(0, "anna");
  made.run(2, at_rest);
  made.damaged_step();
  EXPECT_THAT(
      error_of([&] { measure_session(written(made), ""); }),
      AllOf(HasSubstr("a.mcap: a message tandem.wire.RecordedStep cannot be read"), HasSubstr("copy it again")));
}

TEST_F(SessionMeasuresTest, AClientsRecordingIsRefused) {
  recording::McapWriter writer({proto::channel_of("/session", wire::RecordedSession())}, "test");
  auto bytes = writer.begin();
  writer.add(0, 1, proto::bytes_of(wire::RecordedSession()));
  for (const auto& part : {writer.pop_chunk(), writer.finish()}) bytes.insert(bytes.end(), part.begin(), part.end());
  std::ofstream(file("c.mcap"), std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  EXPECT_THAT(error_of([&] { measure_session(file("c.mcap"), ""); }),
              AllOf(HasSubstr("c.mcap is no recording of a room"), HasSubstr("tandem-server --record")));
  EXPECT_THAT(error_of([&] { measure_session(file("none.mcap"), ""); }),
              AllOf(HasSubstr("none.mcap cannot be opened"), HasSubstr("name a recording")));
}

TEST_F(SessionMeasuresTest, OfAGameInARoomHaveItsScoreAndTheGraspedBall) {
  double score = 0;
  {
    server::GameRoom game(server::load_scene(physics::shipped_scene("ring")));
    server::RoomRecorder recorder(
        game.room, {.file = file("ring.mcap"), .program = "test 1", .recording = 7, .capacity = 1U << 17U});
    game.room.watch(recorder);
    game.join(0);
    server::play_ring(game);
    game.run(0.6);
    recorder.finish();
    ASSERT_EQ(recorder.steps_lost(), 0U);
    score = game.status().total();
  }
  const SessionMeasures session = measure_session(file("ring.mcap"), "");
  ASSERT_EQ(session.parts.size(), 3U);
  EXPECT_EQ(session.whole().outcome, PartOutcome::kReached);
  EXPECT_EQ(session.whole().score, score);
  EXPECT_EQ(session.whole().grasps, 1U);
  EXPECT_EQ(session.whole().objects, 1U);
  EXPECT_GT(session.whole().force_peak_n, 0);
  EXPECT_NEAR(session.whole().range->size_m().x(), 0.2, 0.005) << "from the ball to the ring";
  EXPECT_EQ(session.parts[1].name, "ring");
  EXPECT_EQ(session.parts[1].outcome, PartOutcome::kReached);
  EXPECT_EQ(session.parts[2].name, "ball in the ring");
  EXPECT_EQ(session.parts[2].score, score);
}

}  // namespace
}  // namespace tandem::lab
