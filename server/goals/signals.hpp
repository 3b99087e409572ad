// External signals of a game: numbers that other programs send by name, such as the valence of an electroencephalogram.
// Their age is counted in steps of the room, so that a replay gives the same results.
#pragma once

#include <array>
#include <boost/container/static_vector.hpp>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "server/assets/scene_goals.hpp"

namespace tandem::server {

/// A closed interval of values.
struct SignalRange {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();

  bool contains(double value) const noexcept { return value >= low && value <= high; }
};

struct PlannedSignal {
  std::uint64_t max_age_steps = 0;
  double min_confidence = 0;
  std::vector<SignalRange> states;
};

/// Newest value of a signal, and the time that the game has spent in each of its states. Times are numbers of steps.
struct SignalStatus {
  bool has_value = false;
  double value = 0;
  double confidence = 0;
  std::uint64_t age_steps = 0;  ///< since the measurement
  bool is_fresh = false;        ///< true: the signal has a value that is not stale
  std::uint8_t state = 0;       ///< 1 + index of the state that contains the value; 0: none
  /// Steps spent in each state in this attempt at the level.
  std::array<std::uint64_t, kMaxSignalStates> level_steps{};
  std::array<std::uint64_t, kMaxSignalStates> steps{};  ///< steps spent in each state in the whole game
};
using SignalStatuses = boost::container::static_vector<SignalStatus, kMaxSignals>;

/// Ages a signal by one step, and determines whether it is fresh and which state it is in.
void advance(SignalStatus& signal, const PlannedSignal& planned) noexcept;
/// Adds one step of the game to the time of the present state.
void count_state(SignalStatus& signal) noexcept;
/// Returns the state in which the signal was for more than the fraction `share` of the level's steps; none if there is
/// no such state.
std::optional<std::size_t> dominant_state(const SignalStatus& signal, std::uint64_t level_steps, double share) noexcept;

}  // namespace tandem::server
