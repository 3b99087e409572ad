// Three-degree-of-freedom touch with a point tool: the hand's point may be inside of things, the proxy, a small ball on
// a spring to it, never is. What the hand feels is that spring.
//
//      goal (hand)                 1. Obstacles move; each takes the place of the proxy beside it along.
//        x                         2. Around that place every convex piece within reach (triangle, primitive) gives a
//  ------|------- surface             plane with the piece below and the ball above it. All that is above all planes is
//     (  o  )     proxy               convex and free, and so is the straight way there.
//                                  3. The point of it nearest to the goal is where the proxy goes: no root finding, no
//                                     sweep, nothing to pass through.
//                                  4. Again from there, until it moves no farther: round an edge, down a curve.
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
  double radius_m = 1e-3;  ///< of the ball, 0.05 mm to 0.1 m: what is narrower is not entered
  bool is_shaded = true;   ///< whether meshes feel like the smooth surface that their triangles stand for
};

/// What went wrong in an update; a mask of these.
enum ProxyFault : std::uint8_t {
  kProxyBadInput = 1,  ///< the goal or a pose was not finite: held at the last good one, no force for a bad goal
  kProxyHeldBack = 2,  ///< not yet at its place: squeezed between bodies, or too far for one update; later ones go on
  kProxyTooDense = 4,  ///< more triangles around than it can hold: it stays. Use a coarser mesh or a smaller ball
};

struct ProxyState {
  Vec3 p_W = Vec3::Zero();                 ///< centre of the ball
  Vec3 goal_W = Vec3::Zero();              ///< of this update
  bool is_touching = false;                ///< something keeps it from the goal
  bool is_sticking = false;                ///< and friction holds it in place there
  Vec3 surface_velocity_W = Vec3::Zero();  ///< of what it leans on
  std::size_t contact_count = 0;           ///< pieces that it leans on, at most 3
  std::uint8_t faults = 0;                 ///< of ProxyFault
};

/// A ball of finite size that follows the hand's point as far as obstacles let it.
///
/// Model   min |p − g| over what the ball can reach; friction: p stays while the pull p − g is inside the cone of μ_s
///         about the load, else p slides to the edge of the cone of μ_d; shading: the goal is shifted along the
///         surface by |load| (m/(m·n) − n), which turns the pull onto the interpolated normal m where the load is n
/// Source  Zilles & Salisbury, "A constraint-based god-object method for haptic display", IROS 1995 (the constrained
///         minimum); Ruspini, Kolarov, Khatib, "The haptic display of complex graphical environments", SIGGRAPH 1997
///         (finite radius, shading in two passes: first a goal from smooth normals, then the true surface); Harwin &
///         Melder, "Improved haptic rendering for multi-finger manipulation using friction cone based god-objects",
///         EuroHaptics 2002 (friction). Ours: pieces as planes that separate, instead of swept balls; the fixed point
///         of shading in closed form; the place kept per obstacle, so that moving bodies cannot pass.
/// Fails   kProxyHeldBack in ProxyState::faults
/// Cost    `bench proxy`. No allocation in update(); work bounded by counts, never by time
/// Thread  one at a time, haptic or room
class GodObject {
 public:
  static constexpr std::size_t kMaxObstacles = 64;
  /// Steps in an update. Sliding over a mesh takes two or three; a hand that jumps may need more than one update.
  static constexpr std::size_t kMaxSteps = 4;
  /// Clearance that rounding may take from the ball: its centre is never nearer to a surface than radius − this.
  static constexpr double kTolerance_m = 1e-8;

  /// In      p_W  free place where the proxy begins; where it overlaps a primitive it is put outside at the first
  ///              update, where it overlaps a mesh it leaves slowly, on the side that its centre is on
  /// Fails   std::invalid_argument: radius, obstacles (ObstacleTrack), a place that is not finite
  GodObject(const GodObjectSettings& settings, std::vector<ProxyObstacle> obstacles, const Vec3& p_W);

  /// One tick. `motions` in the order of the obstacles; those it leaves out stay where they are.
  const ProxyState& update(const Vec3& goal_W, std::span<const RigidState> motions = {}) noexcept;
  /// Leaves an obstacle out from the next update on, or lets it be felt again: best where the ball is clear of it, else
  /// it begins as an overlap, see the constructor.
  void set_present(std::size_t obstacle, bool is_present) noexcept;
  /// Elsewhere, without a way from here to there.
  void reset(const Vec3& p_W) noexcept;

  const ProxyState& state() const { return state_; }
  /// Corners of its way in the last update, straight in between; the last one is where it is. Beside a moving obstacle
  /// the way is as free, but another one.
  std::span<const Vec3> way_W() const { return {way_W_.data(), way_count_}; }
  const GodObjectSettings& settings() const { return settings_; }

 private:
  Vec3 sane_goal(const Vec3& goal_W, std::uint8_t& faults) const noexcept;
  void take_motions(std::span<const RigidState> motions, std::uint8_t& faults) noexcept;
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
  double reach_m_ = 0;   ///< of this step
  double wanted_m_ = 0;  ///< what the next step may need
  double travel_m_ = 0;  ///< of the last update's longest step
  std::array<Vec3, kMaxSteps> way_W_;
  std::size_t way_count_ = 0;
  Vec3 last_move_ = Vec3::Zero();  ///< of the last step
  double relaxation_ = 1;          ///< of the last step
  double taken_ = 1;               ///< how much of the way to its target it went
  bool was_sticking_ = false;
  bool has_slipped_ = false;
  Vec3 unhindered_W_ = Vec3::Zero();  ///< where the proxy would be if there were nothing
};

/// Depth of the hand at which the damper has its full coefficient. Ours: a hand at 0.1 m/s passes it in 5 ms.
inline constexpr double kFullDamping_m = 5e-4;

/// Force on the hand: the law's spring between goal and proxy, and its damper along the pull alone, against what the
/// proxy leans on; so sliding is not damped. Zero where nothing is touched. It never draws the hand in: where it leaves
/// so fast that the damper outweighs the spring, it is zero.
///
/// Model   on tool f = law(d = goal − p, v = w u u·(v_hand − v_surface)), u = d/|d|, w = min(1, |d|/kFullDamping_m);
///         on hand −f where f·u > 0, else 0. With the damper faded in, there is no force where contact begins and ends
/// Source  the fade is that of Hunt & Crossley, "Coefficient of restitution interpreted as damping in vibroimpact",
///         J. Appl. Mech. 1975, whose damping grows with depth; theirs grows on, ours ends at the law's own
/// In      v_WH  velocity of the hand's point [m/s]
Vec3 proxy_force_on_hand_W(const ProxyState& state, const CouplingLaw& law, const Vec3& v_WH) noexcept;

}  // namespace tandem::haptics
