// Tests the whole client in virtual time, with a scripted device and a simulated server.
#include "client/client.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <ctime>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "common/base/progress.hpp"
#include "common/contact/contact_shape.hpp"
#include "common/geometry/mesh_repair.hpp"
#include "common/haptics/proxy/proxy_mesh.hpp"
#include "proto/scene_ranges.hpp"
#include "tests/client/haptics/scripted_device.hpp"
#include "tests/common/contact/test_meshes.hpp"
#include "tests/support/allocation_counter.hpp"
#include "tests/support/hub_bench.hpp"
#include "tests/support/session_bench.hpp"

namespace tandem::client {
namespace {

using testing::Contains;
using testing::HasSubstr;

/// The server's reply to the first user who joins a room with one box.
wire::Joined box_scene() {
  static const wire::Joined kJoined = test::HubBench().join("ada").joined;
  return kJoined;
}

/// A scene without a valid local model, because its tool has no mass.
wire::Joined unusable_scene() {
  wire::Joined joined = box_scene();
  joined.mutable_tool_masses(0)->set_mass_kg(0);
  return joined;
}

/// A scene without a local model, because its asset never arrives.
wire::Joined scene_without_its_asset() {
  wire::Joined joined = box_scene();
  wire::AssetInfo& asset = *joined.add_assets();
  asset.set_sha256(std::string(32, 'x'));
  asset.set_size_bytes(100);
  asset.set_kind("contact");
  return joined;
}

class ClientBench {
 public:
  explicit ClientBench(const ClientSettings& settings = {}) : client(settings, device, transport_) {
    client.session().on_event = [this](const Event& event) {
      if (const std::string line = log_line(event); !line.empty()) log.push_back(line);
    };
    client.session().start(now);
  }

  void join(const wire::Joined& joined) {
    client.session().on_connected(now);
    wire::ServerControl welcome;
    welcome.mutable_welcome()->set_protocol_version(proto::kProtocolVersion);
    welcome.mutable_welcome()->set_connection_id(7);
    welcome.mutable_welcome()->set_epoch(5);
    welcome.mutable_welcome()->set_datagram_port(4711);
    send(welcome);
    wire::ServerControl answer;
    *answer.mutable_joined() = joined;
    send(answer);
    sequence_ = 0;
  }
  void join_again(const wire::Joined& joined) {
    client.session().on_disconnected(now, "cut");
    run(250);
    join(joined);
  }

  /// Runs the client for some milliseconds. In each of them a state arrives, the haptic thread ticks and the io thread
  /// polls. A state that arrives before the tick that adopts a scene is not displayed in that scene.
  void run(int milliseconds = 2) {
    for (int i = 0; i < milliseconds; ++i) {
      now += std::chrono::milliseconds(1);
      receive_state();
      client.haptics().tick(now);
      client.poll(now);
    }
  }
  void receive_state() {
    proto::ServerUpdate update;
    update.step = Step{++step_};
    update.bodies.emplace_back().id = BodyId{1};
    update.bodies.back().state.X.p = Vec3(0.1, 0.2, 0.3);
    update.stepped = update.sent = server_time_of_own_clock(now);
    proto::Bytes datagram;
    proto::append_header({proto::DatagramType::kServerUpdate, 5, ConnectionId{7}, ++sequence_}, datagram);
    proto::ServerUpdateEncoder().append(update, datagram);
    client.session().on_datagram(datagram, now);
  }
  bool is_local() const { return client.haptics().record().is_local; }

  LocalTime now{std::chrono::seconds(10)};
  ScriptedDevice device;
  std::vector<std::string> log;

 private:
  void send(const wire::ServerControl& message) {
    proto::Bytes frame;
    proto::append_frame(message, frame);
    client.session().on_control_bytes(frame, now);
  }

  test::RecordingClientTransport transport_;
  std::uint64_t sequence_ = 0;
  std::uint64_t step_ = 0;

 public:
  Client client;
};

TEST(Client, ShowsTheLocalModelOfEachJoinFromItsFirstState) {
  ClientBench bench;
  bench.join(box_scene());
  bench.run();
  EXPECT_TRUE(bench.is_local());
  const LocalModel* const first = bench.client.haptics().local_model();
  ASSERT_NE(first, nullptr);
  bench.join_again(box_scene());
  EXPECT_EQ(bench.client.haptics().local_model(), first) << "the haptic path has not been in the new scene yet";
  bench.run();
  EXPECT_TRUE(bench.is_local());
  EXPECT_NE(bench.client.haptics().local_model(), first);
}

TEST(Client, ProvidesAWindowWithFeltAndReceivedBodies) {
  ClientSettings settings;
  settings.haptics.feeds_view = true;
  ClientBench bench(settings);
  bench.join(box_scene());
  bench.run(20);
  const View* const view = bench.client.haptics().newest_view();
  ASSERT_NE(view, nullptr);
  ASSERT_EQ(view->bodies.size(), 1U);
  EXPECT_TRUE(view->record.is_local);
  EXPECT_LT((view->received_bodies[0].state.X.p - Vec3(0.1, 0.2, 0.3)).norm(), 1e-6) << "single precision on the wire";
  const RigidState felt = bench.client.haptics().local_model()->body(BodyId{1});
  EXPECT_LT((view->bodies[0].state.X.p - felt.X.p).norm(), 0.01) << "up to a few ticks old";
}

TEST(Client, ReportsOnceWhyThereIsNoLocalModelAndUsesTheLatePose) {
  ClientBench bench;
  bench.join(unusable_scene());
  bench.run();
  EXPECT_EQ(bench.client.model_problem(), "tool_masses[0].mass_kg is 0; it must be more than 0");
  EXPECT_THAT(bench.log, Contains(HasSubstr("no local model of this scene")));
  EXPECT_FALSE(bench.is_local());
  EXPECT_GT(bench.client.haptics().record().newest_step.value, 0U) << "and it is in the scene";
  bench.log.clear();
  bench.join_again(unusable_scene());
  bench.run();
  EXPECT_THAT(bench.log, testing::Not(Contains(HasSubstr("no local model of this scene"))));
  bench.join_again(box_scene());
  bench.run();
  EXPECT_EQ(bench.client.model_problem(), "");
  EXPECT_TRUE(bench.is_local());
}

TEST(Client, AModelIsMadeOnlyForTheStageThatShowsItAndForWhoMayMoveSomething) {
  ClientBench late_pose({.haptics = {.stage = {.name = "late-pose"}}});
  late_pose.join(box_scene());
  late_pose.run();
  EXPECT_EQ(late_pose.client.haptics().local_model(), nullptr);
  ClientBench observer({.session = {.role = wire::ROLE_OBSERVER}});
  wire::Joined joined = box_scene();
  joined.set_role(wire::ROLE_OBSERVER);
  observer.join(joined);
  observer.run();
  EXPECT_EQ(observer.client.haptics().local_model(), nullptr);
  EXPECT_EQ(observer.client.model_problem(), "");
}

class ClientOfStage : public testing::TestWithParam<std::string> {};

TEST_P(ClientOfStage, NoTickAllocatesOrFreesWhenModelsComeAndGo) {
  ClientBench bench({.haptics = {.stage = {.name = GetParam()}}});
  std::uint64_t allocations = 0;
  std::uint64_t frees = 0;
  bench.join(box_scene());
  for (int i = 1; i <= 10; ++i) {
    bench.now += std::chrono::milliseconds(1);
    bench.receive_state();
    const std::uint64_t allocated_before = test::allocation_count();
    const std::uint64_t freed_before = test::free_count();
    bench.client.haptics().tick(bench.now);
    allocations += test::allocation_count() - allocated_before;
    frees += test::free_count() - freed_before;
    if (i % 2 == 1) continue;
    ASSERT_TRUE(bench.is_local()) << "join " << i / 2;
    bench.join_again(box_scene());
  }
  EXPECT_EQ(allocations, 0U);
  EXPECT_EQ(frees, 0U);
}

INSTANTIATE_TEST_SUITE_P(WithAModel, ClientOfStage, testing::Values("local-model", "god-object"),
                         [](const auto& test) { return test.param == "god-object" ? "GodObject" : "LocalModel"; });

/// Blocks the construction of a model at its first cancellation point until it is cancelled.
struct HeldMaking {
  ClientSettings settings() {
    return {.makes_models_aside = true, .at_point_of_making = [this](const std::stop_token& stop) {
              const auto patience = std::chrono::steady_clock::now() + std::chrono::seconds(30);
              ++points;
              while (!stop.stop_requested() && std::chrono::steady_clock::now() < patience) std::this_thread::yield();
              is_called_off = stop.stop_requested();
            }};
  }
  void wait_until_it_began() const {
    while (points == 0) std::this_thread::yield();
  }
  std::atomic<int> points{0};
  std::atomic<bool> is_called_off{false};
};

TEST(Client, ThatIsClosedCallsOffTheModelThatIsBeingMade) {
  HeldMaking making;
  {
    ClientBench bench(making.settings());
    bench.join(box_scene());
    making.wait_until_it_began();
  }
  EXPECT_TRUE(making.is_called_off);
  EXPECT_EQ(making.points, 1) << "it must stop at the point where it is cancelled";
}

TEST(Client, ThatGoesToAnotherSceneCallsOffTheModelOfTheOld) {
  HeldMaking making;
  ClientBench bench(making.settings());
  bench.join(box_scene());
  making.wait_until_it_began();
  bench.join_again(box_scene());
  // Waits for the construction thread. Virtual time does not advance meanwhile.
  while (making.points < 2) bench.client.poll(bench.now);
  EXPECT_TRUE(making.is_called_off);
}

/// Processor time used by this thread [s].
double thread_s() {
  std::timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// Uses a mesh of 327,680 triangles, whose processing takes about a second on a slow machine. Fails if the work between
// two cancellation points is a large part of the total, so that cancellation would take long.
TEST(CallOff, OfALargeMeshWaitsForASmallPieceOfItsWork) {
  const geometry::TriangleMesh mesh = contact::sphere_mesh(0.1, 7);
  const std::size_t pieces_of_one_pass = mesh.triangles.size() / kCallOffEvery;
  const double begun_s = thread_s();
  double last_s = begun_s, longest_s = 0;
  std::size_t points = 0;
  const auto note = [&](const std::stop_token&) {
    const double now_s = thread_s();
    longest_s = std::max(longest_s, now_s - std::exchange(last_s, now_s));
    ++points;
  };
  {
    const CallOffScope scope({}, note);
    const haptics::ProxyMesh made(mesh);
  }
  note({});
  EXPECT_GE(points, 6 * pieces_of_one_pass);
  EXPECT_LT(longest_s, 0.15 * (thread_s() - begun_s));
}

TEST(CallOff, EndsTheMakingAtAnyPoint) {
  const geometry::TriangleMesh mesh = contact::sphere_mesh(0.1, 5);
  std::size_t all = 0;
  {
    const CallOffScope scope({}, [&](const std::stop_token&) { ++all; });
    const haptics::ProxyMesh made(mesh);
  }
  for (std::size_t point = 1; point <= all; ++point) {
    std::stop_source stop;
    std::size_t count = 0;
    const CallOffScope scope(stop.get_token(), [&](const std::stop_token&) {
      if (++count == point) stop.request_stop();
    });
    EXPECT_THROW(haptics::ProxyMesh{mesh}, CalledOff) << "point " << point << " of " << all;
    EXPECT_EQ(count, point);
  }
  EXPECT_NO_THROW(call_off_point()) << "without a scope";
}

TEST(CallOff, OfAContactShapeIsPossibleInEachOfItsParts) {
  const auto bytes =
      contact::contact_asset_bytes(*contact::make_contact_mesh(geometry::repaired(contact::sphere_mesh(0.02, 3))));
  std::size_t points = 0;
  const CallOffScope scope({}, [&](const std::stop_token&) { ++points; });
  EXPECT_NE(contact::contact_shape_from(bytes), nullptr);
  EXPECT_GE(points, 8U);
}

TEST(Client, AGodObjectReportsTheBallThatItUses) {
  ClientBench bench({.haptics = {.stage = {.name = "god-object"}}});
  EXPECT_EQ(bench.client.stage_note(), "");
  bench.join(box_scene());
  bench.run();
  EXPECT_TRUE(bench.is_local());
  EXPECT_EQ(bench.client.haptics().local_model(), nullptr);
  EXPECT_THAT(bench.client.stage_note(), HasSubstr("touches 1 shape with a ball of 5 mm radius"));
}

TEST(Client, AGodObjectEndsASessionWhoseSceneItCannotTouch) {
  ClientBench bench({.haptics = {.stage = {.name = "god-object"}}});
  wire::Joined joined = box_scene();
  joined.mutable_scene()->mutable_bodies(0)->mutable_shapes(0)->mutable_molecule();
  bench.join(joined);
  EXPECT_EQ(bench.client.session().status().state, SessionState::kEnded);
  EXPECT_TRUE(bench.client.session().status().is_setup_error);
  EXPECT_THAT(bench.client.session().status().why, HasSubstr("use stage local-model"));
}

TEST(Client, AGodObjectDisplaysNothingForAnUnusableSceneAndReportsWhy) {
  ClientBench bench({.haptics = {.stage = {.name = "god-object"}}});
  wire::Joined joined = box_scene();
  joined.mutable_scene()->mutable_bodies(0)->mutable_shapes(0)->mutable_mesh()->set_file("a.obj");
  proto::complete_numbers(*joined.mutable_scene());
  bench.join(joined);
  bench.run();
  EXPECT_FALSE(bench.is_local());
  EXPECT_THAT(bench.client.stage_note(), testing::AllOf(HasSubstr("no force"), HasSubstr("a.obj is too large")));
  EXPECT_THAT(bench.client.model_problem(), HasSubstr("a.obj is too large"));
}

TEST(Client, AGodObjectReportsWhichAssetIsMissing) {
  ClientBench bench({.haptics = {.stage = {.name = "god-object"}}});
  wire::Joined joined = box_scene();
  wire::Mesh& mesh = *joined.mutable_scene()->mutable_bodies(0)->mutable_shapes(0)->mutable_mesh();
  mesh.set_file("a.obj");
  mesh.set_surface_sha256(std::string(32, 's'));
  proto::complete_numbers(*joined.mutable_scene());
  wire::AssetInfo& offered = *joined.add_assets();
  offered.set_name("a.obj");
  offered.set_kind("surface");
  offered.set_size_bytes(kMaxAssetBytes + 1);
  offered.set_sha256(mesh.surface_sha256());
  bench.join(joined);
  bench.run();
  EXPECT_FALSE(bench.is_local());
  EXPECT_THAT(bench.client.stage_note(),
              testing::AllOf(HasSubstr("no force"), HasSubstr("surface of a.obj is not here")));
}

TEST(Client, WithoutATickNoModelIsFreedAndTheNewestIsShownAtLast) {
  ClientBench bench;
  bench.join(box_scene());
  bench.run();
  const LocalModel* const in_use = bench.client.haptics().local_model();
  for (int i = 0; i < 4; ++i) {
    bench.client.session().on_disconnected(bench.now, "cut");
    for (int ms = 0; ms < 2000; ++ms) bench.client.poll(bench.now += std::chrono::milliseconds(1));
    bench.join(box_scene());
  }
  EXPECT_EQ(bench.client.haptics().local_model(), in_use) << "the haptic thread may be in the middle of its step";
  EXPECT_TRUE(in_use->has_started()) << "the model must still be alive";
  bench.run(1);
  EXPECT_FALSE(bench.is_local()) << "that of the fifth join waited until the tick had left the first";
  bench.run();
  EXPECT_TRUE(bench.is_local());
}

TEST(Client, AModelMadeAsideIsShownWhenItIsReady) {
  ClientBench bench({.makes_models_aside = true});
  bench.join(box_scene());
  while (!bench.is_local()) {
    bench.run();
    std::this_thread::yield();
  }
  EXPECT_EQ(bench.client.model_problem(), "");
}

TEST(Client, AModelOfASceneThatWasLeftIsNotShownInTheNext) {
  ClientBench bench({.makes_models_aside = true});
  bench.join(box_scene());  // another thread begins to construct the local model of this scene
  bench.client.session().on_disconnected(bench.now, "cut");
  bench.now += std::chrono::seconds(1);
  bench.client.session().poll(bench.now);
  bench.join(scene_without_its_asset());  // the construction ends only after the client has adopted this next scene
  const auto until = std::chrono::steady_clock::now() + std::chrono::milliseconds(100);
  while (std::chrono::steady_clock::now() < until) {
    bench.run();
    ASSERT_FALSE(bench.is_local());
  }
  EXPECT_EQ(bench.client.session().scene_generation(), 2U);
}

TEST(Client, AnotherStageIsUsedOnceItsModelIsReady) {
  ClientBench bench({.haptics = {.stage = {.name = "hold"}}});
  bench.join(box_scene());
  bench.run();
  EXPECT_FALSE(bench.is_local());
  bench.client.set_stage({.name = "local-model"});
  bench.run(3);
  EXPECT_TRUE(bench.is_local());
  const LocalModel* const model = bench.client.haptics().local_model();
  ASSERT_NE(model, nullptr);
  bench.client.set_stage({.name = "god-object"});
  bench.run(3);
  EXPECT_TRUE(bench.is_local());
  EXPECT_EQ(bench.client.haptics().local_model(), nullptr);
  EXPECT_THAT(bench.client.stage_note(), HasSubstr("ball of 5 mm"));
  bench.client.set_stage({.name = "late-pose"});
  bench.run(3);
  EXPECT_FALSE(bench.is_local());
  bench.join_again(box_scene());
  bench.run(3);
  EXPECT_FALSE(bench.is_local()) << "it stays over a new join";
}

TEST(Client, AStageThatCannotShowTheSceneIsNotTakenAndOneThatDoesNotExistNeither) {
  ClientBench bench;
  wire::Joined joined = box_scene();
  joined.mutable_scene()->mutable_bodies(0)->mutable_shapes(0)->mutable_molecule();
  bench.join(joined);
  bench.run();
  bench.client.set_stage({.name = "god-object"});
  bench.run(3);
  EXPECT_EQ(bench.client.stage().name, "local-model");
  EXPECT_THAT(bench.client.stage_note(), HasSubstr("use stage local-model"));
  EXPECT_THROW(bench.client.set_stage({.name = "magic"}), std::invalid_argument);
  EXPECT_THROW(bench.client.set_stage({.predictor = "magic"}), std::invalid_argument);
  EXPECT_EQ(bench.client.stage().name, "local-model");
}

TEST(Client, AStageSelectedBeforeTheJoinIsUsedInTheRoom) {
  ClientBench bench({.haptics = {.stage = {.name = "hold"}}});
  bench.client.set_stage({.name = "local-model"});
  bench.join(box_scene());
  bench.run(3);
  EXPECT_TRUE(bench.is_local());
}

}  // namespace
}  // namespace tandem::client
