#include "server/recording/room_recorder.hpp"

#include <algorithm>
#include <cmath>

#include "common/docking/molecular_field.hpp"
#include "proto/recording/schema.hpp"

namespace tandem::server {
namespace {

std::vector<recording::Channel> channels() {
  return {proto::channel_of("/room", wire::RecordedRoom()), proto::channel_of("/step", wire::RecordedStep()),
          proto::channel_of("/states", wire::RecordedStates())};
}

std::string field_kernel_of(const LoadedScene& scene) {
  const auto molecules =
      std::ranges::count_if(scene.world.bodies, [](const auto& body) { return body.molecule != nullptr; });
  return molecules < 2 ? std::string() : std::string(docking::MolecularField::default_kernel());
}

wire::RecordedRoom description_of(const Room& room, const RoomRecording& settings) {
  wire::RecordedRoom out;
  out.set_program(settings.program);
  out.set_room(room.name());
  out.set_recording(settings.recording);
  *out.mutable_scene() = room.scene().description;
  for (const Asset& asset : room.scene().assets) {
    wire::AssetInfo& info = *out.add_assets();
    info.set_sha256(asset.sha256.data(), asset.sha256.size());
    info.set_size_bytes(asset.bytes->size());
    info.set_kind(asset.kind);
    info.set_name(asset.name);
  }
  out.set_scene_file(settings.scene_file);
  out.set_field_kernel(field_kernel_of(room.scene()));
  out.set_controls_tool_passivity(room.options().controls_tool_passivity);
  if (settings.restored) *out.mutable_restored() = *settings.restored;
  return out;
}

}  // namespace

RoomRecorder::RoomRecorder(const Room& room, RoomRecording settings)
    : settings_(std::move(settings)),
      description_(description_of(room, settings_)),
      moving_bodies_(moving_bodies_of(room.scene())),
      states_every_(
          static_cast<std::uint64_t>(std::max(1.0, std::round(1 / (settings_.states_hz * to_seconds(room.period())))))),
      ring_(settings_.capacity),
      step_(room.steps_done().value + 1),
      writer_(
          settings_.file, recording::McapWriter(channels(), settings_.program), settings_.rotation,
          [this](std::uint32_t part) { return proto::bytes_of(description(part)); }, settings_.unix_offset) {}

RoomRecorder::~RoomRecorder() = default;

wire::RecordedRoom RoomRecorder::description(std::uint32_t part) const {
  wire::RecordedRoom out = description_;
  out.set_part(part);
  return out;
}

/// Appends a record to the ring. If the ring is full, the whole step is lost, and further records of that step are not
/// appended.
template <class What>
void RoomRecorder::push(const What& what) noexcept {
  if (is_losing_ || !ring_.push({step_, what})) is_losing_ = true;
  ++records_;
}

void RoomRecorder::on_command(const RoomCommand& command) noexcept {
  push(command);
}

void RoomRecorder::on_input(std::size_t seat, const proto::ClientUpdate& input) noexcept {
  push(TakenInput{seat, input});
}

void RoomRecorder::push_states(const Room& room) noexcept {
  for (const BodyId id : moving_bodies_) push(proto::BodyState{id, room.world().body(id), UserId{}});
  for (std::size_t i = 0; i < proto::kMaxUsers; ++i) {
    const Seat& seat = room.seat(i);
    if (!seat.is_manipulator()) continue;
    const physics::ToolState tool = room.world().tool(seat.tool);
    push(ToolRecord{seat.tool, seat.user, tool.tool, tool.wrench_on_hand_W, tool.held});
  }
}

void RoomRecorder::on_step(const Room& room, ServerTime now, TickFaults faults) noexcept {
  const bool has_states = step_ % states_every_ == 0;
  if (has_states) push_states(room);
  if (room.game() != nullptr) {
    for (const GameEvent& event : room.game()->events()) push(event);
    if (has_states) push(room.game()->status());
  }
  push(StepEnd{now, faults, records_, room.world().field_energy_kj_per_mol(), has_states, hashes_of(room)});
  if (is_losing_) steps_lost_.fetch_add(1, std::memory_order_relaxed);
  is_losing_ = false;
  records_ = 0;
  ++step_;
}

void RoomRecorder::drain() {
  while (ring_.pop(record_)) writer_.write(record_);
  writer_.flush_if_due();
}

void RoomRecorder::finish() {
  while (ring_.pop(record_)) writer_.write(record_);
  writer_.file().finish();
}

std::string RoomRecorder::pop_news() {
  std::string news = writer_.file().pop_news();
  const std::uint64_t lost = steps_lost();
  if (!news.empty() || lost == reported_lost_) return news;
  const bool is_first = reported_lost_ == 0;
  reported_lost_ = lost;
  return is_first ? "recording " + file().path().string() + " does not keep up: steps are left out, and counted" : "";
}

}  // namespace tandem::server
