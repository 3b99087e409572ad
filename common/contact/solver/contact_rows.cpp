#include "common/contact/solver/contact_rows.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/contact/lanes/lanes.hpp"

namespace tandem::contact {
namespace {

constexpr std::size_t kLanes = 4;

/// Largest speed at which the hard floor pushes out a contact that is deeper than the rigid depth. It is slow for a
/// hand: 3 mm take 15 ms.
constexpr double kRecovery_m_per_s = 0.2;
/// Value of `excess` for lanes without a contact. It is so negative that their force is zero.
constexpr double kFarAway_m = -1e30;
/// Upper limit of the factor r, by which friction is stiffer for a contact beyond the rigid depth; see ContactRows.
/// With a larger r, friction does not converge within a step's iterations if kilonewtons press on a corner.
constexpr double kMaxRate = 100;
/// Smallest divisor; prevents a division by zero. It is far below any length or squared length that occurs.
constexpr double kTiny = 1e-200;

/// Allowed deviation of a normal's squared length from 1.
constexpr double kMaxOff = 1e-3;

bool is_usable(const ContactPoint& c) {
  // A sum is finite only if all of its terms are.
  const double all = c.p_W.sum() + c.normal_W.sum() + c.bristle_W.sum() + c.depth_m + c.area_m2;
  return std::isfinite(all) && c.area_m2 > 0 && std::abs(c.normal_W.squaredNorm() - 1) < kMaxOff;
}

}  // namespace

/// Four contacts, one in each lane. Unused lanes have no force. The symbols in the comments are those of ContactRows.
struct alignas(32) ContactRow {
  using Lanes = portable::Lanes;

  Lanes nx, ny, nz;  // normal
  Lanes rx, ry, rz;  // position relative to about_W
  Lanes depth;       // depth in the soft layer: min(δ, ρ); for a gap δ (h + τ)/h
  Lanes excess;      // depth in the hard floor: min(δ − ρ, h · recovery speed)
  Lanes soft;        // stiffness w of the soft layer
  Lanes tangential;  // tangential stiffness k_t
  Lanes sx, sy, sz;  // bristle
  Lanes limit;       // friction limit μ f_n
  Lanes rate;        // factor r of the tangential displacement
  // Results of the last evaluate():
  Lanes normal_force;
  Lanes zx, zy, zz;
  Lanes by_twist;  // −∂f/∂v = by_twist 1 + along_normal nnᵀ − along_slip zzᵀ
  Lanes along_normal;
  Lanes along_slip;
};

}  // namespace tandem::contact

#define TANDEM_KERNEL "common/contact/lanes/contact_rows.inc"
#include "common/contact/lanes/twice.inc"

namespace tandem::contact {

ContactRows::ContactRows(std::size_t contacts, std::size_t patches) : rows_(contacts / kLanes + patches) {}
ContactRows::~ContactRows() = default;

bool ContactRows::append(std::span<const ContactPoint> contacts, PatchTerms& terms, std::uint32_t& ill) noexcept {
  const std::size_t needed = (contacts.size() + kLanes - 1) / kLanes;
  terms.first = terms.end = used_;
  if (needed > rows_.size() - used_) return false;
  used_ += needed;
  terms.end = used_;
  const std::span<ContactRow> rows = std::span(rows_).subspan(terms.first, needed);
  const bool are_usable = (uses_avx2() ? avx2::set_rows : portable::set_rows)(contacts, terms, rows);
  for (std::size_t i = are_usable ? contacts.size() : 0; i < kLanes * needed; ++i) {
    const bool is_present = i < contacts.size();
    if (is_present && is_usable(contacts[i])) continue;
    set_empty(rows[i / kLanes], i % kLanes);
    if (is_present) ++ill;
  }
  return true;
}

void ContactRows::set_empty(ContactRow& row, std::size_t lane) noexcept {
  for (ContactRow::Lanes* lanes :
       {&row.nx, &row.ny, &row.nz, &row.rx, &row.ry, &row.rz, &row.sx, &row.sy, &row.sz, &row.depth, &row.soft}) {
    (*lanes)[lane] = 0;
  }
  row.excess[lane] = kFarAway_m;
  row.tangential[lane] = 1;
}

Wrench ContactRows::evaluate(const PatchTerms& terms, const Twist& twist, FrictionLimit friction) noexcept {
  const std::span<ContactRow> rows = std::span(rows_).subspan(terms.first, terms.end - terms.first);
  std::array<double, 6> sums;
  (uses_avx2() ? avx2::evaluate_rows : portable::evaluate_rows)(rows, terms, twist, friction, sums);
  return {{sums[0], sums[1], sums[2]}, {sums[3], sums[4], sums[5]}};
}

Mat6 ContactRows::derivative(const PatchTerms& terms) const noexcept {
  const std::span<const ContactRow> rows = std::span(rows_).subspan(terms.first, terms.end - terms.first);
  std::array<double, 6> vv, ww;
  std::array<double, 9> vw;
  (uses_avx2() ? avx2::sum_derivatives : portable::sum_derivatives)(rows, vv, vw, ww);
  Mat6 k;
  k.topLeftCorner<3, 3>() << vv[0], vv[1], vv[2], vv[1], vv[3], vv[4], vv[2], vv[4], vv[5];
  k.topRightCorner<3, 3>() << vw[0], vw[1], vw[2], vw[3], vw[4], vw[5], vw[6], vw[7], vw[8];
  k.bottomLeftCorner<3, 3>() = k.topRightCorner<3, 3>().transpose();
  k.bottomRightCorner<3, 3>() << ww[0], ww[1], ww[2], ww[1], ww[3], ww[4], ww[2], ww[4], ww[5];
  return k;
}

PatchResult ContactRows::finish(const PatchTerms& terms, std::span<ContactPoint> contacts) const noexcept {
  const std::span<const ContactRow> rows = std::span(rows_).subspan(terms.first, terms.end - terms.first);
  return (uses_avx2() ? avx2::finish_rows : portable::finish_rows)(rows, terms, contacts);
}

}  // namespace tandem::contact
