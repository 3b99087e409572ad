// Datagrams with the moment at which the kernel had them: a program that was held up reads old ones, and must know it.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "common/base/time.hpp"

namespace tandem::client {

/// From now on the kernel stamps what comes. A socket that cannot is used without: then a datagram came when it is read.
void stamp_what_comes(int socket) noexcept;

struct StampedSize {
  std::size_t bytes = 0;  ///< at most the buffer's
  LocalTime came{};
};

/// The next datagram that waits.
///
/// Model   came = now − (wall clock − stamp). A difference that is negative or over ten seconds is of a wall clock that
///         was set meanwhile, and counts as none; one that is set by less makes the state look older for a moment.
/// Out     nothing: errno says why, EAGAIN that none waits
/// Thread  any, one at a time; no allocation
std::optional<StampedSize> receive_stamped(int socket, std::span<std::byte> buffer, LocalTime now) noexcept;

}  // namespace tandem::client
