// Three-degree-of-freedom touch with a point tool. The hand's point may penetrate obstacles; the proxy, a small ball on
// a spring to it, never does. The hand feels that spring.
//
//      goal (hand)                 1. Obstacles move; each moves the proxy's place beside it along.
//        x                         2. Around that place every convex piece within reach (triangle, primitive) gives a
//  ------|------- surface             plane with the piece below and the ball above it. The region above all planes is
//     (  o  )     proxy               convex and free, and so is the straight way there.
//                                  3. The proxy moves to the point of this region nearest to the goal: no root
//                                     finding, no sweep, no tunnelling.
//                                  4. Steps 2 and 3 repeat until the proxy stops: around an edge, down a curve.
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
  double radius_m = 1e-3;  ///< radius of the ball, 0.05 mm to 0.1 m: narrower gaps are not entered
  bool is_shaded = true;   ///< whether meshes feel like the smooth surface that their triangles approximate
};

/// Bit mask of faults in an update.
enum ProxyFault : std::uint8_t {
  kProxyBadInput = 1,  ///< the goal or a pose was not finite: the last good pose is kept; no force for a bad goal
  kProxyHeldBack = 2,  ///< not yet at its place: squeezed by bodies, or too far for one update; continued in later ones
  kProxyTooDense = 4,  ///< too many triangles nearby: the proxy stays. Use a coarser mesh or a smaller ball
};

struct ProxyState {
  Vec3 p_W = Vec3::Zero();                 ///< centre of the ball
  Vec3 goal_W = Vec3::Zero();              ///< goal of this update
  bool is_touching = false;                ///< an obstacle keeps the proxy from the goal
  bool is_sticking = false;                ///< friction holds the touching proxy in place
  Vec3 surface_velocity_W = Vec3::Zero();  ///< velocity of the touched surface
  std::size_t contact_count = 0;           ///< pieces that the proxy leans on, at most 3
  std::uint8_t faults = 0;                 ///< bits of ProxyFault
};

/// Ball of finite size that follows the hand's point as far as obstacles permit.
///
/// Model   min |p − g| over the places that the ball can reach. Friction: p stays while the pull p − g is inside the
///         cone of μ_s about the load, else p slides to the edge of the cone of μ_d. Shading: the goal is shifted along
///         the surface by |load| (m/(m·n) − n), which turns the pull onto the interpolated normal m where the load is n
/// Source  Zilles & Salisbury, "A constraint-based god-object method for haptic display", IROS 1995 (the constrained
///         minimum); Ruspini, Kolarov, Khatib, "The haptic display of complex graphical environments", SIGGRAPH 1997
///         (finite radius, shading in two passes: first a goal from smooth normals, then the true surface); Harwin &
///         Melder, "Improved haptic rendering for multi-finger manipulation using friction cone based god-objects",
///         EuroHaptics 2002 (friction). Ours: pieces as separating planes instead of swept balls; the fixed point of
///         shading in closed form; the place kept per obstacle, so that moving bodies cannot pass.
/// Fails   kProxyHeldBack in ProxyState::faults
/// Cost    `bench proxy`. No allocation in update(); work bounded by counts, never by time
/// Thread  one at a time, haptic or room
class GodObject {
 public:
  static constexpr std::size_t kMaxObstacles = 64;
  /// Steps in an update. Sliding over a mesh takes two or three; a jump of the hand may need more than one update.
  static constexpr std::size_t kMaxSteps = 4;
  /// Clearance that rounding may remove: the ball's centre is never nearer to a surface than radius − this.
  static constexpr double kTolerance_m = 1e-8;

  /// In      p_W  free place of the proxy at the start. A ball that overlaps a primitive is placed outside at the first
  ///         update. A ball that overlaps a mesh leaves it slowly, on the side of its centre
  /// Fails   std::invalid_argument: radius, obstacles (ObstacleTrack), a place that is not finite
  GodObject(const GodObjectSettings& settings, std::vector<ProxyObstacle> obstacles, const Vec3& p_W);

  /// Performs one tick. `motions` in the order of the obstacles; obstacles beyond its end do not move.
  const ProxyState& update(const Vec3& goal_W, std::span<const RigidState> motions = {}) noexcept;
  /// Excludes an obstacle from the next update on, or includes it again. Include it where the ball is clear of it;
  /// otherwise the ball starts with an overlap, see the constructor.
  void set_present(std::size_t obstacle, bool is_present) noexcept;
  /// Moves the proxy to another place without a path to it.
  void reset(const Vec3& p_W) noexcept;

  const ProxyState& state() const { return state_; }
  /// Corners of the proxy's path in the last update, connected by straight lines; the last one is its place. Relative
  /// to a moving obstacle the path is different, but also free.
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
  double reach_m_ = 0;   ///< reach of this step
  double wanted_m_ = 0;  ///< reach that the next step may need
  double travel_m_ = 0;  ///< longest step of the last update
  std::array<Vec3, kMaxSteps> way_W_;
  std::size_t way_count_ = 0;
  Vec3 last_move_ = Vec3::Zero();  ///< move of the last step
  double relaxation_ = 1;          ///< factor of the last step
  double taken_ = 1;               ///< share of the way to its target that the last step covered
  bool was_sticking_ = false;
  bool has_slipped_ = false;
  Vec3 unhindered_W_ = Vec3::Zero();  ///< place of the proxy without obstacles
};

/// Depth of the hand at which the damper has its full coefficient. Ours: a hand at 0.1 m/s reaches it in 5 ms.
inline constexpr double kFullDamping_m = 5e-4;

/// Returns the force on the hand: the law's spring between goal and proxy, and its damper along the pull alone,
/// relative to the touched surface, so that sliding is not damped. Zero without contact. The force never pulls the hand
/// inwards: it is zero where the hand leaves so fast that the damper outweighs the spring.
///
/// Model   on tool f = law(d = goal − p, v = w u u·(v_hand − v_surface)), u = d/|d|, w = min(1, |d|/kFullDamping_m); on
///         hand −f where f·u > 0, else 0. The faded damper makes the force zero where contact begins and ends
/// Source  the fade is that of Hunt & Crossley, "Coefficient of restitution interpreted as damping in vibroimpact", J.
///         Appl. Mech. 1975, whose damping grows with depth; theirs grows without bound, ours up to the law's damping
/// In      v_WH  velocity of the hand's point [m/s]
Vec3 proxy_force_on_hand_W(const ProxyState& state, const CouplingLaw& law, const Vec3& v_WH) noexcept;

}  // namespace tandem::haptics
