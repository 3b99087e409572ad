// Tests that hands start at the same time over links with different delays, in virtual time.
#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "client/client.hpp"
#include "common/base/random.hpp"
#include "devices/sim/sim_device.hpp"
#include "lab/session/session_settings.hpp"
#include "lab/session/virtual_network.hpp"
#include "tests/support/scene_of.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::lab {
namespace {

using std::chrono::milliseconds;

constexpr Duration kSlot = std::chrono::microseconds(250);

const char* const kScene = R"({"name": "three",
  "bodies": [{"name": "floor", "shapes": [{"box": {"size_m": [1, 1, 0.1]}}], "placement": {"position_m": [0, 0, -1]}}],
  "tools": [{"name": "a"}, {"name": "b", "placement": {"position_m": [0.1, 0, 0]}},
            {"name": "c", "placement": {"position_m": [0.2, 0, 0]}}],
  "coupling": {"law": "spring-damper", "stiffness_n_per_m": 200, "damping_n_s_per_m": 2}})";

/// A room, and users who join it at given times.
struct Session {
  explicit Session(const server::RoomStartSettings& start)
      : room(RoomId{1}, "lab", test::scene_of(kScene), {.start = start}), hub(hub_settings(1), {&room}, network) {}

  struct User {
    User(VirtualClientTransport& its_transport, const std::string& name)
        : transport(its_transport),
          device(devices::SimDevice::default_spec(), {}, devices::named_hand_path("press-down"), 1),
          client(settings(name), device, transport) {}
    static client::ClientSettings settings(const std::string& name) {
      client::ClientSettings settings;
      settings.session.user_name = name;
      settings.haptics.stage.name = "late-pose";
      return settings;
    }
    VirtualClientTransport& transport;
    devices::SimDevice device;
    client::Client client;
    bool has_joined = false;
  };

  User& add(const net::LinkParameters& link, std::uint64_t seed) {
    users.push_back(std::make_unique<User>(network.add_client(link, link, seed), std::to_string(users.size())));
    users.back()->client.session().start(clock.now());
    return *users.back();
  }

  void run_until(LocalTime end) {
    while (clock.now() < end) {
      clock.advance_to(clock.now() + kSlot);
      const LocalTime now = clock.now();
      const bool is_tick = now.time_since_epoch() % milliseconds(1) == Duration(0);
      network.collect(now);
      network.deliver(hub, now);
      if (is_tick) room.step(server_time_of_own_clock(now));
      hub.poll(VirtualClock(now));
      for (const auto& user : users) {
        user->transport.deliver(user->client.session(), now);
        user->has_joined |= user->client.session().status().state == client::SessionState::kActive;
        if (is_tick && user->has_joined)
          user->client.haptics().tick(now);  // as in tandem-client, the haptic loop starts after the user has joined
        user->client.poll(now);
      }
    }
  }

  VirtualClock clock;
  VirtualNetwork network{clock};
  server::Room room;
  server::SessionHub hub;
  std::vector<std::unique_ptr<User>> users;
};

net::LinkParameters link_of(Random& random) {
  net::LinkParameters link;
  link.delay = milliseconds(1 + random.next_u64() % 100);
  link.jitter = milliseconds(random.next_u64() % 6);
  link.loss = 0.05 * static_cast<double>(random.next_u64() % 2);
  return link;
}

TEST(RoomStart, HandsStartTogetherEvenIfAUserJoinsLate) {
  Random random(test::test_seed(1));
  for (int trial = 0; trial < 30; ++trial) {
    const std::size_t users = 2 + random.next_u64() % 2;
    Session session({.users = users, .countdown = std::chrono::seconds(2)});
    for (std::size_t i = 0; i < users; ++i) {
      session.add(link_of(random), 100 * static_cast<std::uint64_t>(trial) + i);
      session.run_until(session.clock.now() + milliseconds(random.next_u64() % 3000));
      if (i + 1 == users) break;
      for (const auto& user : session.users) EXPECT_GT(user->client.haptics().began_at(), session.clock.now());
    }
    session.run_until(session.clock.now() + std::chrono::seconds(3));
    const LocalTime first = session.users[0]->client.haptics().began_at();
    for (const auto& user : session.users) {
      const client::HapticCore& hand = user->client.haptics();
      ASSERT_LT(hand.began_at(), session.clock.now()) << "trial " << trial << ": it did not begin";
      // Client and server use the same clock in this test, so the true clock offset is 0. Each client's estimate of the
      // offset may be wrong by up to 5 ms, the standard deviation of the jitter. Two hands may thus start up to 10 ms
      // apart.
      EXPECT_LT(std::abs(to_seconds(hand.began_at() - first)), 0.010) << "trial " << trial;
      EXPECT_EQ(user->device.path_time(), hand.record().at - hand.began_at());
    }
  }
}

TEST(RoomStart, AHandThatHasBegunDoesNotBeginAgain) {
  Session session({.users = 1, .countdown = std::chrono::seconds(1)});
  session.add({}, 1);
  session.run_until(LocalTime(std::chrono::seconds(2)));
  const LocalTime began = session.users[0]->client.haptics().began_at();
  ASSERT_LT(began, session.clock.now());
  session.users[0]->client.session().on_disconnected(session.clock.now(), "cut");
  session.run_until(LocalTime(std::chrono::seconds(5)));
  ASSERT_EQ(session.users[0]->client.session().status().state, client::SessionState::kActive);
  EXPECT_EQ(session.users[0]->client.haptics().began_at(), began);
}

TEST(RoomStart, AHandThatJoinsAfterTheStartBeginsAtOnce) {
  Session session({.users = 1, .countdown = Duration(0)});
  session.add({}, 1);
  session.run_until(LocalTime(std::chrono::seconds(2)));
  Session::User& late = session.add({}, 2);
  session.run_until(LocalTime(std::chrono::seconds(3)));
  EXPECT_GT(late.client.haptics().began_at(), LocalTime(std::chrono::seconds(2)));
  EXPECT_LT(late.client.haptics().began_at(), LocalTime(milliseconds(2100)));
}

TEST(RoomStart, WithoutOneEachHandBeginsWithItsFirstTick) {
  Session session({});
  Session::User& user = session.add({}, 1);
  session.run_until(LocalTime(std::chrono::seconds(1)));
  EXPECT_EQ(user.device.path_time(), user.client.haptics().record().at - user.client.haptics().began_at());
  EXPECT_GT(user.device.path_time(), milliseconds(800));
}

}  // namespace
}  // namespace tandem::lab
