// Stage: the exchangeable part of the haptic path that computes the wrench on the hand from the handle and the received
// state. The lab compares the stages, with and without passivity controller, under the names of the command line.
// Stages with a residual are also compared with each predictor.
//
//   handle, newest server state ──▶ stage ──▶ passivity controller ──▶ safety ──▶ device
//                                    │ ▲
//                   fit of predictors└─┘ service(), another thread
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "client/exchange/mailboxes.hpp"
#include "common/base/time.hpp"
#include "common/haptics/coupling/coupling_law.hpp"
#include "common/haptics/wave/wave.hpp"
#include "proto/state.hpp"

namespace tandem::client {

class LocalModel;
class ProxyWorld;

/// Name of the predictor that weights the residual by the accuracy of its recent predictions.
inline constexpr std::string_view kScoredPredictor = "scored";

/// Maximum number of samples that a stage processes in one tick, whatever time stamps are received from the server.
inline constexpr std::uint64_t kMaxStageSamples = 512;

/// Selects a stage and its parts. The names are the same on the command line, in experiment files and in reports.
struct StageSettings {
  std::string name = "local-model";  ///< name of the stage, one of stage_names()
  /// Predictor of the residual, one of predictor_names(); "none" also disables the prediction of other users' hands
  std::string predictor = "scored";
  bool passivity = true;          ///< true: the passivity controller follows the stage
  haptics::WaveImpedance wave{};  ///< wave impedance of the stage "wave"
};

/// Inputs of a stage at one haptic tick.
struct StageInput {
  LocalTime now{};
  Tick tick;
  double period_s = 0.001;                         ///< measured time since the last tick; > 0, at most 0.01
  RigidState handle;                               ///< pose and twist of the handle (X_WH, V_WH) in this tick
  std::uint32_t buttons = 0;                       ///< pressed buttons, as bits of Button
  const ReceivedUpdate* newest = nullptr;          ///< newest server state; null before the first state
  bool is_new = false;                             ///< true: `newest` was received after the previous tick
  Duration age{0};                                 ///< age of `newest`: time since reception plus its age when sent
  const haptics::CouplingLaw* coupling = nullptr;  ///< the scene's coupling law; never null
  const haptics::CouplingParameters* parameters = nullptr;  ///< coefficients, bounded for the device; never null
  const HapticScene* scene = nullptr;                       ///< current scene, with the coupling bounds of this device
  LocalModel* local_model = nullptr;                        ///< null if the current scene has no local model
  /// ball of stage "god-object" and its obstacles; null if there are none
  ProxyWorld* proxy_world = nullptr;
  BodyId watched;  ///< body whose state is to be reported in StageOutput::watched_body
};

/// Outputs of a stage at one tick, all in the world frame W.
struct StageOutput {
  Wrench wrench_on_hand_W;  ///< wrench on the hand, about the handle's origin
  /// Method of bridging the network delay. It determines the fields that the update to the server contains.
  proto::ClientMode mode = proto::ClientMode::kHandle;
  RigidState tool;         ///< tool of the local model, or ball of stage "god-object"; not sent
  Wrench wave;             ///< running integral of the wave for kWave (common/haptics/wave/wave_port.hpp)
  Duration round_trip{0};  ///< round trip from an input to its answer, as measured by the stage; 0 if not known
  /// The remaining values do not determine the wrench. is_local and energy_from_local_j are inputs of the passivity
  /// controller; the others are for traces and metrics.
  bool is_local = false;          ///< true: the wrench comes from the local model or the ball, whose state is `tool`
  Wrench local_wrench_on_hand_W;  ///< wrench of the local model or of the ball, without the predicted residual
  bool is_predicting = false;     ///< true: the wrench contains a predicted part
  bool has_watched_body = false;
  RigidState watched_body;  ///< state of the watched body in the local model
  /// Net energy that local bodies and fields have supplied to the coupling since the start [J]. The passivity
  /// controller adds each increase to the energy that the hand may receive, like energy supplied by the server's world.
  double energy_from_local_j = 0;
  /// Number of samples that a force stream appended in this tick; at most kMaxStageSamples.
  std::uint64_t samples = 0;
};

/// One method of rendering the scene to the hand.
///
/// Thread  tick(), set_displayed() and reset(): haptic, no allocation, no throw. service(): one other thread at a time,
///         concurrently with the haptic thread. Between these threads a stage exchanges data by mailboxes, not locks
class Stage {
 public:
  virtual ~Stage() = default;
  virtual std::string_view name() const noexcept = 0;
  /// Computes the wrench; it is zero if no server state is known. Called at each tick with a valid sample and a scene
  /// whose force may be displayed.
  virtual StageOutput tick(const StageInput& input) noexcept = 0;
  /// Reports the wrench about the handle that is displayed for the coming period, after passivity controller, safety
  /// chain and clamp.
  virtual void set_displayed(const Wrench& on_hand_W) noexcept { static_cast<void>(on_hand_W); }
  /// Discards the history. Called when a new scene starts.
  virtual void reset() noexcept {}
  /// Does slow work such as fitting predictors, outside the haptic tick, for at most 1 ms. May be called at any time,
  /// even without new data.
  virtual void service() noexcept {}
};

/// Returns null for an unknown name or predictor.
std::unique_ptr<Stage> make_stage(const StageSettings& settings);
/// Fails   std::invalid_argument: unknown stage or predictor (the message lists the existing ones), unusable impedance
std::unique_ptr<Stage> require_stage(const StageSettings& settings);
/// Returns true if the stage needs a local model. Client builds the model for such a stage.
bool needs_local_model(std::string_view stage);
/// Returns whether the stage renders the contact of a ball instead of the tool. Such a stage cannot render every scene
/// (proxy_problem()).
bool needs_proxy_world(std::string_view stage);
/// Returns the names of all stages (or predictors), in the order of the help text.
std::vector<std::string_view> stage_names();
std::vector<std::string_view> predictor_names();
/// Returns the names of all stages (or predictors) as one line for messages: "late-pose, hold, …".
std::string listed_stage_names();
std::string listed_predictor_names();

}  // namespace tandem::client
