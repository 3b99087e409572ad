#include "lab/session/room_bench.hpp"

#include <algorithm>
#include <stdexcept>

#include "common/realtime/realtime.hpp"
#include "lab/session/simulated_user.hpp"

namespace tandem::lab {
namespace {

void record_touch(const server::Room& room, std::size_t users, RoomBenchResult& result) {
  std::uint32_t contacts = 0;
  for (std::size_t i = 0; i < users; ++i) {
    const physics::TouchSummary touch = room.world().touch(i);
    contacts += touch.contacts;
    result.depth_max_m = std::max(result.depth_max_m, touch.deepest_m);
    result.force_max_n = std::max({result.force_max_n, touch.force_n, touch.soft_force_n});
  }
  result.contacts_max = std::max(result.contacts_max, contacts);
}

}  // namespace

RoomBenchResult bench_room(const std::shared_ptr<const server::LoadedScene>& scene,
                           const std::vector<std::string>& hands, Duration duration) {
  constexpr std::uint64_t kSeed = 1;
  if (hands.size() > scene->world.tools.size()) {
    throw std::invalid_argument("--users " + std::to_string(hands.size()) + ": the scene has " +
                                std::to_string(scene->world.tools.size()) + " tools; ask for fewer users");
  }
  // Its hands are paths and supply no energy.
  const server::RoomOptions options{.soft_stepping = server::SoftStepping::kWorker, .controls_tool_passivity = false};
  const auto room = std::make_unique<server::Room>(RoomId{1}, scene->description.name(), scene, options);
  std::vector<std::unique_ptr<SimulatedUser>> seats;
  for (std::size_t i = 0; i < hands.size(); ++i) {
    seats.push_back(std::make_unique<SimulatedUser>(*room, i, devices::named_hand_path(hands[i]), kSeed + i));
  }
  RoomBenchResult result;
  const SteadyClock clock;
  const LocalTime begin = clock.now();
  realtime::PeriodicTimer timer(room->period(), begin);
  for (LocalTime due = timer.wait(); due < begin + duration; due = timer.wait()) {
    for (const auto& seat : seats) seat->move(due);
    const LocalTime before = clock.now();
    room->step(server_time_of_own_clock(before));
    const Duration took = clock.now() - before;
    result.step.record(took);
    if (took > room->period()) ++result.overlong;
    for (const auto& seat : seats) seat->feel(due);
    record_touch(*room, seats.size(), result);
    for (std::size_t i = 0; i < seats.size(); ++i)
      result.faults |= room->mailboxes(i).output.front().update.tick_faults;
  }
  result.lateness = timer.lateness();
  result.missed = timer.missed();
  return result;
}

}  // namespace tandem::lab
