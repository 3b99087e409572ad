#include "lab/studies/contact/pose_check.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/base/random.hpp"
#include "common/contact/contact_pair.hpp"

namespace tandem::lab {
namespace {

// Largest depth of a tested pose, as a multiple of the depth from which contact is rigid. In thin walls, that rigid
// depth is at most 0.4 of the half thickness.
constexpr double kDeepestInRigid = 2;
constexpr double kDeepestPose_m = kDeepestInRigid * contact::kMaxRigidDepth;
constexpr double kBand_m = 3e-4;
constexpr std::size_t kPlacingPoints = 20000;
constexpr int kBisections = 20, kStepsBack = 20;
constexpr double kSamePlane_m = 1e-5, kOnSurface_m = 2e-5;

Vec3 random_direction(Random& random) {
  const Vec3 v(random.normal(), random.normal(), random.normal());
  return v.norm() > 1e-9 ? Vec3(v.normalized()) : Vec3::UnitX();
}

Quat random_rotation(Random& random) {
  Eigen::Vector4d q;
  for (double& component : q) component = random.normal();
  return q.norm() > 1e-9 ? Quat(q.normalized()) : Quat::Identity();
}

/// Returns whether a point of `from` is deeper than `depth_m` in `to`. Only a sample of the points is tested, which
/// suffices for the choice of poses.
bool is_deeper(const TouchObject& from, const Pose& X_TF, const TouchObject& to, double depth_m) {
  const auto& points = from.shape->shells.surface.points;
  const std::size_t stride = points.size() / kPlacingPoints + 1;
  for (std::size_t i = 0; i < points.size(); i += stride) {
    const Vec3 p_T = X_TF * points[i].p_S.cast<double>();
    const double rough = -to.shape->field->distance_m(p_T);
    if (rough > depth_m) return true;
    // Near the surface the distance grid stores the exact distance. Farther away it gives only the sign, so the
    // distance is computed from the mesh.
    if (rough > 0.5 * to.shape->field->band_m() &&
        -to.exact->distance_m(p_T, std::numeric_limits<double>::infinity()) > depth_m)
      return true;
  }
  return false;
}

double deepest_pose_m(const TouchObject& a, const TouchObject& b) {
  return kDeepestInRigid * std::min(a.shape->rigid_depth_m, b.shape->rigid_depth_m);
}

Pose random_pose(const TouchObject& a, const TouchObject& b, Random& random) {
  const double limit_m = deepest_pose_m(a, b);
  const double wanted = random.uniform(0, limit_m);
  const Vec3 direction = random_direction(random);
  Pose X_WA{Vec3::Zero(), random_rotation(random)};
  double inside = 0, outside = a.shape->radius_m() + b.shape->radius_m();
  for (int i = 0; i < kBisections; ++i) {
    const double middle = (inside + outside) / 2;
    X_WA.p = direction * middle;
    const bool is_deep = is_deeper(a, X_WA, b, wanted) || is_deeper(b, X_WA.inverse(), a, wanted);
    (is_deep ? inside : outside) = middle;
  }
  // The bisection tests only a sample of the points. If a thin wall has passed through another wall, no sampled point
  // may be deep, and the bisection accepts a pose that is too deep. Therefore A is moved back by the excess of the
  // exact depth.
  for (int i = 0; i < kStepsBack; ++i) {
    const double deepest = deepest_overlap_m(*a.exact, X_WA, *b.exact, Pose{}, 0, 2 * kDeepestPose_m);
    if (deepest <= limit_m) break;
    X_WA.p += (deepest - wanted) * direction;
  }
  return X_WA;
}

/// Points of contact sorted by x, so that those near a place are found quickly. The search returns a limited number of
/// contacts. If it finds more points, one contact represents several of them. In this case, those of its points that
/// are inside the other body are stored, too.
class NearContacts {
 public:
  NearContacts(const contact::ContactPair& pair, const TouchObject& a, const Pose& X_WA, const TouchObject& b) {
    const Pose X_AW = X_WA.inverse();
    for (const contact::ContactPoint& contact : pair.contacts()) {
      if (contact.depth_m < 0) continue;
      points_.push_back(contact.p_W);
      faces_.push_back(contact);
      if (contact.count == 1) continue;
      const bool is_of_a = pair.is_of_a(contact);
      for (const contact::ShellPoint& point : pair.points_of(contact)) {
        const Vec3 p_S = point.p_S.cast<double>();
        const Vec3 p_W = is_of_a ? X_WA * p_S : p_S;
        const double distance_m = is_of_a ? b.shape->field->distance_m(p_W) : a.shape->field->distance_m(X_AW * p_W);
        if (distance_m < 0) points_.push_back(p_W);
      }
    }
    std::ranges::sort(points_, {}, [](const Vec3& point) { return point.x(); });
  }
  bool has_within(const Vec3& p_W, double radius_m) const {
    const auto by_x = [](const Vec3& point, double x) { return point.x() < x; };
    for (auto it = std::lower_bound(points_.begin(), points_.end(), p_W.x() - radius_m, by_x); it != points_.end();
         ++it) {
      if (it->x() > p_W.x() + radius_m) return false;
      if ((*it - p_W).squaredNorm() <= radius_m * radius_m) return true;
    }
    return false;
  }

  /// Returns whether some contact represents this point: at the position of the point, the depth below the plane of the
  /// contact equals the depth of the point, within kSamePlane_m.
  bool has_face_over(const OverlapPoint& point) const {
    return std::ranges::any_of(faces_, [&point](const contact::ContactPoint& face) {
      // A motion along the normal moves points of A out of B, and points of B into A. Therefore both signs are tried.
      const double way_m = face.normal_W.dot(point.p_W - face.p_W);
      const double error_m = face.depth_m - point.depth_m;
      return std::min(std::abs(error_m - way_m), std::abs(error_m + way_m)) <= kSamePlane_m;
    });
  }

 private:
  std::vector<Vec3> points_;
  std::vector<contact::ContactPoint> faces_;
};

/// Returns the depth of a contact according to the exact surfaces. It is 0 if none of the contact's points lies on the
/// surface of its own body. The function is needed for a vertex of the other body that pierces a face: the contact is
/// deep, although no vertex of the face is.
double exact_depth_m(const contact::ContactPair& pair, const contact::ContactPoint& contact, const TouchObject& a,
                     const Pose& X_WA, const TouchObject& b, double deepest_m) {
  const bool is_of_a = pair.is_of_a(contact);
  const Pose X_WS = is_of_a ? X_WA : Pose{}, X_OW = is_of_a ? Pose{} : X_WA.inverse();
  const TouchObject &own = is_of_a ? a : b, &other = is_of_a ? b : a;
  double depth_m = 0;
  const auto sample_at = [&](const Vec3& p_S) {
    if (std::abs(own.exact->distance_m(p_S, kOnSurface_m)) > kOnSurface_m) return;
    depth_m = std::max(depth_m, -other.exact->distance_m(X_OW * (X_WS * p_S), deepest_m));
  };
  sample_at(X_WS.inverse() * contact.p_W);
  for (const contact::ShellPoint& point : pair.points_of(contact)) sample_at(point.p_S.cast<double>());
  return depth_m;
}

}  // namespace

PoseCheck check_poses(const TouchObject& a, const TouchObject& b, std::size_t poses, std::uint64_t seed,
                      const std::function<void(std::size_t)>& progress, std::uint32_t budget) {
  PoseCheck result;
  contact::ContactPair pair(budget);
  constexpr double kDeepest_m = 2 * kDeepestPose_m;
  const double near_m = 2 * std::max(a.spacing_m(), b.spacing_m());
  for (std::size_t i = 0; i < poses; ++i) {
    Random random(seed, i);
    const Pose X_WA = random_pose(a, b, random);
    pair.bind(a.shape.get(), b.shape.get());
    pair.find(X_WA, Pose{}, kBand_m);
    const auto found = std::ranges::max_element(pair.contacts(), {}, &contact::ContactPoint::depth_m);
    const bool presses = found != pair.contacts().end() && found->depth_m > 0;
    const double deepest_found = presses ? found->depth_m : 0;
    const double deepest_contact = presses ? exact_depth_m(pair, *found, a, X_WA, b, kDeepest_m) : 0;

    const NearContacts contacts(pair, a, X_WA, b);
    const auto points = overlap_points(*a.exact, X_WA, *b.exact, Pose{}, kMissedDepth_m, kDeepest_m);
    const bool is_missed = std::any_of(points.begin(), points.end(), [&](const OverlapPoint& point) {
      return !contacts.has_within(point.p_W, near_m + point.depth_m) && !contacts.has_face_over(point);
    });
    result.missed_poses += is_missed ? 1 : 0;
    result.exact_points += points.size();
    const double deepest =
        std::max(deepest_contact, deepest_overlap_m(*a.exact, X_WA, *b.exact, Pose{}, 0, kDeepest_m));
    result.deepest_max_m = std::max(result.deepest_max_m, deepest);
    if (const double error = std::abs(deepest - deepest_found); error > result.deepest_error_max_m) {
      result.deepest_error_max_m = error;
      result.worst_pose = i;
    }
    ++result.poses;
    if (progress) progress(result.poses);
  }
  return result;
}

}  // namespace tandem::lab
