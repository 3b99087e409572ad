#include "client/view/figures.hpp"

#include <gtest/gtest.h>

namespace tandem::client {
namespace {

TickRecord tick_at(LocalTime at, double force_n) {
  static std::uint64_t number = 0;
  TickRecord record;
  record.tick = Tick{++number};
  record.at = at;
  record.displayed_on_hand_D.f.z() = force_n;
  return record;
}

TEST(Figures, ACurveLosesNoPeakBetweenTwoOfItsValues) {
  Figures figures;
  LocalTime now{std::chrono::seconds(1)};
  for (int i = 0; i < 1000; ++i) figures.add(tick_at(now += std::chrono::milliseconds(1), i == 503 ? 3 : 1));
  EXPECT_EQ(figures.force_n.largest(), 3);
  EXPECT_EQ(figures.force_n.newest(), 1);
  EXPECT_NEAR(figures.longest_tick_ms.largest(), 1, 1e-6);
  figures.add(tick_at(now += std::chrono::milliseconds(30), 1));
  EXPECT_NEAR(figures.longest_tick_ms.largest(), 30, 1e-6);
}

TEST(Figures, JitterIsTheSpreadOfTheWayAndNotItsLengthNorTheOffsetOfClocks) {
  for (const bool is_steady : {true, false}) {
    Figures figures;
    View view;
    view.has_state = true;
    LocalTime now{std::chrono::seconds(100)};
    for (std::uint64_t i = 1; i < 200; ++i) {
      now += std::chrono::milliseconds(10);
      const Duration way = std::chrono::milliseconds(is_steady || i % 2 == 0 ? 40 : 50);
      view.newest.update.step = Step{i};
      view.newest.update.sent = ServerTime{now.time_since_epoch() - way + std::chrono::hours(5)};
      view.newest.received = now;
      figures.add(&view, {}, now);
    }
    EXPECT_NEAR(figures.jitter_ms, is_steady ? 0 : 5, 0.1);
  }
}

TEST(Figures, LossIsThatOfTheLastTwoSeconds) {
  Figures figures;
  ClientIoSnapshot io;
  LocalTime now{std::chrono::seconds(1)};
  const auto run = [&](double seconds, std::uint64_t lost_of_ten) {
    for (int i = 0; i < seconds * 50; ++i) {
      now += std::chrono::milliseconds(20);
      io.links.down.sent += 10;
      io.links.down.lost += lost_of_ten;
      figures.add(nullptr, io, now);
    }
  };
  run(3, 2);
  EXPECT_NEAR(figures.loss_down, 0.2, 1e-9);
  EXPECT_EQ(figures.loss_up, 0);
  run(3, 0);
  EXPECT_EQ(figures.loss_down, 0);
}

}  // namespace
}  // namespace tandem::client
