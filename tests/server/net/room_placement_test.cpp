// Tests the assignment of rooms to threads: few rooms may be moved, and a slow room must not delay others.
#include "server/net/room_placement.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <vector>

namespace tandem::server {
namespace {

using testing::ElementsAre;

constexpr auto kAlone = std::nullopt;

struct PlacedRoom {
  double load = 0;
  bool may_share = true;
  std::optional<std::size_t> worker;
};

/// Returns the workers of the rooms after `calls` calls of place_rooms() with two workers.
std::vector<std::optional<std::size_t>> placed(const std::vector<PlacedRoom>& rooms, int calls = 1) {
  std::vector<double> loads;
  std::vector<std::optional<std::size_t>> workers;
  for (const PlacedRoom& room : rooms) {
    loads.push_back(room.may_share ? room.load : kSharesWithNobody);
    workers.push_back(room.worker);
  }
  for (int i = 0; i < calls; ++i) place_rooms(loads, workers, 2);
  return workers;
}

TEST(RoomPlacement, ARoomThatFitsIsNotMoved) {
  EXPECT_THAT(placed({{0.1, true, 0}, {0.2, true, 1}, {0.1, true, 0}, {0.02, false, kAlone}}),
              ElementsAre(0, 1, 0, kAlone));
}

TEST(RoomPlacement, ARoomThatMayNotShareGetsASeparateThread) {
  EXPECT_THAT(placed({{4, false, 0}, {0.1, true, 0}, {0.1, true, 1}}), ElementsAre(kAlone, 0, 1));
}

TEST(RoomPlacement, ARoomThatMayShareAgainIsMovedToTheLeastLoadedWorker) {
  EXPECT_THAT(placed({{0.1, true, kAlone}, {0.3, true, 0}, {0.2, true, 1}}), ElementsAre(1, 0, 1));
  EXPECT_THAT(placed({{0.1, true, kAlone}, {0.1, true, kAlone}, {0, true, 0}}), ElementsAre(0, 1, 0));
}

TEST(RoomPlacement, NoRoomIsMovedToAWorkerThatItWouldOverload) {
  EXPECT_THAT(placed({{0.15, true, kAlone}, {0.3, true, 0}, {0.3, true, 0}, {0.3, true, 1}, {0.3, true, 1}}),
              ElementsAre(kAlone, 0, 0, 1, 1));
}

TEST(RoomPlacement, AMuchBusierWorkerPassesOneRoomToTheOther) {
  EXPECT_THAT(placed({{0.1, true, 0}, {0.15, true, 0}, {0.2, true, 0}, {0.05, true, 1}}), ElementsAre(0, 0, 1, 1));
  EXPECT_THAT(placed({{0.3, true, 0}, {0, true, 0}, {0, true, 1}}), ElementsAre(0, 0, 1))
      << "it would only turn it round";
}

TEST(RoomPlacement, ARoomOfAnOverloadedWorkerIsMovedOrGetsASeparateThread) {
  EXPECT_THAT(placed({{0.3, true, 0}, {0.3, true, 0}, {0.3, true, 0}, {0.3, true, 1}}), ElementsAre(1, 0, 0, 1));
  EXPECT_THAT(placed({{0.3, true, 0}, {0.3, true, 0}, {0.29, true, 0}, {0.4, true, 1}, {0.4, true, 1}}),
              ElementsAre(kAlone, 0, 0, 1, 1));
}

TEST(RoomPlacement, SettlesForAnyLoads) {
  std::vector<PlacedRoom> rooms;
  for (int i = 0; i < 16; ++i) rooms.push_back({0.02 + 0.01 * i, true, 0});
  EXPECT_EQ(placed(rooms, 20), placed(rooms, 21));
}

}  // namespace
}  // namespace tandem::server
