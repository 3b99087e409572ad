// Tests the session hub with a fake transport: joins, requests, time-outs and refusals. A user who misbehaves must not
// affect other users.
#include "server/session/session_hub.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "proto/soft_shape.hpp"
#include "server/session/session_answers.hpp"
#include "tests/support/hub_bench.hpp"

namespace tandem::server {
namespace {

using test::message_of;
using testing::AllOf;
using testing::HasSubstr;

TEST(SessionHub, UsesConnectionIdsFromItsSourceExceptZeroAndThoseInUse) {
  HubSettings settings;
  settings.connection_ids = [drawn = std::vector<std::uint64_t>{9, 5, 5, 0}]() mutable {
    const std::uint64_t next = drawn.back();
    drawn.pop_back();
    return next;
  };
  test::HubBench bench(settings);
  test::BenchClient first = bench.connect();
  test::BenchClient second = bench.connect();
  bench.greet(first);
  bench.greet(second);
  EXPECT_EQ(first.connection.value, 5U);
  EXPECT_EQ(second.connection.value, 9U);
}

TEST(SessionHub, NeedsASourceOfConnectionIds) {
  test::RecordingTransport transport;
  EXPECT_THROW(SessionHub({}, {}, transport), std::invalid_argument);
}

TEST(SessionHub, OneUsersFloodOfGrabsIsAnsweredBusyAndTheOthersAreServed) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada");
  test::BenchClient ben = bench.join("ben");
  bench.drain(ada);
  bench.send_state(ada);
  bench.send_state(ben);
  bench.step();
  const auto grab_any = [](std::uint32_t request) {
    wire::ClientControl message;
    message.set_request(request);
    message.mutable_grab();
    return message;
  };
  for (int round = 0; round < 3; ++round) {
    for (std::uint32_t i = 0; i < 15; ++i) bench.send(ada, grab_any(i));
    bench.send(ben, grab_any(1));
    EXPECT_EQ(test::described(bench.drain(ben)), "") << "forwarded to the room, not refused";
    bench.step();
    EXPECT_EQ(test::described(bench.drain(ben)), round == 0 ? "grabbed" : "error ERROR_ALREADY_HOLDING");
    const auto answers = bench.drain(ada);
    ASSERT_EQ(answers.size(), 15U) << "round " << round << ": one of the room, the others busy";
    EXPECT_EQ(answers.back().request(), 0U) << "the first was asked of the room and answered after its step";
    for (std::size_t i = 0; i + 1 < answers.size(); ++i) {
      ASSERT_EQ(answers[i].error().code(), wire::ERROR_NOT_ALLOWED) << "round " << round << " answer " << i;
      ASSERT_EQ(answers[i].request(), i + 1);
    }
  }
  EXPECT_EQ(bench.hub->user_count(), 2U);
}

TEST(SessionHub, RefusesAnUnknownRoomWithTheListOfRooms) {
  test::HubBench bench({}, {test::two_hands_scene("attic"), test::two_hands_scene("cellar")});
  test::BenchClient client = bench.connect();
  bench.greet(client);
  bench.send(client, test::HubBench::join_message("ada", wire::ROLE_MANIPULATOR, "garage"));
  const auto answers = bench.drain(client);
  ASSERT_EQ(test::described(answers), "error ERROR_UNKNOWN_ROOM, goodbye");
  EXPECT_EQ(answers[0].request(), 7U);
  EXPECT_THAT(answers[0].error().text(), AllOf(HasSubstr("garage"), HasSubstr("attic"), HasSubstr("cellar")));
}

TEST(SessionHub, AnEmptyRoomNameIsTheOnlyRoomButNeverOneOfSeveral) {
  test::HubBench one;
  EXPECT_EQ(one.join("ada").joined.scene().name(), "bench");
  test::HubBench two({}, {test::two_hands_scene("attic"), test::two_hands_scene("cellar")});
  EXPECT_EQ(two.join("ada").joined.user(), 0U);
}

TEST(SessionHub, OnlyAUserWhoFloodsWithControlMessagesIsDisconnected) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada"), ben = bench.join("ben");
  const wire::ClientControl ping = message_of([](auto& message) { message.mutable_ping()->set_token(1); });
  for (int k = 0; k < 250; ++k) bench.send(ada, ping);
  bench.step(20);
  EXPECT_EQ(bench.hub->user_count(), 1U);
  const auto received = bench.drain(ada);
  ASSERT_FALSE(received.empty());
  EXPECT_THAT(received.back().goodbye().text(), HasSubstr("at most 100 a second"));
  for (int k = 0; k < 900; ++k) {
    bench.now += std::chrono::milliseconds(11);
    bench.send(ben, ping);
    ASSERT_EQ(bench.hub->user_count(), 1U) << "90 a second, message " << k;
  }
}

TEST(SessionHub, SendsNewUsersABoundedNoteAboutOmittedPartsOfTheScene) {
  auto scene = std::make_shared<server::LoadedScene>(*test::scene_of(test::two_hands_scene()));
  for (int i = 0; i < 30; ++i) scene->notes_for_users.push_back(std::to_string(i) + std::string(400, 'x') + "ä");
  Room room(RoomId{1}, "bench", scene);
  RoomSeats seats(room);
  const wire::ServerControl answer = joined_answer(1, seats, seats.allocate(UserRole::kManipulator).value());
  const auto& notes = answer.joined().notes();
  ASSERT_EQ(notes.size(), 20);
  EXPECT_EQ(notes[18], "18" + std::string(395, 'x') + "…") << "400 bytes";
  EXPECT_EQ(notes[19], "and 11 more, which the server's log names");
  EXPECT_LE(answer.ByteSizeLong(), joined_answer_bound(*scene));
}

TEST(SessionHub, GivesEachManipulatorASeparateToolAndReusesItAfterALeave) {
  test::HubBench bench;
  test::BenchClient first = bench.join("ada");
  test::BenchClient second = bench.join("ben");
  EXPECT_EQ(first.joined.tool(), 0U);
  EXPECT_EQ(second.joined.tool(), 1U);
  EXPECT_EQ(bench.join("cleo").joined.user(), 0U) << "two tools, so no third manipulator";
  bench.send(first, message_of([](auto& message) { message.mutable_leave(); }));
  test::BenchClient third = bench.join("dora");
  EXPECT_EQ(third.joined.tool(), 0U);
  EXPECT_GT(third.joined.user(), second.joined.user()) << "user ids are never used again";
}

/// The refusal of a full room may propose to join as an observer only if a seat for an observer is free.
TEST(SessionHub, AFullRoomOffersAnObserversPlaceOnlyIfOneIsFree) {
  test::HubBench bench;
  for (const char* name : {"ada", "ben"}) ASSERT_NE(bench.join(name).joined.user(), 0U);
  const auto refusal_of = [&bench](const std::string& name, wire::Role role) {
    test::BenchClient late = bench.connect();
    bench.greet(late);
    bench.send(late, test::HubBench::join_message(name, role));
    std::string text;
    for (const wire::ServerControl& message : bench.drain(late)) text += message.error().text();
    return text;
  };
  EXPECT_THAT(refusal_of("cleo", wire::ROLE_MANIPULATOR), HasSubstr("join as an observer, or wait"));
  ASSERT_NE(bench.join("dora", wire::ROLE_OBSERVER).joined.user(), 0U);
  EXPECT_THAT(refusal_of("cleo", wire::ROLE_MANIPULATOR),
              AllOf(HasSubstr("a manipulator; wait"), testing::Not(HasSubstr("observer"))));
  EXPECT_THAT(refusal_of("eve", wire::ROLE_OBSERVER), HasSubstr("an observer; wait"));
}

TEST(SessionHub, AUserSeesOthersComeAndGo) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada");
  test::BenchClient eve = bench.connect();
  bench.greet(eve);
  bench.send(eve, test::HubBench::join_message("eve", wire::ROLE_OBSERVER));
  const auto for_eve = bench.drain(eve);
  ASSERT_EQ(test::described(for_eve), "joined, user_joined");
  EXPECT_EQ(for_eve[1].user_joined().name(), "ada");
  const auto for_ada = bench.drain(ada);
  ASSERT_EQ(test::described(for_ada), "user_joined");
  EXPECT_EQ(for_ada[0].user_joined().role(), wire::ROLE_OBSERVER);
  bench.hub->on_disconnected(eve.handle, bench.now);
  const auto later = bench.drain(ada);
  ASSERT_EQ(test::described(later), "user_left");
  EXPECT_EQ(later[0].user_left().reason(), wire::DISCONNECT_CONNECTION_LOST);
}

TEST(SessionHub, AnswersAGrabWithTheResultOfTheRoom) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada");
  test::BenchClient ben = bench.join("ben");
  bench.drain(ada);
  bench.send_state(ada);
  bench.send_state(ben);
  bench.step(5);
  const auto grab_one = message_of([](auto& message) { message.mutable_grab()->set_body(1); });
  bench.send(ada, grab_one);
  bench.step();
  auto answers = bench.drain(ada);
  ASSERT_EQ(test::described(answers), "grabbed");
  EXPECT_EQ(answers[0].request(), 42U);
  EXPECT_EQ(answers[0].grabbed().body(), 1U);
  bench.send(ben, grab_one);
  bench.step();
  EXPECT_EQ(test::described(bench.drain(ben)), "grabbed") << "two hands may hold the same body";
  bench.send(ben, grab_one);
  bench.step();
  EXPECT_EQ(test::described(bench.drain(ben)), "error ERROR_ALREADY_HOLDING");
  bench.send(ben, message_of([](auto& message) { message.mutable_release(); }));
  bench.step();
  EXPECT_EQ(test::described(bench.drain(ben)), "released");
}

TEST(SessionHub, ASilentUserIsRemovedAndReleasesItsGrabWithinTwoSeconds) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada");
  test::BenchClient ben = bench.join("ben");
  bench.send_state(ada);
  bench.send_state(ben);
  bench.step(5);
  bench.send(ada, message_of([](auto& message) { message.mutable_grab()->set_body(1); }));
  bench.step();
  ASSERT_EQ(bench.newest_update(ben)->bodies.at(0).held_by, UserId{ada.joined.user()});
  bench.drain(ben);
  // Ada's connection remains open without any traffic, as if a cable was unplugged. Only ben sends. The hub must end
  // ada's connection, so that her tool releases the body.
  const LocalTime vanished = bench.now;
  while (bench.hub->user_count() == 2 && bench.now - vanished < std::chrono::seconds(3)) {
    bench.send_state(ben);
    bench.step();
  }
  bench.step();
  EXPECT_LE(bench.now - vanished, std::chrono::seconds(2));
  EXPECT_GE(bench.now - vanished, HubSettings{}.silence_timeout - std::chrono::milliseconds(2));
  EXPECT_FALSE(bench.newest_update(ben)->bodies.at(0).held_by.is_valid());
  const auto received = bench.drain(ben);
  ASSERT_EQ(test::described(received), "user_left");
  EXPECT_EQ(received[0].user_left().reason(), wire::DISCONNECT_SILENCE);
  EXPECT_EQ(bench.join("cleo").joined.tool(), ada.joined.tool());
}

TEST(SessionHub, AnObserverReceivesEverythingAndMovesNothing) {
  test::HubBench bench;
  test::BenchClient eve = bench.join("eve", wire::ROLE_OBSERVER);
  EXPECT_EQ(bench.send_state(eve), eve.handle);
  bench.step(3);
  ASSERT_TRUE(bench.newest_update(eve).has_value());
  EXPECT_EQ(bench.newest_update(eve)->bodies.size(), 1U);
  proto::ClientUpdate pushy = bench.resting_input(eve);
  pushy.handle_valid = true;
  EXPECT_EQ(bench.deliver(bench.datagram_of(eve, pushy)), 0U);
  EXPECT_EQ(bench.hub->counters().received_drops.count(proto::DropReason::kNotAllowed), 1U);
  for (const auto& forbidden :
       {message_of([](auto& m) { m.mutable_grab(); }), message_of([](auto& m) { m.mutable_release(); }),
        message_of([](auto& m) { m.mutable_set_parameter()->set_name("coupling.force_limit_n"); })}) {
    bench.send(eve, forbidden);
    EXPECT_EQ(test::described(bench.drain(eve)), "error ERROR_NOT_ALLOWED");
  }
  EXPECT_EQ(bench.join("eva", wire::ROLE_OBSERVER).joined.user(), 0U) << "limits.observers is 1";
}

/// Returns a mesh file of a flat square. A comment of `comment_bytes` makes it larger than one chunk.
std::string square_obj(std::size_t comment_bytes) {
  return "# " + std::string(comment_bytes, 'x') + "\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n";
}

TEST(SessionHub, ServesAnAssetChunkByChunkToItsLastByte) {
  const auto folder = std::filesystem::path(testing::TempDir());
  const std::string bytes = square_obj(2 * proto::kAssetChunkBytes);
  std::ofstream(folder / "square.obj") << bytes;
  test::HubBench bench({}, {R"({"name": "meshes", "bodies": [{"name": "floor", "shapes": [{"mesh": {"file": ")" +
                            (folder / "square.obj").string() + R"("}}]}], "tools": [{"name": "a"}]})"});
  test::BenchClient ada = bench.join("ada");
  ASSERT_EQ(ada.joined.assets_size(), 5) << "the file, its contact fine and coarse, its surface, its drawing";
  ASSERT_EQ(ada.joined.assets(0).size_bytes(), bytes.size());
  std::string fetched;
  for (int i = 0; i < 3; ++i) {
    bench.step();
    bench.send(ada, message_of([&](auto& message) {
                 message.mutable_get_asset()->set_sha256(ada.joined.assets(0).sha256());
                 message.mutable_get_asset()->set_offset(fetched.size());
               }));
    const auto answers = bench.drain(ada);
    ASSERT_EQ(test::described(answers), "asset_chunk");
    EXPECT_LE(answers[0].asset_chunk().data().size(), proto::kAssetChunkBytes);
    fetched += answers[0].asset_chunk().data();
  }
  EXPECT_EQ(fetched, bytes);
  const auto piece_bytes = [&](std::uint32_t max_bytes, std::size_t offset) {
    bench.step();
    bench.send(ada, message_of([&](auto& message) {
                 message.mutable_get_asset()->set_sha256(ada.joined.assets(0).sha256());
                 message.mutable_get_asset()->set_offset(offset);
                 message.mutable_get_asset()->set_max_bytes(max_bytes);
               }));
    return bench.drain(ada).at(0).asset_chunk().data().size();
  };
  EXPECT_EQ(piece_bytes(1000, 7), 1000U);
  EXPECT_EQ(piece_bytes(1000, bytes.size() - 7), 7U);
  EXPECT_EQ(piece_bytes(0xFFFFFFFF, 7), proto::kAssetChunkBytes);
  bench.step();
  bench.send(ada, message_of([&](auto& message) {
               message.mutable_get_asset()->set_sha256(ada.joined.assets(0).sha256());
               message.mutable_get_asset()->set_offset(bytes.size() + 1);
             }));
  EXPECT_EQ(test::described(bench.drain(ada)), "error ERROR_BAD_VALUE");
}

/// Checks that a join with a value out of range is refused.
void expect_refused(const wire::ClientControl& join) {
  test::HubBench bench;
  test::BenchClient ada = bench.connect();
  bench.greet(ada);
  bench.send(ada, join);
  EXPECT_EQ(test::described(bench.drain(ada)), "error ERROR_BAD_VALUE, goodbye") << join.ShortDebugString();
  EXPECT_EQ(bench.hub->user_count(), 0U);
}

TEST(SessionHub, RefusesADeadbandThatHidesMoreThanItMay) {
  for (const double deadband : {-0.01, 0.51, 1e9}) {
    wire::ClientControl join = test::HubBench::join_message("ada");
    join.mutable_join()->set_deadband(deadband);
    expect_refused(join);
  }
}

TEST(SessionHub, SendsOthersTheForceLimitOfADeviceInTheWorld) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada");
  test::BenchClient ben = bench.connect();
  bench.greet(ben);
  wire::ClientControl join = test::HubBench::join_message("ben");
  join.mutable_join()->mutable_coupling_bounds()->set_force_limit_n(2);
  bench.send(ben, join);
  const auto received = bench.drain(ada);
  ASSERT_EQ(test::described(received), "user_joined");
  const wire::UserJoined& user = received[0].user_joined();
  EXPECT_EQ(user.tool(), 1U);
  const double scale = bench.rooms.front()->scene().workspaces.at(1).force_scale;
  EXPECT_EQ(user.coupling_bounds().force_limit_n(), 2 / scale);
  EXPECT_FALSE(user.coupling_bounds().has_stiffness_n_per_m()) << "it must not be mentioned";
}

TEST(SessionHub, RefusesBoundsOfACouplingThatNoDeviceHas) {
  for (const double newtons : {-1.0, 0.0, 1e9}) {
    wire::ClientControl join = test::HubBench::join_message("ada");
    join.mutable_join()->mutable_coupling_bounds()->set_force_limit_n(newtons);
    expect_refused(join);
  }
}

TEST(SessionHub, JoinedContainsTheInertiaOfEveryBodyAndTool) {
  test::HubBench bench;
  const test::BenchClient ada = bench.join("ada");
  const LoadedScene& scene = bench.rooms.front()->scene();
  ASSERT_EQ(ada.joined.body_masses_size(), static_cast<int>(scene.world.bodies.size()));
  ASSERT_EQ(ada.joined.tool_masses_size(), static_cast<int>(scene.world.tools.size()));
  const wire::MassProperties& box = ada.joined.body_masses(0);
  EXPECT_EQ(box.mass_kg(), 0.1);
  ASSERT_EQ(box.centre_size(), 7);
  ASSERT_EQ(box.principal_inertia_kg_m2_size(), 3);
  // The moment of inertia of a cube with the edge a about any axis through its centre is m a²/6.
  for (const double moment : box.principal_inertia_kg_m2()) EXPECT_NEAR(moment, 0.1 * 0.02 * 0.02 / 6, 1e-12);
}

TEST(SessionHub, AcceptsNoMoreConnectionsThanItsLimit) {
  test::HubBench bench({.max_connections = 2});
  bench.join("ada");
  test::BenchClient second = bench.join("ben");
  test::BenchClient third = bench.connect();
  EXPECT_EQ(test::described(bench.drain(third)), "error ERROR_SERVER_FULL, goodbye");
  EXPECT_TRUE(bench.transport.closed.contains(third.handle));
  bench.hub->on_disconnected(second.handle, bench.now);
  EXPECT_EQ(test::described(bench.drain(bench.connect())), "");
  EXPECT_EQ(bench.hub->connection_count(), 2U);
}

TEST(SessionHub, RandomBytesEndOnlyTheirOwnConnection) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada");
  const auto grab = message_of([](auto& message) { message.mutable_grab()->set_body(1); });
  int ended = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    test::BenchClient mallory = bench.join("mallory");
    for (int i = 0; i < 50; ++i) {
      proto::Bytes control;
      proto::append_frame(grab, control);
      proto::Bytes datagram = bench.datagram_of(mallory, bench.resting_input(mallory));
      for (proto::Bytes* bytes : {&control, &datagram}) {
        for (int flips = 0; flips < 3; ++flips) {
          (*bytes)[random.next_u32() % bytes->size()] = static_cast<std::byte>(random.next_u32());
        }
        if (random.uniform() < 0.2) bytes->resize(random.next_u32() % bytes->size());
      }
      bench.hub->on_control_bytes(mallory.handle, control, bench.now);
      bench.deliver(datagram);
      ASSERT_EQ(bench.send_state(ada), ada.handle);
      bench.step();
    }
    if (bench.hub->state_of(mallory.handle) != ConnectionState::kActive) ++ended;
    bench.hub->on_disconnected(mallory.handle, bench.now);
    ASSERT_EQ(bench.hub->state_of(ada.handle), ConnectionState::kActive);
    ASSERT_EQ(bench.hub->connection_count(), 1U);
    EXPECT_TRUE(bench.newest_update(ada).has_value());
  }
  EXPECT_GT(ended, 100) << "random bytes are seldom a message";
}

TEST(SessionHub, StoppingSendsGoodbyeToAllUsers) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada");
  test::BenchClient ben = bench.connect();
  bench.hub->stop(bench.now);
  for (const test::BenchClient& client : {ada, ben}) {
    const auto last = bench.drain(client);
    ASSERT_EQ(test::described(last), "goodbye");
    EXPECT_EQ(last[0].goodbye().reason(), wire::DISCONNECT_SERVER_STOPPING);
    EXPECT_TRUE(bench.transport.closed.contains(client.handle));
  }
  EXPECT_EQ(bench.hub->connection_count(), 0U);
}

/// Returns two_hands_scene() with a soft pad below the first tool.
std::string soft_scene() {
  std::string scene = test::two_hands_scene();
  const std::string old = "\"coupling\"";
  return scene.replace(scene.find(old), old.size(),
                       R"("soft_bodies": [{"name": "pad", "block": {"size_m": [0.06, 0.06, 0.03], "spacing_m": 0.01},
                          "placement": {"position_m": [-0.02, 0, -0.05]}, "anchored": ["-z"]}], "coupling")");
}

test::BenchClient join_with_shapes(test::HubBench& bench, const std::string& name, bool has_shapes) {
  test::BenchClient client = bench.connect();
  wire::ClientControl join = test::HubBench::join_message(name);
  join.mutable_join()->set_wants_soft_shapes(has_shapes);
  bench.greet(client);
  bench.send(client, join);
  return client;
}

std::size_t shapes_in(const std::vector<wire::ServerControl>& messages) {
  return static_cast<std::size_t>(std::ranges::count_if(messages, [](const auto& m) { return m.has_soft_shape(); }));
}

TEST(SessionHub, SendsSoftShapesOnlyOnRequestAndAfterOtherMessages) {
  test::HubBench bench({}, {soft_scene()});
  test::BenchClient ada = join_with_shapes(bench, "ada", true), ben = join_with_shapes(bench, "ben", false);
  bench.step(500);
  const auto received = bench.drain(ada);
  const std::size_t shapes = shapes_in(received);
  EXPECT_GT(shapes, 0U) << "it sags";
  EXPECT_LE(shapes, 10U) << "20 a second";
  EXPECT_EQ(shapes_in(bench.drain(ben)), 0U);
  const auto last = std::ranges::find_if(received, [](const auto& m) { return m.has_soft_shape(); });
  const auto offsets = proto::read_soft_shape(last->soft_shape());
  ASSERT_TRUE(offsets);
  EXPECT_EQ(offsets->size(), proto::kSoftLatticePoints);
  bench.transport.queued = 1;
  bench.step(500);
  EXPECT_EQ(shapes_in(bench.drain(ada)), 0U) << "something waits for the reader";
}

TEST(SessionHub, CountsRefusalsOfOldProgramsAndWhyConnectionsEnded) {
  test::HubBench bench;
  test::BenchClient old = bench.connect();
  wire::ClientControl hello;
  hello.mutable_hello()->set_protocol_version(proto::kProtocolVersion - 1);
  bench.send(old, hello);
  test::BenchClient anna = bench.join("anna");
  test::BenchClient ben = bench.join("ben", wire::ROLE_OBSERVER);
  EXPECT_EQ(bench.hub->users_in(0), (std::array<std::size_t, 3>{1, 1, 0}));
  wire::ClientControl leave;
  leave.mutable_leave();
  bench.send(anna, leave);
  bench.hub->on_disconnected(ben.handle, bench.now);
  EXPECT_EQ(bench.hub->users_in(0), (std::array<std::size_t, 3>{0, 0, 0}));
  const HubCounters& counters = bench.hub->counters();
  EXPECT_EQ(counters.refusals[wire::ERROR_WRONG_VERSION], 1U);
  EXPECT_EQ(counters.ends[wire::DISCONNECT_WRONG_VERSION], 1U);
  EXPECT_EQ(counters.ends[wire::DISCONNECT_LEFT], 1U);
  EXPECT_EQ(counters.ends[wire::DISCONNECT_CONNECTION_LOST], 1U);
}

TEST(SessionHub, MeasuresTheRoundTripByItsOwnClock) {
  test::HubBench bench;
  test::BenchClient anna = bench.join("anna");
  const auto answer_after = [&](Duration away, Duration held) {
    proto::ClientUpdate input = bench.resting_input(anna);
    input.acknowledged_sent = server_time_of_own_clock(bench.now - away);
    input.acknowledged_held = held;
    bench.deliver(bench.datagram_of(anna, input));
  };
  bench.send_state(anna);  // this state acknowledges no state of the server, so it must give no round-trip time
  EXPECT_EQ(bench.hub->counters().round_trip.count(), 0U);
  answer_after(std::chrono::milliseconds(42), std::chrono::milliseconds(2));
  answer_after(-std::chrono::hours(1), Duration{0});  // acknowledges a future state, so it must give no measurement
  EXPECT_EQ(bench.hub->counters().round_trip.count(), 1U);
  EXPECT_EQ(bench.hub->counters().round_trip.max(), std::chrono::milliseconds(40));
}

TEST(SessionHub, RecordsOneRoundTripForEachAcknowledgedState) {
  test::HubBench bench;
  test::BenchClient anna = bench.join("anna");
  const ServerTime state = server_time_of_own_clock(bench.now);
  const auto answer = [&](ServerTime acknowledged, Duration held) {
    bench.now += std::chrono::milliseconds(1);
    proto::ClientUpdate input = bench.resting_input(anna);
    input.acknowledged_sent = acknowledged;
    input.acknowledged_held = held;
    EXPECT_EQ(bench.deliver(bench.datagram_of(anna, input)), anna.handle);
    return bench.hub->counters().round_trip.count();
  };
  EXPECT_EQ(answer(state, Duration{0}), 1U);
  for (int i = 1; i < 10; ++i) EXPECT_EQ(answer(state, std::chrono::milliseconds(i)), 1U) << "the same state";
  EXPECT_EQ(answer(ServerTime{}, Duration{0}), 1U) << "no state";
  EXPECT_EQ(answer(state + std::chrono::milliseconds(5), Duration{0}), 2U);
}

}  // namespace
}  // namespace tandem::server
