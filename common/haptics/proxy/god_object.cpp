#include "common/haptics/proxy/god_object.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

namespace tandem::haptics {
namespace {

constexpr std::size_t kMaxPieces = 2048;
/// Maximum number of planes added in a step. At most three of them are active in the end.
constexpr int kMaxPlanes = 32;
/// Depth below a plane up to which a point counts as above it. For comparison, the rounding error of coordinates within
/// 10 km is 1e-12 m.
constexpr double kSlack_m = 1e-9;
/// Length of a step below which an update ends. kSettled_m corresponds to a force of 1 mN at 1 N/mm. With shading,
/// steps shrink geometrically; the update then also ends when a step is shorter than kSettledShare times its first
/// step. The next update continues from the position reached.
constexpr double kSettled_m = 1e-6;
constexpr double kSettledShare = 0.1;
/// Reach of the first step of an update during contact: kTravelReserve times the longest step of the last update, but
/// at least kMinReach_m, the motion of a hand at 0.1 m/s in a tick. A larger reach would include more triangles in
/// every step.
constexpr double kTravelReserve = 1.25;
constexpr double kMinReach_m = 1e-4;
constexpr double kReachGrowth = 2;
/// Cosine of the largest angle by which shading may turn the normal. A normal at a larger angle would belong to another
/// face.
constexpr double kMinShadingCosine = 0.5;
/// Bounds of a step's relaxation factor during shading, see relaxation_of(). A step is lengthened only if the cosine of
/// the angle to the previous step exceeds kStraightCosine. The values were chosen by a test with the Stanford bunny: a
/// hand that presses 5 mm deep causes the fewest ticks with the fault kProxyHeldBack.
constexpr double kMinRelaxation = 0.1;
constexpr double kMaxRelaxation = 5;
constexpr double kStraightCosine = 0.8;
/// Distance from the origin to which goals are clamped, so that their squares do not overflow.
constexpr double kFarthestGoal_m = 1e3;

bool is_far(const Vec3& a, const Vec3& b) {
  return (a - b).squaredNorm() > 1e-14;  // 0.1 µm: points closer than this count as equal
}

}  // namespace

GodObject::GodObject(const GodObjectSettings& settings, std::vector<ProxyObstacle> obstacles, const Vec3& p_W)
    : settings_(settings), pieces_(kMaxPieces) {
  if (!(settings.radius_m >= 5e-5 && settings.radius_m <= 0.1)) {
    throw std::invalid_argument("radius_m of the proxy is " + std::to_string(settings.radius_m) +
                                "; it must be 0.00005 to 0.1 m");
  }
  if (obstacles.size() > kMaxObstacles) {
    throw std::invalid_argument(std::to_string(obstacles.size()) + " obstacles for a proxy; give at most " +
                                std::to_string(kMaxObstacles));
  }
  if (!is_finite(p_W)) throw std::invalid_argument("the proxy's first place is not finite");
  tracks_.reserve(obstacles.size());
  for (ProxyObstacle& obstacle : obstacles) tracks_.emplace_back(std::move(obstacle), static_cast<int>(tracks_.size()));
  reset(p_W);
}

void GodObject::reset(const Vec3& p_W) noexcept {
  std::uint8_t faults = 0;
  const Vec3 place_W = sane_goal(p_W, faults);
  for (ObstacleTrack& track : tracks_) track.set_place_W(place_W);
  state_ = {};
  state_.p_W = state_.goal_W = unhindered_W_ = place_W;
  state_.faults = faults;
  travel_m_ = 0;
  was_sticking_ = false;
}

void GodObject::set_present(std::size_t obstacle, bool is_present) noexcept {
  if (obstacle >= tracks_.size() || tracks_[obstacle].is_present() == is_present) return;
  tracks_[obstacle].set_present(is_present);
  tracks_[obstacle].set_place_W(state_.p_W);
}

Vec3 GodObject::sane_goal(const Vec3& goal_W, std::uint8_t& faults) const noexcept {
  if (is_finite(goal_W)) return clamped_to_length(goal_W, kFarthestGoal_m);
  faults |= kProxyBadInput;
  return state_.p_W;
}

void GodObject::apply_motions(std::span<const RigidState> motions, std::uint8_t& faults) noexcept {
  const std::size_t count = std::min(motions.size(), tracks_.size());
  for (std::size_t i = 0; i < count; ++i) {
    if (!tracks_[i].move_to(motions[i])) faults |= kProxyBadInput;
    if (!tracks_[i].is_present()) tracks_[i].set_place_W(state_.p_W);
  }
}

const ProxyState& GodObject::update(const Vec3& goal_W, std::span<const RigidState> motions) noexcept {
  std::uint8_t faults = 0;
  apply_motions(motions, faults);
  const Vec3 goal = sane_goal(goal_W, faults);
  wanted_m_ = state_.is_touching ? std::max(kMinReach_m, kTravelReserve * travel_m_) : longest_way_m(goal);
  last_move_ = Vec3::Zero();
  relaxation_ = 1;
  has_slipped_ = false;
  travel_m_ = 0;
  bool is_settled = false;
  double first = 0;
  way_count_ = 0;
  while (way_count_ < kMaxSteps && !is_settled) {
    const double moved = step(goal, faults);
    if (way_count_ == 0) first = moved;
    travel_m_ = std::max(travel_m_, moved);
    is_settled = moved <= std::max(kSettled_m, kSettledShare * first);
    way_W_[way_count_++] = held_place_W();
  }
  if (!is_settled) faults |= kProxyHeldBack;
  settle_state(goal, faults);
  return state_;
}

double GodObject::step(const Vec3& goal_W, std::uint8_t& faults) noexcept {
  gather(goal_W, faults);
  project(goal_W, false);
  Vec3 pulled_to_W = goal_W;
  if (settings_.is_shaded && !planes_.active().empty()) {
    pulled_to_W = shaded_goal(goal_W);
    project(pulled_to_W, true);
  }
  Vec3 target_W = with_friction(pulled_to_W);
  const Vec3 move = tracks_.empty() ? Vec3(Vec3::Zero()) : Vec3(target_W - tracks_.front().place_W());
  relaxation_ = relaxation_of(move);
  if (relaxation_ > 1) target_W = lengthened(pulled_to_W, target_W);
  last_move_ = move;
  const double allowed = allowed_fraction(target_W);
  if (allowed < 1) wanted_m_ = planes_.active().empty() ? longest_way_m(goal_W) : kReachGrowth * wanted_m_;
  return move_towards(target_W, unblocked_fraction(target_W, allowed));
}

void GodObject::gather(const Vec3& goal_W, std::uint8_t& faults) noexcept {
  reach_m_ = wanted_m_;
  for (ObstacleTrack& track : tracks_) {
    const double reach = track.prepare(goal_W, settings_.radius_m, wanted_m_);
    if (reach <= 0) faults |= kProxyTooDense;
    reach_m_ = std::min(reach_m_, reach);
  }
  // Reduces the reach until all pieces fit into pieces_. If pieces_ is too small even for the smallest reach, the proxy
  // cannot move.
  for (int attempt = 0; attempt < 8; ++attempt, reach_m_ /= 4) {
    piece_count_ = 0;
    bool fits = true;
    for (const ObstacleTrack& track : tracks_) {
      fits = fits && track.gather(settings_.radius_m, reach_m_, pieces_, piece_count_);
    }
    if (fits) return;
  }
  faults |= kProxyTooDense;
  reach_m_ = 0;
}

/// Finds the point above all planes that is nearest to the goal. The planes come from pieces_, the pieces near the
/// proxy. `is_begun` is true if pieces_ is unchanged since the last call. The planes that were active then are added
/// first, because they are likely to be active again.
void GodObject::project(const Vec3& goal_W, bool is_begun) noexcept {
  const PlaneProjection last = planes_;
  planes_.start(goal_W);
  for (const PlaneProjection::Active& active : last.active()) {
    if (is_begun && active.side.height_m(planes_.point()) < -kSlack_m) planes_.add(active.side, active.tag);
  }
  for (int i = 0; i < kMaxPlanes; ++i) {
    const int violated = nearest_violated();
    if (violated < 0) return;
    const NearPiece& piece = pieces_[static_cast<std::size_t>(violated)];
    const Vec3& place_W = track_of(piece).place_W();
    const Vec3 at_W = place_W + allowed_fraction(planes_.point()) * (planes_.point() - place_W);
    if (!planes_.add(piece.higher_side(at_W), violated)) return;
  }
}

/// Returns the nearest piece whose planes are all violated; −1 if there is none. Pieces are taken in the order of their
/// distance, because the plane of a touched piece often keeps the ball clear of its neighbours, too. A neighbour's own
/// plane passes through its point closest to the ball, and would stop a ball that slides towards their common edge
/// half-way.
int GodObject::nearest_violated() const noexcept {
  const Vec3& x = planes_.point();
  const double fraction = allowed_fraction(x);
  int nearest = -1;
  // A piece that is farther away than the length of the motion cannot be touched.
  double nearest_m = settings_.radius_m + fraction * longest_way_m(x);
  for (std::size_t i = 0; i < piece_count_; ++i) {
    const NearPiece& piece = pieces_[i];
    if (piece.distance_m >= nearest_m) continue;
    const Vec3& place_W = track_of(piece).place_W();
    const Vec3 at_W = place_W + fraction * (x - place_W);
    if (piece.is_clear(at_W, kSlack_m)) continue;
    const auto active = planes_.active();
    const auto tag = static_cast<int>(i);
    if (std::any_of(active.begin(), active.end(), [&](const auto& one) { return one.tag == tag; })) continue;
    if (is_kept_by_active(piece, at_W)) continue;
    nearest = tag;
    nearest_m = piece.distance_m;
  }
  return nearest;
}

/// Returns true if an active plane separates the piece from the segment of motion. The piece is then below the plane,
/// and both ends of the segment are above it.
bool GodObject::is_kept_by_active(const NearPiece& piece, const Vec3& at_W) const noexcept {
  const ObstacleTrack& track = track_of(piece);
  for (const PlaneProjection::Active& active : planes_.active()) {
    if (active.side.height_m(at_W) >= -kSlack_m && active.side.height_m(track.place_W()) >= -kSlack_m &&
        track.is_below(piece, active.side, settings_.radius_m)) {
      return true;
    }
  }
  return false;
}

/// Returns the fraction of the motion to the target that is allowed. Pieces of an obstacle are known only within the
/// reach around the proxy's position relative to this obstacle, so the proxy must not move beyond the reach.
double GodObject::allowed_fraction(const Vec3& target_W) const noexcept {
  double squared = 0;
  for (const ObstacleTrack& track : tracks_) {
    if (track.obstacle().mesh) squared = std::max(squared, (target_W - track.place_W()).squaredNorm());
  }
  return squared <= reach_m_ * reach_m_ ? 1 : reach_m_ / std::sqrt(squared);
}

double GodObject::longest_way_m(const Vec3& target_W) const noexcept {
  double squared = 0;
  for (const ObstacleTrack& track : tracks_) squared = std::max(squared, (target_W - track.place_W()).squaredNorm());
  return std::sqrt(squared);
}

/// Returns the fraction of the motion to the target that is free of collisions, at most `fraction`. Two causes can make
/// the target violate planes: friction may have moved it away from the point found by project(), and project() adds a
/// limited number of planes.
double GodObject::unblocked_fraction(const Vec3& target_W, double fraction) const noexcept {
  double free = fraction;
  const double reach_m = settings_.radius_m + fraction * longest_way_m(target_W);
  for (std::size_t i = 0; i < piece_count_; ++i) {
    const NearPiece& piece = pieces_[i];
    if (piece.distance_m >= reach_m) continue;
    const Vec3& place_W = track_of(piece).place_W();
    const Vec3 at_W = place_W + free * (target_W - place_W);
    if (piece.is_clear(at_W, kSlack_m)) continue;
    const auto free_of = [&](const AllowedSide& side) {
      const double end = side.height_m(at_W);
      if (end >= -kSlack_m) return free;
      const double begin = side.height_m(place_W);
      // A ball that already overlaps the piece is below its plane at both ends of the motion. It may move if the motion
      // leads upwards.
      if (begin < 0) return end >= begin ? free : 0.0;
      return free * begin / (begin - end);
    };
    double of_piece = free_of(piece.closest);
    if (piece.has_face) of_piece = std::max(of_piece, free_of(piece.face));
    if (of_piece < free && !is_kept_by_active(piece, at_W)) free = of_piece;
  }
  return free;
}

Vec3 GodObject::shaded_goal(const Vec3& goal_W) const noexcept {
  const Vec3 load = planes_.point() - goal_W;
  const double depth = load.norm();
  if (!(depth > 0)) return goal_W;
  Vec3 smooth = Vec3::Zero();
  for (const PlaneProjection::Active& active : planes_.active()) {
    const NearPiece& piece = piece_of(active);
    smooth += active.load_m * track_of(piece).shaded_normal_W(piece);
  }
  smooth = smooth.stableNormalized();
  const Vec3 n = load / depth;
  const double cosine = smooth.dot(n);
  if (!(cosine > kMinShadingCosine)) return goal_W;
  return goal_W + depth * (smooth / cosine - n);
}

Vec3 GodObject::with_friction(const Vec3& goal_W) noexcept {
  const Vec3& x = planes_.point();
  const auto active = planes_.active();
  if (active.empty()) return x;
  const PlaneProjection::Active* heaviest = &active.front();
  double load = 0, still = 0, sliding = 0;
  for (const PlaneProjection::Active& one : active) {
    const ProxyObstacle& obstacle = track_of(piece_of(one)).obstacle();
    load += one.load_m;
    still += one.load_m * obstacle.static_friction;
    sliding += one.load_m * obstacle.dynamic_friction;
    if (one.load_m > heaviest->load_m) heaviest = &one;
  }
  if (!(still > 0)) {
    has_slipped_ = true;
    return x;
  }
  // Friction pulls the proxy back to the position to which the touched body carried it. This is the displacement from x
  // to that position, projected onto the active planes.
  Vec3 back = track_of(piece_of(*heaviest)).place_W() - x;
  std::array<Vec3, 3> axes;
  for (std::size_t i = 0; i < active.size(); ++i) {
    Vec3 axis = active[i].side.normal;
    for (std::size_t j = 0; j < i; ++j) axis -= axis.dot(axes[j]) * axes[j];
    axes[i] = axis.stableNormalized();
    back -= back.dot(axes[i]) * axes[i];
  }
  const double length = back.norm();
  const double depth = (x - goal_W).norm() / load;
  if (length <= depth * (was_sticking_ && !has_slipped_ ? still : sliding) + kSlack_m) return x + back;
  has_slipped_ = true;
  return x + back * (depth * sliding / length);
}

/// Returns the relaxation factor for the next step, computed from the last two steps. With shading, the goal moves with
/// the proxy, so the steps shrink geometrically. The factor speeds up their convergence:
/// * above 1 if successive steps have the same direction, as on some surfaces
/// * below 1 if they alternate, as on a concave surface with a deep goal
///
/// Source  Irons & Tuck, "A version of the Aitken accelerator for computer iteration", 1969
double GodObject::relaxation_of(const Vec3& move) const noexcept {
  if (!settings_.is_shaded || way_count_ == 0 || planes_.active().empty()) return 1;
  const Vec3 change = move - last_move_;
  const double along = last_move_.dot(move);
  const double aitken = change.squaredNorm() > 0 ? -taken_ * last_move_.dot(change) / change.squaredNorm() : 0;
  if (along < 0) return std::clamp(aitken, kMinRelaxation, 1.0);
  const bool is_straight = along > kStraightCosine * last_move_.norm() * move.norm();
  // The last step of an update is not lengthened, because no further step could correct it.
  const bool is_last = way_count_ + 1 == kMaxSteps;
  return is_straight && aitken > 0 ? std::min(aitken, is_last ? 1.0 : kMaxRelaxation) : std::min(1.0, relaxation_);
}

/// Lengthens a step by the relaxation factor. Not the target but the goal is moved, and projected again, so that the
/// new target is above all planes.
Vec3 GodObject::lengthened(const Vec3& pulled_to_W, const Vec3& target_W) noexcept {
  const Vec3 farther_W = pulled_to_W + (relaxation_ - 1) * (target_W - tracks_.front().place_W());
  project(farther_W, true);
  if (!planes_.active().empty()) return with_friction(farther_W);
  relaxation_ = 1;
  project(pulled_to_W, true);
  return target_W;
}

/// Moves the proxy's position relative to each obstacle by the same fraction of its distance to the target. Positions
/// that were equal therefore remain equal.
double GodObject::move_towards(const Vec3& target_W, double fraction) noexcept {
  unhindered_W_ = target_W;
  const double share = fraction * std::min(1.0, relaxation_);
  taken_ = fraction * relaxation_;
  double moved = 0;
  for (ObstacleTrack& track : tracks_) {
    const Vec3 way = share * (target_W - track.place_W());
    moved = std::max(moved, way.norm());
    track.set_place_W(share >= 1 ? target_W : Vec3(track.place_W() + way));
  }
  return moved;
}

/// Returns the proxy's position. The proxy has one position for each obstacle; they differ while bodies squeeze the
/// proxy. The result is the one that is farthest from the unhindered position.
Vec3 GodObject::held_place_W() const noexcept {
  Vec3 place_W = unhindered_W_;
  double farthest = -1;
  for (const ObstacleTrack& track : tracks_) {
    const double distance = (track.place_W() - unhindered_W_).squaredNorm();
    if (distance > farthest) place_W = track.place_W();
    farthest = std::max(farthest, distance);
  }
  return place_W;
}

void GodObject::settle_state(const Vec3& goal_W, std::uint8_t faults) noexcept {
  state_ = {};
  state_.goal_W = goal_W;
  state_.p_W = held_place_W();
  for (const ObstacleTrack& track : tracks_) {
    if (is_far(track.place_W(), state_.p_W)) faults |= kProxyHeldBack;
  }
  double load = 0;
  for (const PlaneProjection::Active& active : planes_.active()) load += active.load_m;
  const bool is_goal_known = is_far(goal_W, state_.p_W);
  for (const PlaneProjection::Active& active : planes_.active()) {
    if (!(load > 0) || !is_goal_known) break;
    ++state_.contact_count;
    state_.surface_velocity_W += active.load_m / load * track_of(piece_of(active)).surface_velocity_W(state_.p_W);
  }
  state_.is_touching = state_.contact_count > 0;
  state_.is_sticking = state_.is_touching && !has_slipped_;
  was_sticking_ = state_.is_sticking;
  state_.faults = faults;
}

Vec3 proxy_force_on_hand_W(const ProxyState& state, const CouplingLaw& law, const Vec3& v_WH) noexcept {
  if (!state.is_touching) return Vec3::Zero();
  CouplingState coupling;
  coupling.d_W = state.goal_W - state.p_W;
  const Vec3 pull = coupling.d_W.stableNormalized();
  const Vec3 v_W = is_finite(v_WH) ? clamped_to_length(v_WH, 1e3) : Vec3::Zero();
  coupling.v_WH = v_W;
  const double faded_in = std::min(1.0, coupling.d_W.norm() / kFullDamping_m);
  coupling.v_W = faded_in * pull.dot(v_W - clamped_to_length(state.surface_velocity_W, 1e3)) * pull;
  const Vec3 on_tool_W = law.wrench_on_tool_W(coupling).f;
  return on_tool_W.dot(pull) > 0 ? Vec3(-on_tool_W) : Vec3::Zero();
}

}  // namespace tandem::haptics
