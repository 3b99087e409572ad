// Local model: the client's copy of its tool and of the bodies it touches. It is stepped at 1 kHz by the server's code,
// so that contact, friction and fields respond to the hand at once, whatever the delay.
//
//   static bodies            same as at the server: only the tool itself is reconciled
//   other users' tools       stepped here too, each pulled to its user's predicted hand (Partner)
//   bodies that any tool     predicted here; the server's state answers an old input and is compared with the model
//   touches                  at that input; the difference is removed slowly (Reconciler)
//   bodies that others       follow the server: played out at a constant delay, then extrapolated to the present
//   move                     by their velocity
//   soft bodies              the server's linearised contact, sent before the touch (SoftFollower)
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "client/exchange/mailboxes.hpp"
#include "client/model/input_history.hpp"
#include "client/model/partner.hpp"
#include "client/model/reconciler.hpp"
#include "client/model/soft_follower.hpp"
#include "common/net/playout.hpp"
#include "common/physics/world.hpp"
#include "proto/state.hpp"

namespace tandem::client {

/// Deliberate errors of the model, for experiments.
struct ModelErrors {
  double mass_scale = 1;              ///< factor on the masses of moving bodies
  double friction_scale = 1;          ///< factor on the friction of bodies
  Vec3 shape_shift_m = Vec3::Zero();  ///< offset of every body's surface, in the body's frame

  bool operator==(const ModelErrors&) const = default;
};

struct LocalModelSettings {
  ReconcilerSettings body{};
  /// Small, because the coupling holds the tool: removes errors left by friction or by a gap passed on the other side.
  ReconcilerSettings tool{.time_constant_s = 0.3,
                          .speed_limit_m_per_s = 0.02,
                          .turn_limit_rad_per_s = 0.3,
                          .dead_zone_m = 2e-4,
                          .dead_zone_rad = 5e-3};
  net::PlayoutSettings playout;
  /// Limits of the extrapolation of bodies that others move.
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
  const ReceivedUpdate* newest = nullptr;  ///< newest state of this scene; null before the first
  bool is_new = false;
  bool predicts_partners = true;       ///< predicts other users' hands; false: they stay at their last received poses
  const HapticScene* scene = nullptr;  ///< the scene's coupling, and its bounds by the users' devices
};

/// Thread  construction: any; then haptic only: no allocation, no throw
class LocalModel {
 public:
  /// In      tool  the user's own tool, an index into description.tools
  LocalModel(const std::shared_ptr<const physics::WorldDescription>& description, std::size_t tool,
             const LocalModelSettings& settings = {});
  ~LocalModel();

  /// Makes one step. Returns zero before the first server state.
  /// Out     wrench on the hand, about the handle, in W
  Wrench step(const LocalModelInput& input) noexcept;

  /// Continues from the state of another model of the same scene, instead of starting from the server's state. Does
  /// nothing if that model has not started, or has other bodies or tools. The other model must not be stepped
  /// afterwards. Effects start anew, and a just released body may collide with the tool.
  ///
  /// In      scene  gives the coupling and bounds with which tools are pulled from the start, as in LocalModelInput
  void continue_from(LocalModel& other, const HapticScene& scene) noexcept;

  bool has_started() const { return has_started_; }
  RigidState tool() const { return tool_state_.tool; }
  BodyId held() const { return tool_state_.held; }
  /// State of a body in the model.
  RigidState body(BodyId id) const { return world_.body(id); }
  /// Current contact points of the tool, or of the body it holds (World::contact_points_W()).
  std::size_t contact_points_W(std::span<Vec3> out) const noexcept { return world_.contact_points_W(tool_, out); }
  /// Another user's tool in the model; `received` if the model does not contain it.
  RigidState partner_tool(UserId user, const RigidState& received) const noexcept;
  /// Delay from an input to the use of the server's answer, including buffering at both ends; 0: not known yet.
  Duration loop_delay() const { return loop_delay_; }
  /// Residual: the server's wrench on the hand minus the model's for the same input, from the newest update that
  /// answered a known input. Consumed by the call.
  std::optional<Wrench> pop_residual() noexcept;
  /// The newest residual, consumed or not; zero before the first.
  const Wrench& newest_residual() const { return newest_residual_; }
  /// Time of the input that the newest residual belongs to.
  LocalTime residual_of() const { return residual_of_; }
  /// Largest Partner::common_share() of the other users: 1 if one has a hand on a body that this user moves. 1 without
  /// others.
  double common_share() const noexcept;
  /// Net work of the hand's coupling on the model [J].
  double coupling_work_j() const { return tool_state_.energy_into_world_j - tool_state_.energy_from_world_j; }
  /// True if the model jumped, for example to the server's state; the displayed force must not jump. Consumed by the
  /// call.
  bool pop_jump() noexcept;
  TickFaults faults() const { return faults_; }

 private:
  /// A movable body in the model.
  struct Copy {
    Copy(BodyId its_id, const LocalModelSettings& settings) : id(its_id), reconciler(settings.body) {}
    BodyId id;
    net::RigidTrack track;
    Reconciler reconciler;
    bool is_known = false;     ///< the server has sent its state
    double unpressed_s = 1e9;  ///< time since any tool last pressed or held it [s]
    double untouched_s = 1e9;  ///< time since this user's tool last held or pressed it [s]
    Shift offset = {};         ///< remaining offset to its pose before it began to follow the server
    bool was_followed = false;

    /// True if the user's tool touches the body, or did within kTouchKept_s.
    bool is_touched() const;
  };
  /// A partner and their tool in the model.
  struct PartnerHere {
    Partner partner;
    std::size_t tool = 0;  ///< the tool in the model, which holds `held`
    bool is_here = false;
    BodyId held;
  };

  static std::vector<Copy> copies_of(const physics::WorldDescription& description, const LocalModelSettings& settings);
  void start(const proto::ServerUpdate& update) noexcept;
  void set_tool_state(std::size_t tool, const physics::ToolState& state) noexcept;
  void receive_update(const LocalModelInput& input) noexcept;
  void compare_tool(const proto::ServerUpdate& update, const ModelThen& then, const LocalModelInput& input) noexcept;
  void mirror_grasp(const proto::ServerUpdate& update) noexcept;
  void follow_buttons(const LocalModelInput& input) noexcept;
  void receive_partners(const proto::ServerUpdate& update) noexcept;
  void drive_partners(const LocalModelInput& input, Duration played, Duration present, double period_s) noexcept;
  void bring_in(PartnerHere& here) noexcept;
  PartnerSurroundings surroundings_of(const PartnerHere& here, Duration played) noexcept;
  void remove_partner(PartnerHere& here) noexcept;
  bool is_held_by_partner(BodyId body) const noexcept;
  void follow_soft_contact(const proto::ServerUpdate& update, bool is_new, double period_s) noexcept;
  void drive_copies(const LocalModelInput& input, double period_s) noexcept;
  bool is_implicit(const Copy& copy) const noexcept;
  void follow_touches(double period_s) noexcept;
  void reconcile(Copy& copy, double period_s) noexcept;
  RigidState seen_at_present(const Copy& copy, Duration played, Duration present) const noexcept;
  void follow(Copy& copy, Duration played, Duration present, double period_s) noexcept;
  void correct_tool(double period_s) noexcept;
  void remember(Tick input) noexcept;

  LocalModelSettings settings_;
  std::size_t tool_;
  std::size_t tools_;  ///< number of tools in the scene
  double step_s_;
  physics::World world_;
  std::vector<Copy> copies_;
  InputHistory history_;
  Reconciler tool_reconciler_;
  net::PlayoutDelay playout_;
  physics::ToolState tool_state_;
  TickFaults faults_ = 0;
  bool has_started_ = false;
  Duration loop_delay_{0};
  std::optional<Wrench> residual_;
  Wrench newest_residual_;
  LocalTime residual_of_{};
  std::vector<PartnerHere> partners_;    ///< reserved for kMaxUsers
  std::optional<Tick> predicted_grasp_;  ///< input of a predicted grasp or release that the server has not answered yet
  LocalTime predicted_grasp_at_{};
  bool grab_button_ = false;
  bool has_jumped_ = false;
  double diverged_s_ = 0;  ///< time for which the tool has differed from the server's beyond kDivergence_m [s]
  SoftFollower soft_;
  BodyId soft_of_;  ///< body that soft_ belongs to: the held body, else invalid for the tool itself
};

}  // namespace tandem::client
