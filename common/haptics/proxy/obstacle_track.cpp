#include "common/haptics/proxy/obstacle_track.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "common/geometry/closest_on_triangle.hpp"

namespace tandem::haptics {
namespace {

/// Limits of the cache's margin: triangles are cached up to this distance beyond those that one step needs. With the
/// smaller margin, a hand at 0.1 m/s queries the tree about every fifth tick.
constexpr double kMinMargin_m = 3e-4;
constexpr double kMaxMargin_m = 7e-4;
/// Smallest margin. If the full cache does not even cover this margin, the region counts as too dense in triangles.
constexpr double kNoMargin_m = 1e-5;
/// Depth by which a ball that overlaps a mesh comes out of it in each step.
constexpr double kRecovery_m = 1e-6;
/// Depth below a face's plane up to which a point counts as above it, to allow for rounding; compare kSlack_m in
/// god_object.cpp.
constexpr double kFaceSlack_m = 2e-9;
/// Distance from the world's origin beyond which double precision is coarser than kFaceSlack_m.
constexpr double kFarthest_m = 1e4;

bool is_pose(const Pose& X) {
  return is_finite(X) && X.p.cwiseAbs().maxCoeff() <= kFarthest_m && std::abs(X.q.norm() - 1) < 1e-3;
}

}  // namespace

ObstacleTrack::ObstacleTrack(ProxyObstacle obstacle, int index) : obstacle_(std::move(obstacle)), index_(index) {
  const std::string name = "obstacle " + std::to_string(index);
  if ((obstacle_.mesh == nullptr) == (obstacle_.primitive == nullptr)) {
    throw std::invalid_argument(name + " has both a mesh and a primitive, or neither; give one of them");
  }
  const bool is_friction = std::isfinite(obstacle_.static_friction) && obstacle_.dynamic_friction >= 0 &&
                           obstacle_.static_friction >= obstacle_.dynamic_friction;
  if (!is_friction) {
    throw std::invalid_argument(name + ": static_friction is " + std::to_string(obstacle_.static_friction) +
                                ", dynamic_friction " + std::to_string(obstacle_.dynamic_friction) +
                                "; give 0 ≤ dynamic_friction ≤ static_friction");
  }
  if (!move_to({obstacle_.X_WB, {}})) {
    throw std::invalid_argument(name + ": X_WB is not a pose within 10 km; give a finite place and a unit quaternion");
  }
  if (obstacle_.mesh) {
    candidates_.resize(kMaxCandidates);
    found_.resize(kMaxCandidates);
  }
}

bool ObstacleTrack::move_to(const RigidState& motion) noexcept {
  V_WB_ = is_finite(motion.V) ? motion.V : Twist{};
  if (!is_pose(motion.X)) return false;
  R_WB_ = motion.X.q.normalized().toRotationMatrix();
  p_WB_ = motion.X.p;
  place_W_ = p_WB_ + R_WB_ * place_B_;
  return true;
}

void ObstacleTrack::set_place_W(const Vec3& p_W) noexcept {
  place_W_ = p_W;
  place_B_ = in_B(p_W);
}

AllowedSide ObstacleTrack::in_W(const Vec3& normal_B, double offset_m) const {
  const Vec3 normal_W = R_WB_ * normal_B;
  return {normal_W, offset_m + normal_W.dot(p_WB_)};
}

double ObstacleTrack::prepare(const Vec3& goal_W, double radius_m, double step_m) noexcept {
  if (!obstacle_.mesh || !is_present_) return std::numeric_limits<double>::infinity();
  const auto reach = [&] { return known_radius_m_ - (place_B_ - known_centre_B_).norm() - radius_m; };
  const double wanted_m = (goal_W - place_W_).norm();
  // The cache is renewed if its remaining reach covers neither the step nor the distance to the goal, and is below half
  // of its initial reach. The new search is centred at the proxy's present position.
  if (known_radius_m_ < 0 || reach() < std::min({step_m, wanted_m, (known_radius_m_ - radius_m) / 2})) {
    if (!refresh(place_B_, radius_m, wanted_m, step_m)) return 0;
  }
  return std::max(reach(), 0.0);
}

/// Copies a triangle from the search result instead of the mesh: only the search result is in the processor's cache.
ObstacleTrack::Candidate ObstacleTrack::candidate_of(const geometry::TriangleTree::Near& near) noexcept {
  Candidate candidate{near.a, near.ab, near.ac, near.ab.cross(near.ac).stableNormalized(), {}, 0, near.triangle};
  const Vec3 middle = (near.ab + near.ac) / 3;
  candidate.centre = near.a + middle;
  candidate.radius_m =
      std::sqrt(std::max({middle.squaredNorm(), (near.ab - middle).squaredNorm(), (near.ac - middle).squaredNorm()}));
  return candidate;
}

bool ObstacleTrack::refresh(const Vec3& p_B, double radius_m, double wanted_m, double step_m) noexcept {
  const geometry::TriangleTree& tree = obstacle_.mesh->tree();
  double margin_m = std::clamp(2 * step_m, kMinMargin_m, kMaxMargin_m);
  const double limit_m = radius_m + wanted_m + margin_m;
  const geometry::TriangleTree::Closest nearest = tree.closest(p_B, limit_m, nearest_triangle_);
  known_centre_B_ = p_B;
  known_radius_m_ = limit_m;
  candidate_count_ = 0;
  if (nearest.triangle < 0) return true;
  nearest_triangle_ = nearest.triangle;
  for (; margin_m > kNoMargin_m; margin_m /= 4) {
    known_radius_m_ = std::min(limit_m, std::max(nearest.distance_m, radius_m) + margin_m);
    candidate_count_ = tree.within(p_B, known_radius_m_, found_);
    if (candidate_count_ > found_.size()) continue;
    for (std::size_t i = 0; i < candidate_count_; ++i) candidates_[i] = candidate_of(found_[i]);
    return true;
  }
  candidate_count_ = 0;
  known_radius_m_ = -1;
  return false;
}

bool ObstacleTrack::gather(double radius_m, double step_m, std::span<NearPiece> pieces,
                           std::size_t& count) const noexcept {
  if (!is_present_) return true;
  if (obstacle_.primitive) {
    if (count >= pieces.size()) return false;
    pieces[count++] = primitive_piece(radius_m);
    return true;
  }
  const double reach_m = radius_m + step_m;
  for (std::size_t i = 0; i < candidate_count_; ++i) {
    const Candidate& triangle = candidates_[i];
    const double far_m = reach_m + triangle.radius_m;
    if ((place_B_ - triangle.centre).squaredNorm() > far_m * far_m) continue;
    if (count >= pieces.size()) return false;
    if (triangle_piece(static_cast<int>(i), place_B_, radius_m, reach_m, pieces[count])) ++count;
  }
  return true;
}

NearPiece ObstacleTrack::primitive_piece(double radius_m) const noexcept {
  const contact::DistanceSample sample = obstacle_.primitive->sample(place_B_);
  NearPiece piece;
  const Vec3 normal_B = sample.gradient.stableNormalized();
  piece.closest = in_W(normal_B, normal_B.dot(place_B_) - sample.distance_m + radius_m);
  piece.obstacle = index_;
  piece.distance_m = sample.distance_m;
  return piece;
}

bool ObstacleTrack::triangle_piece(int candidate, const Vec3& p_B, double radius_m, double reach_m,
                                   NearPiece& piece) const noexcept {
  const Candidate& triangle = candidates_[static_cast<std::size_t>(candidate)];
  const Vec3 ap = p_B - triangle.a;
  const geometry::OnTriangle on = geometry::closest_on_triangle(triangle.ab, triangle.ac, ap);
  const Vec3 outward = ap - on.from_a;
  const double squared = outward.squaredNorm();
  if (squared >= reach_m * reach_m) return false;
  const double distance = std::sqrt(squared);
  const double height = triangle.normal.dot(ap);
  const double side = height < 0 ? -1 : 1;
  const bool is_on_face = on.feature == 0 || distance < kRecovery_m;
  const Vec3 normal_B = is_on_face ? Vec3(side * triangle.normal) : Vec3(outward / distance);
  piece.closest = in_W(normal_B, normal_B.dot(p_B) - distance + std::min(radius_m, distance + kRecovery_m));
  piece.has_face = !is_on_face && side * height >= radius_m - kFaceSlack_m;
  if (piece.has_face) {
    piece.face = in_W(side * triangle.normal, side * triangle.normal.dot(triangle.a) + radius_m);
  }
  piece.obstacle = index_;
  piece.candidate = candidate;
  piece.distance_m = distance;
  return true;
}

bool ObstacleTrack::is_below(const NearPiece& piece, const AllowedSide& side, double radius_m) const noexcept {
  if (piece.candidate < 0) return false;
  const Candidate& triangle = candidates_[static_cast<std::size_t>(piece.candidate)];
  const Vec3 normal_B = R_WB_.transpose() * side.normal;
  const double highest =
      normal_B.dot(triangle.a) + std::max({0.0, normal_B.dot(triangle.ab), normal_B.dot(triangle.ac)});
  return highest + radius_m <= side.offset_m - side.normal.dot(p_WB_) + kFaceSlack_m;
}

Vec3 ObstacleTrack::shaded_normal_W(const NearPiece& piece) const noexcept {
  const Vec3& plain = piece.closest.normal;
  if (piece.candidate < 0) return plain;
  const Candidate& triangle = candidates_[static_cast<std::size_t>(piece.candidate)];
  const Vec3 on = geometry::closest_on_triangle(triangle.ab, triangle.ac, place_B_ - triangle.a).from_a;
  // Barycentric coordinates of the closest point, computed from areas.
  const Vec3 doubled_area = triangle.ab.cross(triangle.ac);
  const double squared = doubled_area.squaredNorm();
  const double at_b = on.cross(triangle.ac).dot(doubled_area) / squared;
  const double at_c = triangle.ab.cross(on).dot(doubled_area) / squared;
  const auto& corners = obstacle_.mesh->normals_of(triangle.triangle);
  const Vec3 smooth_B = (1 - at_b - at_c) * corners[0].cast<double>() + at_b * corners[1].cast<double>() +
                        at_c * corners[2].cast<double>();
  const Vec3 smooth_W = R_WB_ * smooth_B.stableNormalized();
  return smooth_W.dot(plain) < 0 ? Vec3(-smooth_W) : smooth_W;
}

}  // namespace tandem::haptics
