// Reads the data of one user from the recording of a room: motion of the hand, forces, held bodies, and the game.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "lab/therapy/session_measures.hpp"

namespace tandem::lab {

/// State of the user's tool, recorded 50 times a second.
struct ToolSample {
  double at_s = 0;
  double force_n = 0;  ///< magnitude of the force on the hand
  std::uint32_t held_body = 0;
};

/// A level or goal of a game. Its times count from the user's join. `begin_s` is negative if the level or goal began
/// before the join.
struct GamePart {
  PartKind kind = PartKind::kLevel;
  PartOutcome outcome = PartOutcome::kOpen;
  std::string name;
  double begin_s = 0, end_s = 0;
  double score = 0;
};

struct RecordedHand {
  HandMotion motion;
  std::vector<ToolSample> tool_samples;
  std::vector<GamePart> game_parts;
  PartOutcome game_outcome = PartOutcome::kNone;
  double score = PartMeasures::kUnknown;
  std::uint64_t recording = 0;
  std::uint64_t joined_ns = 0;  ///< time of the user's first join [ns since 1970]
  std::string scene;
  bool is_damaged = false;
};

/// Reads the data of a user from a recording.
/// Fails   see measure_session()
RecordedHand read_hand(const std::filesystem::path& file, const std::string& user);

}  // namespace tandem::lab
