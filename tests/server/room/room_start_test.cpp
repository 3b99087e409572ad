// Tests the common start of a room's hands: the countdown, its cancellation, and the messages to users.
#include "server/room/room_start.hpp"

#include <gtest/gtest.h>

#include <set>

#include "common/base/random.hpp"
#include "tests/support/hub_bench.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Duration kCountdown = seconds(3);

ServerTime at(std::int64_t ms) {
  return ServerTime(milliseconds(ms));
}

TEST(RoomStart, IsACountdownAfterTheLastUsersHand) {
  RoomStart start({.users = 2, .countdown = kCountdown});
  EXPECT_EQ(start.message().awaited(), 2U);
  EXPECT_TRUE(start.add(UserId{1}, at(1000)));
  EXPECT_FALSE(start.add(UserId{1}, at(1500))) << "a user counts once";
  EXPECT_EQ(start.message().awaited(), 1U);
  EXPECT_EQ(start.message().starts_server_ns(), 0U);
  EXPECT_TRUE(start.add(UserId{2}, at(9000)));
  EXPECT_EQ(start.starts_at(), at(9000) + kCountdown);
  EXPECT_EQ(start.message().awaited(), 0U);
  EXPECT_FALSE(start.add(UserId{3}, at(9500))) << "a third user does not delay the start";
}

TEST(RoomStart, IsWithdrawnWhenAUserLeavesDuringTheCountdownAndStandsAfterIt) {
  RoomStart start({.users = 2, .countdown = kCountdown});
  start.add(UserId{1}, at(0));
  start.add(UserId{2}, at(0));
  EXPECT_TRUE(start.remove(UserId{1}, at(2999)));
  EXPECT_EQ(start.message().awaited(), 1U);
  EXPECT_TRUE(start.add(UserId{3}, at(5000)));
  EXPECT_FALSE(start.remove(UserId{3}, at(8000))) << "the hands have begun";
  EXPECT_EQ(start.starts_at(), at(8000));
  EXPECT_TRUE(start.remove(UserId{2}, at(9000))) << "an empty room starts anew";
  EXPECT_EQ(start.message().awaited(), 2U);
}

TEST(RoomStart, WithoutAwaitedUsersNoStartIsAnnounced) {
  RoomStart start({});
  EXPECT_FALSE(start.is_used());
  EXPECT_FALSE(start.add(UserId{1}, at(0)));
  EXPECT_FALSE(start.remove(UserId{1}, at(0)));
}

/// Independent model of the rules in the class comment of RoomStart: the users present and the time of the start.
/// RoomStart must agree with it for any sequence of events.
struct Model {
  std::size_t users;
  std::set<std::uint32_t> here{};
  std::optional<ServerTime> starts{};

  void add(std::uint32_t user, ServerTime now) {
    here.insert(user);
    if (!starts && here.size() >= users) starts = now + kCountdown;
  }
  void remove(std::uint32_t user, ServerTime now) {
    const bool was_here = here.erase(user) > 0;
    if (was_here && starts && *starts > now && here.size() < users) starts.reset();
    if (was_here && here.empty()) starts.reset();
  }
};

TEST(RoomStart, FollowsItsModelInAnySequenceOfArrivalsAndDepartures) {
  Random random(test::test_seed(1));
  for (int sequence = 0; sequence < 500; ++sequence) {
    const std::size_t users = 1 + random.next_u64() % 4;
    RoomStart start({.users = users, .countdown = kCountdown});
    Model model{users};
    std::int64_t ms = 0;
    wire::RoomStart before = start.message();
    for (int event = 0; event < 40; ++event) {
      ms += static_cast<std::int64_t>(random.next_u64() % 2500);
      const auto user = static_cast<std::uint32_t>(1 + random.next_u64() % 5);
      const bool is_arrival = random.next_u64() % 3 > 0;
      const bool has_changed = is_arrival ? start.add(UserId{user}, at(ms)) : start.remove(UserId{user}, at(ms));
      is_arrival ? model.add(user, at(ms)) : model.remove(user, at(ms));
      ASSERT_EQ(start.starts_at(), model.starts) << "sequence " << sequence << ", event " << event;
      const wire::RoomStart message = start.message();
      ASSERT_EQ(message.awaited(), model.starts ? 0 : users - std::min(users, model.here.size()));
      ASSERT_EQ(has_changed, message.SerializeAsString() != before.SerializeAsString())
          << "sequence " << sequence << ", event " << event;
      before = message;
    }
  }
}

std::vector<wire::RoomStart> starts_in(const std::vector<wire::ServerControl>& messages) {
  std::vector<wire::RoomStart> starts;
  for (const auto& message : messages) {
    if (message.has_room_start()) starts.push_back(message.room_start());
  }
  return starts;
}

TEST(SessionHub, AnnouncesTheCommonStartToAllUsers) {
  test::HubBench bench({}, {test::two_hands_scene()}, {.start = {.users = 2, .countdown = kCountdown}});
  test::BenchClient ada = bench.join("ada");
  EXPECT_EQ(ada.joined.start().awaited(), 2U);
  bench.send_state(ada);
  EXPECT_EQ(starts_in(bench.drain(ada)).at(0).awaited(), 1U);
  const test::BenchClient watching = bench.join("obs", wire::ROLE_OBSERVER);
  EXPECT_EQ(watching.joined.start().awaited(), 1U);
  test::BenchClient ben = bench.join("ben");
  bench.step(700);
  bench.send_state(ada);
  EXPECT_TRUE(starts_in(bench.drain(ada)).empty()) << "ben has joined, but no hand of his has arrived";
  bench.send_state(ben);
  const auto expected = static_cast<std::uint64_t>((bench.now + kCountdown).time_since_epoch().count());
  for (const server::ConnectionHandle user : {ada.handle, ben.handle, watching.handle}) {
    const auto starts = starts_in(std::exchange(bench.transport.messages[user], {}));
    ASSERT_EQ(starts.size(), 1U);
    EXPECT_EQ(starts[0].starts_server_ns(), expected);
  }
  bench.hub->on_disconnected(ben.handle, bench.now);
  EXPECT_EQ(starts_in(bench.drain(ada)).at(0).awaited(), 1U);
}

TEST(SessionHub, ARoomWithoutACommonStartAnnouncesNone) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada");
  EXPECT_FALSE(ada.joined.has_start());
  bench.send_state(ada);
  EXPECT_TRUE(starts_in(bench.drain(ada)).empty());
}

}  // namespace
}  // namespace tandem::server
