#include "common/realtime/handover.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <thread>

namespace tandem::realtime {
namespace {

/// Object that counts its living instances.
struct Counted {
  explicit Counted(std::uint32_t its_generation) : generation(its_generation) { ++alive; }
  Counted(const Counted&) = delete;
  ~Counted() {
    generation = 0;
    --alive;
  }
  std::uint32_t generation;
  static inline std::atomic<int> alive{0};
};

bool offer_one(Handover<Counted>& handover, std::uint32_t generation) {
  auto object = std::make_unique<Counted>(generation);
  return handover.offer(generation, object);
}

TEST(Handover, TheUserSeesOnlyTheObjectOfTheGenerationItEntered) {
  Handover<Counted> handover;
  EXPECT_EQ(handover.get(), nullptr);
  ASSERT_TRUE(offer_one(handover, 1));
  EXPECT_EQ(handover.get(), nullptr) << "not entered yet";
  handover.enter(1);
  ASSERT_NE(handover.get(), nullptr);
  EXPECT_EQ(handover.get()->generation, 1U);
  handover.enter(2);
  EXPECT_EQ(handover.get(), nullptr) << "generation 2 has none yet, and that of 1 is not its";
  ASSERT_TRUE(offer_one(handover, 2));
  EXPECT_EQ(handover.get()->generation, 2U);
  handover.enter(3);
  EXPECT_EQ(handover.get(), nullptr) << "the slot of 3 has the object of 1";
}

TEST(Handover, NothingIsFreedThatTheUserMayStillUse) {
  Handover<Counted> handover;
  ASSERT_TRUE(offer_one(handover, 1));
  handover.enter(1);
  ASSERT_TRUE(offer_one(handover, 2));
  auto third = std::make_unique<Counted>(3);
  EXPECT_FALSE(handover.offer(3, third)) << "the user is in 1";
  ASSERT_NE(third, nullptr) << "and may be offered again";
  EXPECT_EQ(Counted::alive, 3);
  EXPECT_EQ(handover.get()->generation, 1U);
  handover.enter(3);
  EXPECT_TRUE(handover.offer(3, third));
  EXPECT_EQ(Counted::alive, 2) << "that of 1 was freed by the maker";
  EXPECT_EQ(handover.get()->generation, 3U);
}

TEST(Handover, UnusedObjectsDoNotBlockLaterOffers) {
  Handover<Counted> handover;
  ASSERT_TRUE(offer_one(handover, 1));
  ASSERT_TRUE(offer_one(handover, 2));
  EXPECT_FALSE(offer_one(handover, 3)) << "the user has not begun";
  handover.enter(3);
  EXPECT_TRUE(offer_one(handover, 3));
  EXPECT_EQ(handover.get()->generation, 3U);
}

TEST(Handover, NeverShowsAFreedOrAnotherGenerationsObjectAcrossThreads) {
  constexpr std::uint32_t kLast = 2'000;
  Handover<Counted> handover;
  std::atomic<std::uint32_t> newest{0};
  std::thread maker([&] {
    for (std::uint32_t generation = 1; generation <= kLast; ++generation) {
      newest.store(generation, std::memory_order_release);
      auto object = std::make_unique<Counted>(generation);
      while (!handover.offer(generation, object)) std::this_thread::yield();
    }
  });
  std::uint32_t seen = 0;
  std::uint32_t entered = 0;
  std::uint64_t wrong = 0;
  while (seen < kLast) {
    const std::uint32_t now = newest.load(std::memory_order_acquire);
    if (now != entered) handover.enter(entered = now);
    const Counted* const object = handover.get();
    if (object == nullptr) {
      std::this_thread::yield();
      continue;
    }
    wrong += object->generation != entered ? 1 : 0;
    seen = entered;
  }
  maker.join();
  EXPECT_EQ(wrong, 0U);
  EXPECT_LE(Counted::alive, 2);
}

}  // namespace
}  // namespace tandem::realtime
