#include "common/world/soft_contact.hpp"

#include <algorithm>

namespace tandem {
namespace {

/// Where the fading ends, in trust radii.
constexpr double kFadeEnd = 4;
/// Below this share of the first force along its direction a contact lets go of everything.
constexpr double kLetGoShare = 0.25;

}  // namespace

Wrench soft_wrench(const SoftContact& contact, const Pose& X_WT) noexcept {
  if (!(contact.trust_radius_m > 0)) return {};
  Eigen::Matrix<double, 6, 1> way;
  way << X_WT.p - contact.X_WT0.p, rotation_vector(X_WT.q * contact.X_WT0.q.conjugate());
  const double distance = std::hypot(way.head<3>().norm(), contact.lever_m * way.tail<3>().norm());
  if (!(distance < kFadeEnd * contact.trust_radius_m)) return {};
  if (distance > contact.trust_radius_m) way *= contact.trust_radius_m / distance;

  const Eigen::Matrix<double, 6, 1> change = contact.stiffness * way;
  Wrench wrench{contact.wrench_W.f - change.head<3>(), contact.wrench_W.t - change.tail<3>()};
  const double pressing = contact.wrench_W.f.squaredNorm();
  if (!(pressing > 0)) return {};
  const double share = wrench.f.dot(contact.wrench_W.f) / pressing;
  const double held = std::clamp(share / kLetGoShare, 0.0, 1.0);
  const double past = std::max(0.0, distance / contact.trust_radius_m - 1);
  return wrench * (held * (1 - past / (kFadeEnd - 1)));
}

}  // namespace tandem
