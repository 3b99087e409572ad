// One obstacle as the proxy knows it: where the proxy last was beside it, and what of it is near.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/contact/primitive_fields.hpp"
#include "common/haptics/proxy/plane_projection.hpp"
#include "common/haptics/proxy/proxy_mesh.hpp"

namespace tandem::haptics {

/// Something that a proxy can touch: a mesh, or a convex primitive with an exact distance.
struct ProxyObstacle {
  std::shared_ptr<const ProxyMesh> mesh;                 ///< this …
  std::shared_ptr<const contact::ExactField> primitive;  ///< … or this
  double static_friction = 0;                            ///< Coulomb's coefficient μ_s, at least that of sliding
  double dynamic_friction = 0;                           ///< μ_d ≥ 0
  Pose X_WB;                                             ///< until the first motion arrives
};

/// A convex piece of an obstacle that the proxy could meet: a triangle, or a whole primitive.
struct NearPiece {
  AllowedSide closest;  ///< at the closest point, across the line to it
  AllowedSide face;     ///< of the triangle itself, where the proxy is above or below all of it
  bool has_face = false;
  int obstacle = 0;
  int candidate = -1;     ///< of the obstacle's list; −1: a primitive
  double distance_m = 0;  ///< from the proxy's centre

  bool is_clear(const Vec3& p, double slack_m) const {
    return closest.height_m(p) >= -slack_m || (has_face && face.height_m(p) >= -slack_m);
  }
  /// Of the two, the side that `p` is higher above.
  const AllowedSide& higher_side(const Vec3& p) const {
    return has_face && face.height_m(p) > closest.height_m(p) ? face : closest;
  }
};

/// Keeps the proxy's last place in the obstacle's frame B, so that however the obstacle moves, the proxy's way past it
/// has no gap; and the triangles around that place, so that the tree is asked only now and then.
class ObstacleTrack {
 public:
  static constexpr std::size_t kMaxCandidates = 1024;

  /// Fails   std::invalid_argument: neither mesh nor primitive, or both; friction; a pose that is none
  ObstacleTrack(ProxyObstacle obstacle, int index);

  /// The pose counts; the twist is for damping alone. False: the pose is not one, and the obstacle stays where it was.
  bool move_to(const RigidState& motion) noexcept;
  /// One that is not present holds nothing back; its place is the caller's to keep beside the ball.
  void set_present(bool is_present) noexcept { is_present_ = is_present; }
  bool is_present() const { return is_present_; }
  const Vec3& place_W() const { return place_W_; }
  void set_place_W(const Vec3& p_W) noexcept;

  /// Makes sure that all triangles are known that a ball of `radius_m` can meet within `step_m` on its way to the goal.
  /// Out     how far it may go; less than the step where a place has more than kMaxCandidates triangles
  double prepare(const Vec3& goal_W, double radius_m, double step_m) noexcept;
  /// Appends what a ball can meet within `step_m` (≤ prepare()'s answer), as far as `pieces` holds.
  /// Out     false: it does not hold all
  bool gather(double radius_m, double step_m, std::span<NearPiece> pieces, std::size_t& count) const noexcept;

  /// Whether the plane keeps the whole triangle of `piece` out of a ball that is above it.
  bool is_below(const NearPiece& piece, const AllowedSide& side, double radius_m) const noexcept;
  /// Normal of the smooth surface that the triangles stand for, at the piece's closest point, on the proxy's side.
  Vec3 shaded_normal_W(const NearPiece& piece) const noexcept;
  Vec3 surface_velocity_W(const Vec3& p_W) const noexcept { return V_WB_.v + V_WB_.w.cross(p_W - p_WB_); }
  const ProxyObstacle& obstacle() const { return obstacle_; }

 private:
  struct Candidate {
    Vec3 a, ab, ac;
    Vec3 normal;
    Vec3 centre;  ///< of a ball around the triangle
    double radius_m = 0;
    int triangle = -1;
  };
  static Candidate candidate_of(const geometry::TriangleTree::Near& near) noexcept;
  Vec3 in_B(const Vec3& p_W) const { return R_WB_.transpose() * (p_W - p_WB_); }
  /// A plane of B's frame in W's.
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

  // All triangles within known_radius_m_ of known_centre_B_.
  Vec3 known_centre_B_ = Vec3::Zero();
  double known_radius_m_ = -1;
  int nearest_triangle_ = -1;
  std::vector<Candidate> candidates_;
  std::vector<geometry::TriangleTree::Near> found_;
  std::size_t candidate_count_ = 0;
};

}  // namespace tandem::haptics
