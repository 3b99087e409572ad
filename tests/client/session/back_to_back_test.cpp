// Tests real client sessions with a real session hub over simulated links.
#include <gtest/gtest.h>

#include <numbers>

#include "common/base/random.hpp"
#include "tests/support/back_to_back.hpp"
#include "tests/support/hub_bench.hpp"

namespace tandem::client {
namespace {

TEST(SessionsBackToBack, TwoHandsShareARoomAndAnObserverSeesThem) {
  test::BackToBack net(test::two_hands_scene(), std::chrono::milliseconds(10));
  test::WiredClient& ada = net.add_client({.user_name = "ada"}, std::chrono::hours(5));
  test::WiredClient& ben = net.add_client({.user_name = "ben"}, -std::chrono::seconds(3));
  test::WiredClient& eve = net.add_client({.user_name = "eve", .role = wire::ROLE_OBSERVER});
  net.run(100);
  ASSERT_EQ(ada.session.status().state, SessionState::kActive);
  ASSERT_EQ(ben.session.status().state, SessionState::kActive);
  ASSERT_EQ(eve.session.status().state, SessionState::kActive);
  for (int i = 0; i < 500; ++i) {
    ada.publish_handle({Vec3(-0.02, 0.01, 0), Quat::Identity()});
    ben.publish_handle({Vec3(0.02, -0.01, 0), Quat::Identity()});
    net.run(1);
  }
  ASSERT_NE(ada.newest(), nullptr);
  ASSERT_NE(eve.newest(), nullptr);
  EXPECT_NEAR(ada.newest()->tool.X.p.y(), 0.01, 1e-3);
  EXPECT_NEAR(ben.newest()->tool.X.p.y(), -0.01, 1e-3);
  EXPECT_EQ(ada.newest()->users.size(), 1U);
  EXPECT_EQ(eve.newest()->users.size(), 2U);
  EXPECT_NEAR(to_seconds(ada.session.clock_sync().round_trip()), 0.020, 1e-9);
  // With equal delays in both directions, the estimate of the clock offset is exact.
  EXPECT_EQ(ada.session.clock_sync().offset(ada.own_time()), Duration(-std::chrono::hours(5)));
  EXPECT_EQ(ben.session.clock_sync().offset(ben.own_time()), Duration(std::chrono::seconds(3)));
  ada.session.send(command::Grab{BodyId{1}}, ada.own_time());
  net.run(30);
  EXPECT_EQ(ada.newest()->held_body, BodyId{1});
  EXPECT_EQ(eve.newest()->bodies.at(0).held_by.value, ada.session.joined()->user());
}

/// Pose of a hand that moves down into a floor within 1 s, stays 15 mm deep for 2 s, and moves up again. It has a
/// tremor of 0.1 mm at 9 Hz.
RigidState pressing_hand(double t) {
  constexpr double kWay_m = 0.05, kTremor_m = 1e-4, kTremorRate = 2 * std::numbers::pi * 9;
  const double u = t < 1 ? t : t < 3 ? 1 : std::max(0.0, 4 - t);
  const double direction = t < 1 ? 1 : t < 3 ? 0 : -1;
  RigidState hand;
  // Minimum-jerk trajectory, which is typical of human hands.
  hand.X.p.z() = 0.04 - kWay_m * u * u * u * (10 - 15 * u + 6 * u * u) + kTremor_m * std::sin(kTremorRate * t);
  hand.V.v.z() =
      -kWay_m * direction * 30 * u * u * (1 - u) * (1 - u) + kTremor_m * kTremorRate * std::cos(kTremorRate * t);
  return hand;
}

struct Pressed {
  double sent_up = 0;  ///< fraction of updates that were sent and not suppressed by the deadband
  double sent_down = 0;
  double largest_n = 0;
};

Pressed press_on_a_floor(double deadband) {
  const std::string scene = R"({"name": "wall",
    "bodies": [{"name": "floor", "shapes": [{"box": {"size_m": [1, 1, 0.1]}}],
                "placement": {"position_m": [0, 0, -0.05]}}],
    "tools": [{"name": "t", "placement": {"position_m": [0, 0, 0.04]}}],
    "coupling": {"law": "spring-damper", "stiffness_n_per_m": 300, "damping_n_s_per_m": 3}})";
  test::BackToBack net(scene, std::chrono::milliseconds(10));
  test::WiredClient& ada = net.add_client({.user_name = "ada", .deadband = deadband});
  net.run(100);
  Pressed pressed;
  for (int ms = 0; ms < 4000; ++ms) {
    const RigidState hand = pressing_hand(1e-3 * ms);
    ada.publish_handle(hand.X, 0, hand.V);
    net.run(1);
    const proto::ServerUpdate* received = ada.newest();
    if (received == nullptr) continue;
    pressed.largest_n = std::max(pressed.largest_n, received->wrench_on_hand_W.f.norm());
  }
  const auto share = [](std::uint64_t sent, std::uint64_t suppressed) {
    return static_cast<double>(sent) / static_cast<double>(sent + suppressed);
  };
  const SessionCounters& up = ada.session.counters();
  const server::HubCounters& down = net.hub->counters();
  pressed.sent_up = share(up.datagrams_sent, up.updates_suppressed);
  pressed.sent_down = share(down.datagrams_sent, down.updates_suppressed);
  return pressed;
}

TEST(SessionsBackToBack, ADeadbandOfTenPercentSavesMostDatagramsOfPressingOnAFloorAndLittleIsFelt) {
  const Pressed all = press_on_a_floor(0);
  const Pressed thinned = press_on_a_floor(0.1);
  EXPECT_EQ(all.sent_up, 1);
  EXPECT_EQ(all.sent_down, 1);
  EXPECT_LE(thinned.sent_up, 0.15);
  EXPECT_LE(thinned.sent_down, 0.15);
  ASSERT_GT(all.largest_n, 2);
  EXPECT_NEAR(thinned.largest_n, all.largest_n, 0.1 * all.largest_n);
}

TEST(SessionsBackToBack, ASessionOverTcpIsTheSameSession) {
  test::BackToBack net(test::two_hands_scene(), std::chrono::milliseconds(10));
  net.delivers_datagrams = false;
  test::WiredClient& ada = net.add_client({.user_name = "ada", .state_over_tcp = true});
  for (int i = 0; i < 3000; ++i) {
    ada.publish_handle({Vec3(-0.02, 0.01, 0), Quat::Identity()});
    net.run(1);
  }
  EXPECT_EQ(ada.session.status().state, SessionState::kActive);
  ASSERT_NE(ada.newest(), nullptr);
  EXPECT_NEAR(ada.newest()->tool.X.p.y(), 0.01, 1e-3);
  EXPECT_GT(ada.session.counters().datagrams_received, 2900U);
}

TEST(SessionsBackToBack, AKilledServerThatComesBackIsJoinedAgain) {
  test::BackToBack net(test::two_hands_scene());
  test::WiredClient& ada = net.add_client({.user_name = "ada"});
  net.run(50);
  ASSERT_EQ(ada.session.status().state, SessionState::kActive);
  net.kill_server();
  net.run(1000);
  EXPECT_EQ(ada.session.status().state, SessionState::kWaiting);
  EXPECT_FALSE(ada.session.status().why.empty());
  net.start_server();
  net.run(2500);
  EXPECT_EQ(ada.session.status().state, SessionState::kActive);
  EXPECT_EQ(ada.session.status().why, "");
  EXPECT_EQ(ada.session.counters().reconnects, 1U);
  const auto before = ada.session.counters().datagrams_received;
  net.run(100);
  EXPECT_GE(ada.session.counters().datagrams_received, before + 99) << "and its state flows again";
}

TEST(SessionsBackToBack, SilenceOnTheStatePathIsNoticedByBothEnds) {
  test::BackToBack net(test::two_hands_scene());
  test::WiredClient& ada = net.add_client({.user_name = "ada", .may_reconnect = false});
  net.run(50);
  net.delivers_datagrams = false;
  net.run(1600);
  EXPECT_EQ(ada.session.status().state, SessionState::kEnded);
  EXPECT_FALSE(ada.session.status().is_setup_error);
  EXPECT_EQ(net.hub->user_count(), 0U);
}

TEST(SessionsBackToBack, DamagedBytesNeverCrashAndNeverLastLongerThanTheDamage) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    test::BackToBack net(test::two_hands_scene());
    test::WiredClient& ada = net.add_client({.user_name = "ada"});
    test::WiredClient& ben = net.add_client({.user_name = "ben", .state_over_tcp = true});
    net.run(50);
    ASSERT_EQ(ben.session.status().state, SessionState::kActive);
    net.damage = [&random](proto::Bytes& bytes) {
      if (bytes.empty() || random.uniform() > 0.1) return;
      bytes[random.next_u32() % bytes.size()] = static_cast<std::byte>(random.next_u32());
      if (random.uniform() < 0.1) bytes.resize(random.next_u32() % (bytes.size() + 1));
    };
    for (int i = 0; i < 3000; ++i) {
      ada.publish_handle({Vec3(-0.02, 0, 0), Quat::Identity()}, i % 100 < 50 ? 0U : 1U);
      ben.publish_handle({Vec3(0.02, 0, 0), Quat::Identity()});
      net.run(1);
    }
    net.damage = {};
    net.run(10'000);
    for (test::WiredClient* client : {&ada, &ben}) {
      // Damaged bytes may look like a refusal by the server, which ends a session with a set-up error. They must have
      // no worse effect.
      const SessionStatus& status = client->session.status();
      EXPECT_TRUE(status.state == SessionState::kActive || status.is_setup_error) << status.why;
    }
  }
}

}  // namespace
}  // namespace tandem::client
