// Tests the age of a datagram. It is computed from the kernel's time stamp, so it must not depend on when the datagram
// is read.
#include "client/net/stamped_receive.hpp"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <thread>

#include "common/base/random.hpp"
#include "tests/support/running_server.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::client {
namespace {

/// Two sockets on this machine; the first one is connected to the second.
class StampedReceive : public testing::Test {
 protected:
  StampedReceive() {
    sockaddr_in place{};
    place.sin_family = AF_INET;
    place.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(bind(to_, reinterpret_cast<sockaddr*>(&place), sizeof place), 0);
    socklen_t size = sizeof place;
    getsockname(to_, reinterpret_cast<sockaddr*>(&place), &size);
    EXPECT_EQ(connect(from_, reinterpret_cast<sockaddr*>(&place), sizeof place), 0);
  }
  ~StampedReceive() override {
    close(from_);
    close(to_);
  }

  int from_ = socket(AF_INET, SOCK_DGRAM, 0), to_ = socket(AF_INET, SOCK_DGRAM, 0);
  SteadyClock clock_;
  std::array<std::byte, 100> buffer_{};
  LocalTime came_{};
};

TEST_F(StampedReceive, ADatagramThatWaitedHasItsTrueAge) {
  StampedReceiver receiver(to_, clock_.now());
  // Sends datagrams until the kernel stamps them. It begins only some time after the system's first socket has
  // requested stamps.
  const auto is_stamped = [this, &receiver] {
    EXPECT_EQ(send(from_, "x", 1, 0), 1);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    const auto received = receiver.receive(buffer_, clock_, came_);
    return received && clock_.now() - came_ > std::chrono::milliseconds(4);
  };
  ASSERT_TRUE(test::eventually(is_stamped));
  const LocalTime before = clock_.now();
  ASSERT_EQ(send(from_, "abc", 3, 0), 3);
  const LocalTime after = clock_.now();
  std::this_thread::sleep_for(std::chrono::milliseconds(60));
  const auto received = receiver.receive(buffer_, clock_, came_);
  ASSERT_TRUE(received);
  EXPECT_EQ(*received, 3U);
  EXPECT_EQ(buffer_[2], std::byte{'c'});
  // Tolerance for the different rates of the wall clock, which gives the stamps, and the steady clock.
  constexpr Duration kSlack = std::chrono::milliseconds(2);
  EXPECT_GE(came_, before - kSlack);
  EXPECT_LE(came_, after + kSlack) << "and not 60 ms later, when it was read";
  EXPECT_FALSE(receiver.receive(buffer_, clock_, came_));
  EXPECT_EQ(errno, EAGAIN);
}

TEST_F(StampedReceive, WithoutAStampItCameSinceTheSocketWasOpened) {
  ASSERT_EQ(send(from_, "abc", 3, 0), 3);
  const LocalTime opened = clock_.now();
  StampedReceiver receiver(to_, opened);
  ASSERT_TRUE(receiver.receive(buffer_, clock_, came_));
  EXPECT_GE(came_, opened);
  EXPECT_LE(came_, clock_.now());
}

TEST_F(StampedReceive, ATooLongDatagramIsCutToTheBuffer) {
  StampedReceiver receiver(to_, clock_.now());
  const std::array<char, 200> much{};
  ASSERT_EQ(send(from_, much.data(), much.size(), 0), 200);
  EXPECT_EQ(receiver.receive(buffer_, clock_, came_), buffer_.size());
}

TEST(BelievedAge, TheAgeOfADatagramDoesNotDependOnTheWallClock) {
  Random random(test::test_seed(59));
  const auto span = [&random](double least_s, double most_s) {
    return from_seconds(std::exp(random.uniform(std::log(least_s), std::log(most_s))));
  };
  for (int trial = 0; trial < 10'000; ++trial) {
    // Age: the time that the datagram waited in the socket, 1 µs to one day. The socket was last found empty up to 1 s
    // before the datagram's arrival.
    const Duration age = span(1e-6, 86400), empty_for = age + span(1e-6, 1);
    EXPECT_EQ(believed_age(age, empty_for, empty_for), age);
    // The wall clock is shifted by up to ten years. In half of the trials it is shifted while the datagram waits, so
    // the stamp gives a wrong age. In the other half it is shifted before the datagram arrives.
    const Duration set_by = (random.uniform() < 0.5 ? 1 : -1) * span(1e-6, 3e8);
    const Duration waited = random.uniform() < 0.5 ? age + set_by : age;
    const Duration believed = believed_age(waited, empty_for, empty_for + set_by);
    EXPECT_LE(believed, empty_for) << "no datagram is older than the time since the socket was empty";
    // Tolerance for slewing of the wall clock: 5 ms plus 0.1 % of the time since the socket was empty.
    EXPECT_GE(believed, age - std::chrono::milliseconds(5) - empty_for / 1000)
        << "set by " << to_seconds(set_by) << " s";
  }
  using std::chrono::seconds;
  EXPECT_EQ(believed_age(seconds(12), seconds(13), seconds(13)), seconds(12))
      << "there is no upper limit of a plausible age";
}

TEST_F(StampedReceive, IsNoOlderThanTheSocketWasEmptyByTheOwnClock) {
  StampedReceiver warm(to_, clock_.now());
  const auto is_stamped = [this, &warm] {
    EXPECT_EQ(send(from_, "x", 1, 0), 1);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    const auto received = warm.receive(buffer_, clock_, came_);
    return received && clock_.now() - came_ > std::chrono::milliseconds(4);
  };
  ASSERT_TRUE(test::eventually(is_stamped));
  VirtualClock clock(LocalTime{std::chrono::seconds(5)});
  StampedReceiver receiver(to_, clock.now());
  ASSERT_FALSE(receiver.receive(buffer_, clock, came_)) << "it is empty";
  const LocalTime empty = clock.now();
  ASSERT_EQ(send(from_, "abc", 3, 0), 3);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  // During the 20 ms, the steady clock of this test advances by 1 ms only. The receiver must conclude that the wall
  // clock was set, and ignore the stamp.
  clock.advance_to(empty + std::chrono::milliseconds(1));
  ASSERT_TRUE(receiver.receive(buffer_, clock, came_));
  EXPECT_EQ(came_, empty);
}

}  // namespace
}  // namespace tandem::client
