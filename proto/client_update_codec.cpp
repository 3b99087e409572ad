// Encodes and decodes the client update.
#include "proto/state_fields.hpp"

namespace tandem::proto {
namespace {

/// Writes the fields that belong to the mode of the client (ClientMode). Fields of other modes stay absent.
void write_mode_part(const ClientUpdate& update, wire::ClientUpdate& out) {
  out.set_mode(static_cast<std::uint32_t>(update.mode));
  out.set_round_trip_ns(nanoseconds_of_delay(update.round_trip));
  // An out-of-range wrench is replaced by zero, because it would make the whole message unreadable.
  const Wrench on_hand_W = is_wrench(update.on_hand_W) ? update.on_hand_W : Wrench{};
  if (update.mode == ClientMode::kLocalModel) write_six(on_hand_W, *out.mutable_on_hand());
  if (update.mode == ClientMode::kWave) write_six(update.wave, *out.mutable_wave());
}

DropReason read_mode_part(const wire::ClientUpdate& in, ClientUpdate& out) {
  if (in.mode() > static_cast<std::uint32_t>(ClientMode::kWave)) return DropReason::kNotFinite;
  out.mode = static_cast<ClientMode>(in.mode());
  if (!read_delay(in.round_trip_ns(), out.round_trip)) return DropReason::kNotFinite;
  const int on_hand_numbers = out.mode == ClientMode::kLocalModel ? kWrenchNumbers : 0;
  if (in.on_hand_size() != on_hand_numbers) return DropReason::kMalformed;
  if (in.wave().empty() != (out.mode != ClientMode::kWave)) return DropReason::kMalformed;
  out.on_hand_W = {};
  if (on_hand_numbers > 0) out.on_hand_W = six_of(in.on_hand());
  if (!is_wrench(out.on_hand_W)) return DropReason::kNotFinite;
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
