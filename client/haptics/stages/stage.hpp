// One replaceable stage of the haptic path: computes the wrench on the hand from the handle and the received state. The
// lab compares stages under the same names as on the command line, each with and without passivity controller. Stages
// that leave a residual are also compared with each predictor of it.
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

#include "client/exchange/mailboxes.hpp"
#include "common/base/time.hpp"
#include "common/haptics/coupling/coupling_law.hpp"
#include "common/haptics/wave/wave.hpp"
#include "proto/state.hpp"

namespace tandem::client {

class LocalModel;
class ProxyWorld;

/// Predictor that displays the residual to the extent that its recent predictions were right.
inline constexpr std::string_view kScoredPredictor = "scored";

/// Limit of the samples that a stage processes in one tick, whatever the server's time stamps are.
inline constexpr std::uint64_t kMaxStageSamples = 512;

/// Selects a stage and its parts. The names are the same on the command line, in experiment files and in reports.
struct StageSettings {
  std::string name = "local-model";  ///< one of stage_names()
  std::string predictor = "scored";  ///< one of predictor_names(), for the residual; "none" also for hands
  bool passivity = true;             ///< a passivity controller follows the stage
  haptics::WaveImpedance wave{};     ///< for "wave"
};

/// Inputs of a stage at one haptic tick.
struct StageInput {
  LocalTime now{};
  Tick tick;
  double period_s = 0.001;                 ///< measured since the last tick; > 0, at most 0.01
  RigidState handle;                       ///< X_WH, V_WH of this tick
  std::uint32_t buttons = 0;               ///< bits of Button
  const ReceivedUpdate* newest = nullptr;  ///< newest server state; null before the first
  bool is_new = false;                     ///< `newest` arrived since the last tick
  Duration age{0};                         ///< age of `newest` (HapticCore): since it arrived, plus its age when sent
  const haptics::CouplingLaw* coupling = nullptr;           ///< the scene's law, never null
  const haptics::CouplingParameters* parameters = nullptr;  ///< of `coupling`, bounded by the device; never null
  const HapticScene* scene = nullptr;                       ///< its coupling_bounds include this user's device
  LocalModel* local_model = nullptr;                        ///< model of this scene; null: none
  ProxyWorld* proxy_world = nullptr;                        ///< ball of this scene; null: none
  BodyId watched;                                           ///< body whose local pose is reported, if the stage has one
};

/// Outputs of a stage at one tick, all in W.
struct StageOutput {
  Wrench wrench_on_hand_W;  ///< about the handle
  /// Sent to the server in addition to the handle.
  proto::ClientMode mode = proto::ClientMode::kHandle;
  RigidState tool;         ///< the stage's own tool, if it has one; not sent
  Wrench wave;             ///< for kWave: running integral of the wave, common/haptics/wave/wave_port.hpp
  Duration round_trip{0};  ///< measured by the stage at matched input; 0: not known
  /// For traces and metrics.
  bool is_local = false;          ///< the wrench comes from a local model or ball, which `tool` describes
  Wrench local_wrench_on_hand_W;  ///< the local model's or ball's part, without the predicted residual
  bool is_predicting = false;     ///< the wrench contains a predicted part
  bool has_watched_body = false;
  RigidState watched_body;  ///< local copy of it
  /// Cumulative net energy that the stage's own stores (local bodies, fields) have given to the coupling. The passivity
  /// controller credits its increase to the hand, like the energy that the server drew from the world.
  double energy_from_local_j = 0;
  /// Samples that a force stream appended in this tick because of the server's time stamps: at most kMaxStageSamples.
  std::uint64_t samples = 0;
};

/// One method of rendering the scene to the hand.
///
/// Thread  tick(), set_displayed() and reset(): haptic, no allocation, no throw. service(): one other thread at a time,
///         concurrently with the haptic one; a stage that implements it exchanges data by mailbox, never by a lock.
class Stage {
 public:
  virtual ~Stage() = default;
  virtual std::string_view name() const noexcept = 0;
  /// Computes the wrench; zero when no state is known. Called at each tick with a valid hand and a displayable scene.
  virtual StageOutput tick(const StageInput& input) noexcept = 0;
  /// Reports the wrench displayed for the coming period, after passivity controller, safety and clamp, about the
  /// handle.
  virtual void set_displayed(const Wrench& on_hand_W) noexcept { static_cast<void>(on_hand_W); }
  /// Discards the history, after a new connection or a repositioned hand.
  virtual void reset() noexcept {}
  /// Off-path work, such as fitting predictors. May be called at any time, also without new data. Bounded: ≤ 1 ms.
  virtual void service() noexcept {}
};

/// Returns null for an unknown name or predictor.
std::unique_ptr<Stage> make_stage(const StageSettings& settings);
/// Fails   std::invalid_argument: unknown stage or predictor (the message lists the existing ones), unusable impedance
std::unique_ptr<Stage> require_stage(const StageSettings& settings);
/// True if the stage needs a local model, which Client builds.
bool needs_local_model(std::string_view stage);
/// True if the stage renders the contact of a ball instead of the tool. It cannot render every scene (proxy_problem()).
bool needs_proxy_world(std::string_view stage);
/// Names in the order of help texts.
std::vector<std::string_view> stage_names();
std::vector<std::string_view> predictor_names();
/// "late-pose, hold, …": names as one line for messages.
std::string listed_stage_names();
std::string listed_predictor_names();

}  // namespace tandem::client
