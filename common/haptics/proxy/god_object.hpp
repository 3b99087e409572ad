// Three-degree-of-freedom contact with a point tool. The hand's point may penetrate obstacles. The proxy, a small ball
// connected to that point by a spring, never does. The user feels the force of that spring.
//
//      goal (hand)                 1. Obstacles move and carry the proxy's position along.
//        x                         2. Every convex piece (triangle, primitive) within reach of that position gives a
//  ------|------- surface             plane, with the piece below and the ball above it. The region above all planes is
//     (  o  )     proxy               convex and free, so every straight segment in it is free, too.
//                                  3. The proxy moves to the point of this region nearest to the goal. This needs no
//                                     root finding and no sweep, and the proxy cannot tunnel.
//                                  4. Steps 2 and 3 repeat until the proxy stops, so that it moves around an edge or
//                                     along a curve.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/haptics/coupling/coupling_law.hpp"
#include "common/haptics/proxy/obstacle_track.hpp"
#include "common/haptics/proxy/plane_projection.hpp"

namespace tandem::haptics {

struct GodObjectSettings {
  double radius_m = 1e-3;  ///< radius of the ball, 0.05 mm to 0.1 m; the ball does not enter narrower gaps
  bool is_shaded = true;   ///< true: meshes feel smooth, as if curved; false: the edges of triangles are felt
};

/// Bit mask of the faults of an update.
enum ProxyFault : std::uint8_t {
  kProxyBadInput = 1,  ///< the goal or a pose was not finite: the last valid pose is used; a bad goal gives no force
  /// The proxy is not yet at its target, because bodies squeeze it or the target was too far for one update. Later
  /// updates continue.
  kProxyHeldBack = 2,
  kProxyTooDense = 4,  ///< too many triangles nearby: the proxy stops. Use a coarser mesh or a smaller ball
};

struct ProxyState {
  Vec3 p_W = Vec3::Zero();                 ///< centre of the ball
  Vec3 goal_W = Vec3::Zero();              ///< goal of this update
  bool is_touching = false;                ///< whether an obstacle holds the proxy back from the goal
  bool is_sticking = false;                ///< whether friction holds the touching proxy in place
  Vec3 surface_velocity_W = Vec3::Zero();  ///< velocity of the touched surface
  std::size_t contact_count = 0;           ///< number of pieces that hold the proxy back, at most 3
  std::uint8_t faults = 0;                 ///< bits of ProxyFault
};

/// Ball of finite size that follows the hand's point as closely as obstacles permit.
///
/// Model   Position: p minimises |p − g| over all positions that the ball can reach, with the goal g. The load is p − g
///         at the minimum; its direction n points out of the surface.
///         Friction: p stays while p − g is inside the cone about n whose slope is the static coefficient μ_s.
///         Otherwise p slides until p − g is on the cone of the dynamic coefficient μ_d.
///         Shading: let m be the interpolated normal. The goal is shifted along the surface by |load| (m/(m·n) − n),
///         and the proxy follows. The vector from the hand's goal to p then has the direction m instead of n
/// Source  Zilles & Salisbury, "A constraint-based god-object method for haptic display", IROS 1995 (the constrained
///         minimum); Ruspini, Kolarov, Khatib, "The haptic display of complex graphical environments", SIGGRAPH 1997
///         (finite radius, shading in two passes: first a goal from smooth normals, then the true surface); Harwin &
///         Melder, "Improved haptic rendering for multi-finger manipulation using friction cone based god-objects",
///         EuroHaptics 2002 (friction). Ours are: separating planes of convex pieces instead of swept balls; the fixed
///         point of shading in closed form; a position stored for each obstacle, so that moving bodies cannot pass
///         through the proxy.
/// Fails   kProxyHeldBack in ProxyState::faults
/// Cost    `bench proxy`. update() allocates nothing; the numbers of its steps, planes and pieces are limited
/// Thread  haptic or room, one at a time
class GodObject {
 public:
  static constexpr std::size_t kMaxObstacles = 64;
  /// Maximum number of steps in an update. Sliding over a mesh needs two or three steps. After a jump of the hand, the
  /// proxy may need several updates to arrive.
  static constexpr std::size_t kMaxSteps = 4;
  /// Largest error of the clearance by rounding. The distance from the ball's centre to a surface is at least the
  /// radius minus this value.
  static constexpr double kTolerance_m = 1e-8;

  /// In      p_W  initial position of the proxy, which should be free of obstacles. If the ball overlaps a primitive,
  ///         it is moved outside at the first update. If it overlaps a mesh, it moves out slowly, towards the side on
  ///         which its centre is
  /// Fails   throws std::invalid_argument: bad radius, bad obstacle (ObstacleTrack), or a position that is not finite
  GodObject(const GodObjectSettings& settings, std::vector<ProxyObstacle> obstacles, const Vec3& p_W);

  /// Performs one tick. `motions` is in the order of the obstacles; obstacles without an entry do not move.
  const ProxyState& update(const Vec3& goal_W, std::span<const RigidState> motions = {}) noexcept;
  /// Excludes an obstacle from the next update on, or includes it again. It should be included only while the ball does
  /// not touch it. If the ball overlaps the obstacle, it is moved out as after construction.
  void set_present(std::size_t obstacle, bool is_present) noexcept;
  /// Moves the proxy to another position at once, even through obstacles.
  void reset(const Vec3& p_W) noexcept;

  const ProxyState& state() const { return state_; }
  /// Corners of the proxy's path in the last update. The path is a polyline that ends at the present position. Relative
  /// to a moving obstacle the path has another shape, which is free of collisions as well.
  std::span<const Vec3> way_W() const { return {way_W_.data(), way_count_}; }
  const GodObjectSettings& settings() const { return settings_; }

 private:
  Vec3 sane_goal(const Vec3& goal_W, std::uint8_t& faults) const noexcept;
  void apply_motions(std::span<const RigidState> motions, std::uint8_t& faults) noexcept;
  double step(const Vec3& goal_W, std::uint8_t& faults) noexcept;
  void gather(const Vec3& goal_W, std::uint8_t& faults) noexcept;
  void project(const Vec3& goal_W, bool is_begun) noexcept;
  int nearest_violated() const noexcept;
  bool is_kept_by_active(const NearPiece& piece, const Vec3& at_W) const noexcept;
  double allowed_fraction(const Vec3& target_W) const noexcept;
  double longest_way_m(const Vec3& target_W) const noexcept;
  double unblocked_fraction(const Vec3& target_W, double fraction) const noexcept;
  Vec3 shaded_goal(const Vec3& goal_W) const noexcept;
  Vec3 with_friction(const Vec3& goal_W) noexcept;
  double relaxation_of(const Vec3& move) const noexcept;
  Vec3 lengthened(const Vec3& pulled_to_W, const Vec3& target_W) noexcept;
  double move_towards(const Vec3& target_W, double fraction) noexcept;
  const NearPiece& piece_of(const PlaneProjection::Active& active) const {
    return pieces_[static_cast<std::size_t>(active.tag)];
  }
  const ObstacleTrack& track_of(const NearPiece& piece) const {
    return tracks_[static_cast<std::size_t>(piece.obstacle)];
  }
  Vec3 held_place_W() const noexcept;
  void settle_state(const Vec3& goal_W, std::uint8_t faults) noexcept;

  GodObjectSettings settings_;
  std::vector<ObstacleTrack> tracks_;
  std::vector<NearPiece> pieces_;
  std::size_t piece_count_ = 0;
  PlaneProjection planes_;
  ProxyState state_;
  /// Radius around the proxy within which obstacle pieces were gathered for the current step. The step must not be
  /// longer.
  double reach_m_ = 0;
  /// Radius requested for the next step. The actual radius (reach_m_) is smaller where triangles are dense.
  double wanted_m_ = 0;
  double travel_m_ = 0;  ///< longest step of the last update
  std::array<Vec3, kMaxSteps> way_W_;
  std::size_t way_count_ = 0;
  Vec3 last_move_ = Vec3::Zero();  ///< displacement in the last step
  double relaxation_ = 1;          ///< relaxation factor of the last step
  double taken_ = 1;               ///< length of the last step as a multiple of the unrelaxed step
  bool was_sticking_ = false;
  bool has_slipped_ = false;
  Vec3 unhindered_W_ = Vec3::Zero();  ///< target of the last step, before obstacles limited the motion
};

/// Distance between hand and proxy from which the damper has its full coefficient. Our choice: a hand that presses at
/// 0.1 m/s reaches it in 5 ms.
inline constexpr double kFullDamping_m = 5e-4;

/// Returns the force on the hand: the law's spring between goal and proxy, plus its damper. Without contact the force
/// is zero. The damper acts only along the line from proxy to goal, with the velocity relative to the touched surface,
/// so that sliding is not damped. The force never pulls the hand into the obstacle: if the hand leaves so fast that the
/// damper outweighs the spring, the force is zero.
///
/// Model   force on the tool: f = law(d = goal − p, v = w u u·(v_hand − v_surface)), u = d/|d|, w = min(1,
///         |d|/kFullDamping_m). Force on the hand: −f if f·u > 0, otherwise 0. The factor w makes the force zero where
///         contact begins and ends
/// Source  the factor w follows Hunt & Crossley, "Coefficient of restitution interpreted as damping in vibroimpact", J.
///         Appl. Mech. 1975, whose damping grows with depth without bound. Our damping grows up to the law's damping
/// In      v_WH  velocity of the hand's point [m/s]
Vec3 proxy_force_on_hand_W(const ProxyState& state, const CouplingLaw& law, const Vec3& v_WH) noexcept;

}  // namespace tandem::haptics
