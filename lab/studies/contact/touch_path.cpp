#include "lab/studies/contact/touch_path.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace tandem::lab {
namespace {

/// Ratio of peak speed to mean speed in a minimum-jerk movement.
constexpr double kPeakOverMean = 1.875;
constexpr double kRest_s = 0.2;
constexpr double kTouching_m = 1e-5;
constexpr int kApproachSteps = 200;

class Way {
 public:
  Way(const TouchPlan& plan, const Pose& start) : plan_(plan) { points_.push_back({Duration{0}, start, 0, ""}); }

  void begin(const std::string& phase) { phase_ = phase; }
  void move_to(const Pose& X_WH) {
    const Pose& from = points_.back().X_DH;
    const double turn = rotation_vector(from.q.conjugate() * X_WH.q).norm();
    const double mean_s = std::max((X_WH.p - from.p).norm() / plan_.speed_m_per_s, turn / plan_.twist_speed_rad_per_s);
    add(X_WH, kPeakOverMean * mean_s);
  }
  void rest() { add(points_.back().X_DH, kRest_s); }
  devices::HandPath path() && { return devices::HandPath(std::move(points_)); }

 private:
  void add(const Pose& X_WH, double seconds) {
    // A new phase begins at the previous point.
    if (!phase_.empty()) points_.back().phase = std::exchange(phase_, "");
    points_.push_back({points_.back().at + from_seconds(seconds), X_WH, 0, ""});
  }

  const TouchPlan& plan_;
  std::vector<devices::WayPoint> points_;
  std::string phase_;
};

double radius_m(const ExactSurface& surface) {
  double radius = 0;
  for (const ExactSurface* part : surface.parts()) {
    for (const Vec3& corner : part->corners()) radius = std::max(radius, corner.norm());
  }
  return radius;
}

Vec3 first_contact(const ExactSurface& a, const ExactSurface& b, const TouchPlan& plan, const Vec3& direction) {
  Pose X_WA{-direction * (radius_m(a) + radius_m(b) + plan.approach_m), plan.q_WA};
  for (int i = 0; i < kApproachSteps; ++i) {
    const double gap = corner_gap_m(a, X_WA, b, Pose{});
    if (gap < kTouching_m) break;
    X_WA.p += direction * gap;
    if (X_WA.p.dot(direction) > 0) break;  // the meshes passed each other without contact
  }
  // The distances of vertices detect a contact of two edges too late, so the meshes may overlap now. Therefore A is
  // moved back by the exact overlap until none remains.
  for (int i = 0; i < kApproachSteps; ++i) {
    const double depth = deepest_overlap_m(a, X_WA, b, Pose{});
    if (depth <= 0) break;
    X_WA.p -= direction * std::max(depth, kTouching_m);
  }
  return X_WA.p;
}

}  // namespace

devices::HandPath touch_path(const ExactSurface& a, const ExactSurface& b, const TouchPlan& plan) {
  const Vec3 into = plan.direction_W.normalized();
  const Vec3 side = into.unitOrthogonal();
  const Vec3 up = into.cross(side);
  const Vec3 contact = first_contact(a, b, plan, into);
  const Pose start{contact - into * plan.approach_m, plan.q_WA};
  const Vec3 pressed = contact + into * plan.press_m;
  const auto turned = [&](double angle) { return (quaternion_of(into * angle) * plan.q_WA).normalized(); };

  Way way(plan, start);
  way.begin("approach");
  way.move_to({contact - into * 1e-3, plan.q_WA});
  way.begin("press");
  way.move_to({pressed, plan.q_WA});
  way.rest();
  way.begin("slide");
  for (const Vec3& along : {side, up}) {
    way.move_to({pressed + along * plan.slide_m, plan.q_WA});
    way.move_to({pressed - along * plan.slide_m, plan.q_WA});
    way.move_to({pressed, plan.q_WA});
  }
  way.begin("twist");
  for (const double angle : {plan.twist_rad, -plan.twist_rad, 0.0}) way.move_to({pressed, turned(angle)});
  way.begin("pull away");
  way.move_to(start);
  way.rest();
  return std::move(way).path();
}

Duration begin_of_phase(const devices::HandPath& path, const std::string& name) {
  const auto found = std::find(path.phases().begin(), path.phases().end(), name);
  if (found == path.phases().end()) throw std::invalid_argument("the hand path has no phase \"" + name + "\"");
  const int wanted = static_cast<int>(found - path.phases().begin());
  Duration at{0};
  while (path.phase_at(at) != wanted) at += from_seconds(0.001);
  return at;
}

}  // namespace tandem::lab
