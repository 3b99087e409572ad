#include "common/realtime/mailbox.hpp"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <thread>

#include "common/realtime/ring.hpp"

namespace tandem::realtime {
namespace {

TEST(Mailbox, ReturnsTheNewestValueOnlyOnce) {
  Mailbox<int> mailbox;
  EXPECT_FALSE(mailbox.poll());
  EXPECT_FALSE(mailbox.publish(1));
  EXPECT_TRUE(mailbox.publish(2)) << "the writer must be notified that 1 was not read";
  ASSERT_TRUE(mailbox.poll());
  EXPECT_EQ(mailbox.front(), 2);
  EXPECT_FALSE(mailbox.poll());
  EXPECT_EQ(mailbox.front(), 2) << "the last value stays readable";
  EXPECT_FALSE(mailbox.publish(3));
}

TEST(Mailbox, NeverShowsAHalfWrittenOrAnOlderValueAcrossThreads) {
  using Value = std::array<std::uint64_t, 16>;  // all elements are written equal; unequal elements reveal a torn value
  Mailbox<Value> mailbox;
  constexpr std::uint64_t kLast = 200'000;
  std::thread writer([&] {
    for (std::uint64_t i = 1; i <= kLast; ++i) {
      mailbox.back().fill(i);
      mailbox.publish();
    }
  });
  std::uint64_t newest = 0;
  while (newest < kLast) {
    if (!mailbox.poll()) continue;
    const Value value = mailbox.front();
    for (const std::uint64_t element : value) ASSERT_EQ(element, value[0]);
    ASSERT_GT(value[0], newest);
    newest = value[0];
  }
  writer.join();
}

TEST(Ring, KeepsOrderAndRefusesWhenFull) {
  Ring<int> ring(2);
  EXPECT_TRUE(ring.push(1));
  EXPECT_TRUE(ring.push(2));
  EXPECT_FALSE(ring.push(3));
  int value = 0;
  ASSERT_TRUE(ring.pop(value));
  EXPECT_EQ(value, 1);
  EXPECT_TRUE(ring.push(4));
  ASSERT_TRUE(ring.pop(value));
  EXPECT_EQ(value, 2);
  ASSERT_TRUE(ring.pop(value));
  EXPECT_EQ(value, 4);
  EXPECT_FALSE(ring.pop(value));
}

TEST(Ring, LosesNothingAcrossThreads) {
  Ring<std::uint32_t> ring(64);
  constexpr std::uint32_t kLast = 100'000;
  std::thread writer([&] {
    for (std::uint32_t i = 1; i <= kLast; ++i) {
      while (!ring.push(i)) std::this_thread::yield();
    }
  });
  for (std::uint32_t expected = 1; expected <= kLast;) {
    std::uint32_t value = 0;
    if (!ring.pop(value)) continue;
    ASSERT_EQ(value, expected);
    ++expected;
  }
  writer.join();
}

}  // namespace
}  // namespace tandem::realtime
