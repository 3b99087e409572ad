#include "client/net/event_queue.hpp"

#include <gtest/gtest.h>

#include <string>

namespace tandem::client {
namespace {

TEST(EventQueue, KeepsTheNewestInTheirOrderAndCountsTheOthers) {
  EventQueue queue;
  EXPECT_TRUE(queue.is_empty());
  const std::size_t surplus = 7;
  for (std::size_t i = 0; i < EventQueue::kCapacity + surplus; ++i) queue.push(event::Log{std::to_string(i)});
  EXPECT_EQ(queue.dropped(), surplus);
  for (std::size_t i = surplus; i < EventQueue::kCapacity + surplus; ++i) {
    const std::optional<Event> event = queue.pop();
    ASSERT_TRUE(event);
    EXPECT_EQ(std::get<event::Log>(*event).text, std::to_string(i));
  }
  EXPECT_FALSE(queue.pop());
  EXPECT_EQ(queue.dropped(), surplus) << "reading must not drop events";
}

}  // namespace
}  // namespace tandem::client
