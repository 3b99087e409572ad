// Datagrams with the moment at which the kernel had them: a program that was held up reads old ones, and must know it.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "common/base/time.hpp"

namespace tandem::client {

/// From now on the kernel stamps what comes. A socket that cannot is used without: then a datagram came when it is read.
void stamp_what_comes(int socket) noexcept;

/// The next datagram that waits.
///
/// Model   came = now − (wall clock − stamp), the wall clock read first: who is held up between sees it later, never too
///         early. A difference that is negative or over ten seconds is of a wall clock that was set meanwhile, and counts
///         as none; one that is set by less makes the state look older for a moment.
/// Out     how many bytes, at most the buffer's; nothing: errno says why, EAGAIN that none waits
/// Thread  any, one at a time; no allocation
std::optional<std::size_t> receive_stamped(int socket, std::span<std::byte> buffer, const Clock& clock,
                                           LocalTime& came) noexcept;

}  // namespace tandem::client
