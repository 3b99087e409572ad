// What a hand's point can touch of a scene by itself: a ball that stays outside of the bodies (common/haptics/proxy),
// and the bodies where the server last said that they are. Nothing here has a mass: what the ball pushes moves only
// when the server says so.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "client/haptics/mailboxes.hpp"
#include "client/session/asset_store.hpp"
#include "common/haptics/proxy/god_object.hpp"
#include "tandem/control.pb.h"

namespace tandem::client {

/// The ball of one user in one scene.
///
/// Model   obstacles are the shapes of the bodies, each for itself: primitives as their formulas, meshes as the
///         triangles of their surface asset, open ones without thickness. Friction is that of a contact, the root of
///         both coefficients. A body is where the newest state has it, carried on by its velocity for kCarriedOn.
///         No obstacles are: tools, for a state does not say which of them another user has (the local model has none
///         of them either); molecules and soft bodies; what this user holds, and a moving body before its first state,
///         until the ball is clear of it (of a mesh: of its bounding box).
/// Thread  step(): haptic, no allocation, no throw
class ProxyWorld {
 public:
  /// Of the ball of a tool that has none about its origin: of the tool that a scene has by default.
  static constexpr double kDefaultRadius_m = 5e-3;
  /// Two periods of the slowest stream of states.
  static constexpr Duration kCarriedOn = std::chrono::milliseconds(20);
  /// Without a state for so long bodies may be anywhere when the next one comes, and no force is left: the ball begins
  /// anew. As `silence_zero` of SafetySettings, and a little more.
  static constexpr Duration kForgotten = std::chrono::milliseconds(150);

  /// In      joined  of a manipulator, as fill_haptic_scene() and proxy_problem() accept it
  /// Fails   std::exception that names the field or asset
  /// Cost    a second for a mesh of a million triangles
  ProxyWorld(const wire::Joined& joined, const AssetMap& assets);
  ~ProxyWorld();

  /// Once a tick. The ball begins where the server's tool is, which is free space.
  const haptics::ProxyState& step(const Vec3& p_WH, const ReceivedUpdate& newest, LocalTime now) noexcept;

  double radius_m() const { return ball_->settings().radius_m; }
  /// One line for people: with what, and what not, the hand touches.
  const std::string& note() const { return note_; }

 private:
  struct Part;
  void take(const ReceivedUpdate& newest) noexcept;
  void move_parts(LocalTime now) noexcept;
  void begin(const proto::ServerUpdate& newest) noexcept;
  void leave_out(BodyId held, const Vec3& p_W) noexcept;

  std::unique_ptr<haptics::GodObject> ball_;
  std::vector<Part> parts_;          ///< in the order of the ball's obstacles
  std::vector<RigidState> motions_;  ///< of the parts
  std::vector<RigidState> bodies_;   ///< as told
  std::vector<LocalTime> told_;      ///< when
  std::vector<char> is_known_;       ///< told, or static
  Step taken_;
  LocalTime heard_{};
  bool has_begun_ = false;
  std::string note_;
};

/// Empty, or why a ball can touch nothing of this scene, or not all, and what to use instead; by kinds and counts
/// alone.
std::string proxy_problem(const wire::Joined& joined);

}  // namespace tandem::client
