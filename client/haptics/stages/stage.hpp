// What the hand is shown, given what is known: one replaceable stage of the haptic path. Stages are compared
// with each other in the lab under the same names as on the command line, each with and without passivity controller,
// and those that leave a residual with each way of predicting it.
//
//   handle, newest server state ──▶ stage ──▶ passivity controller ──▶ safety ──▶ device
//                                    │ ▲
//                     fitted off path└─┘ service(), another thread
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "client/haptics/mailboxes.hpp"
#include "common/base/time.hpp"
#include "common/haptics/coupling/coupling_law.hpp"
#include "common/haptics/wave/wave.hpp"
#include "proto/state.hpp"

namespace tandem::client {

class LocalModel;
class ProxyWorld;

/// The predictor that shows of a residual what came true lately.
inline constexpr std::string_view kScoredPredictor = "scored";

/// What the server's time stamps can make a stage process in one tick, whatever they say.
inline constexpr std::uint64_t kMaxStageSamples = 512;

/// Which stage, with which parts. The same names on the command line, in experiment files and in reports.
struct StageSettings {
  std::string name = "local-model";  ///< one of stage_names()
  std::string predictor = "scored";  ///< one of predictor_names(): of a residual; "none" foresees no hands either
  bool passivity = true;             ///< a passivity controller follows the stage
  haptics::WaveImpedance wave{};     ///< of "wave"
};

/// What a stage may use at one haptic tick.
struct StageInput {
  LocalTime now{};
  Tick tick;
  double period_s = 0.001;                                  ///< since the last tick, of the clock; > 0, at most 0.01
  RigidState handle;                                        ///< X_WH, V_WH of this tick
  std::uint32_t buttons = 0;                                ///< bits of Button
  const ReceivedUpdate* newest = nullptr;                   ///< newest server state; null before the first
  bool is_new = false;                                      ///< `newest` came since the last tick
  Duration age{0};                                          ///< since `newest` arrived
  const haptics::CouplingLaw* coupling = nullptr;           ///< the scene's law, never null
  const haptics::CouplingParameters* parameters = nullptr;  ///< in force in `coupling`, already bounded; never null
  const HapticScene* scene = nullptr;  ///< with what this user's device bears among the bounds of the coupling
  LocalModel* local_model = nullptr;   ///< of this scene; null: the session has none
  ProxyWorld* proxy_world = nullptr;   ///< likewise
  BodyId watched;                      ///< whose local pose is to be reported, if the stage has one
};

/// What a stage does at one tick. All in W.
struct StageOutput {
  Wrench wrench_on_hand_W;  ///< about the handle
  /// What is sent to the server besides the handle.
  proto::ClientMode mode = proto::ClientMode::kHandle;
  RigidState tool;         ///< the stage's own, if it has one; not sent
  Wrench wave;             ///< of kWave: the wave's running integral, common/haptics/wave/wave_port.hpp
  Duration round_trip{0};  ///< as the stage measured it at matched input; 0: not known
  /// For traces and metrics.
  bool is_local = false;          ///< the wrench is of a local model or ball: `tool` is that
  Wrench local_wrench_on_hand_W;  ///< of it, the local model's part: without the predicted residual
  bool is_predicting = false;     ///< a predictor is in the wrench
  bool has_watched_body = false;
  RigidState watched_body;  ///< of the local copy
  /// Cumulative: what the stage's own store of energy (local bodies, fields) has given the coupling so far, less what
  /// it got; the passivity controller lets the hand have its rise, as it does what the server drew from the world.
  double energy_from_local_j = 0;
  /// Samples that the server's time stamps made a force stream append in this tick: at most kMaxStageSamples.
  std::uint64_t samples = 0;
};

/// One way of showing the hand the scene.
///
/// Thread  tick(), set_displayed() and reset(): haptic, no allocation, no throw. service(): one other thread at a time,
///         beside the haptic one; a stage that implements it hands over by mailbox, never by a lock.
class Stage {
 public:
  virtual ~Stage() = default;
  virtual std::string_view name() const noexcept = 0;
  /// Zero wrench when nothing is known. Called at every tick at which the hand is valid and something may be displayed.
  virtual StageOutput tick(const StageInput& input) noexcept = 0;
  /// After passivity controller, safety and clamp: what the hand has got for the coming period, about the handle.
  virtual void set_displayed(const Wrench& on_hand_W) noexcept { static_cast<void>(on_hand_W); }
  /// Forget history: a new connection, or the hand was repositioned.
  virtual void reset() noexcept {}
  /// Off-path work, such as fitting predictors; may be called at any time, also when nothing is new. Bounded: ≤ 1 ms.
  virtual void service() noexcept {}
};

/// Null for an unknown name or predictor.
std::unique_ptr<Stage> make_stage(const StageSettings& settings);
/// Fails   std::invalid_argument: a stage or predictor that does not exist, with those that do; an unusable impedance
std::unique_ptr<Stage> require_stage(const StageSettings& settings);
/// Whether the stage shows a local model, which Client makes.
bool needs_local_model(std::string_view stage);
/// Whether the stage shows what a ball touches instead of the scene's tool, and so not every scene (proxy_problem()).
bool needs_proxy_world(std::string_view stage);
/// In the order of help texts.
std::vector<std::string_view> stage_names();
std::vector<std::string_view> predictor_names();
/// "late-pose, hold, …": for messages.
std::string listed_stage_names();
std::string listed_predictor_names();

}  // namespace tandem::client
