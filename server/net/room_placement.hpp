// Assignment of rooms to threads.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <span>

namespace tandem::server {

/// Load value for a room that must not share a thread, because it would delay other rooms.
inline constexpr double kSharesWithNobody = std::numeric_limits<double>::infinity();

/// Reassigns as few rooms as possible. A room that must not share gets a separate thread. A room that may share is
/// assigned to the least loaded worker that has capacity. The largest room of an overloaded worker is moved away. If
/// the loads of two workers differ much, one room moves; at most one per call.
///
/// Why     A thread that wakes up steps all its due rooms in sequence. If waking up costs as much as a small step
///         (nested virtual machines), sharing saves half of the time. Shared data also stays in the cache.
/// In      loads    for each room: fraction of a thread's time that its steps take, or kSharesWithNobody
///         count    number of workers; at least 1
/// In-out  workers  for each room: index of its shared worker, below `count`; none: it has a separate thread
void place_rooms(std::span<const double> loads, std::span<std::optional<std::size_t>> workers, std::size_t count);

}  // namespace tandem::server
