#include "server/recording/step_writer.hpp"

#include <algorithm>
#include <utility>

#include "proto/recording/exact_state.hpp"
#include "proto/recording/schema.hpp"
#include "server/goals/game_codec.hpp"

namespace tandem::server {
namespace {

/// Period of flushes. If the server is killed, at most the steps of this period, and of one period of the recorder
/// thread (20 ms), are lost.
constexpr std::uint64_t kFlushEvery_ns = 250'000'000;

std::uint64_t unix_ns(ServerTime time, Duration offset) {
  return static_cast<std::uint64_t>(std::max(Duration(0), time.time_since_epoch() + offset).count());
}

}  // namespace

StepWriter::StepWriter(std::filesystem::path file, recording::McapWriter writer, recording::RotationSettings rotation,
                       recording::RecordingFile::Describe describe, Duration unix_offset)
    : file_(std::move(file), std::move(writer), rotation, std::move(describe)), unix_offset_(unix_offset) {}

void StepWriter::write(const StepRecord& record) {
  if (record.step != step_) {
    step_ = record.step;
    records_ = 0;
    message_.Clear();
    states_.Clear();
  }
  ++records_;
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
  } else if (const auto* end = std::get_if<StepEnd>(&record.what)) {
    if (records_ == end->records + 1) write_step(record.step, *end);
  }
}

void StepWriter::write_step(std::uint64_t step, const StepEnd& end) {
  newest_ns_ = unix_ns(end.now, unix_offset_);
  message_.set_step(step);
  message_.set_stepped_server_ns(static_cast<std::uint64_t>(end.now.time_since_epoch().count()));
  message_.set_tick_faults(end.faults);
  message_.mutable_body_hashes()->Add(end.hashes.bodies.begin(), end.hashes.bodies.end());
  message_.mutable_tool_hashes()->Add(end.hashes.tools.begin(), end.hashes.tools.end());
  file_.add(kStepTopic, newest_ns_, proto::bytes_of(message_));
  if (!end.has_states) return;
  states_.set_step(step);
  states_.set_field_energy_kj_per_mol(end.field_energy_kj_per_mol);
  file_.add(kStatesTopic, newest_ns_, proto::bytes_of(states_));
}

void StepWriter::flush_if_due() {
  const bool is_idle = newest_ns_ == checked_ns_;
  checked_ns_ = newest_ns_;
  if (!is_idle && newest_ns_ < flushed_ns_ + kFlushEvery_ns) return;
  flushed_ns_ = newest_ns_;
  file_.flush(newest_ns_);
}

}  // namespace tandem::server
