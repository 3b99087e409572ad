#include "server/recording/room_recorder.hpp"

#include <algorithm>
#include <cmath>

#include "common/docking/molecular_field.hpp"
#include "proto/recording/exact_state.hpp"
#include "proto/recording/schema.hpp"
#include "server/goals/game_codec.hpp"

namespace tandem::server {
namespace {

/// Period of flushes. If the server is killed, only steps younger than this period plus the period of drain() are lost.
constexpr std::uint64_t kFlushEvery_ns = 250'000'000;
enum : std::uint16_t { kRoomTopic, kStepTopic, kStatesTopic };

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

std::uint64_t unix_ns(ServerTime time, Duration offset) {
  return static_cast<std::uint64_t>(std::max(Duration(0), time.time_since_epoch() + offset).count());
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
      file_(settings_.file, recording::McapWriter(channels(), settings_.program), settings_.rotation,
            [this](std::uint32_t part) { return proto::bytes_of(description(part)); }) {}

RoomRecorder::~RoomRecorder() = default;

wire::RecordedRoom RoomRecorder::description(std::uint32_t part) const {
  wire::RecordedRoom out = description_;
  out.set_part(part);
  return out;
}

/// Appends a record to the ring. If it does not fit, later records of the step are not appended, and the step is lost.
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
  push(Stepped{now, faults, records_, room.world().field_energy_kj_per_mol(), has_states, hashes_of(room)});
  if (is_losing_) steps_lost_.fetch_add(1, std::memory_order_relaxed);
  is_losing_ = false;
  records_ = 0;
  ++step_;
}

/// Adds a record to the messages of its step. A step with missing records is not written.
void RoomRecorder::write(const Record& record) {
  if (record.step != taken_step_) {
    taken_step_ = record.step;
    taken_records_ = 0;
    message_.Clear();
    states_.Clear();
  }
  ++taken_records_;
  if (const auto* command = std::get_if<RoomCommand>(&record.what)) {
    *message_.add_commands() = recorded(*command);
  } else if (const auto* input = std::get_if<TakenInput>(&record.what)) {
    *message_.add_inputs() = recorded(*input);
  } else if (const auto* body = std::get_if<proto::BodyState>(&record.what)) {
    wire::RecordedBody& out = *states_.add_bodies();
    out.set_id(body->id.value);
    proto::write_exact(body->state, *out.mutable_state());
  } else if (const auto* tool = std::get_if<ToolRecord>(&record.what)) {
    wire::RecordedTool& out = *states_.add_tools();
    out.set_tool(tool->tool);
    out.set_user(tool->user.value);
    proto::write_exact(tool->state, *out.mutable_state());
    proto::write_exact(tool->on_hand_W, *out.mutable_wrench_on_hand());
    out.set_held_body(tool->held.value);
  } else if (const auto* event = std::get_if<GameEvent>(&record.what)) {
    *message_.add_game_events() = event_message(*event);
  } else if (const auto* game = std::get_if<GameStatus>(&record.what)) {
    write_checkpoint(*game, *states_.mutable_game());
  } else if (const auto* stepped = std::get_if<Stepped>(&record.what)) {
    if (taken_records_ == stepped->records + 1) write_step(record, *stepped);
  }
}

void RoomRecorder::write_step(const Record& record, const Stepped& stepped) {
  newest_ns_ = unix_ns(stepped.now, settings_.unix_offset);
  message_.set_step(record.step);
  message_.set_stepped_server_ns(static_cast<std::uint64_t>(stepped.now.time_since_epoch().count()));
  message_.set_tick_faults(stepped.faults);
  message_.mutable_body_hashes()->Add(stepped.hashes.bodies.begin(), stepped.hashes.bodies.end());
  message_.mutable_tool_hashes()->Add(stepped.hashes.tools.begin(), stepped.hashes.tools.end());
  file_.add(kStepTopic, newest_ns_, proto::bytes_of(message_));
  if (!stepped.has_states) return;
  states_.set_step(record.step);
  states_.set_field_energy_kj_per_mol(stepped.field_energy_kj_per_mol);
  file_.add(kStatesTopic, newest_ns_, proto::bytes_of(states_));
}

void RoomRecorder::drain() {
  const std::uint64_t before_ns = newest_ns_;
  while (ring_.pop(record_)) write(record_);
  // If no step was added, the room is idle, and everything is flushed immediately.
  if (newest_ns_ != before_ns && newest_ns_ < flushed_ns_ + kFlushEvery_ns) return;
  flushed_ns_ = newest_ns_;
  file_.flush(newest_ns_);
}

void RoomRecorder::finish() {
  while (ring_.pop(record_)) write(record_);
  file_.finish();
}

std::string RoomRecorder::pop_news() {
  std::string news = file_.pop_news();
  const std::uint64_t lost = steps_lost();
  if (!news.empty() || lost == reported_lost_) return news;
  const bool is_first = reported_lost_ == 0;
  reported_lost_ = lost;
  return is_first ? "recording " + file_.path().string() + " does not keep up: steps are left out, and counted" : "";
}

}  // namespace tandem::server
