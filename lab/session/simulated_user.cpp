#include "lab/session/simulated_user.hpp"

#include <utility>

namespace tandem::lab {

SimulatedUser::SimulatedUser(server::Room& room, std::size_t index, devices::HandPath path, std::uint64_t seed)
    : room_(room),
      seat_(static_cast<std::uint8_t>(index)),
      device_(devices::SimDevice::default_spec(), devices::HandParameters{}, std::move(path), seed),
      workspace_(room.scene().workspaces[index]) {
  room_.post({.kind = server::RoomCommand::Kind::kJoin,
              .seat = {seat_, UserId{static_cast<std::uint32_t>(index + 1)}, server::UserRole::kManipulator, seat_}});
}

void SimulatedUser::move(LocalTime now) {
  const devices::DeviceSample sample = device_.read(now);
  proto::ClientUpdate& update = room_.input(seat_).back();
  update = proto::ClientUpdate{};
  ++tick_.value;
  update.input_tick = tick_;
  update.handle_valid = true;
  update.handle = {workspace_.world_pose(sample.X_DH), workspace_.world_twist(sample.V_DH)};
  update.buttons = sample.buttons;
  room_.input(seat_).publish();
}

Wrench SimulatedUser::feel(LocalTime now) {
  room_.output().poll();
  const Wrench on_hand_W = room_.output().front().own[seat_].wrench_on_hand_W;
  device_.write(now, workspace_.device_wrench(on_hand_W));
  return on_hand_W;
}

}  // namespace tandem::lab
