// What the hand is shown, given what is known: one replaceable stage of the haptic path. Stages are compared
// with each other in the lab under the same names as on the command line.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/coupling/coupling_law.hpp"
#include "common/time.hpp"
#include "proto/state.hpp"

namespace tandem {

/// What a stage may use at one haptic tick.
struct StageInput {
  LocalTime now{};
  RigidState handle;                      ///< X_WH, V_WH of this tick
  const ServerUpdate* newest = nullptr;   ///< newest server state; null before the first
  Duration age{0};                        ///< since `newest` arrived
  const CouplingLaw* coupling = nullptr;  ///< the scene's law, never null
};

class Stage {
 public:
  virtual ~Stage() = default;
  virtual std::string_view name() const noexcept = 0;
  /// Wrench on the hand in W, about the handle; zero when nothing is known.
  /// Thread  haptic: no allocation, no throw
  virtual Wrench wrench_on_hand_W(const StageInput& input) noexcept = 0;
  /// Forget history: a new connection, or the hand was repositioned.
  virtual void reset() noexcept {}
};

/// "late-pose": local coupling to the newest tool pose of the server. A law whose tool is at the handle has no coupling
/// that could be rendered here: then the server's wrench is shown, as "hold" does.
class LatePose final : public Stage {
 public:
  std::string_view name() const noexcept override { return "late-pose"; }
  Wrench wrench_on_hand_W(const StageInput& input) noexcept override;
};

/// "hold": the newest wrench of the server, unchanged until the next.
class Hold final : public Stage {
 public:
  std::string_view name() const noexcept override { return "hold"; }
  Wrench wrench_on_hand_W(const StageInput& input) noexcept override;
};

/// Null for an unknown name.
std::unique_ptr<Stage> make_stage(std::string_view name);
std::vector<std::string_view> stage_names();
/// "late-pose, hold": for messages.
std::string listed_stage_names();

}  // namespace tandem
