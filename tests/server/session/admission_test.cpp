// Tests how the hub answers joins with a token and resumes with a credential, valid and invalid.
#include "server/session/admission.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/join_token.hpp"
#include "tests/support/hub_bench.hpp"

namespace tandem::server {
namespace {

using testing::HasSubstr;

class AdmissionTest : public testing::Test {
 protected:
  HubSettings settings() {
    HubSettings settings;
    settings.admission = AdmissionSettings{
        .audience = server_key.id(), .issuers = {issuer.public_key()}, .unix_ms = [this] { return unix_ms; }};
    return settings;
  }
  wire::TokenClaims claims() const {
    wire::TokenClaims claims;
    claims.set_audience(server_key.id().data(), 32);
    claims.set_role(wire::ROLE_MANIPULATOR);
    claims.set_issued_ms(unix_ms);
    claims.set_expires_ms(unix_ms + 60'000);
    return claims;
  }
  proto::Bytes token(const std::function<void(wire::TokenClaims&)>& change = {}) const {
    wire::TokenClaims changed = claims();
    if (change) change(changed);
    return proto::sign_token(changed, issuer);
  }

  wire::ClientControl join_by(const proto::Bytes& by, wire::Role role = wire::ROLE_UNSPECIFIED) const {
    wire::ClientControl join = test::HubBench::join_message("ada", role);
    join.mutable_join()->set_token(by.data(), by.size());
    const secure::PublicKey key = client_key.public_key();
    join.mutable_join()->set_resume_key(key.data(), key.size());
    return join;
  }
  wire::ClientControl resume_by(const test::BenchClient& client, const std::string& credential,
                                const secure::KeyPair& key) const {
    wire::ClientControl join = test::HubBench::join_message("ada", wire::ROLE_UNSPECIFIED);
    const auto exported = test::RecordingTransport::export_of(client.handle, secure::kResumeExport);
    const secure::Signature signature = key.sign(exported.secret.bytes());
    join.mutable_join()->mutable_resume()->set_credential(credential);
    join.mutable_join()->mutable_resume()->set_signature(signature.data(), signature.size());
    return join;
  }
  test::BenchClient greeted() {
    test::BenchClient client = bench->connect();
    bench->greet(client);
    return client;
  }
  /// Sends a join and returns a description of the hub's answer. After an accepted join, `in` contains the message
  /// Joined.
  std::string answer_to(const test::BenchClient& client, const wire::ClientControl& join, wire::Joined* in = nullptr) {
    bench->send(client, join);
    auto messages = bench->drain(client);
    std::erase_if(messages, [](const wire::ServerControl& message) { return message.has_user_joined(); });
    if (in != nullptr && !messages.empty()) *in = messages[0].joined();
    return test::described(messages);
  }
  std::string answer_to(const wire::ClientControl& join) { return answer_to(greeted(), join); }
  /// Returns the message with which a user joins by a second device, on the connection of `client`. The user's first
  /// device has `credential` and signs with `key`.
  wire::ClientControl join_beside(const test::BenchClient& client, const std::string& credential,
                                  const secure::KeyPair& key) const {
    wire::ClientControl join = resume_by(client, credential, key);
    join.mutable_join()->mutable_beside()->Swap(join.mutable_join()->mutable_resume());
    join.mutable_join()->clear_resume();
    const secure::PublicKey own = second_key.public_key();
    join.mutable_join()->set_resume_key(own.data(), own.size());
    return join;
  }
  void start_server(const std::vector<std::string>& scenes = {test::two_hands_scene()}) {
    bench = std::make_unique<test::HubBench>(settings(), scenes);
    bench->transport.is_encrypted = true;
  }
  void SetUp() override { start_server(); }
  /// Advances the monotonic clock and the wall clock by the same time.
  void pass(Duration duration) {
    bench->now += duration;
    unix_ms += static_cast<std::uint64_t>(duration / std::chrono::milliseconds(1));
  }
  /// Joins as a new user, who gets a credential.
  test::BenchClient joined_client(const std::function<void(wire::TokenClaims&)>& change = {}) {
    test::BenchClient client = greeted();
    EXPECT_EQ(answer_to(client, join_by(token(change)), &client.joined), "joined");
    EXPECT_EQ(client.joined.resume_credential().size(), 16U);
    return client;
  }
  std::uint64_t refusals(wire::ErrorCode code) const {
    return bench->hub->counters().refusals[static_cast<std::size_t>(code)];
  }

  std::uint64_t unix_ms = 1'700'000'000'000;
  const secure::KeyPair server_key = secure::KeyPair::make(secure::KeyPair::Kind::kP256);
  const secure::KeyPair issuer = secure::KeyPair::make(secure::KeyPair::Kind::kEd25519);
  const secure::KeyPair client_key = secure::KeyPair::make(secure::KeyPair::Kind::kEd25519);
  const secure::KeyPair second_key = secure::KeyPair::make(secure::KeyPair::Kind::kEd25519);
  std::unique_ptr<test::HubBench> bench;
};

TEST_F(AdmissionTest, WithoutATokenNobodyJoins) {
  EXPECT_EQ(answer_to(test::HubBench::join_message("ada")), "error ERROR_BAD_TOKEN, goodbye");
  EXPECT_EQ(refusals(wire::ERROR_BAD_TOKEN), 1U);
  EXPECT_EQ(bench->hub->user_count(), 0U);
}

TEST_F(AdmissionTest, ATokenLetsInOnce) {
  const proto::Bytes once = token();
  EXPECT_EQ(answer_to(join_by(once)), "joined");
  EXPECT_EQ(answer_to(join_by(once)), "error ERROR_TOKEN_USED, goodbye");
  EXPECT_EQ(refusals(wire::ERROR_TOKEN_USED), 1U);
}

TEST_F(AdmissionTest, ATokenThatGotNoSeatIsStillGood) {
  const proto::Bytes mine = token();
  const test::BenchClient a = joined_client();
  joined_client();
  EXPECT_EQ(answer_to(join_by(mine)), "error ERROR_ROOM_FULL, goodbye");
  bench->hub->on_disconnected(a.handle, bench->now);
  EXPECT_EQ(answer_to(join_by(mine)), "joined");
}

TEST_F(AdmissionTest, ExpiredEarlyForeignAndTamperedTokensAreRefusedEachForItsReason) {
  proto::Bytes tampered = token();
  tampered[tampered.size() / 2] ^= std::byte{1};
  EXPECT_EQ(answer_to(join_by(tampered)), "error ERROR_BAD_TOKEN, goodbye");
  EXPECT_EQ(answer_to(join_by(token([](auto& c) { c.set_audience(std::string(32, 'x')); }))),
            "error ERROR_BAD_TOKEN, goodbye");
  EXPECT_EQ(answer_to(join_by(token([](auto& c) { c.set_room("attic"); }))), "error ERROR_UNKNOWN_ROOM, goodbye");
  wire::ClientControl elsewhere = join_by(token([](auto& c) { c.set_room("attic"); }));
  elsewhere.mutable_join()->set_room("bench");
  EXPECT_EQ(answer_to(elsewhere), "error ERROR_NOT_ALLOWED, goodbye");
  const auto shifted = [this](std::int64_t by_ms) {
    return token([by_ms](auto& c) {
      c.set_issued_ms(c.issued_ms() + static_cast<std::uint64_t>(by_ms));
      c.set_expires_ms(c.expires_ms() + static_cast<std::uint64_t>(by_ms));
    });
  };
  EXPECT_EQ(answer_to(join_by(shifted(120'000))), "error ERROR_TOKEN_EXPIRED, goodbye") << "from the future";
  const proto::Bytes mine = token();
  pass(std::chrono::seconds(60));
  EXPECT_EQ(answer_to(join_by(mine)), "error ERROR_TOKEN_EXPIRED, goodbye");
  EXPECT_EQ(bench->hub->user_count(), 0U);
}

TEST_F(AdmissionTest, WhenTheTableIsFullAnotherTokenIsRefusedAndNoneForgotten) {
  HubSettings small = settings();
  InvitationLedger ledger({}, {}, {}, 1);
  small.admission->ledger = &ledger;
  bench = std::make_unique<test::HubBench>(small);
  bench->transport.is_encrypted = true;
  const proto::Bytes once = token();
  const test::BenchClient client = greeted();
  EXPECT_EQ(answer_to(client, join_by(once)), "joined");
  EXPECT_EQ(answer_to(join_by(token())), "error ERROR_SERVER_FULL, goodbye");
  EXPECT_EQ(answer_to(join_by(once)), "error ERROR_TOKEN_USED, goodbye");
  pass(std::chrono::seconds(60));
  EXPECT_EQ(answer_to(join_by(token())), "joined") << "the first one's time is over";
  bench.reset();  // the hub uses the ledger, so it must be destroyed first
}

TEST_F(AdmissionTest, RoleNameAndForceAreTheTokens) {
  const auto observer = [](auto& c) { c.set_role(wire::ROLE_OBSERVER); };
  EXPECT_EQ(answer_to(join_by(token(observer), wire::ROLE_MANIPULATOR)), "error ERROR_NOT_ALLOWED, goodbye");
  test::BenchClient client = greeted();
  EXPECT_EQ(answer_to(client, join_by(token(observer)), &client.joined), "joined");
  EXPECT_EQ(client.joined.role(), wire::ROLE_OBSERVER);
  bench->send(client, test::message_of([](auto& message) { message.mutable_grab(); }));
  EXPECT_EQ(test::described(bench->drain(client)), "error ERROR_NOT_ALLOWED");
  const auto limited = [](auto& c) {
    c.set_user_name("guest");
    c.set_max_force_n(1.5);
  };
  EXPECT_EQ(answer_to(join_by(token(limited))), "joined");
  const auto received = bench->drain(client);
  ASSERT_EQ(test::described(received), "user_joined");
  EXPECT_EQ(received[0].user_joined().name(), "guest");
  EXPECT_EQ(received[0].user_joined().coupling_bounds().force_limit_n(), 1.5);
}

TEST_F(AdmissionTest, WhoLostTheConnectionComesBackWithItsKeyAsWhatItWas) {
  const test::BenchClient before = joined_client();
  bench->hub->on_disconnected(before.handle, bench->now);
  bench->now += kResumeWithin - std::chrono::seconds(1);
  test::BenchClient after = greeted();
  EXPECT_EQ(answer_to(after, resume_by(after, before.joined.resume_credential(), client_key), &after.joined), "joined");
  EXPECT_EQ(after.joined.role(), wire::ROLE_MANIPULATOR);
  EXPECT_EQ(after.joined.resume_credential(), before.joined.resume_credential());
}

TEST_F(AdmissionTest, WhoIsStillHereByAnOldConnectionLeavesIt) {
  const test::BenchClient before = joined_client();
  const test::BenchClient after = greeted();
  EXPECT_EQ(answer_to(after, resume_by(after, before.joined.resume_credential(), client_key)), "joined");
  const auto received = bench->drain(before);
  ASSERT_EQ(test::described(received), "goodbye");
  EXPECT_EQ(received[0].goodbye().reason(), wire::DISCONNECT_RESUMED);
  EXPECT_EQ(bench->hub->user_count(), 1U);
}

TEST_F(AdmissionTest, AStolenCredentialIsWorthNothingWithoutItsKey) {
  const test::BenchClient victim = joined_client();
  const std::string& stolen = victim.joined.resume_credential();
  const test::BenchClient thief = greeted();
  const secure::KeyPair other = secure::KeyPair::make(secure::KeyPair::Kind::kEd25519);
  EXPECT_EQ(answer_to(thief, resume_by(thief, stolen, other)), "error ERROR_BAD_CREDENTIAL, goodbye");
  const test::BenchClient second = greeted();
  EXPECT_EQ(answer_to(second, resume_by(victim, stolen, client_key)), "error ERROR_BAD_CREDENTIAL, goodbye")
      << "a signature of another connection";
  EXPECT_EQ(refusals(wire::ERROR_BAD_CREDENTIAL), 2U);
  EXPECT_EQ(bench->hub->user_count(), 1U) << "the victim notices nothing";
}

TEST_F(AdmissionTest, ACredentialEndsWithItsTimeWithLeavingAndInAnotherRoom) {
  const test::BenchClient late = joined_client();
  bench->hub->on_disconnected(late.handle, bench->now);
  pass(kResumeWithin);
  test::BenchClient again = greeted();
  EXPECT_EQ(answer_to(again, resume_by(again, late.joined.resume_credential(), client_key)),
            "error ERROR_BAD_CREDENTIAL, goodbye");
  const test::BenchClient leaving = joined_client();
  bench->send(leaving, test::message_of([](auto& message) { message.mutable_leave(); }));
  again = greeted();
  EXPECT_EQ(answer_to(again, resume_by(again, leaving.joined.resume_credential(), client_key)),
            "error ERROR_BAD_CREDENTIAL, goodbye");
  const test::BenchClient here = joined_client([](auto& claims) { claims.set_room("bench"); });
  bench->hub->on_disconnected(here.handle, bench->now);
  again = greeted();
  wire::ClientControl elsewhere = resume_by(again, here.joined.resume_credential(), client_key);
  elsewhere.mutable_join()->set_room("attic");
  EXPECT_EQ(answer_to(again, elsewhere), "error ERROR_NOT_ALLOWED, goodbye");
}

TEST_F(AdmissionTest, ATokenForAnyRoomLetsItsUserGoFromOneToAnother) {
  start_server({test::two_hands_scene("hall"), test::two_hands_scene("attic")});
  test::BenchClient user = greeted();
  wire::ClientControl first = join_by(token());
  first.mutable_join()->set_room("hall");
  ASSERT_EQ(answer_to(user, first, &user.joined), "joined");
  const std::string credential = user.joined.resume_credential();
  for (const std::string room : {"attic", "hall", "cellar", "attic"}) {
    bench->send(user, test::message_of([](auto& message) { message.mutable_leave()->set_to_return(true); }));
    EXPECT_EQ(bench->hub->user_count(), 0U) << "his tool is free at once";
    user = greeted();
    wire::ClientControl join = resume_by(user, credential, client_key);
    join.mutable_join()->set_room(room);
    const std::string answer = answer_to(user, join, &user.joined);
    if (room == "cellar") {
      EXPECT_EQ(answer, "error ERROR_UNKNOWN_ROOM, goodbye") << "and he may go back";
      continue;
    }
    EXPECT_EQ(answer, "joined") << room;
    EXPECT_EQ(user.joined.scene().name(), room);
    EXPECT_EQ(user.joined.resume_credential(), credential);
  }
  // A user who resumes without a room name returns to the last room.
  bench->hub->on_disconnected(user.handle, bench->now);
  user = greeted();
  EXPECT_EQ(answer_to(user, resume_by(user, credential, client_key), &user.joined), "joined");
  EXPECT_EQ(user.joined.scene().name(), "attic");
}

TEST_F(AdmissionTest, ATokenForSignalsAdmitsToNoOtherRoleAndNoOtherTokenToIt) {
  const auto for_signals = [](auto& claims) { claims.set_role(wire::ROLE_SIGNAL); };
  for (const wire::Role role : {wire::ROLE_MANIPULATOR, wire::ROLE_OBSERVER, wire::ROLE_OPERATOR}) {
    EXPECT_EQ(answer_to(join_by(token(for_signals), role)), "error ERROR_NOT_ALLOWED, goodbye");
    const auto of_role = [role](auto& claims) { claims.set_role(role); };
    EXPECT_EQ(answer_to(join_by(token(of_role), wire::ROLE_SIGNAL)), "error ERROR_NOT_ALLOWED, goodbye");
    bench->now += std::chrono::seconds(1);  // fills the token buckets of the address
  }
  EXPECT_EQ(answer_to(join_by(token(for_signals))), "error ERROR_NOT_ALLOWED, goodbye") << "the room has no signals";
  const test::BenchClient first = joined_client();
  test::BenchClient second = greeted();
  wire::ClientControl join = join_beside(second, first.joined.resume_credential(), client_key);
  join.mutable_join()->set_role(wire::ROLE_SIGNAL);
  EXPECT_EQ(answer_to(second, join), "error ERROR_NOT_ALLOWED, goodbye") << "a second device is no source of signals";
}

TEST_F(AdmissionTest, ASecondDeviceJoinsBesideTheFirstWithinItsToken) {
  const test::BenchClient first = joined_client([](auto& claims) { claims.set_max_force_n(2); });
  const std::string& credential = first.joined.resume_credential();
  test::BenchClient second = greeted();
  wire::ClientControl join = join_beside(second, credential, client_key);
  join.mutable_join()->set_role(wire::ROLE_OPERATOR);
  join.mutable_join()->set_room("attic");
  ASSERT_EQ(answer_to(second, join, &second.joined), "joined");
  EXPECT_EQ(second.joined.scene().name(), "bench");
  EXPECT_EQ(second.joined.role(), wire::ROLE_MANIPULATOR);
  EXPECT_NE(second.joined.tool(), first.joined.tool());
  EXPECT_NE(second.joined.resume_credential(), credential) << "it comes back by itself";
  bool is_announced = false;
  for (const wire::ServerControl& message : bench->drain(first)) {
    is_announced = is_announced || message.user_joined().coupling_bounds().force_limit_n() == 2;
  }
  EXPECT_TRUE(is_announced) << "with no more force than the token allows";
  const test::BenchClient third = greeted();
  EXPECT_EQ(answer_to(third, join_beside(third, credential, client_key)), "error ERROR_NOT_ALLOWED, goodbye")
      << "one beside the first";
  const test::BenchClient fourth = greeted();
  EXPECT_EQ(answer_to(fourth, join_beside(fourth, second.joined.resume_credential(), second_key)),
            "error ERROR_NOT_ALLOWED, goodbye")
      << "and none beside the second";
  // The second device has lost its connection. The user may replace it by another device. The replaced device must then
  // not be able to resume.
  bench->hub->on_disconnected(second.handle, bench->now);
  test::BenchClient new_second = greeted();
  EXPECT_EQ(answer_to(new_second, join_beside(new_second, credential, client_key), &new_second.joined), "joined");
  const test::BenchClient late = greeted();
  EXPECT_EQ(answer_to(late, resume_by(late, second.joined.resume_credential(), second_key)),
            "error ERROR_BAD_CREDENTIAL, goodbye");
}

TEST_F(AdmissionTest, ASecondDeviceNeedsTheFirstOnesKeyAndPresence) {
  const test::BenchClient first = joined_client();
  const test::BenchClient thief = greeted();
  EXPECT_EQ(answer_to(thief, join_beside(thief, first.joined.resume_credential(), second_key)),
            "error ERROR_BAD_CREDENTIAL, goodbye");
  bench->hub->on_disconnected(first.handle, bench->now);
  const test::BenchClient early = greeted();
  EXPECT_EQ(answer_to(early, join_beside(early, first.joined.resume_credential(), client_key)),
            "error ERROR_BAD_CREDENTIAL, goodbye");
}

TEST_F(AdmissionTest, WhoIsKickedGoesWithBothDevicesAlsoAfterARestart) {
  wire::AdmissionState kept;
  bench->hub->on_admission = [&kept](const wire::AdmissionState& state) { kept = state; };
  const test::BenchClient first = joined_client([](auto& claims) { claims.set_room("bench"); });
  test::BenchClient second = greeted();
  ASSERT_EQ(answer_to(second, join_beside(second, first.joined.resume_credential(), client_key), &second.joined),
            "joined");
  bench->hub->poll(VirtualClock(bench->now));
  Admission again({.audience = server_key.id(),
                   .issuers = {issuer.public_key()},
                   .unix_ms = [this] { return unix_ms; },
                   .resumed = kept});
  const auto id_of = [](const test::BenchClient& client) {
    Admission::Id id{};
    std::ranges::copy(std::as_bytes(std::span(client.joined.resume_credential())), id.begin());
    return id;
  };
  EXPECT_EQ(again.revoke(id_of(first)), id_of(second));
  test::BenchClient operator_client = greeted();
  // The room has only two tools. The second device leaves, so that a tool is free for the operator.
  bench->hub->on_disconnected(second.handle, bench->now);
  EXPECT_EQ(answer_to(operator_client, join_by(token([](auto& c) { c.set_role(wire::ROLE_OPERATOR); }))), "joined");
  bench->send(operator_client,
              test::message_of([&](auto& message) { message.mutable_kick()->set_user(first.joined.user()); }));
  const test::BenchClient late = greeted();
  EXPECT_EQ(answer_to(late, resume_by(late, second.joined.resume_credential(), second_key)),
            "error ERROR_BAD_CREDENTIAL, goodbye");
}

TEST_F(AdmissionTest, WhoIsKickedByTheSecondDeviceGoesWithBoth) {
  std::string scene = test::two_hands_scene();
  scene.insert(scene.find(R"({"name": "b")"), R"({"name": "c", "placement": {"position_m": [0, 0.05, 0]}}, )");
  start_server({scene});
  const test::BenchClient first = joined_client();
  test::BenchClient second = greeted();
  ASSERT_EQ(answer_to(second, join_beside(second, first.joined.resume_credential(), client_key), &second.joined),
            "joined");
  test::BenchClient operator_client = greeted();
  ASSERT_EQ(answer_to(operator_client, join_by(token([](auto& c) { c.set_role(wire::ROLE_OPERATOR); }))), "joined");
  bench->send(operator_client,
              test::message_of([&](auto& message) { message.mutable_kick()->set_user(second.joined.user()); }));
  EXPECT_EQ(bench->hub->user_count(), 1U);
  const test::BenchClient again = greeted();
  EXPECT_EQ(answer_to(again, join_beside(again, first.joined.resume_credential(), client_key)),
            "error ERROR_BAD_CREDENTIAL, goodbye");
}

TEST_F(AdmissionTest, WhoLeavesTakesTheSecondDeviceAlong) {
  const test::BenchClient first = joined_client();
  test::BenchClient second = greeted();
  ASSERT_EQ(answer_to(second, join_beside(second, first.joined.resume_credential(), client_key)), "joined");
  bench->send(first, test::message_of([](auto& message) { message.mutable_leave(); }));
  EXPECT_EQ(bench->hub->user_count(), 0U);
}

TEST_F(AdmissionTest, WhoIsKickedDoesNotComeBack) {
  test::BenchClient operator_client = greeted();
  EXPECT_EQ(answer_to(operator_client, join_by(token([](auto& c) { c.set_role(wire::ROLE_OPERATOR); }))), "joined");
  const test::BenchClient kicked = joined_client();
  bench->send(operator_client,
              test::message_of([&](auto& message) { message.mutable_kick()->set_user(kicked.joined.user()); }));
  const test::BenchClient again = greeted();
  EXPECT_EQ(answer_to(again, resume_by(again, kicked.joined.resume_credential(), client_key)),
            "error ERROR_BAD_CREDENTIAL, goodbye");
}

TEST_F(AdmissionTest, AServerThatGoesOnKnowsWhoMayComeBackToWhichTool) {
  wire::AdmissionState kept;
  const auto keep = [this, &kept] {
    bench->hub->on_admission = [&kept](const wire::AdmissionState& state) { kept = state; };
  };
  keep();
  const test::BenchClient lost = joined_client(), here = joined_client();
  ASSERT_EQ(here.joined.tool(), 1U);
  bench->hub->on_disconnected(lost.handle, bench->now);
  bench->now += kResumeWithin - std::chrono::seconds(10);
  unix_ms += static_cast<std::uint64_t>((kResumeWithin - std::chrono::seconds(10)) / std::chrono::milliseconds(1));
  bench->hub->poll(VirtualClock(bench->now));  // the other clients are silent and time out
  const auto restart = [&] {
    HubSettings resumed = settings();
    ASSERT_TRUE(resumed.admission->resumed.ParseFromString(kept.SerializeAsString()));
    bench = std::make_unique<test::HubBench>(resumed);
    bench->transport.is_encrypted = true;
    keep();
  };
  unix_ms += 1000;
  restart();
  test::BenchClient again = greeted();
  EXPECT_EQ(answer_to(again, resume_by(again, here.joined.resume_credential(), client_key), &again.joined), "joined");
  EXPECT_EQ(again.joined.tool(), 1U) << "the one he had, though the first is free";
  again = greeted();
  EXPECT_EQ(answer_to(again, resume_by(again, lost.joined.resume_credential(), client_key), &again.joined), "joined");
  EXPECT_EQ(again.joined.tool(), 0U);
  bench->hub->on_disconnected(again.handle, bench->now);
  bench->hub->poll(VirtualClock(bench->now));
  unix_ms += static_cast<std::uint64_t>(kResumeWithin / std::chrono::milliseconds(1));
  restart();
  again = greeted();
  EXPECT_EQ(answer_to(again, resume_by(again, lost.joined.resume_credential(), client_key)),
            "error ERROR_BAD_CREDENTIAL, goodbye")
      << "the time goes on while no server runs";
}

TEST_F(AdmissionTest, WithoutKeysForItsDatagramsNobodyIsIn) {
  bench->transport.is_encrypted = false;
  EXPECT_EQ(answer_to(join_by(token())), "goodbye") << "its state would go out as it is";
  EXPECT_EQ(bench->hub->user_count(), 0U);
}

TEST_F(AdmissionTest, WhoIsRefusedWhenHeComesBackHasNoMoreTimeThanOthers) {
  const test::BenchClient before = joined_client(), after = greeted();
  wire::ClientControl bad = resume_by(after, before.joined.resume_credential(), client_key);
  bad.mutable_join()->set_deadband(9);
  EXPECT_EQ(answer_to(after, bad), "error ERROR_BAD_VALUE, goodbye");
  bench->now += kResumeWithin;
  const test::BenchClient late = greeted();
  EXPECT_EQ(answer_to(late, resume_by(late, before.joined.resume_credential(), client_key)),
            "error ERROR_BAD_CREDENTIAL, goodbye");
}

}  // namespace
}  // namespace tandem::server
