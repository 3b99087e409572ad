// Measures of one user in one session, from the recording of a room.
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "lab/therapy/hand_motion.hpp"

namespace tandem::lab {

/// Largest number of levels and goals of a session. A session with more is refused.
inline constexpr std::size_t kMaxParts = 2000;
/// Largest number of movements that are stored one by one. The measures include all.
inline constexpr std::size_t kMaxMovements = 10'000;

enum class PartKind : std::uint8_t { kSession, kLevel, kGoal };
/// kNone: the scene has no game. kOpen: the recording ends, or another level starts, before the end of the level.
enum class PartOutcome : std::uint8_t { kNone, kReached, kFailed, kOpen };

std::string text_of(PartKind kind);
std::string text_of(PartOutcome outcome);

/// Measures of a whole session, of one try of a level, or of a goal. Times count from the user's join. Numbers that are
/// not known are NaN.
struct PartMeasures {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

  PartKind kind = PartKind::kSession;
  PartOutcome outcome = PartOutcome::kNone;
  std::string name;
  double begin_s = 0;   ///< a goal begins with its level or, if the goals are in order, with the end of the one before
  double time_s = 0;    ///< duration
  double moving_s = 0;  ///< duration of the movements
  double path_m = 0;    ///< path of the hand
  double score = kUnknown;                                  ///< gained points
  double force_mean_n = kUnknown, force_peak_n = kUnknown;  ///< magnitude of the force of the coupling on the hand
  /// Smoothness of the movements that begin in this part: median and quartiles.
  double smoothness = kUnknown, smoothness_low = kUnknown, smoothness_high = kUnknown;
  std::uint64_t movements = 0;
  std::uint64_t grasps = 0;   ///< number of times that a body was grasped
  std::uint64_t objects = 0;  ///< number of different bodies that were held
  std::optional<MotionRange> range = {};
};

struct SessionMeasures {
  std::uint64_t recording = 0;  ///< number of the recording; the same session is not stored twice
  std::string begun_utc;        ///< time of the user's join, such as 2026-12-01T10:00:00Z
  std::string scene;
  bool is_cut = false;                       ///< the recording is damaged; the readable part was measured
  std::optional<MotionRange> calibration{};  ///< range of motion before the session
  std::vector<PartMeasures> parts;           ///< first the session, then levels and goals by their begin
  std::vector<Movement> movements;           ///< the first kMaxMovements

  const PartMeasures& whole() const { return parts.front(); }
  /// Number of parts of this kind and outcome.
  std::size_t count(PartKind kind, PartOutcome outcome) const;
};

/// Measures a session.
/// In      file  first file of a recording by `tandem-server --record`
///         user  name of the user in the recording; empty: its only user with a tool
///         calibration_s  first seconds after the join of the user that are the calibration, 1..kMaxSession_s; none: the
///                 session has no calibration
/// Fails   std::invalid_argument, which names file, field and remedy: the file is no recording of a room, the user is
///         not in it or not the only one, no motion of the user was recorded, less than 1 s of the calibration was
///         recorded, or a limit is exceeded
SessionMeasures measure_session(const std::filesystem::path& file, const std::string& user,
                                std::optional<double> calibration_s = {});

/// Returns the range of motion of a user in a recording of a calibration.
/// Fails   as measure_session()
MotionRange measure_calibration(const std::filesystem::path& file, const std::string& user);

}  // namespace tandem::lab
