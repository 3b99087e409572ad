// A datagram is as old as the kernel says, however late it is read.
#include "client/net/stamped_receive.hpp"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <thread>

#include "tests/support/running_server.hpp"

namespace tandem::client {
namespace {

/// Two sockets of this machine, the first connected to the second.
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

TEST_F(StampedReceive, WhatWaitedIsAsOldAsItIs) {
  stamp_what_comes(to_);
  // The first socket of a system that wants stamps gets them a little later.
  const auto is_stamped = [this] {
    EXPECT_EQ(send(from_, "x", 1, 0), 1);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    const auto received = receive_stamped(to_, buffer_, clock_, came_);
    return received && clock_.now() - came_ > std::chrono::milliseconds(4);
  };
  ASSERT_TRUE(test::eventually(is_stamped));
  const LocalTime before = clock_.now();
  ASSERT_EQ(send(from_, "abc", 3, 0), 3);
  const LocalTime after = clock_.now();
  std::this_thread::sleep_for(std::chrono::milliseconds(60));
  const auto received = receive_stamped(to_, buffer_, clock_, came_);
  ASSERT_TRUE(received);
  EXPECT_EQ(*received, 3U);
  EXPECT_EQ(buffer_[2], std::byte{'c'});
  // The wall clock may be slewed a little against the other.
  constexpr Duration kSlack = std::chrono::milliseconds(2);
  EXPECT_GE(came_, before - kSlack);
  EXPECT_LE(came_, after + kSlack) << "and not 60 ms later, when it was read";
  EXPECT_FALSE(receive_stamped(to_, buffer_, clock_, came_));
  EXPECT_EQ(errno, EAGAIN);
}

TEST_F(StampedReceive, WithoutAStampItCameWhenItIsRead) {
  ASSERT_EQ(send(from_, "abc", 3, 0), 3);
  VirtualClock clock;
  clock.advance_to(LocalTime{std::chrono::seconds(5)});
  const auto received = receive_stamped(to_, buffer_, clock, came_);
  ASSERT_TRUE(received);
  EXPECT_EQ(came_, clock.now());
}

TEST_F(StampedReceive, OneThatIsLongerThanTheBufferIsCutToIt) {
  stamp_what_comes(to_);
  const std::array<char, 200> much{};
  ASSERT_EQ(send(from_, much.data(), much.size(), 0), 200);
  EXPECT_EQ(receive_stamped(to_, buffer_, clock_, came_), buffer_.size());
}

}  // namespace
}  // namespace tandem::client
