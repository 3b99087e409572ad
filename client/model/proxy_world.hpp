// Proxy rendering of a scene with a ball that stays outside of the bodies (common/haptics/proxy). The bodies have the
// server's newest states. Neither ball nor bodies have mass here: pushed bodies move only when new states of the server
// arrive.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "client/exchange/asset_map.hpp"
#include "client/exchange/mailboxes.hpp"
#include "common/haptics/proxy/god_object.hpp"
#include "tandem/control.pb.h"

namespace tandem::client {

/// The ball of one user, with the bodies of one scene as obstacles.
///
/// Model   Each shape of a body is a separate obstacle:
///         * Primitives are exact distance functions. Meshes are the triangles of their surface asset; open meshes have
///           no thickness.
///         * The friction coefficient is the root of the product of both coefficients, as in every contact.
///         * A body has its newest received state, extrapolated by its velocity for at most kCarriedOn.
///         * Never obstacles: tools (a state does not say which tool another user has), molecules, soft bodies.
///         * Temporarily no obstacles: the body that this user holds, and a moving body before its first state. Such a
///           body becomes an obstacle when the ball no longer touches the shape (for a mesh: its bounding box).
/// Thread  step(): haptic, no allocation, no throw
class ProxyWorld {
 public:
  /// Radius of the ball if no shape of the tool contains its origin. It equals the radius of the default tool.
  static constexpr double kDefaultRadius_m = 5e-3;
  /// Maximum extrapolation time: two periods of the lowest state rate.
  static constexpr Duration kCarriedOn = std::chrono::milliseconds(20);
  /// Time without a state after which the ball is restarted at the server's tool, because bodies may have moved far in
  /// the meantime. The time is slightly longer than `silence_zero` of SafetySettings, so no force is displayed at the
  /// restart.
  static constexpr Duration kForgotten = std::chrono::milliseconds(150);

  /// In      joined  join message of a manipulator, accepted by fill_haptic_scene() and proxy_problem()
  /// Fails   std::exception if a field or asset is unusable; the message names it
  /// Cost    1 s for a mesh of a million triangles
  ProxyWorld(const wire::Joined& joined, const AssetMap& assets);
  ~ProxyWorld();

  /// Steps the ball. Must be called once a tick. The ball starts at the server's tool, which does not penetrate bodies.
  /// In      absent_bodies  bit mask, see HapticScene::absent_bodies
  const haptics::ProxyState& step(const Vec3& p_WH, const ReceivedUpdate& newest, LocalTime now,
                                  std::uint64_t absent_bodies = 0) noexcept;

  double radius_m() const { return ball_->settings().radius_m; }
  /// Returns one line of text for the user: the size of the ball, and the objects that it can and cannot touch.
  const std::string& note() const { return note_; }

 private:
  struct Part;
  void receive(const ReceivedUpdate& newest) noexcept;
  void move_parts(LocalTime now) noexcept;
  void begin(const proto::ServerUpdate& newest) noexcept;
  void leave_out(BodyId held, const Vec3& p_W) noexcept;

  std::unique_ptr<haptics::GodObject> ball_;
  std::vector<Part> parts_;             ///< shapes of bodies, in the order of the ball's obstacles
  std::vector<RigidState> motions_;     ///< current states of the shapes in parts_, in the same order
  std::vector<RigidState> bodies_;      ///< last received states of the bodies
  std::vector<LocalTime> received_at_;  ///< reception times of the states in bodies_
  std::uint64_t absent_bodies_ = 0;     ///< last value of HapticScene::absent_bodies
  std::vector<char> is_known_;          ///< 1 if the body is static or its state was received; else 0
  Step taken_;
  LocalTime last_received_{};
  bool has_begun_ = false;
  std::string note_;
};

/// Checks whether this scene can be rendered with a ball. This depends on the coupling law, and on the kinds and number
/// of shapes. Returns an empty text if it can, otherwise the reason and the stage to use instead.
std::string proxy_problem(const wire::Joined& joined);

}  // namespace tandem::client
