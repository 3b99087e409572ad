// The client update, both ways.
#include "proto/state_fields.hpp"

namespace tandem::proto {
namespace {

bool is_direction_or_none(const Vec3& a) {
  return a.isZero(0) || std::abs(a.norm() - 1) <= kMaxQuaternionError;
}
bool is_sendable_copy(const CopyTarget& copy) {
  return copy.body.is_valid() && is_sendable(copy.state) && is_within(copy.p_BJ, 0.999 * kMaxPositionM) &&
         is_direction_or_none(copy.pressing_B);
}

void write_copy(const CopyTarget& copy, wire::BodyCopy& out) {
  write_compact(copy.body.value, copy.state, *out.mutable_state());
  for (const double number : copy.p_BJ) out.add_point(static_cast<float>(number));
  if (copy.pressing_B.isZero(0)) return;
  for (const double number : copy.pressing_B) out.add_pressing(static_cast<float>(number));
}

DropReason read_copy(const wire::BodyCopy& in, CopyTarget& out) {
  const bool has_direction = in.pressing_size() == 3;
  if (!in.has_state() || in.point_size() != 3 || (!has_direction && !in.pressing().empty())) {
    return DropReason::kMalformed;
  }
  if (const DropReason drop = read_compact(in.state(), out.state); drop != DropReason::kNone) return drop;
  out.body = BodyId{in.state().id()};
  out.p_BJ = {in.point(0), in.point(1), in.point(2)};
  out.pressing_B = Vec3::Zero();
  if (!is_within(out.p_BJ, kMaxPositionM)) return DropReason::kNotFinite;
  if (!has_direction) return DropReason::kNone;
  out.pressing_B = {in.pressing(0), in.pressing(1), in.pressing(2)};
  if (!(std::abs(out.pressing_B.norm() - 1) <= kMaxQuaternionError)) return DropReason::kNotFinite;
  out.pressing_B.normalize();
  return DropReason::kNone;
}

DropReason read_copies(const wire::ClientUpdate& in, ClientUpdate& out) {
  out.copies.clear();
  const bool may_have = out.mode == ClientMode::kLocalModel;
  if (in.copies_size() > (may_have ? static_cast<int>(kMaxCopies) : 0)) return DropReason::kMalformed;
  for (const wire::BodyCopy& message : in.copies()) {
    CopyTarget copy;
    if (const DropReason drop = read_copy(message, copy); drop != DropReason::kNone) return drop;
    const auto is_same = [&copy](const CopyTarget& other) { return other.body == copy.body; };
    if (std::ranges::any_of(out.copies, is_same)) return DropReason::kMalformed;
    out.copies.push_back(copy);
  }
  return DropReason::kNone;
}

/// What belongs to the mode; absent in the others.
void write_mode_part(const ClientUpdate& update, wire::ClientUpdate& out) {
  out.set_mode(static_cast<std::uint32_t>(update.mode));
  out.set_round_trip_ns(nanoseconds_of_delay(update.round_trip));
  if (update.mode == ClientMode::kLocalModel) {
    write_rigid(update.tool, *out.mutable_tool());
    for (const CopyTarget& copy : update.copies) {
      if (is_sendable_copy(copy)) write_copy(copy, *out.add_copies());
    }
  }
  if (update.mode == ClientMode::kWave) write_six(update.wave, *out.mutable_wave());
}

DropReason read_mode_part(const wire::ClientUpdate& in, ClientUpdate& out) {
  out.tool = {};
  if (in.mode() > static_cast<std::uint32_t>(ClientMode::kWave)) return DropReason::kNotFinite;
  out.mode = static_cast<ClientMode>(in.mode());
  if (!read_delay(in.round_trip_ns(), out.round_trip)) return DropReason::kNotFinite;
  if (in.has_tool() != (out.mode == ClientMode::kLocalModel)) return DropReason::kMalformed;
  if (in.wave().empty() != (out.mode != ClientMode::kWave)) return DropReason::kMalformed;
  if (in.has_tool()) {
    if (const DropReason drop = read_rigid(in.tool(), out.tool); drop != DropReason::kNone) return drop;
  }
  if (const DropReason drop = read_copies(in, out); drop != DropReason::kNone) return drop;
  return read_wave(in.wave(), out.wave);
}

}  // namespace

void append_client_update(const ClientUpdate& update, Bytes& out) {
  auto& message = fresh_message<wire::ClientUpdate>();
  message.set_input_tick(update.input_tick.value);
  write_rigid(update.handle, *message.mutable_handle());
  message.set_buttons(update.buttons);
  message.set_handle_valid(update.handle_valid);
  message.set_sent_local_ns(nanoseconds_of(update.sent.time_since_epoch()));
  message.set_acknowledged_step(update.acknowledged_step.value);
  message.set_acknowledged_server_ns(nanoseconds_of(update.acknowledged_sent.time_since_epoch()));
  message.set_acknowledged_held_ns(nanoseconds_of(update.acknowledged_held));
  message.set_energy_to_hand_j(update.energy_to_hand_j);
  message.set_energy_from_hand_j(update.energy_from_hand_j);
  write_mode_part(update, message);
  append_bytes(message, message.ByteSizeLong(), out);
}

DropReason parse_client_update(std::span<const std::byte> payload, ClientUpdate& out) {
  auto& in = fresh_message<wire::ClientUpdate>();
  if (!parse_payload(payload, in) || !in.has_handle()) return DropReason::kMalformed;
  out.input_tick.value = in.input_tick();
  out.handle_valid = in.handle_valid();
  out.buttons = in.buttons();
  out.acknowledged_step.value = in.acknowledged_step();
  out.energy_to_hand_j = in.energy_to_hand_j();
  out.energy_from_hand_j = in.energy_from_hand_j();
  const bool has_times = read_time(in.sent_local_ns(), out.sent) &&
                         read_time(in.acknowledged_server_ns(), out.acknowledged_sent) &&
                         read_time(in.acknowledged_held_ns(), out.acknowledged_held);
  if (!has_times || !is_cumulative_energy(out.energy_to_hand_j) || !is_cumulative_energy(out.energy_from_hand_j)) {
    return DropReason::kNotFinite;
  }
  if (const DropReason drop = read_rigid(in.handle(), out.handle); drop != DropReason::kNone) return drop;
  return read_mode_part(in, out);
}

}  // namespace tandem::proto
