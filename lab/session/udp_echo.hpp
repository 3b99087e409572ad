// Measures a lower bound for the latency of a server on this machine: the latency of a thread that only returns each
// datagram to its sender.
#pragma once

#include <cstddef>
#include <utility>

#include "common/base/histogram.hpp"
#include "common/base/time.hpp"

namespace tandem::lab {

/// Sends one datagram from each of `users` sockets in turn to an echo thread over loopback. The calling thread sends.
/// Each socket sends at 0.999 times `rate_hz`. Therefore the sending times drift through the whole period of a room
/// that runs at `rate_hz`. A datagram has the size of a user's usual input.
///
/// In      priority  real-time priority of the echo thread; 0: normal priority
/// Out     first: time from sending a datagram until its answer is sent. second: processor time of both threads. Both
///         exclude the first 0.2 s
/// Fails   boost::system::system_error: the sockets cannot be opened
std::pair<Histogram, Duration> udp_echo_latency(std::size_t users, double rate_hz, Duration duration, int priority);

}  // namespace tandem::lab
