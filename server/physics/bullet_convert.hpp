// Conversions between the vector types of Bullet and of this project, for files that use Bullet.
#pragma once

#include <LinearMath/btTransform.h>

#include "common/base/spatial.hpp"

namespace tandem::server {

inline Vec3 from_bullet(const btVector3& v) {
  return {v.x(), v.y(), v.z()};
}
inline btVector3 to_bullet(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}
inline Pose from_bullet(const btTransform& X) {
  const btQuaternion q = X.getRotation();
  return {from_bullet(X.getOrigin()), Quat(q.w(), q.x(), q.y(), q.z()).normalized()};
}
inline btTransform to_bullet(const Pose& X) {
  return btTransform(btQuaternion(X.q.x(), X.q.y(), X.q.z(), X.q.w()), to_bullet(X.p));
}

}  // namespace tandem::server
