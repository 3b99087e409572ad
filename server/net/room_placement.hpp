// Which thread steps which room.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <span>

namespace tandem::server {

/// The load of a room that would hold others up.
inline constexpr double kSharesWithNobody = std::numeric_limits<double>::infinity();

/// Moves rooms, as few as it can: who may not share gets a thread of his own; who may goes to the worker that has least
/// to do, if it bears him; of a worker that has too much the largest room goes; and where one worker has much more to
/// do than another, one room changes over, at most one a call.
///
/// Why     a thread that wakes up steps all its rooms that are due one after the other: on a machine where waking up
///         costs as much as a small step (nested virtual machines), half of the time; and what they all use stays in
///         the cache.
/// In      loads    of each room: share of a thread's time that its steps take, or kSharesWithNobody
///         count    of workers; at least 1
/// In-out  workers  of each room: that steps it with others, below `count`; none: it has a thread of its own
void place_rooms(std::span<const double> loads, std::span<std::optional<std::size_t>> workers, std::size_t count);

}  // namespace tandem::server
