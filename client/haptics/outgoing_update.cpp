#include "client/haptics/outgoing_update.hpp"

#include <algorithm>
#include <chrono>

namespace tandem::client {
namespace {

// Duration of invalid samples during which the last valid buttons are still sent. So a few invalid samples do not make
// the tool release a held body.
constexpr Duration kButtonsKept{std::chrono::milliseconds(100)};

// Returns the round trip that the stage has measured. If there is none, returns the round trip of the newest exchanged
// time stamps.
Duration round_trip(const StageOutput& output, const ReceivedUpdate* newest) {
  if (output.round_trip > Duration{0}) return std::min(output.round_trip, proto::kMaxDelay);
  if (newest == nullptr || newest->update.echoed_sent == LocalTime{}) return Duration{0};
  const Duration away = newest->received - newest->update.echoed_sent;
  return std::clamp(away - (newest->update.sent - newest->update.received), Duration{0}, proto::kMaxDelay);
}

}  // namespace

void OutgoingUpdate::write(proto::ClientUpdate& update, const TickRecord& record, const StageOutput& output,
                           const ReceivedUpdate* newest, bool is_driving, const PortWork& requested) noexcept {
  update = proto::ClientUpdate{};
  update.input_tick = record.tick;
  update.handle = record.handle_W;
  update.handle_valid = record.sample.is_valid && is_driving;
  update.buttons = is_driving ? buttons_of(record) : 0;
  update.mode = output.mode;
  update.on_hand_W = output.wrench_on_hand_W;
  update.wave = output.wave;
  update.round_trip = round_trip(output, newest);
  update.energy_to_hand_j = requested.to_hand_j();
  update.energy_from_hand_j = requested.from_hand_j();
}

// Returns the buttons to send. After a single invalid sample, the tool must still hold its body; after a series of
// invalid samples longer than kButtonsKept, the tool must release it.
std::uint32_t OutgoingUpdate::buttons_of(const TickRecord& record) noexcept {
  if (record.sample.is_valid) {
    buttons_ = record.sample.buttons;
    buttons_seen_at_ = record.at;
  } else if (record.at - buttons_seen_at_ > kButtonsKept) {
    buttons_ = 0;
  }
  return buttons_;
}

}  // namespace tandem::client
