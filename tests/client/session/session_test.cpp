#include "client/session/session.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "client/session/credentials.hpp"
#include "proto/join_token.hpp"
#include "tests/support/session_bench.hpp"

namespace tandem::client {
namespace {

using testing::HasSubstr;

TEST(ClientSession, ItsUserScalesAndTurnsTheScenesWorkspaceFromTheFirstJoinOn) {
  SessionSettings settings;
  settings.workspace = {.scale = 1.5, .turn_rad = 0.5};
  test::SessionBench bench(settings);
  bench.join();
  ASSERT_TRUE(bench.mailboxes.scene.poll());
  const WorkspaceMapping& received = bench.mailboxes.scene.front().workspace;
  EXPECT_EQ(received.position_scale, 3.0);
  EXPECT_EQ(received.force_scale, 0.75);
  EXPECT_NEAR(rotation_vector(received.X_WD.q).z(), 0.5, 1e-12);
}

TEST(ClientSession, PublishesTheSceneOfEachJoinAsANewGeneration) {
  test::SessionBench bench;
  bench.join();
  ASSERT_TRUE(bench.mailboxes.scene.poll());
  const HapticScene first = bench.mailboxes.scene.front();
  EXPECT_EQ(first.generation, 1U);
  EXPECT_TRUE(first.may_display);
  EXPECT_EQ(first.workspace.X_WD.p, Vec3(0.1, 0.2, 0.3));
  EXPECT_EQ(first.workspace.position_scale, 2.0);
  EXPECT_EQ(first.workspace.force_scale, 0.5);
  EXPECT_EQ(first.coupling.stiffness_n_per_m, 1.0);
  bench.session.on_disconnected(bench.now, "cut");
  ASSERT_TRUE(bench.mailboxes.scene.poll());
  EXPECT_FALSE(bench.mailboxes.scene.front().may_display) << "forces end with the connection";
  EXPECT_FALSE(bench.mailboxes.scene.front().may_drive);
  EXPECT_EQ(bench.mailboxes.scene.front().generation, 1U);
  bench.wait(std::chrono::milliseconds(250));
  bench.join();
  ASSERT_TRUE(bench.mailboxes.scene.poll());
  EXPECT_EQ(bench.mailboxes.scene.front().generation, 2U);
  EXPECT_TRUE(bench.mailboxes.scene.front().may_display);
  EXPECT_EQ(bench.session.counters().reconnects, 1U);
}

TEST(ClientSession, RefusesEveryHostileSceneByFieldAndNeverShowsIt) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  using Change = std::function<void(wire::Joined&)>;
  const std::pair<std::string, Change> changes[] = {
      {"force_scale", [](auto& j) { j.mutable_scene()->mutable_tools(0)->mutable_workspace()->set_force_scale(1e30); }},
      {"force_scale", [](auto& j) { j.mutable_scene()->mutable_tools(0)->mutable_workspace()->clear_force_scale(); }},
      {"position_scale",
       [](auto& j) { j.mutable_scene()->mutable_tools(0)->mutable_workspace()->set_position_scale(-1); }},
      {"position_m",
       [](auto& j) {
         j.mutable_scene()->mutable_tools(0)->mutable_workspace()->mutable_device_base()->add_position_m(1);
       }},
      {"position_m",
       [](auto& j) {
         j.mutable_scene()->mutable_tools(0)->mutable_workspace()->mutable_device_base()->set_position_m(1, 1e9);
       }},
      {"stiffness_n_per_m", [](auto& j) { j.mutable_scene()->mutable_coupling()->set_stiffness_n_per_m(1e9); }},
      {"force_limit_n", [](auto& j) { j.mutable_scene()->mutable_coupling()->clear_force_limit_n(); }},
      {"damping_n_s_per_m", [](auto& j) { j.mutable_scene()->mutable_coupling()->set_damping_n_s_per_m(-1); }},
      {"law", [](auto& j) { j.mutable_scene()->mutable_coupling()->set_law("magnet"); }},
      {"tool", [](auto& j) { j.set_tool(1); }},
      {"user", [](auto& j) { j.set_user(0); }},
      {"role", [](auto& j) { j.set_role(wire::ROLE_OBSERVER); }},
      {"bodies",
       [](auto& j) {
         for (std::size_t i = 0; i <= proto::kMaxBodies; ++i) j.mutable_scene()->add_bodies();
       }},
  };
  for (const auto& [field, change] : changes) {
    SCOPED_TRACE(field);
    wire::Joined joined = test::minimal_joined();
    change(joined);
    test::SessionBench bench;
    bench.join(joined);
    EXPECT_EQ(bench.state(), "ended");
    EXPECT_TRUE(bench.session.status().is_setup_error);
    EXPECT_THAT(bench.session.status().why, HasSubstr(field));
    EXPECT_FALSE(bench.mailboxes.scene.poll());
  }
  wire::Joined not_a_number = test::minimal_joined();
  not_a_number.mutable_scene()->mutable_coupling()->set_force_limit_n(nan);
  test::SessionBench bench;
  bench.join(not_a_number);
  EXPECT_EQ(bench.state(), "ended");
}

TEST(ClientSession, BacksOffByDoublingUpToItsLimitAndStartsOverAfterAJoin) {
  test::SessionBench bench;
  bench.join();
  bench.session.on_disconnected(bench.now, "cut");
  for (const int expected_ms : {250, 500, 1000, 2000, 2000}) {
    const LocalTime lost = bench.now;
    while (bench.state() == "waiting") bench.wait(std::chrono::milliseconds(1));
    EXPECT_EQ(bench.now - lost, Duration(std::chrono::milliseconds(expected_ms)));
    bench.session.on_disconnected(bench.now, "connection refused");
  }
  while (bench.state() == "waiting") bench.wait(std::chrono::milliseconds(1));
  bench.join();
  bench.session.on_disconnected(bench.now, "cut");
  bench.wait(std::chrono::milliseconds(250));
  EXPECT_EQ(bench.state(), "connecting");
}

TEST(ClientSession, ReportsThatUdpMayBeBlockedIfAJoinIsFollowedBySilence) {
  test::SessionBench bench;
  bench.join();
  bench.wait(std::chrono::milliseconds(1500));
  EXPECT_EQ(bench.state(), "waiting");
  EXPECT_THAT(bench.session.status().why, HasSubstr("--transport tcp"));
  test::SessionBench connected_bench;
  connected_bench.join();
  connected_bench.send_update();
  connected_bench.wait(std::chrono::milliseconds(1500));
  EXPECT_THAT(connected_bench.session.status().why, HasSubstr("nothing was received from the server for 1500 ms"));
}

TEST(ClientSession, TextFromTheWireCannotWriteEscapeSequences) {
  test::SessionBench bench;
  bench.session.on_connected(bench.now);
  bench.deliver_error(wire::ERROR_UNKNOWN_ROOM, "no\x1b[2J\nroom" + std::string(5000, 'x'));
  EXPECT_EQ(bench.session.status().why.find('\x1b'), std::string::npos);
  EXPECT_EQ(bench.session.status().why.find('\n'), std::string::npos);
  EXPECT_LT(bench.session.status().why.size(), 500U);
}

TEST(ClientSession, AParameterFromTheServerIsBoundedBeforeItReachesTheHand) {
  test::SessionBench bench;
  bench.join();
  bench.mailboxes.scene.poll();
  wire::ServerControl message;
  message.mutable_parameter_set()->set_name("coupling.stiffness_n_per_m");
  message.mutable_parameter_set()->set_value(123);
  bench.deliver(message);
  bench.wait(CouplingWatch::kAtLatest);
  ASSERT_TRUE(bench.mailboxes.scene.poll());
  EXPECT_EQ(bench.mailboxes.scene.front().coupling.stiffness_n_per_m, 123);
  EXPECT_EQ(bench.mailboxes.scene.front().generation, 1U) << "a parameter restarts no ramp";
  message.mutable_parameter_set()->set_value(1e12);
  bench.deliver(message);
  bench.wait(CouplingWatch::kAtLatest);
  EXPECT_FALSE(bench.mailboxes.scene.poll());
}

TEST(ClientSession, ALawFromTheServerIsTakenWhereItCanReplaceTheOneBefore) {
  test::SessionBench bench;
  bench.join();
  bench.mailboxes.scene.poll();
  const auto deliver_law = [&bench](const std::string& law) {
    wire::ServerControl message;
    message.mutable_parameter_set()->set_name("coupling.law");
    message.mutable_parameter_set()->set_text(law);
    bench.deliver(message);
    bench.wait(CouplingWatch::kQuiet);
    return bench.mailboxes.scene.poll();
  };
  ASSERT_TRUE(haptics::are_exchangeable(bench.session.law(), *haptics::find_coupling_law("qsa-dynamic")));
  ASSERT_TRUE(deliver_law("qsa-dynamic"));
  const HapticScene& scene = bench.mailboxes.scene.front();
  EXPECT_EQ(haptics::coupling_laws()[scene.law].name, "qsa-dynamic");
  EXPECT_EQ(scene.generation, 1U) << "no ramp is restarted, no model made anew";
  EXPECT_EQ(bench.session.joined()->scene().coupling().law(), "qsa-dynamic") << "a model that is made later has it";
  EXPECT_THAT(bench.news, HasSubstr("qsa-dynamic"));
  for (const char* law : {"", "hooke", "qsa-static", "direct", "\x1b[2J"}) {
    EXPECT_FALSE(deliver_law(law)) << law;
    EXPECT_EQ(bench.session.law().name, "qsa-dynamic") << law;
  }
  EXPECT_EQ(bench.session.status().state, SessionState::kActive);
}

TEST(Session, ListsTheOtherUsers) {
  test::SessionBench bench;
  bench.join();
  const auto meet = [&bench](std::uint32_t user, const std::string& name) {
    wire::ServerControl message;
    message.mutable_user_joined()->set_user(user);
    message.mutable_user_joined()->set_name(name);
    bench.deliver(message);
  };
  meet(4, "ben");
  meet(5, "eve");
  wire::ServerControl left;
  left.mutable_user_left()->set_user(4);
  bench.deliver(left);
  ASSERT_EQ(bench.session.users().size(), 1U);
  EXPECT_EQ(bench.session.users()[0].name(), "eve");
  for (std::uint32_t user = 100; user < 1000; ++user) meet(user, "x");
  EXPECT_LE(bench.session.users().size(), proto::kMaxUsers) << "however many a server tells of";
  bench.session.on_disconnected(bench.now, "cut");
  bench.wait(std::chrono::milliseconds(250));
  bench.join();
  EXPECT_TRUE(bench.session.users().empty());
}

wire::ServerControl welcome_with_rooms() {
  wire::ServerControl message;
  message.mutable_welcome()->set_protocol_version(proto::kProtocolVersion);
  message.mutable_welcome()->set_connection_id(8);
  for (const char* room : {"hall", "attic"}) message.mutable_welcome()->add_rooms(room);
  return message;
}

void greet(test::SessionBench& bench) {
  bench.session.on_connected(bench.now);
  bench.deliver(welcome_with_rooms());
}

TEST(ClientSession, GoesToAnotherRoomAndComesBackFromOneThatRefuses) {
  test::SessionBench bench({.room = "hall"});
  greet(bench);
  bench.deliver_joined();
  ASSERT_EQ(bench.state(), "active");
  EXPECT_THAT(bench.session.rooms(), testing::ElementsAre("hall", "attic"));
  bench.transport.messages.clear();
  bench.session.send(command::ChangeRoom{"attic"}, bench.now);
  EXPECT_EQ(test::described(bench.transport.messages), "leave");
  EXPECT_FALSE(bench.scene_may_display()) << "no force on the way";
  EXPECT_EQ(bench.state(), "connecting");
  bench.transport.messages.clear();
  greet(bench);
  ASSERT_EQ(test::described(bench.transport.messages), "hello, join");
  EXPECT_EQ(bench.transport.messages.back().join().room(), "attic");
  bench.deliver_error(wire::ERROR_ROOM_FULL);
  EXPECT_THAT(bench.news, HasSubstr("attic"));
  bench.transport.messages.clear();
  greet(bench);
  EXPECT_EQ(bench.transport.messages.back().join().room(), "hall");
  bench.deliver_joined();
  EXPECT_EQ(bench.state(), "active");
  bench.session.send(command::ChangeRoom{"attic"}, bench.now);
  greet(bench);
  bench.deliver_joined();
  EXPECT_EQ(bench.session.room(), "attic");
  EXPECT_EQ(bench.state(), "active");
}

/// Lets a user join the room "hall" by a token.
void join_by_token(test::SessionBench& bench) {
  bench.transport.is_encrypted = true;
  greet(bench);
  EXPECT_FALSE(bench.transport.messages.back().join().token().empty());
  wire::Joined joined = test::minimal_joined();
  joined.set_resume_credential(std::string(16, 'c'));
  bench.deliver_joined(joined);
  ASSERT_EQ(bench.state(), "active");
  bench.transport.messages.clear();
}

/// Returns a token for `room` without a valid signature. A client does not check signatures.
proto::Bytes token_for(const std::string& room) {
  wire::TokenClaims claims;
  claims.set_audience(std::string(32, 'a'));
  claims.set_role(wire::ROLE_MANIPULATOR);
  claims.set_room(room);
  claims.set_issued_ms(1'700'000'000'000);
  claims.set_expires_ms(1'700'000'060'000);
  return proto::sign_token(claims, secure::KeyPair::make(secure::KeyPair::Kind::kEd25519));
}

TEST(ClientSession, GoesToAnotherRoomByItsCredentialWhereTheTokenWasForAny) {
  test::SessionBench bench({.room = "hall", .token = token_for("")});
  join_by_token(bench);
  bench.session.send(command::ChangeRoom{"attic"}, bench.now);
  ASSERT_EQ(test::described(bench.transport.messages), "leave");
  EXPECT_TRUE(bench.transport.messages.back().leave().to_return());
  greet(bench);
  const wire::JoinRoom& join = bench.transport.messages.back().join();
  EXPECT_EQ(join.room(), "attic");
  EXPECT_EQ(join.resume().credential(), std::string(16, 'c'));
}

TEST(ClientSession, StaysWhereItsTokenIsForThatRoomAlone) {
  test::SessionBench bench({.room = "hall", .token = token_for("hall")});
  join_by_token(bench);
  bench.session.send(command::ChangeRoom{"attic"}, bench.now);
  EXPECT_TRUE(bench.transport.messages.empty());
  EXPECT_EQ(bench.state(), "active");
  EXPECT_THAT(bench.news, HasSubstr("attic"));
}

TEST(ClientSession, ASecondOneOfTheSameUserShowsWhatTheFirstHas) {
  test::SessionBench first({.room = "hall", .token = token_for("")}), second({.room = "hall"});
  second.transport.is_encrypted = true;
  EXPECT_EQ(first.session.credentials_beside(), nullptr);
  join_by_token(first);
  ASSERT_NE(first.session.credentials_beside(), nullptr);
  second.session.set_credentials(*first.session.credentials_beside());
  greet(second);
  const wire::JoinRoom& join = second.transport.messages.back().join();
  EXPECT_EQ(join.beside().credential(), std::string(16, 'c'));
  EXPECT_FALSE(join.has_resume());
  EXPECT_TRUE(join.token().empty());
  EXPECT_EQ(join.resume_key().size(), 32U) << "it needs a key to rejoin automatically";
}

TEST(ClientSession, HasAStateFromTheFirstOneOfAJoinUntilItIsLost) {
  test::SessionBench bench;
  bench.join();
  EXPECT_EQ(bench.state(), "active");
  EXPECT_FALSE(bench.session.has_state()) << "joined, but no state was received";
  bench.send_update();
  EXPECT_TRUE(bench.session.has_state());
  bench.session.on_disconnected(bench.now, "cut");
  EXPECT_FALSE(bench.session.has_state());
  bench.wait(std::chrono::milliseconds(250));
  bench.join();
  EXPECT_FALSE(bench.session.has_state()) << "states of the previous connection do not count";
}

TEST(ClientSession, CountsOfItsRequestsOnlyTheSettingsThatAreRefused) {
  test::SessionBench bench;
  bench.join();
  const auto refuse = [&bench](const wire::ClientControl& request) {
    wire::ServerControl answer;
    answer.set_request(request.request());
    answer.mutable_error()->set_code(wire::ERROR_NOT_ALLOWED);
    bench.deliver(answer);
  };
  bench.session.send(command::Release{}, bench.now);
  bench.session.send(command::SetParameter{"coupling.stiffness_n_per_m", 400}, bench.now);
  bench.session.send(command::SetLaw{"spring-damper"}, bench.now);
  ASSERT_EQ(bench.transport.messages.size(), 3U);
  refuse(bench.transport.messages[0]);
  EXPECT_EQ(bench.session.counters().refused_settings, 0U);
  refuse(bench.transport.messages[1]);
  refuse(bench.transport.messages[1]);
  refuse(bench.transport.messages[2]);
  EXPECT_EQ(bench.session.counters().refused_settings, 2U);
}

}  // namespace
}  // namespace tandem::client
