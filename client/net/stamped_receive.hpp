// Receives datagrams with the kernel's reception time, so that a delayed thread does not take old datagrams for fresh
// ones.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "common/base/time.hpp"

namespace tandem::client {

/// Reads the datagrams of one socket.
///
/// Model   came = now − (wall clock − stamp). The wall clock may be set while a datagram waits. A datagram read now
///         arrived after the socket was last found empty. The difference is used if both clocks advanced alike since
///         then, and if it is neither negative nor longer than that time. Otherwise the datagram counts as that old,
///         the maximum. An old datagram therefore never passes for a fresh one, for any waiting time and any change of
///         the wall clock. The wall clock is read after the datagram: a delay of the thread in between makes the age
///         larger, not smaller.
/// Thread  any, one at a time; no allocation
class StampedReceiver {
 public:
  StampedReceiver() = default;
  /// Enables kernel time stamps on `socket`, which must be empty. If they are not available, a datagram's reception
  /// time is the time at which it is read.
  StampedReceiver(int socket, LocalTime now) noexcept;

  /// Reads the next waiting datagram.
  ///
  /// Out     its size [bytes], at most the buffer's; nothing: see errno, EAGAIN if none waits
  std::optional<std::size_t> receive(std::span<std::byte> buffer, const Clock& clock, LocalTime& came) noexcept;

 private:
  int socket_ = -1;
  LocalTime empty_at_{};       ///< socket last found empty, on the own clock …
  Duration wall_at_empty_{0};  ///< … and on the wall clock
};

/// Age of a datagram: `waited` if plausible, otherwise `empty_for`.
///
/// In      waited          time since its stamp, by the wall clock
///         empty_for       time since the socket was empty, by the own clock …
///         empty_for_wall  … and by the wall clock
Duration believed_age(Duration waited, Duration empty_for, Duration empty_for_wall) noexcept;

}  // namespace tandem::client
