#include "common/contact/contact_rows.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::contact {
namespace {

constexpr std::size_t kLanes = 2;

/// Speed at which the hard floor lifts what has sunk below it. Ours: slow enough for a hand, and 3 mm take 15 ms.
constexpr double kRecovery_m_per_s = 0.2;
/// k_t / k_n, see ContactRows.
constexpr double kTangentialRatio = 0.8;
/// The excess of rows without a force.
constexpr double kFarAway_m = -1e30;
/// Divides instead of zero; far below any length or square of a length here.
constexpr double kTiny = 1e-200;

bool is_usable(const ContactPoint& c) {
  // A sum is finite only if all of its terms are.
  const double all = c.p_W.sum() + c.normal_W.sum() + c.bristle_W.sum() + c.depth_m + c.area_m2;
  return std::isfinite(all) && c.area_m2 > 0 && std::abs(c.normal_W.squaredNorm() - 1) < 1e-3;
}

using Lane = Eigen::Array<double, 2, 1>;

Lane positive(const Lane& x) {
  return x.max(0.0);
}
/// 1 where x > 0, else 0. A selection would not be vectorised.
Lane is_positive(const Lane& x) {
  return (x.max(0.0) * 1e290).min(1.0);
}

}  // namespace

/// Two contacts; unused halves have no force.
struct ContactRows::Row {
  Lane nx, ny, nz;  // normal
  Lane rx, ry, rz;  // from about_W
  Lane depth;       // min(δ, ρ), or of a gap δ (h + τ)/h
  Lane excess;      // min(δ − ρ, h · recovery speed)
  Lane soft;        // w
  Lane tangential;  // k_t
  Lane sx, sy, sz;  // bristle
  Lane limit;       // μ f_n
  // Of the last evaluate():
  Lane normal_force;
  Lane zx, zy, zz;
  Lane by_twist;  // −∂f/∂v = by_twist 1 + along_normal nnᵀ − along_slip zzᵀ
  Lane along_normal;
  Lane along_slip;
};

/// Velocity of A past B at the contact, and how fast the contact closes.
struct ContactRows::Motion {
  Lane vx, vy, vz, closing;
};

ContactRows::ContactRows(std::size_t contacts, std::size_t patches) : rows_(contacts / kLanes + patches) {}
ContactRows::~ContactRows() = default;

bool ContactRows::append(std::span<const ContactPoint> contacts, PatchTerms& terms, std::uint32_t& ill) noexcept {
  const std::size_t needed = (contacts.size() + kLanes - 1) / kLanes;
  terms.first = terms.end = used_;
  if (needed > rows_.size() - used_) return false;
  used_ += needed;
  terms.end = used_;
  for (std::size_t i = 0; i < kLanes * needed; ++i) {
    Row& row = rows_[terms.first + i / kLanes];
    const auto half = static_cast<Eigen::Index>(i % kLanes);
    const bool is_there = i < contacts.size();
    if (is_there && is_usable(contacts[i])) {
      set(row, half, contacts[i], terms);
    } else {
      set_empty(row, half);
      if (is_there) ++ill;
    }
  }
  return true;
}

void ContactRows::set(Row& row, Eigen::Index half, const ContactPoint& contact, const PatchTerms& terms) noexcept {
  const Vec3& n = contact.normal_W;
  const Vec3 r = contact.p_W - terms.about_W;
  const Vec3 bristle = contact.bristle_W - n * n.dot(contact.bristle_W);
  const double soft = terms.stiffness_n_per_m3 * contact.area_m2;
  row.nx[half] = n.x();
  row.ny[half] = n.y();
  row.nz[half] = n.z();
  row.rx[half] = r.x();
  row.ry[half] = r.y();
  row.rz[half] = r.z();
  row.sx[half] = bristle.x();
  row.sy[half] = bristle.y();
  row.sz[half] = bristle.z();
  const bool is_gap = contact.depth_m < 0;
  row.depth[half] =
      is_gap ? contact.depth_m * terms.lag_s() / terms.step_s : std::min(contact.depth_m, terms.rigid_depth_m);
  row.excess[half] = std::min(contact.depth_m - terms.rigid_depth_m, terms.step_s * kRecovery_m_per_s);
  row.soft[half] = soft;
  row.tangential[half] = std::max(kTangentialRatio * soft, kTiny);
}

void ContactRows::set_empty(Row& row, Eigen::Index half) noexcept {
  for (Lane* lane :
       {&row.nx, &row.ny, &row.nz, &row.rx, &row.ry, &row.rz, &row.sx, &row.sy, &row.sz, &row.depth, &row.soft}) {
    (*lane)[half] = 0;
  }
  row.excess[half] = kFarAway_m;
  row.tangential[half] = 1;
}

ContactRows::Motion ContactRows::motion(const Row& row, const Twist& twist) noexcept {
  const Vec3 &v = twist.v, &w = twist.w;
  Motion motion{v.x() + w.y() * row.rz - w.z() * row.ry, v.y() + w.z() * row.rx - w.x() * row.rz,
                v.z() + w.x() * row.ry - w.y() * row.rx, Lane::Zero()};
  motion.closing = -(row.nx * motion.vx + row.ny * motion.vy + row.nz * motion.vz);
  return motion;
}

Wrench ContactRows::evaluate(const PatchTerms& terms, const Twist& twist, FrictionLimit friction) noexcept {
  const double step_s = terms.step_s, lag_s = terms.lag_s(), hard = terms.hard_n_per_m;
  Lane fx = Lane::Zero(), fy = fx, fz = fx, tx = fx, ty = fx, tz = fx;
  for (std::size_t i = terms.first; i < terms.end; ++i) {
    Row& row = rows_[i];
    const auto [vx, vy, vz, closing] = motion(row, twist);
    const Lane layer = row.depth + lag_s * closing;
    const Lane floor = row.excess + step_s * closing;
    const Lane normal = row.soft * positive(layer) + hard * positive(floor);

    const Lane zx = row.sx + lag_s * (vx + row.nx * closing);
    const Lane zy = row.sy + lag_s * (vy + row.ny * closing);
    const Lane zz = row.sz + lag_s * (vz + row.nz * closing);
    const Lane per_length = 1.0 / (zx * zx + zy * zy + zz * zz + kTiny).sqrt();
    if (friction == FrictionLimit::kFollows) row.limit = terms.friction * normal;
    const Lane at_limit = row.limit * per_length;
    const Lane kept = at_limit.min(row.tangential);

    const Lane by_twist = kept * lag_s;
    row.normal_force = normal;
    row.zx = zx;
    row.zy = zy;
    row.zz = zz;
    row.by_twist = by_twist;
    row.along_normal = row.soft * lag_s * is_positive(layer) + hard * step_s * is_positive(floor) - by_twist;
    row.along_slip = by_twist * is_positive(row.tangential - at_limit) * per_length * per_length;

    const Lane x = normal * row.nx - kept * zx, y = normal * row.ny - kept * zy, z = normal * row.nz - kept * zz;
    fx += x;
    fy += y;
    fz += z;
    tx += row.ry * z - row.rz * y;
    ty += row.rz * x - row.rx * z;
    tz += row.rx * y - row.ry * x;
  }
  return {{fx.sum(), fy.sum(), fz.sum()}, {tx.sum(), ty.sum(), tz.sum()}};
}

Mat6 ContactRows::derivative(const PatchTerms& terms) const noexcept {
  // With K = −∂f/∂v of a contact and R = [r]×: sums of K, of −K R and of −R K R = R (−K R).
  Lane vv[6] = {Lane::Zero(), Lane::Zero(), Lane::Zero(), Lane::Zero(), Lane::Zero(), Lane::Zero()};
  Lane vw[9] = {Lane::Zero(), Lane::Zero(), Lane::Zero(), Lane::Zero(), Lane::Zero(),
                Lane::Zero(), Lane::Zero(), Lane::Zero(), Lane::Zero()};
  Lane ww[6] = {Lane::Zero(), Lane::Zero(), Lane::Zero(), Lane::Zero(), Lane::Zero(), Lane::Zero()};
  for (std::size_t i = terms.first; i < terms.end; ++i) {
    const Row& row = rows_[i];
    const Lane a = row.by_twist, b = row.along_normal, c = row.along_slip;
    const Lane bx = b * row.nx, by = b * row.ny, bz = b * row.nz, cx = c * row.zx, cy = c * row.zy, cz = c * row.zz;
    const Lane kxx = a + bx * row.nx - cx * row.zx, kyy = a + by * row.ny - cy * row.zy,
               kzz = a + bz * row.nz - cz * row.zz;
    const Lane kxy = bx * row.ny - cx * row.zy, kxz = bx * row.nz - cx * row.zz, kyz = by * row.nz - cy * row.zz;
    vv[0] += kxx;
    vv[1] += kxy;
    vv[2] += kxz;
    vv[3] += kyy;
    vv[4] += kyz;
    vv[5] += kzz;
    const Lane x = row.rx, y = row.ry, z = row.rz;
    // −K R, row by row: −(k × ...) with R = [0 −z y; z 0 −x; −y x 0].
    const Lane mxx = kxz * y - kxy * z, mxy = kxx * z - kxz * x, mxz = kxy * x - kxx * y;
    const Lane myx = kyz * y - kyy * z, myy = kxy * z - kyz * x, myz = kyy * x - kxy * y;
    const Lane mzx = kzz * y - kyz * z, mzy = kxz * z - kzz * x, mzz = kyz * x - kxz * y;
    vw[0] += mxx;
    vw[1] += mxy;
    vw[2] += mxz;
    vw[3] += myx;
    vw[4] += myy;
    vw[5] += myz;
    vw[6] += mzx;
    vw[7] += mzy;
    vw[8] += mzz;
    ww[0] += y * mzx - z * myx;
    ww[1] += y * mzy - z * myy;
    ww[2] += y * mzz - z * myz;
    ww[3] += z * mxy - x * mzy;
    ww[4] += z * mxz - x * mzz;
    ww[5] += x * myz - y * mxz;
  }
  Mat6 k;
  k.topLeftCorner<3, 3>() << vv[0].sum(), vv[1].sum(), vv[2].sum(), vv[1].sum(), vv[3].sum(), vv[4].sum(), vv[2].sum(),
      vv[4].sum(), vv[5].sum();
  k.topRightCorner<3, 3>() << vw[0].sum(), vw[1].sum(), vw[2].sum(), vw[3].sum(), vw[4].sum(), vw[5].sum(), vw[6].sum(),
      vw[7].sum(), vw[8].sum();
  k.bottomLeftCorner<3, 3>() = k.topRightCorner<3, 3>().transpose();
  k.bottomRightCorner<3, 3>() << ww[0].sum(), ww[1].sum(), ww[2].sum(), ww[1].sum(), ww[3].sum(), ww[4].sum(),
      ww[2].sum(), ww[4].sum(), ww[5].sum();
  return k;
}

PatchResult ContactRows::finish(const PatchTerms& terms, std::span<ContactPoint> contacts) const noexcept {
  PatchResult outcome;
  const double share = terms.step_s / terms.lag_s();
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const Row& row = rows_[terms.first + i / kLanes];
    const auto half = static_cast<Eigen::Index>(i % kLanes);
    const double normal_force = row.normal_force[half];
    if (!(normal_force > 0)) {
      contacts[i].bristle_W.setZero();
      continue;
    }
    const Vec3 old(row.sx[half], row.sy[half], row.sz[half]);
    const Vec3 z(row.zx[half], row.zy[half], row.zz[half]);
    Vec3 bristle = old + share * (z - old);
    const double longest = terms.friction * normal_force / row.tangential[half];
    const double length_squared = bristle.squaredNorm();
    if (length_squared > longest * longest) bristle *= longest / std::sqrt(length_squared);
    contacts[i].bristle_W = bristle;
    outcome.normal_force_n += normal_force;
    outcome.deepest_m = std::max(outcome.deepest_m, contacts[i].depth_m);
    ++outcome.pressing;
  }
  return outcome;
}

}  // namespace tandem::contact
