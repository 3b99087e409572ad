// Measures of one user in one session, computed from the recording of a room.
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "lab/therapy/hand_motion.hpp"

namespace tandem::lab {

/// Largest number of levels and goals in a session. A session with more of them is refused.
inline constexpr std::size_t kMaxParts = 2000;
/// Largest number of movements that are stored individually. The other measures include all movements.
inline constexpr std::size_t kMaxMovements = 10'000;

enum class PartKind : std::uint8_t { kSession, kLevel, kGoal };
/// Outcome of a part. kNone: the scene has no game. kOpen: the part has no result, because the recording or the attempt
/// at the level ended before.
enum class PartOutcome : std::uint8_t { kNone, kReached, kFailed, kOpen };

std::string text_of(PartKind kind);
std::string text_of(PartOutcome outcome);

/// Measures of a part: the whole session, one attempt at a level, or a goal. Times count from the user's join. Unknown
/// numbers are NaN.
struct PartMeasures {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

  PartKind kind = PartKind::kSession;
  PartOutcome outcome = PartOutcome::kNone;
  std::string name;
  /// start time. A goal starts with its level; if goals must be reached one after the other, it starts at the end of
  /// the previous goal
  double begin_s = 0;
  double time_s = 0;                                        ///< duration
  double moving_s = 0;                                      ///< total duration of all movements
  double path_m = 0;                                        ///< length of the hand's path
  double score = kUnknown;                                  ///< points that were gained in this part
  double force_mean_n = kUnknown, force_peak_n = kUnknown;  ///< magnitude of the coupling force on the hand
  /// Smoothness of the movements that begin in this part: median and quartiles.
  double smoothness = kUnknown, smoothness_low = kUnknown, smoothness_high = kUnknown;
  std::uint64_t movements = 0;
  std::uint64_t grasps = 0;   ///< number of times that a body was grasped
  std::uint64_t objects = 0;  ///< number of different bodies that were held
  std::optional<MotionRange> range = {};
};

struct SessionMeasures {
  /// unique number of the recording; a recording with the same number cannot be added again
  std::uint64_t recording = 0;
  std::string begun_utc;  ///< time of the user's join, such as 2026-12-01T10:00:00Z
  std::string scene;
  bool is_cut = false;                       ///< true: the recording is damaged, and only a part was measured
  std::optional<MotionRange> calibration{};  ///< range of motion before the session; none: no calibration
  std::vector<PartMeasures> parts;           ///< the session, then its levels and goals, sorted by begin_s
  std::vector<Movement> movements;           ///< the first kMaxMovements movements

  const PartMeasures& whole() const { return parts.front(); }
  /// Returns the number of parts of this kind with this outcome.
  std::size_t count(PartKind kind, PartOutcome outcome) const;
};

/// Measures a session.
/// In      file  first file of a recording by `tandem-server --record`
///         user  name of the user in the recording; empty: the only user with a tool
///         calibration_s  duration of the calibration at the start of the session, counted from the user's join,
///         1..kMaxSession_s; none: the session contains no calibration
/// Fails   std::invalid_argument, which names file, field and remedy, in these cases:
///         * The file is not a recording of a room, or a limit such as kMaxParts is exceeded.
///         * The recording has no such user, or `user` is empty and several users have a tool.
///         * No motion of the user, or less than 1 s of the calibration was recorded.
SessionMeasures measure_session(const std::filesystem::path& file, const std::string& user,
                                std::optional<double> calibration_s = {});

/// Returns the range of motion of a user in a recording of a calibration.
/// Fails   as measure_session()
MotionRange measure_calibration(const std::filesystem::path& file, const std::string& user);

}  // namespace tandem::lab
