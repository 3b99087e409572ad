// Measures a lower bound for the latency of a server, by a thread that only echoes each datagram.
#pragma once

#include <cstddef>
#include <utility>

#include "common/base/histogram.hpp"
#include "common/base/time.hpp"

namespace tandem::lab {

/// Sends one datagram from each of `users` sockets in turn to an echo thread over loopback. The calling thread sends.
/// The rate is `rate_hz` minus 0.1 %, so that the sending times drift through the period of a room at `rate_hz`. A
/// datagram has the size of a user's usual input.
///
/// In      priority  real-time priority of the echo thread; 0: normal priority
/// Out     values after the first 0.2 s: the time from sending each datagram to sending its answer, and the processor
///         time of both threads
/// Fails   boost::system::system_error: the sockets cannot be opened
std::pair<Histogram, Duration> udp_echo_latency(std::size_t users, double rate_hz, Duration duration, int priority);

}  // namespace tandem::lab
