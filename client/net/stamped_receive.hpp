// Receives datagrams with the time at which the kernel received them. So old datagrams do not appear fresh if the
// reading thread was delayed.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "common/base/time.hpp"

namespace tandem::client {

/// Reads the datagrams of one socket.
///
/// Model   came = now − age
///         came  time of reception, the result
///         age   the apparent age w if it is plausible, otherwise its upper bound now − T
///         T     time at which the socket was last found empty; the datagram has arrived after T
///         w     wall clock minus the kernel's stamp, which is a time of the wall clock. w is plausible if two
///               conditions hold: w is between 0 and now − T, and both clocks have advanced equally since T. The second
///               condition detects that the wall clock was set while the datagram waited
///         So an old datagram never appears fresh. The wall clock is read after the datagram, so a delay of the thread
///         in between increases the age.
/// Thread  any, one at a time; no allocation
class StampedReceiver {
 public:
  StampedReceiver() = default;
  /// Enables the kernel's time stamps on `socket`, which must be empty. If they are not available, a datagram's
  /// reception time is the time at which it is read.
  StampedReceiver(int socket, LocalTime now) noexcept;

  /// Reads the next waiting datagram.
  ///
  /// Out     size of the datagram [bytes], at most that of the buffer; nothing on an error, see errno (EAGAIN: none
  ///         waits)
  std::optional<std::size_t> receive(std::span<std::byte> buffer, const Clock& clock, LocalTime& came) noexcept;

 private:
  int socket_ = -1;
  LocalTime empty_at_{};       ///< local time at which the socket was last found empty
  Duration wall_at_empty_{0};  ///< time of the wall clock at empty_at_
};

/// Returns the age of a datagram: `waited` if this value is plausible, otherwise the upper bound `empty_for`.
///
/// In      waited          time since its stamp, by the wall clock
///         empty_for       time since the socket was empty, by the local clock
///         empty_for_wall  time since the socket was empty, by the wall clock
Duration believed_age(Duration waited, Duration empty_for, Duration empty_for_wall) noexcept;

}  // namespace tandem::client
