#include "server/session/session_hub.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include <filesystem>
#include <fstream>

#include "tests/support/hub_bench.hpp"

namespace tandem::server {
namespace {

using testing::AllOf;
using testing::HasSubstr;

wire::ClientControl message_of(const std::function<void(wire::ClientControl&)>& fill) {
  wire::ClientControl message;
  message.set_request(42);
  fill(message);
  return message;
}

TEST(SessionHub, TakesConnectionIdsFromItsSourceButNeverZeroOrOneInUse) {
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
  bench.take(ada);
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
    for (std::uint32_t i = 0; i < 1000; ++i) bench.send(ada, grab_any(i));
    bench.send(ben, grab_any(1));
    EXPECT_EQ(test::described(bench.take(ben)), "") << "asked of the room, not refused";
    bench.step();
    EXPECT_EQ(test::described(bench.take(ben)), round == 0 ? "grabbed" : "error ERROR_ALREADY_HOLDING");
    const auto answers = bench.take(ada);
    ASSERT_EQ(answers.size(), 1000U) << "round " << round << ": one of the room, the others busy";
    EXPECT_EQ(answers.back().request(), 0U) << "the first was asked of the room and answered after its step";
    for (std::size_t i = 0; i + 1 < answers.size(); ++i) {
      ASSERT_EQ(answers[i].error().code(), wire::ERROR_NOT_ALLOWED) << "round " << round << " answer " << i;
      ASSERT_EQ(answers[i].request(), i + 1);
    }
  }
  EXPECT_EQ(bench.hub->user_count(), 2U);
}

TEST(SessionHub, ANewcomerIsNotSentWhatItsSlotsFormerUserWasTold) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada", wire::ROLE_MANIPULATOR, "state-tcp");
  bench.step();
  bench.send(ada, message_of([](auto& message) { message.mutable_leave(); }));
  test::BenchClient ben = bench.join("ben", wire::ROLE_MANIPULATOR, "state-tcp");
  ASSERT_EQ(ben.joined.tool(), ada.joined.tool());
  bench.take(ben);
  // A step in which the room has not heard of the change: it publishes for ada, after ben has joined. What the ring
  // holds cannot be kept back here, so the room's part is played by hand.
  UserUpdate late;
  late.user = UserId{ada.joined.user()};
  late.update.step = Step{77};
  bench.now += std::chrono::milliseconds(1);
  late.update.stepped = server_time_of_own_clock(bench.now);
  bench.rooms[0]->mailboxes(0).output.publish(late);
  bench.hub->poll(bench.now);
  EXPECT_EQ(test::described(bench.take(ben)), "");
  bench.step();
  EXPECT_EQ(test::described(bench.take(ben)), "state_datagram");
}

TEST(SessionHub, TellsAnUnknownRoomWhichRoomsThereAre) {
  test::HubBench bench({}, {test::two_hands_scene("attic"), test::two_hands_scene("cellar")});
  test::BenchClient client = bench.connect();
  bench.greet(client);
  bench.send(client, test::HubBench::join_message("ada", wire::ROLE_MANIPULATOR, "garage"));
  const auto answers = bench.take(client);
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

TEST(SessionHub, RefusesNamesThatCouldSpoilALogOrAWindow) {
  const std::string allowed[] = {"ada", "Zoë", "李雷", std::string(64, 'x')};
  const std::string refused[] = {"",
                                 std::string(65, 'x'),
                                 "a\nb",
                                 "a\x1b[2J",
                                 "a\xc2\x85",
                                 "\xe2\x80\xae"
                                 "evil",
                                 "a\xe2\x80\xa8"
                                 "b",
                                 std::string("a\0b", 3)};
  for (const std::string& name : allowed) {
    test::HubBench bench;
    EXPECT_EQ(bench.join(name).joined.user(), 1U) << name;
  }
  for (const std::string& name : refused) {
    test::HubBench bench;
    EXPECT_EQ(bench.join(name).joined.user(), 0U) << testing::PrintToString(name);
    for (const std::string& line : bench.log) EXPECT_THAT(line, testing::Not(HasSubstr(name.empty() ? "\n" : name)));
  }
}

TEST(SessionHub, GivesEachManipulatorAToolOfItsOwnAndReusesItAfterALeave) {
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

TEST(SessionHub, AUserSeesOthersComeAndGo) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada");
  test::BenchClient eve = bench.connect();
  bench.greet(eve);
  bench.send(eve, test::HubBench::join_message("eve", wire::ROLE_OBSERVER));
  const auto for_eve = bench.take(eve);
  ASSERT_EQ(test::described(for_eve), "joined, user_joined");
  EXPECT_EQ(for_eve[1].user_joined().name(), "ada");
  const auto for_ada = bench.take(ada);
  ASSERT_EQ(test::described(for_ada), "user_joined");
  EXPECT_EQ(for_ada[0].user_joined().role(), wire::ROLE_OBSERVER);
  bench.hub->on_disconnected(eve.handle, bench.now);
  const auto later = bench.take(ada);
  ASSERT_EQ(test::described(later), "user_left");
  EXPECT_EQ(later[0].user_left().reason(), wire::DISCONNECT_CONNECTION_LOST);
}

TEST(SessionHub, SendsEachPublishedStepOnceWithTheFourTimeStamps) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada");
  bench.step();
  EXPECT_TRUE(bench.take_datagrams(ada).empty()) << "before its first datagram a user has no address";
  proto::ClientUpdate input = bench.resting_input(ada);
  input.sent = LocalTime(std::chrono::milliseconds(77));
  const LocalTime arrived = bench.now;
  EXPECT_EQ(bench.deliver(bench.datagram_of(ada, input)), ada.handle);
  bench.step(10);
  const auto sent = bench.take_datagrams(ada);
  ASSERT_EQ(sent.size(), 10U);
  bench.hub->poll(bench.now);
  EXPECT_TRUE(bench.take_datagrams(ada).empty()) << "nothing new was published";
  proto::ServerUpdate update;
  proto::DatagramHeader header;
  ASSERT_EQ(proto::parse_header(sent.back(), header), proto::DropReason::kNone);
  EXPECT_EQ(header.sequence, 10U);
  EXPECT_EQ(header.connection, ada.connection);
  ASSERT_EQ(proto::parse_server_update(proto::payload_of(sent.back()), update), proto::DropReason::kNone);
  EXPECT_EQ(update.echoed_sent, input.sent);
  EXPECT_EQ(update.received, server_time_of_own_clock(arrived));
  EXPECT_EQ(update.sent, server_time_of_own_clock(bench.now));
  EXPECT_EQ(update.answered_input, input.input_tick);
}

TEST(SessionHub, AnswersAGrabWithWhatTheRoomDid) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada");
  test::BenchClient ben = bench.join("ben");
  bench.take(ada);
  bench.send_state(ada);
  bench.send_state(ben);
  bench.step(5);
  const auto grab_one = message_of([](auto& message) { message.mutable_grab()->set_body(1); });
  bench.send(ada, grab_one);
  bench.step();
  auto answers = bench.take(ada);
  ASSERT_EQ(test::described(answers), "grabbed");
  EXPECT_EQ(answers[0].request(), 42U);
  EXPECT_EQ(answers[0].grabbed().body(), 1U);
  bench.send(ben, grab_one);
  bench.step();
  EXPECT_EQ(test::described(bench.take(ben)), "grabbed") << "two hands may hold the same body";
  bench.send(ben, grab_one);
  bench.step();
  EXPECT_EQ(test::described(bench.take(ben)), "error ERROR_ALREADY_HOLDING");
  bench.send(ben, message_of([](auto& message) { message.mutable_release(); }));
  bench.step();
  EXPECT_EQ(test::described(bench.take(ben)), "released");
}

TEST(SessionHub, ASilentUserIsGoneAndItsGrabFreeWithinTwoSeconds) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada");
  test::BenchClient ben = bench.join("ben");
  bench.send_state(ada);
  bench.send_state(ben);
  bench.step(5);
  bench.send(ada, message_of([](auto& message) { message.mutable_grab()->set_body(1); }));
  bench.step();
  ASSERT_EQ(bench.newest_update(ben)->bodies.at(0).held_by, UserId{ada.joined.user()});
  bench.take(ben);
  // The connection of ada stays open, as when a cable is pulled; only ben is heard.
  const LocalTime vanished = bench.now;
  while (bench.hub->user_count() == 2 && bench.now - vanished < std::chrono::seconds(3)) {
    bench.send_state(ben);
    bench.step();
  }
  bench.step();
  EXPECT_LE(bench.now - vanished, std::chrono::seconds(2));
  EXPECT_GE(bench.now - vanished, HubSettings{}.silence_timeout - std::chrono::milliseconds(2));
  EXPECT_FALSE(bench.newest_update(ben)->bodies.at(0).held_by.is_valid());
  const auto told = bench.take(ben);
  ASSERT_EQ(test::described(told), "user_left");
  EXPECT_EQ(told[0].user_left().reason(), wire::DISCONNECT_SILENCE);
  EXPECT_EQ(bench.join("cleo").joined.tool(), ada.joined.tool());
}

TEST(SessionHub, AnObserverSeesEverythingAndMovesNothing) {
  test::HubBench bench;
  test::BenchClient eve = bench.join("eve", wire::ROLE_OBSERVER);
  EXPECT_EQ(bench.send_state(eve), eve.handle);
  bench.step(3);
  ASSERT_TRUE(bench.newest_update(eve).has_value());
  EXPECT_EQ(bench.newest_update(eve)->bodies.size(), 1U);
  proto::ClientUpdate pushy = bench.resting_input(eve);
  pushy.handle_valid = true;
  EXPECT_EQ(bench.deliver(bench.datagram_of(eve, pushy)), 0U);
  EXPECT_EQ(bench.hub->counters().received_drops.of(proto::DropReason::kNotAllowed), 1U);
  for (const auto& forbidden :
       {message_of([](auto& m) { m.mutable_grab(); }), message_of([](auto& m) { m.mutable_release(); }),
        message_of([](auto& m) { m.mutable_set_parameter()->set_name("coupling.force_limit_n"); })}) {
    bench.send(eve, forbidden);
    EXPECT_EQ(test::described(bench.take(eve)), "error ERROR_NOT_ALLOWED");
  }
  EXPECT_EQ(bench.join("eva", wire::ROLE_OBSERVER).joined.user(), 0U) << "limits.observers is 1";
}

wire::ClientControl set_parameter(const std::string& name, double value) {
  return message_of([&](auto& message) {
    message.mutable_set_parameter()->set_name(name);
    message.mutable_set_parameter()->set_value(value);
  });
}

TEST(SessionHub, AParameterIsBoundedToldToAllAndKnownToNewcomers) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada");
  test::BenchClient ben = bench.join("ben");
  bench.take(ada);
  bench.send(ada, set_parameter("coupling.stiffness_n_per_m", 250));
  const auto own = bench.take(ada);
  ASSERT_EQ(test::described(own), "parameter_set");
  EXPECT_EQ(own[0].request(), 42U);
  const auto others = bench.take(ben);
  ASSERT_EQ(test::described(others), "parameter_set");
  EXPECT_EQ(others[0].request(), 0U);
  EXPECT_EQ(others[0].parameter_set().value(), 250);
  for (const double bad : {-1.0, 1e9, 100001.0}) {
    bench.send(ada, set_parameter("coupling.stiffness_n_per_m", bad));
    EXPECT_EQ(test::described(bench.take(ada)), "error ERROR_BAD_VALUE") << bad;
  }
  bench.send(ada, set_parameter("gravity", 1));
  EXPECT_EQ(test::described(bench.take(ada)), "error ERROR_UNKNOWN_PARAMETER");
  bench.send(ben, message_of([](auto& message) { message.mutable_leave(); }));
  EXPECT_EQ(bench.join("cleo").joined.scene().coupling().stiffness_n_per_m(), 250);
}

/// two_hands_scene() with another coupling.
test::HubBench bench_with_coupling(const std::string& coupling) {
  std::string scene = test::two_hands_scene();
  const std::string old = R"({"law": "spring-damper", "stiffness_n_per_m": 200, "damping_n_s_per_m": 2})";
  EXPECT_NE(scene.find(old), std::string::npos);
  return test::HubBench({}, {scene.replace(scene.find(old), old.size(), coupling)});
}

/// name → value of the parameter_set messages.
std::map<std::string, double> parameters_in(const std::vector<wire::ServerControl>& messages) {
  std::map<std::string, double> values;
  for (const wire::ServerControl& message : messages) {
    if (message.has_parameter_set()) values[message.parameter_set().name()] = message.parameter_set().value();
  }
  return values;
}

TEST(SessionHub, UnderTheAdaptiveLawOneIsToldTheStiffnessOfWhatOneHolds) {
  test::HubBench bench = bench_with_coupling(R"({"law": "adaptive", "adaptive": {
      "mass_range_kg": [0.01, 1], "stiffness_n_per_m": [100, 1000], "damping_n_s_per_m": [5]}})");
  test::BenchClient ada = bench.join("ada");
  test::BenchClient ben = bench.join("ben");
  EXPECT_DOUBLE_EQ(ada.joined.scene().coupling().stiffness_n_per_m(), 150) << "the tool's 0.05 kg";
  bench.take(ada);
  bench.send(ada, message_of([](auto& message) { message.mutable_grab()->set_body(1); }));
  bench.step();
  const auto grabbed = bench.take(ada);
  EXPECT_EQ(test::described(grabbed), "grabbed, parameter_set");
  EXPECT_EQ(parameters_in(grabbed), (std::map<std::string, double>{{"coupling.stiffness_n_per_m", 200}}));
  EXPECT_EQ(test::described(bench.take(ben)), "") << "it is ada's alone";
  bench.send(ada, set_parameter("coupling.force_limit_n", 4));
  EXPECT_EQ(parameters_in(bench.take(ben)), (std::map<std::string, double>{{"coupling.force_limit_n", 4}}));
  bench.take(ada);
  bench.send(ada, set_parameter("coupling.stiffness_n_per_m", 500));
  EXPECT_EQ(test::described(bench.take(ada)), "error ERROR_NOT_ALLOWED") << "the law chooses it";
  bench.send(ada, message_of([](auto& message) { message.mutable_release(); }));
  bench.step();
  EXPECT_EQ(parameters_in(bench.take(ada)), (std::map<std::string, double>{{"coupling.stiffness_n_per_m", 150}}));
}

TEST(SessionHub, ALostEventLeavesTheCouplingThatIsToldRight) {
  test::HubBench bench = bench_with_coupling(R"({"law": "adaptive", "adaptive": {
      "mass_range_kg": [0.01, 1], "stiffness_n_per_m": [100, 1000], "damping_n_s_per_m": [5]}})");
  test::BenchClient ada = bench.join("ada");
  bench.take(ada);
  bench.send(ada, message_of([](auto& message) { message.mutable_grab()->set_body(1); }));
  Room& room = *bench.rooms.front();
  room.step(ServerTime(room.period()));
  RoomEvent lost;
  ASSERT_TRUE(room.next_event(lost));
  EXPECT_EQ(lost.kind, RoomEvent::Kind::kGrabbed);
  bench.step();
  EXPECT_EQ(parameters_in(bench.take(ada)), (std::map<std::string, double>{{"coupling.stiffness_n_per_m", 200}}));
}

TEST(SessionHub, AMasslessToolHasDampingOnlyWhileItHoldsABody) {
  test::HubBench bench =
      bench_with_coupling(R"({"law": "qsa-static", "damping_n_s_per_m": 4, "damping_n_m_s_per_rad": 0.01})");
  test::BenchClient ada = bench.join("ada");
  EXPECT_EQ(ada.joined.scene().coupling().damping_n_s_per_m(), 0);
  bench.send(ada, message_of([](auto& message) { message.mutable_grab()->set_body(1); }));
  bench.step();
  EXPECT_EQ(parameters_in(bench.take(ada)), (std::map<std::string, double>{{"coupling.damping_n_s_per_m", 4},
                                                                           {"coupling.damping_n_m_s_per_rad", 0.01}}));
  test::BenchClient ben = bench.join("ben");
  bench.take(ada);
  bench.send(ben, set_parameter("coupling.damping_n_s_per_m", 7));
  EXPECT_EQ(parameters_in(bench.take(ada)), (std::map<std::string, double>{{"coupling.damping_n_s_per_m", 7}}));
  EXPECT_EQ(parameters_in(bench.take(ben)), (std::map<std::string, double>{{"coupling.damping_n_s_per_m", 0}}));
}

// The flat square that a scene of bytes needs; the comment makes the file larger than one chunk.
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
  ASSERT_EQ(ada.joined.assets_size(), 2) << "the file, and what contact makes of it";
  ASSERT_EQ(ada.joined.assets(0).size_bytes(), bytes.size());
  std::string fetched;
  for (int i = 0; i < 3; ++i) {
    bench.send(ada, message_of([&](auto& message) {
                 message.mutable_get_asset()->set_sha256(ada.joined.assets(0).sha256());
                 message.mutable_get_asset()->set_offset(fetched.size());
               }));
    const auto answers = bench.take(ada);
    ASSERT_EQ(test::described(answers), "asset_chunk");
    EXPECT_LE(answers[0].asset_chunk().data().size(), proto::kAssetChunkBytes);
    fetched += answers[0].asset_chunk().data();
  }
  EXPECT_EQ(fetched, bytes);
  bench.send(ada, message_of([&](auto& message) {
               message.mutable_get_asset()->set_sha256(ada.joined.assets(0).sha256());
               message.mutable_get_asset()->set_offset(bytes.size() + 1);
             }));
  EXPECT_EQ(test::described(bench.take(ada)), "error ERROR_BAD_VALUE");
}

TEST(SessionHub, DropsEachBadDatagramForItsOwnReason) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada");
  bench.send_state(ada);
  bench.send_state(ada);
  const auto reason_of = [&bench](const proto::Bytes& datagram, std::function<bool(ConnectionHandle)> may = {}) {
    const proto::DropCounters before = bench.hub->counters().received_drops;
    EXPECT_EQ(bench.hub->on_datagram(datagram, bench.now, may), 0U);
    for (int i = 1; i < static_cast<int>(proto::DropReason::kCount); ++i) {
      const auto reason = static_cast<proto::DropReason>(i);
      if (bench.hub->counters().received_drops.of(reason) > before.of(reason)) return reason;
    }
    return proto::DropReason::kNone;
  };
  const auto next = [&] { return bench.datagram_of(ada, bench.resting_input(ada)); };
  EXPECT_EQ(reason_of(proto::Bytes(10)), proto::DropReason::kTooShort);
  EXPECT_EQ(reason_of(proto::Bytes(proto::kMaxDatagramBytes + 1)), proto::DropReason::kTooLong);
  proto::Bytes server_type = next();
  server_type[0] |= std::byte{0x08};
  EXPECT_EQ(reason_of(server_type), proto::DropReason::kType);
  proto::Bytes other_epoch = next();
  other_epoch[0] ^= std::byte{0x01};
  EXPECT_EQ(reason_of(other_epoch), proto::DropReason::kUnknownConnection);
  proto::Bytes other_connection = next();
  other_connection[4] ^= std::byte{0x01};
  EXPECT_EQ(reason_of(other_connection), proto::DropReason::kUnknownConnection);
  EXPECT_EQ(reason_of(next(), [](ConnectionHandle) { return false; }), proto::DropReason::kNotAllowed);
  const proto::Bytes older = next();
  const proto::Bytes newer = next();
  ASSERT_EQ(bench.deliver(newer), ada.handle);
  EXPECT_EQ(reason_of(newer), proto::DropReason::kDuplicate);
  EXPECT_EQ(reason_of(older), proto::DropReason::kLate);
  proto::Bytes cut = next();
  cut.resize(cut.size() - 3);
  EXPECT_EQ(reason_of(cut), proto::DropReason::kMalformed);
  proto::ClientUpdate far = bench.resting_input(ada);
  far.handle.X.p.x() = 2 * proto::kMaxPositionM;
  EXPECT_EQ(reason_of(bench.datagram_of(ada, far)), proto::DropReason::kNotFinite);
  EXPECT_EQ(bench.send_state(ada), ada.handle) << "none of them shut out the good one that follows";
}

TEST(SessionHub, ADamagedDatagramFarAheadDoesNotShutOutTheGoodOnesBehindIt) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada");
  ASSERT_EQ(bench.send_state(ada), ada.handle);
  test::BenchClient damaged = ada;
  damaged.sequence += 1000;
  proto::Bytes datagram = bench.datagram_of(damaged, bench.resting_input(damaged));
  datagram.resize(datagram.size() - 1);
  EXPECT_EQ(bench.deliver(datagram), 0U);
  EXPECT_EQ(bench.send_state(ada), ada.handle);
}

TEST(SessionHub, AnotherConnectionsStateCannotBeForgedOverTcp) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada", wire::ROLE_MANIPULATOR, "state-tcp");
  test::BenchClient mallory = bench.join("mallory", wire::ROLE_MANIPULATOR, "state-tcp");
  const proto::Bytes forged = bench.datagram_of(ada, bench.resting_input(ada));
  bench.send(mallory,
             message_of([&forged](auto& message) { message.set_state_datagram(forged.data(), forged.size()); }));
  EXPECT_EQ(bench.hub->counters().received_drops.of(proto::DropReason::kNotAllowed), 1U);
}

TEST(SessionHub, StateOverTcpIsSkippedWhileControlBytesWait) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada", wire::ROLE_MANIPULATOR, "state-tcp");
  bench.step(5);
  EXPECT_EQ(bench.take(ada).size(), 5U);
  EXPECT_TRUE(bench.take_datagrams(ada).empty());
  bench.transport.queued = 1;
  bench.step(5);
  EXPECT_TRUE(bench.take(ada).empty());
  EXPECT_EQ(bench.hub->counters().sent_drops.of(proto::DropReason::kOverwritten), 5U);
  bench.transport.queued = 0;
  bench.step();
  EXPECT_EQ(test::described(bench.take(ada)), "state_datagram");
}

TEST(SessionHub, CountsWhatTheNetworkDidNotTakeAndWhatNobodySent) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada");
  bench.send_state(ada);
  bench.step();
  bench.transport.takes_datagrams = false;
  bench.step(3);
  EXPECT_EQ(bench.hub->counters().sent_drops.of(proto::DropReason::kSendFailed), 3U);
  bench.transport.takes_datagrams = true;
  for (int i = 0; i < 4; ++i) {
    bench.now += std::chrono::milliseconds(1);
    bench.rooms.front()->step(server_time_of_own_clock(bench.now));
  }
  bench.hub->poll(bench.now);
  EXPECT_EQ(bench.hub->counters().sent_drops.of(proto::DropReason::kOverwritten), 3U)
      << "of four steps the newest was sent";
  bench.send_state(ada);
  bench.send_state(ada);
  EXPECT_EQ(bench.hub->counters().received_drops.of(proto::DropReason::kOverwritten), 1U);
}

TEST(SessionHub, ANewUserNeverGetsAnUpdateMadeForTheSlotsFormerUser) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada");
  proto::ClientUpdate pulled = bench.resting_input(ada);
  pulled.handle.X.p.y() += 0.05;
  bench.deliver(bench.datagram_of(ada, pulled));
  bench.step(200);
  // Published for ada, not yet polled when she leaves and ben takes her seat and tool.
  bench.now += std::chrono::milliseconds(1);
  bench.rooms.front()->step(server_time_of_own_clock(bench.now));
  bench.send(ada, message_of([](auto& message) { message.mutable_leave(); }));
  test::BenchClient ben = bench.join("ben");
  ASSERT_EQ(ben.joined.tool(), ada.joined.tool());
  bench.send_state(ben);
  bench.hub->poll(bench.now);
  EXPECT_TRUE(bench.take_datagrams(ben).empty());
  bench.step();
  ASSERT_TRUE(bench.newest_update(ben).has_value());
  EXPECT_LT(std::abs(bench.newest_update(ben)->tool.X.p.y()), 0.01) << "the tool starts anew";
}

/// Joins with a deadband and sends its state every millisecond, at rest; returns how many updates it got in a second.
std::size_t updates_in_a_second(double deadband) {
  test::HubBench bench;
  test::BenchClient ada = bench.connect();
  bench.greet(ada);
  wire::ClientControl join = test::HubBench::join_message("ada");
  join.mutable_join()->set_deadband(deadband);
  bench.send(ada, join);
  for (const wire::ServerControl& message : bench.take(ada)) {
    if (message.has_joined()) ada.joined = message.joined();
  }
  const auto run = [&](int steps) {
    for (int i = 0; i < steps; ++i) {
      bench.send_state(ada);
      bench.step();
    }
  };
  run(200);
  bench.take_datagrams(ada);
  run(1000);
  const std::size_t sent = bench.take_datagrams(ada).size();
  EXPECT_EQ(bench.hub->counters().updates_suppressed > 0, deadband > 0);
  return sent;
}

TEST(SessionHub, WithADeadbandAUserAtRestIsToldAtTheFloorRateAndNoLess) {
  EXPECT_EQ(updates_in_a_second(0), 1000U);
  EXPECT_EQ(updates_in_a_second(0.1), 100U);
}

TEST(SessionHub, RefusesADeadbandThatHidesMoreThanItMay) {
  for (const double deadband : {-0.01, 0.51, 1e9}) {
    test::HubBench bench;
    test::BenchClient ada = bench.connect();
    bench.greet(ada);
    wire::ClientControl join = test::HubBench::join_message("ada");
    join.mutable_join()->set_deadband(deadband);
    bench.send(ada, join);
    EXPECT_EQ(test::described(bench.take(ada)), "error ERROR_BAD_VALUE, goodbye") << deadband;
    EXPECT_EQ(bench.hub->user_count(), 0U);
  }
}

TEST(SessionHub, JoinedTellsHowMassIsSpreadInEveryBodyAndTool) {
  test::HubBench bench;
  const test::BenchClient ada = bench.join("ada");
  const LoadedScene& scene = bench.rooms.front()->scene();
  ASSERT_EQ(ada.joined.body_masses_size(), static_cast<int>(scene.world.bodies.size()));
  ASSERT_EQ(ada.joined.tool_masses_size(), static_cast<int>(scene.world.tools.size()));
  const wire::MassProperties& box = ada.joined.body_masses(0);
  EXPECT_EQ(box.mass_kg(), 0.1);
  ASSERT_EQ(box.centre_size(), 7);
  ASSERT_EQ(box.principal_inertia_kg_m2_size(), 3);
  // A cube: m a²/6 about every axis.
  for (const double moment : box.principal_inertia_kg_m2()) EXPECT_NEAR(moment, 0.1 * 0.02 * 0.02 / 6, 1e-12);
}

TEST(SessionHub, TakesNoMoreConnectionsThanItsLimit) {
  test::HubBench bench({.max_connections = 2});
  bench.connect();
  test::BenchClient second = bench.connect();
  test::BenchClient third = bench.connect();
  EXPECT_EQ(test::described(bench.take(third)), "error ERROR_SERVER_FULL, goodbye");
  EXPECT_TRUE(bench.transport.closed.contains(third.handle));
  bench.hub->on_disconnected(second.handle, bench.now);
  EXPECT_EQ(test::described(bench.take(bench.connect())), "");
  EXPECT_EQ(bench.hub->connection_count(), 2U);
}

TEST(SessionHub, RandomBytesEndTheirOwnConnectionAndNobodyElses) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    test::HubBench bench;
    test::BenchClient ada = bench.join("ada");
    test::BenchClient mallory = bench.join("mallory");
    const auto grab = message_of([](auto& message) { message.mutable_grab()->set_body(1); });
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
    EXPECT_EQ(bench.hub->state_of(ada.handle), ConnectionState::kActive);
    EXPECT_TRUE(bench.newest_update(ada).has_value());
  }
}

TEST(SessionHub, StoppingSaysGoodbyeToEverybody) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada");
  test::BenchClient ben = bench.connect();
  bench.hub->stop(bench.now);
  for (const test::BenchClient& client : {ada, ben}) {
    const auto last = bench.take(client);
    ASSERT_EQ(test::described(last), "goodbye");
    EXPECT_EQ(last[0].goodbye().reason(), wire::DISCONNECT_SERVER_STOPPING);
    EXPECT_TRUE(bench.transport.closed.contains(client.handle));
  }
  EXPECT_EQ(bench.hub->connection_count(), 0U);
}

}  // namespace
}  // namespace tandem::server
