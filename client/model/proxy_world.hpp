// Ball rendering of a scene: a ball that stays outside of the bodies (common/haptics/proxy), with the bodies at the
// server's newest states. Nothing here has mass: bodies that the ball pushes move only with the server's states.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "client/exchange/asset_map.hpp"
#include "client/exchange/mailboxes.hpp"
#include "common/haptics/proxy/god_object.hpp"
#include "tandem/control.pb.h"

namespace tandem::client {

/// The ball of one user in one scene.
///
/// Model   obstacles are the bodies' shapes, each a separate obstacle: primitives as formulas, meshes as the triangles
///         of their surface asset, open ones without thickness. Friction is that of a contact: the root of the product
///         of both coefficients. A body is at its newest state, extrapolated by its velocity for at most kCarriedOn.
///         Excluded: tools, because a state does not say which tool another user has; molecules and soft bodies.
///         Temporarily excluded: the body that this user holds, and a moving body before its first state, until the
///         ball is clear of it (of a mesh: of its bounding box).
/// Thread  step(): haptic, no allocation, no throw
class ProxyWorld {
 public:
  /// Radius for a tool without a ball about its origin: that of the default tool.
  static constexpr double kDefaultRadius_m = 5e-3;
  /// Longest extrapolation: two periods of the slowest stream of states.
  static constexpr Duration kCarriedOn = std::chrono::milliseconds(20);
  /// After this time without a state the ball starts anew: bodies may be anywhere, and no force is left. Slightly
  /// longer than `silence_zero` of SafetySettings.
  static constexpr Duration kForgotten = std::chrono::milliseconds(150);

  /// In      joined  a manipulator's message, accepted by fill_haptic_scene() and proxy_problem()
  /// Fails   std::exception that names the field or asset
  /// Cost    a second for a mesh of a million triangles
  ProxyWorld(const wire::Joined& joined, const AssetMap& assets);
  ~ProxyWorld();

  /// Steps the ball; once a tick. It starts at the server's tool, which is in free space.
  const haptics::ProxyState& step(const Vec3& p_WH, const ReceivedUpdate& newest, LocalTime now) noexcept;

  double radius_m() const { return ball_->settings().radius_m; }
  /// One line for the user: the ball, and the objects that it does and does not touch.
  const std::string& note() const { return note_; }

 private:
  struct Part;
  void receive(const ReceivedUpdate& newest) noexcept;
  void move_parts(LocalTime now) noexcept;
  void begin(const proto::ServerUpdate& newest) noexcept;
  void leave_out(BodyId held, const Vec3& p_W) noexcept;

  std::unique_ptr<haptics::GodObject> ball_;
  std::vector<Part> parts_;             ///< in the order of the ball's obstacles
  std::vector<RigidState> motions_;     ///< motions of the parts
  std::vector<RigidState> bodies_;      ///< last received states
  std::vector<LocalTime> received_at_;  ///< reception times of these states
  std::vector<char> is_known_;          ///< received, or static
  Step taken_;
  LocalTime last_received_{};
  bool has_begun_ = false;
  std::string note_;
};

/// Returns why a ball can touch nothing, or only a part, of this scene, with the stage to use instead; empty if it can
/// touch all. Depends only on kinds and counts of shapes.
std::string proxy_problem(const wire::Joined& joined);

}  // namespace tandem::client
