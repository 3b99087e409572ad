// One obstacle of the proxy: the proxy's last position relative to the obstacle, and the obstacle's pieces near the
// proxy.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/contact/field/primitive_fields.hpp"
#include "common/haptics/proxy/plane_projection.hpp"
#include "common/haptics/proxy/proxy_mesh.hpp"

namespace tandem::haptics {

/// Obstacle that a proxy can touch: a mesh, or a convex primitive with an exact distance field.
struct ProxyObstacle {
  std::shared_ptr<const ProxyMesh> mesh;                 ///< null if the obstacle is a primitive
  std::shared_ptr<const contact::ExactField> primitive;  ///< null if the obstacle is a mesh
  double static_friction = 0;                            ///< Coulomb's coefficient μ_s, at least dynamic_friction
  double dynamic_friction = 0;                           ///< μ_d ≥ 0
  Pose X_WB;                                             ///< pose until the first motion is received
};

/// Convex piece of an obstacle within reach of the proxy: a triangle, or an entire primitive.
struct NearPiece {
  /// Plane perpendicular to the segment from the piece's closest point to the proxy, at the distance of the ball's
  /// radius from that point.
  AllowedSide closest;
  /// Plane parallel to the triangle, at the distance of the ball's radius. Used if the proxy is entirely on one side of
  /// the triangle's plane, but its closest point is on an edge or corner.
  AllowedSide face;
  bool has_face = false;
  int obstacle = 0;
  int candidate = -1;     ///< index in the obstacle's list of triangles; −1 for a primitive
  double distance_m = 0;  ///< distance from the proxy's centre

  bool is_clear(const Vec3& p, double slack_m) const {
    return closest.height_m(p) >= -slack_m || (has_face && face.height_m(p) >= -slack_m);
  }
  /// Returns the plane for which height_m(p) is largest.
  const AllowedSide& higher_side(const Vec3& p) const {
    return has_face && face.height_m(p) > closest.height_m(p) ? face : closest;
  }
};

/// Follows the motion of an obstacle. The proxy's last position is stored in the obstacle's frame B, so that the
/// proxy's path relative to a moving obstacle has no gap. Triangles around this position are cached, so that the tree
/// is queried only occasionally.
class ObstacleTrack {
 public:
  static constexpr std::size_t kMaxCandidates = 1024;

  /// Fails   throws std::invalid_argument: neither mesh nor primitive, or both; invalid friction; invalid pose
  ObstacleTrack(ProxyObstacle obstacle, int index);

  /// Sets the obstacle's pose and twist; the twist is used only for damping. Returns false for an invalid pose. The
  /// obstacle then keeps its pose.
  bool move_to(const RigidState& motion) noexcept;
  /// Includes or excludes the obstacle. An excluded obstacle does not hold the proxy back. While it is excluded, the
  /// caller must still update the proxy's stored position by set_place_W().
  void set_present(bool is_present) noexcept { is_present_ = is_present; }
  bool is_present() const { return is_present_; }
  const Vec3& place_W() const { return place_W_; }
  void set_place_W(const Vec3& p_W) noexcept;

  /// Caches all triangles that a ball of `radius_m` can meet within `step_m` on its path to the goal.
  /// Out     permitted distance; it is below `step_m` if a region has more than kMaxCandidates triangles
  double prepare(const Vec3& goal_W, double radius_m, double step_m) noexcept;
  /// Appends to `pieces` the obstacle's pieces that a ball can meet within `step_m`. `step_m` is at most the result of
  /// prepare().
  /// Out     false if `pieces` is too small
  bool gather(double radius_m, double step_m, std::span<NearPiece> pieces, std::size_t& count) const noexcept;

  /// Returns whether a ball above the plane `side` cannot touch the triangle of `piece`, because the triangle is
  /// entirely below that plane.
  bool is_below(const NearPiece& piece, const AllowedSide& side, double radius_m) const noexcept;
  /// Returns the normal of the smooth surface that the triangles approximate, at the piece's closest point. The normal
  /// points to the proxy's side.
  Vec3 shaded_normal_W(const NearPiece& piece) const noexcept;
  Vec3 surface_velocity_W(const Vec3& p_W) const noexcept { return V_WB_.v + V_WB_.w.cross(p_W - p_WB_); }
  const ProxyObstacle& obstacle() const { return obstacle_; }

 private:
  struct Candidate {
    Vec3 a, ab, ac;
    Vec3 normal;
    Vec3 centre;  ///< centre of the triangle's bounding ball
    double radius_m = 0;
    int triangle = -1;
  };
  static Candidate candidate_of(const geometry::TriangleTree::Near& near) noexcept;
  Vec3 in_B(const Vec3& p_W) const { return R_WB_.transpose() * (p_W - p_WB_); }
  /// Converts a plane from frame B to W.
  AllowedSide in_W(const Vec3& normal_B, double offset_m) const;
  bool refresh(const Vec3& p_B, double radius_m, double wanted_m, double step_m) noexcept;
  NearPiece primitive_piece(double radius_m) const noexcept;
  bool triangle_piece(int candidate, const Vec3& p_B, double radius_m, double reach_m, NearPiece& piece) const noexcept;

  ProxyObstacle obstacle_;
  int index_;
  bool is_present_ = true;
  Eigen::Matrix3d R_WB_ = Eigen::Matrix3d::Identity();
  Vec3 p_WB_ = Vec3::Zero();
  Twist V_WB_;
  Vec3 place_B_ = Vec3::Zero();
  Vec3 place_W_ = Vec3::Zero();

  // All triangles within known_radius_m_ of known_centre_B_ are in the cache.
  Vec3 known_centre_B_ = Vec3::Zero();
  double known_radius_m_ = -1;
  int nearest_triangle_ = -1;
  std::vector<Candidate> candidates_;
  std::vector<geometry::TriangleTree::Near> found_;
  std::size_t candidate_count_ = 0;
};

}  // namespace tandem::haptics
