// Conditions of goals, as pure functions of the states of a room's bodies.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "common/base/spatial.hpp"
#include "server/goals/signals.hpp"

namespace tandem::server {

/// States of a room's bodies after a step, indexed as in the scene. States and holders are set only for bodies that a
/// condition names.
struct BodyStates {
  std::span<const RigidState> states;
  std::span<const std::uint8_t> holders;    ///< number of tools that hold each body
  std::uint64_t absent = 0;                 ///< bit i: body i does not exist; every condition about it is false
  std::uint64_t covered = 0;                ///< bit i: silhouette i of the game is covered (SilhouetteFit)
  std::span<const SignalStatus> signals{};  ///< signals of the game
};

/// A ball that represents part of a body. A region contains the body if it contains all balls of the body. A ball is a
/// point (radius 0), or one of the spheres of a round shape.
struct BodyBall {
  Vec3 p_B;
  double radius_m = 0;
};

/// A closed region of space in the frame of a body, or of the world.
struct GoalRegion {
  enum class Kind : std::uint8_t { kSphere, kBox, kCylinder };
  std::optional<std::size_t> body = {};  ///< none: the world
  Pose X_FR = {};  ///< pose of the region's centre and axes in the frame of `body` or of the world
  Kind kind = Kind::kBox;
  Vec3 half_m =
      Vec3::Zero();  ///< box: half edges. Sphere: x is the radius. Cylinder: x is the radius, z half the length

  /// Returns whether a ball lies in the region. `p_R` is its centre in the frame of the region.
  bool contains(const Vec3& p_R, double radius_m) const noexcept;
};

struct InRegionCondition {
  std::size_t body = 0;
  GoalRegion region;
  /// The balls that must all be inside the region: one at the body's origin, or all that represent the body.
  std::vector<BodyBall> balls;
};

struct AtPoseCondition {
  std::size_t body = 0;
  std::optional<std::size_t> beside = {};  ///< none: the world
  Pose X_FT = {};                          ///< target in the frame of `beside`
  double position_m = 0;
  double angle_rad = 0;
};

struct HeldCondition {
  std::size_t body = 0;
  std::uint32_t hands = 1;
};

struct SlowerCondition {
  std::size_t body = 0;
  double speed_m_per_s = 0;
  double turn_rad_per_s = 0;
};

struct SilhouetteCondition {
  std::size_t fit = 0;  ///< index of the silhouette in the game
};

struct SignalCondition {
  std::size_t signal = 0;  ///< index of the signal in the game
  SignalRange range;
  bool is_required = false;  ///< a stale signal does not satisfy the condition
};

using GoalCondition = std::variant<InRegionCondition, AtPoseCondition, HeldCondition, SlowerCondition,
                                   SilhouetteCondition, SignalCondition>;

/// Returns whether the condition holds.
///
/// Model   * A region or a target pose that belongs to a body moves with that body.
///         * The distance of two orientations is the angle of the rotation from one to the other.
///         * A condition about a stale signal does not hold here. Game decides whether it counts as satisfied.
/// Cost    proportional to the balls of the body, at most kMaxBodyBalls; no allocation
bool holds(const GoalCondition& condition, const BodyStates& bodies) noexcept;

/// Limit of the number of balls that represent a body. A body that needs more is represented by the corners of its
/// bounding box.
inline constexpr std::size_t kMaxBodyBalls = 64;

}  // namespace tandem::server
