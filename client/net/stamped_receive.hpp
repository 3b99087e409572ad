// Datagrams with the moment at which the kernel had them: a program that was held up reads old ones, and must know it.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "common/base/time.hpp"

namespace tandem::client {

/// Reads the datagrams of one socket.
///
/// Model   came = now − (wall clock − stamp). The wall clock may be set while a datagram waits. What is read now came after
///         the socket was last found empty: if the wall clock and the own clock have gone on alike since then, the
///         difference is believed; else, or if it is negative or longer than since then, the datagram counts as old as
///         it can be. So an old one never passes for a fresh one, however long it waited and whatever the wall clock did.
///         The wall clock is read after the datagram: a thread that is held up between sees it later, never too early.
/// Thread  any, one at a time; no allocation
class StampedReceiver {
 public:
  StampedReceiver() = default;
  /// From now on the kernel stamps what comes to `socket`, which is empty. One that cannot be stamped is used without:
  /// then a datagram came when it is read.
  StampedReceiver(int socket, LocalTime now) noexcept;

  /// The next datagram that waits.
  ///
  /// Out     how many bytes, at most the buffer's; nothing: errno says why, EAGAIN that none waits
  std::optional<std::size_t> receive(std::span<std::byte> buffer, const Clock& clock, LocalTime& came) noexcept;

 private:
  int socket_ = -1;
  LocalTime empty_at_{};       ///< no datagram waited then …
  Duration wall_at_empty_{0};  ///< … when the wall clock said this
};

/// How long ago a datagram came.
///
/// In      waited          since its stamp, by the wall clock
///         empty_for       since the socket was empty, by the own clock …
///         empty_for_wall  … and by the wall clock
Duration believed_age(Duration waited, Duration empty_for, Duration empty_for_wall) noexcept;

}  // namespace tandem::client
