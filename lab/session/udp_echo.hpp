// What a server could not be faster than: each datagram is sent back by a thread that does nothing else.
#pragma once

#include <cstddef>
#include <utility>

#include "common/base/histogram.hpp"
#include "common/base/time.hpp"

namespace tandem::lab {

/// Sends one datagram for each of `users` sockets at `rate_hz`, less a thousandth, in turn, on the calling thread, to a thread of real-time
/// priority `priority` (0: normal), over loopback; datagrams are as large as a user's usual input. So they come at any time between the
/// steps of rooms that keep that rate.
///
/// Out     after a fifth of a second to settle: from the send of each datagram to the send of its answer; processor time of both threads
/// Fails   boost::system::system_error: no sockets
std::pair<Histogram, Duration> udp_echo_latency(std::size_t users, double rate_hz, Duration duration, int priority);

}  // namespace tandem::lab
