// Lower bound of a server's latency: a thread that only returns each datagram.
#pragma once

#include <cstddef>
#include <utility>

#include "common/base/histogram.hpp"
#include "common/base/time.hpp"

namespace tandem::lab {

/// Sends one datagram from each of `users` sockets, in turn, on the calling thread, to an echo thread over loopback.
/// The rate is `rate_hz` less a thousandth, so that the datagrams drift through the period of rooms at that rate. Their
/// size is that of a user's usual input.
///
/// In      priority  real-time priority of the echo thread; 0: normal
/// Out     after a fifth of a second of settling: time from sending each datagram to sending its answer; processor time
///         of both threads
/// Fails   boost::system::system_error: no sockets
std::pair<Histogram, Duration> udp_echo_latency(std::size_t users, double rate_hz, Duration duration, int priority);

}  // namespace tandem::lab
