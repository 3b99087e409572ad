// Fills in the update that the client sends to the server at each tick.
#pragma once

#include "client/exchange/mailboxes.hpp"
#include "client/haptics/port_work.hpp"
#include "client/haptics/stages/stage.hpp"
#include "client/haptics/tick_record.hpp"

namespace tandem::client {

/// Fills in proto::ClientUpdate, except the exchanged time stamps, which the channel sets (proto/datagram_channel.hpp).
///
/// Thread  haptic: no allocation, no throw
class OutgoingUpdate {
 public:
  /// In      newest  newest server state; null if none was received in this scene
  ///         is_driving  true: the user drives a tool; false: handle and buttons are omitted from the update
  ///         requested  work of the wrench before the safety chain [world joules]
  void write(proto::ClientUpdate& update, const TickRecord& record, const StageOutput& output,
             const ReceivedUpdate* newest, bool is_driving, const PortWork& requested) noexcept;
  /// Discards the last buttons, because a new scene starts with no button pressed.
  void forget_buttons() noexcept { buttons_ = 0; }

 private:
  std::uint32_t buttons_of(const TickRecord& record) noexcept;

  std::uint32_t buttons_ = 0;  ///< buttons of the last valid sample in this scene
  LocalTime buttons_seen_at_{};
};

}  // namespace tandem::client
