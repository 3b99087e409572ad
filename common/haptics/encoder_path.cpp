#include "common/haptics/encoder_path.hpp"

namespace tandem::haptics {
namespace {

Vec3 within(const Vec3& value, double reach) noexcept {
  return value.cwiseMax(-reach).cwiseMin(reach);
}

}  // namespace

EncoderPath::EncoderPath(double position_step_m, double rotation_step_rad) noexcept
    : reach_m_(position_step_m / 2), reach_rad_(rotation_step_rad / 2) {}

Pose EncoderPath::follow(const Pose& X, const Twist& V, double period_s) noexcept {
  if (reach_m_ == 0 && reach_rad_ == 0) return X;
  if (!has_pose_) X_ = X;
  has_pose_ = true;
  const Vec3 beside_m = within(X_.p + V.v * period_s - X.p, reach_m_);
  const Quat predicted = quaternion_of(V.w * period_s) * X_.q;
  const Vec3 beside_rad = within(rotation_vector(predicted * X.q.conjugate()), reach_rad_);
  X_ = {X.p + beside_m, (quaternion_of(beside_rad) * X.q).normalized()};
  return X_;
}

}  // namespace tandem::haptics
