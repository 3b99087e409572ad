#include "common/haptics/proxy/plane_projection.hpp"

namespace tandem::haptics {
namespace {

/// Depth below a plane up to which a point counts as on the plane. It is the rounding error of sums of coordinates of
/// up to 100 m.
constexpr double kOnPlane_m = 1e-11;
/// Gram determinants below which planes count as parallel, indexed by the number of planes. For two planes, the value
/// corresponds to an angle of 1e-6 rad.
constexpr std::array<double, 4> kMinDeterminant{0, 0, 1e-12, 1e-16};

/// Solves G λ = r for the first `count` rows of a symmetric G with ones on its diagonal.
bool solve_gram(const Eigen::Matrix3d& gram, const Vec3& right, std::size_t count, Vec3& lambda) noexcept {
  if (count == 1) {
    lambda = Vec3(right[0], 0, 0);
    return true;
  }
  if (count == 2) {
    const double c = gram(0, 1);
    const double determinant = 1 - c * c;
    if (!(determinant > kMinDeterminant[2])) return false;
    lambda = Vec3(right[0] - c * right[1], right[1] - c * right[0], 0) / determinant;
    return true;
  }
  const Vec3 first = gram.col(1).cross(gram.col(2));
  const double determinant = gram.col(0).dot(first);
  if (!(determinant > kMinDeterminant[3])) return false;
  lambda =
      Vec3(right.dot(first), right.dot(gram.col(2).cross(gram.col(0))), right.dot(gram.col(0).cross(gram.col(1)))) /
      determinant;
  return true;
}

}  // namespace

bool PlaneProjection::add(const AllowedSide& side, int tag) noexcept {
  const std::size_t total = count_ + 1;
  std::array<Active, 4> planes;
  planes[0] = {side, tag, 0};
  for (std::size_t i = 0; i < count_; ++i) planes[i + 1] = active_[i];
  // Tries every set of planes that contains the added plane (bit 0), which is active in the new solution. The set of
  // all four planes is not tried, because three planes suffice to fix a point.
  for (unsigned chosen = 1; chosen < (1U << total); chosen += 2) {
    if (chosen != 0b1111U && try_set({planes.data(), total}, chosen)) return true;
  }
  return false;
}

bool PlaneProjection::try_set(std::span<const Active> planes, unsigned chosen) noexcept {
  std::array<std::size_t, 3> members{};
  std::size_t count = 0;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    if ((chosen >> i & 1U) != 0) members[count++] = i;
  }
  Eigen::Matrix3d gram = Eigen::Matrix3d::Identity();
  Vec3 right = Vec3::Zero();
  for (std::size_t i = 0; i < count; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    right[row] = -planes[members[i]].side.height_m(goal_);
    for (std::size_t j = 0; j < i; ++j) {
      const auto column = static_cast<Eigen::Index>(j);
      gram(row, column) = gram(column, row) = planes[members[i]].side.normal.dot(planes[members[j]].side.normal);
    }
  }
  Vec3 lambda = Vec3::Zero();
  if (!solve_gram(gram, right, count, lambda) || lambda.minCoeff() < 0) return false;
  Vec3 x = goal_;
  for (std::size_t i = 0; i < count; ++i) {
    x += lambda[static_cast<Eigen::Index>(i)] * planes[members[i]].side.normal;
  }
  for (const Active& plane : planes) {
    if (!(plane.side.height_m(x) >= -kOnPlane_m)) return false;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const Active& plane = planes[members[i]];
    active_[i] = {plane.side, plane.tag, lambda[static_cast<Eigen::Index>(i)]};
  }
  count_ = count;
  point_ = x;
  return true;
}

}  // namespace tandem::haptics
