// The goals of a scene file: defaults and checks.
#pragma once

#include <cstddef>
#include <string>

#include "proto/signals.hpp"
#include "server/assets/scene_field.hpp"
#include "tandem/scene.pb.h"

namespace tandem::server {

inline constexpr std::size_t kMaxLevels = 16, kMaxGoalsPerLevel = 16, kMaxConditionsPerGoal = 16;
/// Limit of the number of silhouettes in all levels together.
inline constexpr std::size_t kMaxSilhouettes = 32;
/// Limit of the number of pieces (outlines) of one silhouette.
inline constexpr std::size_t kMaxPieces = 16;

using proto::kMaxSignals, proto::kMaxSignalStates;
inline constexpr std::size_t kMaxTableRows = 16, kMaxSolutions = 4;

/// Fills in the defaults of a game that are not numbers, or that depend on other fields.
void complete_goals(wire::Scene& scene);
/// Refuses the first goal that cannot be evaluated. The message includes the remedy.
void check_goals(const wire::Scene& scene, const SceneField& file);
/// Returns the remedy for an unknown field in a message of a game; empty if the field is not in a game.
std::string unknown_goal_field_remedy(const std::string& field);

}  // namespace tandem::server
