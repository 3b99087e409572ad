// Tests the replay of a room's recording. It must reach the same state after each step, or name the first step and body
// that differ.
#include "lab/recording/session_replay.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <functional>

#include "common/base/random.hpp"
#include "common/recording/mcap_reader.hpp"
#include "common/recording/mcap_writer.hpp"
#include "proto/coupling_fields.hpp"
#include "proto/recording/recorded_files.hpp"
#include "proto/recording/schema.hpp"
#include "server/recording/room_recorder.hpp"
#include "server/room/room_seats.hpp"
#include "tests/common/physics/scene_support.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::lab {
namespace {

namespace fs = std::filesystem;

constexpr const char* kBodies =
    R"({"name": "floor", "shapes": [{"box": {"size_m": [1, 1, 0.1]}}], "placement": {"position_m": [0, 0, -0.05]}},
       {"name": "cube", "shapes": [{"box": {"size_m": [0.04, 0.04, 0.04]}}], "mass_kg": 0.2, "graspable": true,
        "placement": {"position_m": [0, 0, 0.02]}},
       {"name": "other", "shapes": [{"box": {"size_m": [0.04, 0.04, 0.04]}}], "mass_kg": 0.2,
        "placement": {"position_m": [0.08, 0, 0.02]}})";
constexpr const char* kTools =
    R"({"name": "l", "placement": {"position_m": [0, 0, 0.06]}}, {"name": "r", "placement": {"position_m": [0.08, 0, 0.06]}})";

class SessionReplayTest : public ::testing::Test {
 protected:
  SessionReplayTest() {
    const char* const name = ::testing::UnitTest::GetInstance()->current_test_info()->name();
    folder_ = fs::temp_directory_path() / ("tandem_" + std::string(name) + std::to_string(::getpid()));
    fs::create_directories(folder_);
    std::ofstream(folder_ / "s.json") << physics::scene_json({.bodies = kBodies, .tools = kTools});
  }
  ~SessionReplayTest() override { fs::remove_all(folder_); }

  fs::path scene() const { return folder_ / "s.json"; }
  fs::path file() const { return folder_ / "r.mcap"; }

  /// Records two hands over links with loss and delay. They move, push, grab, rotate, change coupling and law, reset
  /// and leave.
  /// In      mode  client mode of the first hand
  void record(proto::ClientMode mode, const std::function<void(server::RoomRecording&)>& change = {}) {
    server::Room room(RoomId{1}, "attic", server::load_scene(scene()));
    server::RoomRecording settings{.file = file(), .program = "test 1", .scene_file = scene().string(), .recording = 7};
    if (change) change(settings);
    server::RoomRecorder recorder(room, settings);
    room.watch(recorder);
    server::RoomSeats seats(room);
    Random random(test::test_seed(1));
    const auto anna = seats.allocate(server::UserRole::kOperator, false, haptics::kNoCouplingBounds, "anna");
    const auto ben = seats.allocate(server::UserRole::kManipulator, true, {.stiffness_n_per_m = 200}, "ben");
    for (int i = 0; i < 3000; ++i) {
      if (i == 1200) seats.set_coupling(*anna, {.stiffness_n_per_m = 500});
      if (i == 1350) seats.set_law(*anna, *haptics::find_coupling_law("stable-dynamic"));
      if (i == 1500) seats.reset(*anna, LocalTime(std::chrono::milliseconds(i)));
      if (i == 2700) seats.leave(*ben);
      if (i % 500 == 100) seats.grab(*ben, BodyId{}, 1);
      if (i % 500 == 300) seats.release(*ben, 2);
      if (random.uniform() > 0.1) room.input(anna->index).publish(input(i, mode, 0, random));
      if (random.uniform() > 0.3) room.input(ben->index).publish(input(i, proto::ClientMode::kHandle, 0.08, random));
      room.step(ServerTime(room.period() * (i + 1)));
      seats.flush();
      if (room.output().poll()) seats.on_update(*ben, room.output().front());
      if (i % 50 == 0) recorder.drain();
    }
    recorder.finish();
    EXPECT_EQ(recorder.steps_lost(), 0U);
    EXPECT_GT(recorder.file().messages_written(), 3000U);
  }

  static proto::ClientUpdate input(int i, proto::ClientMode mode, double x_m, Random& random) {
    proto::ClientUpdate update;
    update.input_tick = Tick{static_cast<std::uint64_t>(i + 1)};
    update.sent =
        LocalTime(std::chrono::milliseconds(i) + std::chrono::microseconds(static_cast<int>(500 * random.uniform())));
    update.handle.X.p = {x_m + 0.02 * std::sin(0.003 * i), 0.01 * std::sin(0.002 * i),
                         0.045 + 0.015 * std::sin(0.005 * i)};
    update.handle.X.q = quaternion_of(Vec3(0.1 * std::sin(0.004 * i), 0.3, 0.2));
    update.handle.V.v = {0.02 * 3 * std::cos(0.003 * i), 0, 0};
    update.handle_valid = i % 700 != 650;
    update.buttons = i % 400 > 200 ? kButtonGrab : 0U;
    update.energy_from_hand_j = 1e-4 * i;
    update.mode = mode;
    if (mode == proto::ClientMode::kWave) update.wave.f = {0.01 * std::sin(0.01 * i), 0, 0};
    return update;
  }

  /// Rewrites the recording after `change` has modified its steps.
  void rewrite(const std::function<void(wire::RecordedStep&)>& change) {
    std::ifstream in(file(), std::ios::binary);
    recording::McapReader reader(in);
    std::optional<recording::McapWriter> writer;
    recording::Bytes out;
    const auto append = [&out](const recording::Bytes& part) { out.insert(out.end(), part.begin(), part.end()); };
    while (const auto message = reader.next()) {
      if (!writer) {
        writer.emplace(std::vector{*reader.channel(0), *reader.channel(1), *reader.channel(2)}, "test");
        append(writer->begin());
      }
      wire::RecordedStep step;
      if (message->channel == 1 && proto::parse_recorded(*message, step)) change(step);
      message->channel == 1 ? writer->add(1, message->log_ns, proto::bytes_of(step))
                            : writer->add(message->channel, message->log_ns, message->data);
    }
    append(writer->pop_chunk());
    append(writer->finish());
    in.close();
    std::ofstream(file(), std::ios::binary)
        .write(reinterpret_cast<const char*>(out.data()), static_cast<std::streamsize>(out.size()));
  }

  ReplayResult replay() { return replay_session(file()); }

  fs::path folder_;
};

TEST_F(SessionReplayTest, HasTheSameStateAfterEachStepInEachMode) {
  for (const auto mode : {proto::ClientMode::kHandle, proto::ClientMode::kLocalModel, proto::ClientMode::kWave}) {
    fs::remove(file());
    record(mode);
    std::uint64_t held = 0;
    const ReplayResult result = replay_session(
        file(), {}, [&held](const server::Room& room) { held += room.world().tool(0).held.is_valid() ? 1 : 0; });
    EXPECT_FALSE(result.differs_at_step) << "step " << *result.differs_at_step << ", " << result.differing_thing;
    EXPECT_FALSE(result.missing_step);
    EXPECT_EQ(result.steps, 3000U);
    EXPECT_GT(result.inputs, 4000U);
    EXPECT_GE(result.commands, 10U);
    EXPECT_GT(held, 100U) << "the hands did something";
    EXPECT_TRUE(result.is_whole);
  }
}

TEST_F(SessionReplayTest, NamesTheFirstStepAndValueThatDiffer) {
  record(proto::ClientMode::kHandle);
  // Replaces the scene by one with the same names, but a slightly heavier cube.
  std::string heavier = physics::scene_json({.bodies = kBodies, .tools = kTools});
  heavier.replace(heavier.find(R"("mass_kg": 0.2)"), 14, R"("mass_kg": 0.3)");
  std::ofstream(scene()) << heavier;
  EXPECT_THROW(replay(), std::invalid_argument) << "another scene is not played";

  // Restores the scene, and changes the inputs of step 800 in the recording. The replay must then differ from the
  // recorded states from this step on, as if a different build had computed it.
  std::ofstream(scene()) << physics::scene_json({.bodies = kBodies, .tools = kTools});
  rewrite([](wire::RecordedStep& step) {
    if (step.step() == 800 && step.inputs_size() > 0) {
      wire::Position& p = *step.mutable_inputs(0)->mutable_update()->mutable_handle()->mutable_p();
      p.set_x_m(p.x_m() + 1e-12);
    }
  });
  const ReplayResult result = replay();
  ASSERT_TRUE(result.differs_at_step);
  EXPECT_GE(*result.differs_at_step, 800U);
  EXPECT_LT(*result.differs_at_step, 810U);
  EXPECT_TRUE(result.differing_thing == "tool l" || result.differing_thing == "body cube") << result.differing_thing;
}

TEST_F(SessionReplayTest, StopsAtAStepThatWasLost) {
  record(proto::ClientMode::kHandle, [](server::RoomRecording& settings) { settings.capacity = 4096; });
  rewrite([](wire::RecordedStep& step) {
    if (step.step() == 1234) step.set_step(0);
  });
  const ReplayResult result = replay();
  EXPECT_EQ(result.missing_step, 1234U);
  EXPECT_EQ(result.steps, 1233U);
}

TEST_F(SessionReplayTest, PlaysFilesThatRotated) {
  record(proto::ClientMode::kHandle, [](server::RoomRecording& settings) { settings.rotation.max_bytes = 50'000; });
  EXPECT_TRUE(fs::exists(folder_ / "r-003.mcap"));
  const ReplayResult result = replay();
  EXPECT_EQ(result.steps, 3000U);
  EXPECT_FALSE(result.differs_at_step);
  EXPECT_THROW(replay_session(folder_ / "r-002.mcap"), std::invalid_argument) << "it does not begin at the start";
}

TEST_F(SessionReplayTest, AFullRingDropsWholeStepsAndCountsThem) {
  server::Room room(RoomId{1}, "attic", server::load_scene(scene()));
  server::RoomRecorder recorder(
      room, {.file = file(), .program = "test", .scene_file = scene().string(), .recording = 7, .capacity = 10});
  room.watch(recorder);
  for (int i = 0; i < 100; ++i) room.step(ServerTime(room.period() * (i + 1)));
  recorder.finish();
  EXPECT_GT(recorder.steps_lost(), 50U);
  EXPECT_FALSE(recorder.pop_news().empty());
  std::uint64_t steps = 0;
  proto::read_recording(file(), [&steps](const std::string& topic, const auto&) {
    steps += topic == "/step" ? 1 : 0;
    return true;
  });
  EXPECT_EQ(steps + recorder.steps_lost(), 100U);
}

}  // namespace
}  // namespace tandem::lab
