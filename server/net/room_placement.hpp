// Assignment of rooms to threads.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <span>

namespace tandem::server {

/// Load of a room that must not share a thread, because its steps would delay other rooms.
inline constexpr double kSharesWithNobody = std::numeric_limits<double>::infinity();

/// Assigns rooms to workers (threads that several rooms may share) and moves as few rooms as possible.
/// * A room that must not share a thread gets a thread of its own.
/// * A room without a worker gets the least loaded worker, if that worker has enough capacity.
/// * Per call, at most one room is moved: the largest room that fits, away from an overloaded worker or from a worker
///   whose load exceeds that of the idlest worker by far.
///
/// Why     A thread that wakes up steps all of its due rooms in sequence. Where waking up costs as much as a small step
///         (nested virtual machines), sharing a thread saves half of the time. Shared data also stay in the cache.
/// In      loads    for each room: fraction of a thread's time that its steps take, or kSharesWithNobody
///         count    number of workers; at least 1
/// In-out  workers  for each room: index of its shared worker, below `count`; none: it has a separate thread
void place_rooms(std::span<const double> loads, std::span<std::optional<std::size_t>> workers, std::size_t count);

}  // namespace tandem::server
