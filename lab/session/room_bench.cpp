#include "lab/session/room_bench.hpp"

#include <algorithm>
#include <stdexcept>

#include "common/realtime/realtime.hpp"
#include "devices/sim/sim_device.hpp"
#include "server/room/room.hpp"

namespace tandem::lab {
namespace {

/// One simulated person at the room's own table: no network, no client.
class SimulatedUser {
 public:
  SimulatedUser(server::Room& room, std::size_t index, const std::string& hand, std::uint64_t seed)
      : room_(room),
        seat_(static_cast<std::uint8_t>(index)),
        device_(devices::SimDevice::default_spec(), devices::HandParameters{}, devices::named_hand_path(hand), seed),
        workspace_(room.scene().workspaces[index]) {
    room_.post({.kind = server::RoomCommand::Kind::kJoin,
                .seat = {seat_, UserId{static_cast<std::uint32_t>(index + 1)}, server::UserRole::kManipulator, seat_}});
  }

  void move(LocalTime now) {
    const devices::DeviceSample sample = device_.read(now);
    proto::ClientUpdate& update = room_.mailboxes(seat_).input.back();
    update = proto::ClientUpdate{};
    ++tick_.value;
    update.input_tick = tick_;
    update.handle_valid = true;
    update.handle = {workspace_.world_pose(sample.X_DH), workspace_.world_twist(sample.V_DH)};
    update.buttons = sample.buttons;
    room_.mailboxes(seat_).input.publish();
  }

  void feel(LocalTime now) {
    if (!room_.mailboxes(seat_).output.poll()) return;
    device_.write(now, workspace_.device_wrench(room_.mailboxes(seat_).output.front().update.wrench_on_hand_W));
  }

 private:
  server::Room& room_;
  std::uint8_t seat_;
  devices::SimDevice device_;
  WorkspaceMapping workspace_;
  Tick tick_;
};

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

RoomBenchResult bench_room(const std::shared_ptr<const server::LoadedScene>& scene, const RoomBenchSettings& settings) {
  if (settings.hands.size() > scene->world.tools.size()) {
    throw std::invalid_argument("--users " + std::to_string(settings.hands.size()) + ": the scene has " +
                                std::to_string(scene->world.tools.size()) + " tools; ask for fewer users");
  }
  // Its hands are paths and supply no energy.
  const server::RoomOptions options{.soft_stepping = server::SoftStepping::kWorker, .controls_tool_passivity = false};
  const auto room = std::make_unique<server::Room>(RoomId{1}, scene->description.name(), scene, options);
  std::vector<std::unique_ptr<SimulatedUser>> seats;
  for (std::size_t i = 0; i < settings.hands.size(); ++i) {
    seats.push_back(std::make_unique<SimulatedUser>(*room, i, settings.hands[i], settings.seed + i));
  }
  RoomBenchResult result;
  const SteadyClock clock;
  const LocalTime begin = clock.now();
  realtime::PeriodicTimer timer(room->period(), begin);
  for (LocalTime due = timer.wait(); due < begin + settings.duration; due = timer.wait()) {
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
