#include "common/physics/soft_contact.hpp"

#include <algorithm>

namespace tandem::physics {
namespace {

/// Lateral distance at which the wrench has faded to zero, as a multiple of the trust radius.
constexpr double kFadeEnd = 4;
/// If the force along its initial direction falls below this fraction of the initial force, the whole wrench is scaled
/// down.
constexpr double kReleaseShare = 0.25;
/// Largest change of depth that is considered. Beyond it, the force remains constant.
constexpr double kDeepest_m = 0.05;

}  // namespace

Wrench soft_wrench(const SoftContact& contact, const Pose& X_WT) noexcept {
  const double pressing = contact.wrench_W.f.norm();
  if (!(contact.trust_radius_m > 0) || !(pressing > 0)) return {};
  const Vec3 normal_W = contact.wrench_W.f / pressing;
  const Vec3 moved_W = X_WT.p - contact.X_WT0.p;
  const double out_m = moved_W.dot(normal_W);
  Vec6 aside;
  aside << moved_W - normal_W * out_m, rotation_vector(X_WT.q * contact.X_WT0.q.conjugate());
  const double distance = std::hypot(aside.head<3>().norm(), contact.lever_m * aside.tail<3>().norm());
  if (!(distance < kFadeEnd * contact.trust_radius_m)) return {};
  if (distance > contact.trust_radius_m) aside *= contact.trust_radius_m / distance;

  Vec6 way = aside;
  way.head<3>() += normal_W * std::clamp(out_m, -kDeepest_m, kDeepest_m);
  const Vec6 change = contact.stiffness * way;
  const Wrench wrench{contact.wrench_W.f - change.head<3>(), contact.wrench_W.t - change.tail<3>()};
  const double share = wrench.f.dot(normal_W) / pressing;
  const double held = std::clamp(share / kReleaseShare, 0.0, 1.0);
  const double past = std::max(0.0, distance / contact.trust_radius_m - 1);
  return wrench * (held * (1 - past / (kFadeEnd - 1)));
}

}  // namespace tandem::physics
