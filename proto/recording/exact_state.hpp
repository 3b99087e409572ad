// Writes and reads states in recordings. They are stored bit-exactly, so their ranges are not checked.
#pragma once

#include "common/base/spatial.hpp"
#include "tandem/state.pb.h"

namespace tandem::proto {

inline void write_exact(const RigidState& from, wire::RigidState& to) {
  to.mutable_p()->set_x_m(from.X.p.x());
  to.mutable_p()->set_y_m(from.X.p.y());
  to.mutable_p()->set_z_m(from.X.p.z());
  to.mutable_q()->set_w(from.X.q.w());
  to.mutable_q()->set_x(from.X.q.x());
  to.mutable_q()->set_y(from.X.q.y());
  to.mutable_q()->set_z(from.X.q.z());
  to.set_vx_m_per_s(from.V.v.x());
  to.set_vy_m_per_s(from.V.v.y());
  to.set_vz_m_per_s(from.V.v.z());
  to.set_wx_rad_per_s(from.V.w.x());
  to.set_wy_rad_per_s(from.V.w.y());
  to.set_wz_rad_per_s(from.V.w.z());
}

inline RigidState read_exact(const wire::RigidState& from) {
  return {
      {{from.p().x_m(), from.p().y_m(), from.p().z_m()}, Quat(from.q().w(), from.q().x(), from.q().y(), from.q().z())},
      {{from.vx_m_per_s(), from.vy_m_per_s(), from.vz_m_per_s()},
       {from.wx_rad_per_s(), from.wy_rad_per_s(), from.wz_rad_per_s()}}};
}

inline void write_exact(const Wrench& from, wire::WrenchOnHand& to) {
  to.set_fx_n(from.f.x());
  to.set_fy_n(from.f.y());
  to.set_fz_n(from.f.z());
  to.set_tx_n_m(from.t.x());
  to.set_ty_n_m(from.t.y());
  to.set_tz_n_m(from.t.z());
}

}  // namespace tandem::proto
