// Tools of the other users in the local model. Each tool is pulled to its user's predicted hand, so that it responds to
// contact with this user's tool without delay.
//
//   received states ──▶ Partner: predicted handle ──▶ the partner's tool in the model ──▶ contact, grasp
#pragma once

#include <span>
#include <vector>

#include "client/exchange/mailboxes.hpp"
#include "client/model/body_copy.hpp"
#include "client/model/partner.hpp"

namespace tandem::client {

/// Activates a tool in `world`, with the state that this tool has in a second model. If the tool holds a body in
/// `state`, it holds the same body in `world`, with the tool's pose in `state`.
void set_tool_state(physics::World& world, std::size_t tool, const physics::ToolState& state) noexcept;

/// Partners (other users) and their tools.
///
/// Invariants  A tool is active in the world only while its partner's handle is received. A partner without a received
///             state for 1 s counts as having left. A tool holds only a body that the server has reported as held by it
/// Thread      haptic: no allocation after construction, no throw. receive() and drive() return true if the model
///             jumped; the displayed force must then be blended
class PartnerTools {
 public:
  PartnerTools();

  /// Adds a state received from the server.
  bool receive(const proto::ServerUpdate& update, physics::World& world) noexcept;
  /// Predicts each partner's handle. The coupling then pulls the partner's tool to it.
  /// In      predicts_motion  false: partners' hands stay at their last received poses
  ///         tools            number of tools in the scene
  bool drive(const ModelStep& step, std::span<const BodyCopy> bodies, bool predicts_motion, std::size_t tools) noexcept;
  /// Resets the tools that hold no body to the server's newest states.
  void restart(physics::World& world) const noexcept;

  /// Sets the coupling bounds of the active tools.
  void bound_couplings(physics::World& world, const HapticScene& scene) const noexcept;
  /// Sets the coupling bounds of all tools in the world of a second model of the same scene. Must be called before
  /// continue_in().
  void bound_all_couplings(physics::World& world, const HapticScene& scene) const noexcept;
  /// Activates those tools in the world of a second model of the same scene that are active here, with their states in
  /// `from`.
  void continue_in(physics::World& world, const physics::World& from) const noexcept;

  /// Returns whether a partner's tool holds the body.
  bool is_holding(BodyId body) const noexcept;
  /// Returns the state of a user's tool in the world, or `received` if that tool is not active.
  RigidState tool_of(UserId user, const RigidState& received, const physics::World& world) const noexcept;
  /// Returns the largest Partner::common_share() of all partners: 1 while a partner and this user have a hand on the
  /// same body. After the partner has left the body, it falls to 0 within 2 s. Returns 1 if no partner's tool is
  /// active.
  double common_share() const noexcept;

 private:
  struct PartnerTool {
    Partner partner;
    std::size_t tool = 0;  ///< index of the partner's tool in the world
    bool is_active = false;
    BodyId held;
  };

  static PartnerSurroundings surroundings_of(const PartnerTool& one, const ModelStep& step,
                                             std::span<const BodyCopy> bodies) noexcept;
  static bool activate(PartnerTool& one, physics::World& world) noexcept;
  static bool deactivate(PartnerTool& one, physics::World& world) noexcept;
  static void follow_grip(PartnerTool& one, const ModelStep& step, std::span<const BodyCopy> bodies) noexcept;

  std::vector<PartnerTool> partners_;  ///< all partners; capacity is reserved for kMaxUsers
};

}  // namespace tandem::client
