// The client's own piece of the world: its tool and what it touches, stepped at 1 kHz by the code that the server runs,
// so that contact, friction and fields answer the hand at once, whatever the delay.
//
//   static things            here as at the server: nothing to reconcile but the tool itself
//   other users' tools       stepped here too, each pulled to where its user's hand is by now (Partner)
//   bodies that any tool     predicted here; the server's state answers an old input, is compared with what was here
//   touches                  at that input, and the difference is taken out slowly (Reconciler)
//   bodies that others       follow the server, played at a constant delay and carried on to the present by their
//   move                     velocity
//   soft bodies              the server's linearised contact, told before the touch (SoftFollower)
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "client/haptics/mailboxes.hpp"
#include "client/model/input_history.hpp"
#include "client/model/partner.hpp"
#include "client/model/reconciler.hpp"
#include "client/model/soft_follower.hpp"
#include "common/net/playout.hpp"
#include "common/physics/world.hpp"
#include "proto/state.hpp"

namespace tandem::client {

/// For experiments: in what the model is wrong.
struct ModelErrors {
  double mass_scale = 1;              ///< of moving bodies, times what the server says
  double friction_scale = 1;          ///< of what bodies touch
  Vec3 shape_shift_m = Vec3::Zero();  ///< every body's surface is off by this, in the body's frame

  bool operator==(const ModelErrors&) const = default;
};

struct LocalModelSettings {
  ReconcilerSettings body{};
  /// The tool is held by its coupling, so it needs little: what friction or a gap passed on another side left.
  ReconcilerSettings tool{.time_constant_s = 0.3,
                          .speed_limit_m_per_s = 0.02,
                          .turn_limit_rad_per_s = 0.3,
                          .dead_zone_m = 2e-4,
                          .dead_zone_rad = 5e-3};
  net::PlayoutSettings playout;
  /// Bodies that others move are carried on by their velocity for so long at most.
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
  const ReceivedUpdate* newest = nullptr;  ///< of this scene; null before the first
  bool is_new = false;
  bool foresees_partners = true;       ///< where other users' hands go; else they stay where they were told
  const HapticScene* scene = nullptr;  ///< the coupling that it asks for, and what the users' devices bear of it
};

/// Thread  constructed anywhere; then haptic only: no allocation, no throw
class LocalModel {
 public:
  /// In      tool  the user's own, index into description.tools
  LocalModel(const std::shared_ptr<const physics::WorldDescription>& description, std::size_t tool,
             const LocalModelSettings& settings = {});
  ~LocalModel();

  /// One step. Zero before the first state of the server.
  /// Out     on the hand, about the handle, in W
  Wrench step(const LocalModelInput& input) noexcept;

  /// Instead of starting as the server has it: goes on where another model of the same scene is, with all that it knew.
  /// Does nothing when that one has not started, or has other bodies or tools. The other one is not to be stepped again.
  /// Effects begin anew, and a tool that has just let go may touch what it held.
  ///
  /// In      scene  as in LocalModelInput: by whose coupling, within whose bounds, tools are pulled from the start
  void go_on_from(LocalModel& other, const HapticScene& scene) noexcept;

  bool has_started() const { return has_started_; }
  RigidState tool() const { return tool_state_.tool; }
  BodyId held() const { return tool_state_.held; }
  /// As the model has it now.
  RigidState body(BodyId id) const { return world_.body(id); }
  /// Where the tool, or what it holds, touches now (World::contact_points_W()).
  std::size_t contact_points_W(std::span<Vec3> out) const noexcept { return world_.contact_points_W(tool_, out); }
  /// Another user's tool as the model steps it; `told` where it does not.
  RigidState partner_tool(UserId user, const RigidState& told) const noexcept;
  /// From an input to its effect being used here, the waiting at both ends included; 0: not known yet.
  Duration loop_delay() const { return loop_delay_; }
  /// What the server's wrench on the hand was beyond the model's for the same input, of the newest update that answered
  /// a known one; consumed by the call.
  std::optional<Wrench> take_residual() noexcept;
  /// The same, whether taken or not; zero before the first.
  const Wrench& newest_residual() const { return newest_residual_; }
  /// When that input was.
  LocalTime residual_of() const { return residual_of_; }
  /// How far another user's hand is on what this user moves (Partner::common_share(), the largest); 1 where there is none.
  double common_share() const noexcept;
  /// Work of the hand's coupling on the model, less what it gave back [J].
  double coupling_work_j() const { return tool_state_.energy_into_world_j - tool_state_.energy_from_world_j; }
  /// The tool was put where the server has it: what is displayed should not jump with it. Consumed by the call.
  bool take_jump() noexcept;
  TickFaults faults() const { return faults_; }

 private:
  /// A body that can move.
  struct Copy {
    Copy(BodyId its_id, const LocalModelSettings& settings) : id(its_id), reconciler(settings.body) {}
    BodyId id;
    net::RigidTrack track;
    Reconciler reconciler;
    bool is_known = false;     ///< the server has told of it
    double unpressed_s = 1e9;  ///< since any tool did
    double untouched_s = 1e9;  ///< since our tool last held or pressed it
    Shift offset = {};         ///< left of where it was when it began to be followed, or to be ours
    bool was_followed = false;

    /// Now, or not long enough ago to have been given up.
    bool is_touched() const;
  };
  /// A partner, and what of him is in the model's world.
  struct PartnerHere {
    Partner partner;
    std::size_t tool = 0;  ///< that is here, and holds `held` there
    bool is_here = false;
    BodyId held;
  };

  static std::vector<Copy> copies_of(const physics::WorldDescription& description, const LocalModelSettings& settings);
  void start(const proto::ServerUpdate& update) noexcept;
  void put_tool(std::size_t tool, const physics::ToolState& as) noexcept;
  void take_update(const LocalModelInput& input) noexcept;
  void compare_tool(const proto::ServerUpdate& update, const ModelThen& then, const LocalModelInput& input) noexcept;
  void mirror_grasp(const proto::ServerUpdate& update) noexcept;
  void follow_buttons(const LocalModelInput& input) noexcept;
  void take_partners(const proto::ServerUpdate& update) noexcept;
  void drive_partners(const LocalModelInput& input, Duration played, Duration present, double period_s) noexcept;
  void bring_in(PartnerHere& here) noexcept;
  PartnerSurroundings surroundings_of(const PartnerHere& here, Duration played) noexcept;
  void let_go(PartnerHere& here) noexcept;
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
  std::size_t tools_;  ///< of the scene
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
  std::optional<Tick> predicted_grasp_;  ///< input of a grasp or release that the server has not answered yet
  LocalTime predicted_grasp_at_{};
  bool grab_button_ = false;
  bool has_jumped_ = false;
  double diverged_s_ = 0;  ///< for how long the tool has been far from the server's
  SoftFollower soft_;
  BodyId soft_of_;  ///< what soft_ is about: what the tool holds, else itself
};

}  // namespace tandem::client
