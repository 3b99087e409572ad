// Local model: the client's copy of the scene's tools and bodies. It is stepped at 1 kHz by the code of the server's
// world, so that contact, friction and fields respond to the hand at once, at any network delay.
//
//   static bodies            same as at the server; they need no reconciliation
//   this user's tool         stepped here and reconciled with the server (Reconciler)
//   other users' tools       stepped here too, each pulled to its user's predicted hand (PartnerTools)
//   bodies in touch with     predicted here. The server's state answers an old input and is compared with the model's
//   a tool                   state at that input. The difference is removed slowly (BodyCopy, Reconciler)
//   other moving bodies      follow the server: played out at a constant delay, then extrapolated to the current time
//                            by their velocity (BodyCopy)
//   the user's grasp         predicted when the button changes, then the server's result applies (GraspPrediction)
//   soft bodies              linearised contact from the server, sent before the first contact (SoftFollower)
//
// RECONCILIATION.md in this folder explains the algorithm.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "client/exchange/mailboxes.hpp"
#include "client/model/body_copy.hpp"
#include "client/model/grasp_prediction.hpp"
#include "client/model/input_history.hpp"
#include "client/model/partner_tools.hpp"
#include "client/model/reconciler.hpp"
#include "client/model/soft_follower.hpp"
#include "common/net/playout.hpp"
#include "common/physics/world.hpp"
#include "proto/state.hpp"

namespace tandem::client {

/// Deliberate errors of the model, for experiments with a model that differs from the server's world.
struct ModelErrors {
  double mass_scale = 1;              ///< factor on the masses and inertias of moving bodies
  double friction_scale = 1;          ///< factor on the friction between a tool and a body
  Vec3 shape_shift_m = Vec3::Zero();  ///< offset of every body's surface, in the body's frame

  bool operator==(const ModelErrors&) const = default;
};

struct LocalModelSettings {
  ReconcilerSettings body{};
  /// Correction of the tool. Low limits are sufficient, because the coupling pulls the tool to the handle in any case.
  /// The correction removes errors due to friction. It also removes the error if the tool has passed an obstacle on one
  /// side here and on the opposite side at the server.
  ReconcilerSettings tool{.time_constant_s = 0.3,
                          .speed_limit_m_per_s = 0.02,
                          .turn_limit_rad_per_s = 0.3,
                          .dead_zone_m = 2e-4,
                          .dead_zone_rad = 5e-3};
  net::PlayoutSettings playout;
  /// Limits of the extrapolation of bodies that follow the server's states, by time and by distance.
  Duration longest_extrapolation{std::chrono::milliseconds(150)};
  double farthest_extrapolation_m = 0.02;
  ModelErrors errors;
};

struct LocalModelInput {
  Tick input;
  LocalTime now{};
  RigidState handle;
  bool has_handle = true;
  std::uint32_t buttons = 0;
  const ReceivedUpdate* newest = nullptr;  ///< newest server state of this scene; null before the first state
  bool is_new = false;
  /// Whether other users' hands are predicted; false: they stay at their last received poses
  bool predicts_partners = true;
  const HapticScene* scene = nullptr;  ///< scene with its coupling and the coupling bounds of the users' devices
};

/// The client's predicted copy of one scene, as described at the top of this file.
///
/// Thread  construction: any; then haptic only: no allocation, no throw
class LocalModel {
 public:
  /// In      tool  index of this user's tool in description.tools
  LocalModel(const std::shared_ptr<const physics::WorldDescription>& description, std::size_t tool,
             const LocalModelSettings& settings = {});
  ~LocalModel();

  /// Advances the model by one step. Returns zero before the first server state.
  /// Out     wrench of the coupling on the hand, about the handle's origin, in W
  Wrench step(const LocalModelInput& input) noexcept;

  /// Continues from the state of another model of the same scene, instead of starting from the server's state. Does
  /// nothing if `other` has not started, or has different bodies or tools. The two models swap their states, so `other`
  /// must not be stepped afterwards.
  ///
  /// Two values are not taken over: the state of effects, and the temporary exemption from contact of a body that the
  /// tool has just released. Without the exemption, tool and body may collide.
  ///
  /// In      scene  coupling of the tools and its bounds, as in LocalModelInput
  void continue_from(LocalModel& other, const HapticScene& scene) noexcept;

  bool has_started() const { return state_.has_started; }
  RigidState tool() const { return state_.tool.tool; }
  BodyId held() const { return state_.tool.held; }
  /// Returns the state of a body in the model.
  RigidState body(BodyId id) const { return world_.body(id); }
  /// Writes the current contact points of the tool, or of the body that it holds (World::contact_points_W()). Returns
  /// their number.
  std::size_t contact_points_W(std::span<Vec3> out) const noexcept { return world_.contact_points_W(tool_, out); }
  /// Returns the state of another user's tool in the model, or `received` if the model does not contain that tool.
  RigidState partner_tool(UserId user, const RigidState& received) const noexcept {
    return state_.partners.tool_of(user, received, world_);
  }
  /// Returns the delay from an input to the use of the server's answer, including buffering at client and server.
  /// Returns 0 if it is not known yet.
  Duration loop_delay() const { return state_.loop_delay; }
  /// Returns the residual: the server's wrench on the hand minus the model's wrench for the same input. It is computed
  /// for each server update that answers an input of the history. Returns nothing if the newest residual was already
  /// returned.
  std::optional<Wrench> pop_residual() noexcept;
  /// Returns the newest residual, even if pop_residual() has returned it; zero before the first residual.
  const Wrench& newest_residual() const { return state_.newest_residual; }
  /// Returns the time of the input to which the newest residual belongs.
  LocalTime residual_of() const { return state_.residual_of; }
  /// Returns the weight of the predicted residual: 1 while another user has a hand on a body that this user moves.
  /// After that user has left the body, the weight falls to 0 within 2 s. Returns 1 without other users.
  double common_share() const noexcept { return state_.partners.common_share(); }
  /// Returns the net work of the hand's coupling on the model [J].
  double coupling_work_j() const { return state_.tool.energy_into_world_j - state_.tool.energy_from_world_j; }
  /// Returns true if the model has jumped since the last call, for example to the server's state after a divergence.
  /// The caller must then blend the displayed force.
  bool pop_jump() noexcept;
  TickFaults faults() const { return faults_; }

 private:
  /// State that a second model of the same scene can take over (continue_from()).
  struct State {
    State(const physics::WorldDescription& description, const LocalModelSettings& settings);

    std::vector<BodyCopy> bodies;  ///< one copy for each movable body
    PartnerTools partners;
    InputHistory history;
    Reconciler tool_reconciler;
    net::PlayoutDelay playout;
    GraspPrediction grasp;
    SoftFollower soft;
    physics::ToolState tool;  ///< state of this user's tool after the last step
    bool has_started = false;
    bool has_jumped = false;
    Duration loop_delay{0};
    std::optional<Wrench> residual;  ///< newest residual until pop_residual() has returned it
    Wrench newest_residual;
    LocalTime residual_of{};
    double diverged_s = 0;                 ///< duration of the present divergence [s] (kDivergence_m)
    std::optional<LocalTime> compared_at;  ///< time at which a server state was last compared with the history
  };

  void start(const proto::ServerUpdate& update, const HapticScene& scene) noexcept;
  void receive_update(const LocalModelInput& input) noexcept;
  void receive_bodies(const proto::ServerUpdate& update, const ModelThen* then) noexcept;
  double interval_to(LocalTime now) noexcept;
  void update_loop_delay(Duration loop, double interval_s) noexcept;
  void compare_tool(const proto::ServerUpdate& update, const ModelThen& then, const LocalModelInput& input,
                    double interval_s) noexcept;
  void restart_from(const proto::ServerUpdate& update) noexcept;
  void mirror_grasp(const proto::ServerUpdate& update) noexcept;
  void set_couplings(const HapticScene& scene) noexcept;
  void follow_game(const HapticScene& scene) noexcept;
  bool is_absent_in_game(BodyId id) const noexcept { return (absent_bodies_ >> (id.value - 1) & 1U) != 0; }
  void follow_buttons(const LocalModelInput& input) noexcept;
  void drive_bodies(const LocalModelInput& input) noexcept;
  ModelStep step_at(Duration played, Duration present) noexcept;
  void correct_tool() noexcept;
  void follow_soft_contact(const proto::ServerUpdate& update, bool is_new) noexcept;
  void note_jump(bool has_jumped) noexcept { state_.has_jumped = state_.has_jumped || has_jumped; }
  double grip_step_m() const noexcept { return settings_.body.speed_limit_m_per_s * step_s_; }
  void remember(Tick input) noexcept;

  LocalModelSettings settings_;
  std::size_t tool_;
  std::size_t tools_;  ///< number of tools in the scene
  double step_s_;
  physics::World world_;
  TickFaults faults_ = 0;            ///< faults of the last step
  std::uint64_t absent_bodies_ = 0;  ///< HapticScene::absent_bodies at the last step
  State state_;
};

}  // namespace tandem::client
