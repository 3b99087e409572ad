// Hundreds of contacts as a handful that acts alike: for what must travel, be shown, or be bounded.
#pragma once

#include <cstdint>
#include <span>

#include "common/contact/contact_pair.hpp"

namespace tandem {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// A contact force with its stiffness.
struct ReducedContact {
  Vec3 p_W = Vec3::Zero();
  Vec3 normal_W = Vec3::UnitZ();
  Vec3 force_on_a_W = Vec3::Zero();
  double stiffness_n_per_m = 0;
};

/// Net wrench of pressing contacts on A about `about_W`, without friction, and its derivative by the motion of A
/// (translation [m], then rotation [rad], both in W; B at rest, B's surface taken as flat at each contact).
struct ContactWrench {
  Wrench on_a_W;
  Matrix6 derivative = Matrix6::Zero();
};
ContactWrench contact_wrench(std::span<const ContactPoint> contacts, double stiffness_n_per_m3, const Vec3& about_W);
ContactWrench contact_wrench(std::span<const ReducedContact> contacts, const Vec3& about_W);

/// At most `out.size()` contacts that have the net wrench of all (to rounding) and nearly their derivative.
/// Out     number written
std::size_t reduce_contacts(std::span<const ContactPoint> contacts, double stiffness_n_per_m3,
                            std::span<ReducedContact> out) noexcept;

}  // namespace tandem
