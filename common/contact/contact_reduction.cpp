#include "common/contact/contact_reduction.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/spatial.hpp"

namespace tandem::contact {
namespace {
constexpr int kMost = static_cast<int>(kReducedContacts);
// A matrix of at most 16 columns that needs no heap memory.
using Columns6 = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, kMost>;

// Number of calls of shared_out(), which divides the contacts among the groups, and of bend(), which corrects the
// groups' lines of force. More calls changed the result little (tried on 15 kinds of patches).
constexpr int kSharings = 2;
constexpr int kBendings = 3;
// Added to the squared distance between a group and a contact, in units of the patch's radius. A contact is divided
// nearly evenly among groups that are nearer than about the root of this value.
constexpr float kBlur = 0.05F;
// Fraction of the trace below which an eigenvalue is regarded as a rounding error.
constexpr double kEigenRounding = 1e-13;

// Adds one contact's force and its derivative; see ContactWrench.
void add(ContactWrench& net, const Vec3& r, const Vec3& normal, const Vec3& force, double stiffness) {
  net.on_a_W.f += force;
  net.on_a_W.t += r.cross(force);
  Vec6 line;
  line << normal, r.cross(normal);
  net.derivative -= stiffness * line * line.transpose();
  // Change of the torque by the displacement δp of the contact: δp × f = −f × δt − f × (δθ × r). ContactWrench defines
  // the symbols.
  const Eigen::Matrix3d force_cross = cross_matrix(force);
  net.derivative.bottomLeftCorner<3, 3>() -= force_cross;
  net.derivative.bottomRightCorner<3, 3>() += force_cross * cross_matrix(r);
}

// Moments of the pressing contacts of a patch about their mean point. Each contact has the stiffness s, the normal n,
// and the position r relative to the mean point.
struct PatchMoments {
  double stiffness = 0;
  double radius_m = 0;  ///< root mean square distance of contacts from the mean; the unit of length below
  Vec3 p_W = Vec3::Zero();
  Vec3 normal_W = Vec3::Zero();    ///< mean of the normals; shorter than 1 where they differ
  Mat6 covariance = Mat6::Zero();  ///< covariance of position and normal
  Mat6 lines = Mat6::Zero();       ///< stiffness matrix Σ s w wᵀ / Σ s of the lines of force w = (n, r × n)
  Wrench wrench_W;
};

PatchMoments moments_of(std::span<const ContactPoint> contacts, double stiffness_n_per_m3) {
  PatchMoments m;
  for (const ContactPoint& contact : contacts) {
    if (!(contact.depth_m > 0)) continue;
    const double stiffness = stiffness_n_per_m3 * contact.area_m2;
    m.stiffness += stiffness;
    m.p_W += stiffness * contact.p_W;
    m.normal_W += stiffness * contact.normal_W;
  }
  m.p_W /= m.stiffness;
  m.normal_W /= m.stiffness;
  for (const ContactPoint& contact : contacts) {
    if (!(contact.depth_m > 0)) continue;
    const double share = stiffness_n_per_m3 * contact.area_m2 / m.stiffness;
    const Vec3 r = contact.p_W - m.p_W;
    Vec6 spread;
    spread << r, contact.normal_W - m.normal_W;
    m.covariance += share * spread * spread.transpose();
    Vec6 line;
    line << contact.normal_W, r.cross(contact.normal_W);
    m.lines += share * line * line.transpose();
    const Vec3 force = m.stiffness * share * contact.depth_m * contact.normal_W;
    m.wrench_W += Wrench{force, r.cross(force)};
  }
  // The lower limit prevents a division by zero for a patch of one point.
  m.radius_m = std::max(1e-9, std::sqrt(m.covariance.topLeftCorner<3, 3>().trace()));
  Vec6 unit = Vec6::Ones();
  unit.head<3>() /= m.radius_m;
  m.covariance = unit.asDiagonal() * m.covariance * unit.asDiagonal();
  unit << Vec3::Ones(), Vec3::Constant(1 / m.radius_m);
  m.lines = unit.asDiagonal() * m.lines * unit.asDiagonal();
  return m;
}

// Applies a function to the eigenvalues of a symmetric matrix. If eigenvalues are equal, the choice of their
// eigenvectors does not affect the result.
template <typename Function>
Mat6 applied(const Mat6& matrix, Function function) {
  const Eigen::SelfAdjointEigenSolver<Mat6> solver(matrix);
  const Vec6 values = solver.eigenvalues().unaryExpr(function);
  return solver.eigenvectors() * values.asDiagonal() * solver.eigenvectors().transpose();
}

Mat6 root(const Mat6& matrix) {
  // An eigenvalue that is only a rounding error is replaced by zero. Its root could be 1e8 times larger than the error.
  // If the contacts of a patch are on a line, this would widen the patch.
  const double zero = kEigenRounding * matrix.trace();
  return applied(matrix, [zero](double value) { return value > zero ? std::sqrt(value) : 0.0; });
}

// Returns the start positions of the groups, one column each, before they are stretched. The components are ±1 in six
// dimensions (three of position, three of normal). Mean 0, covariance 1. With 16 groups, the third moments are 0, too.
Columns6 pattern(int count) {
  Columns6 corners(6, count);
  for (int i = 0; i < count; ++i) {
    const auto sign = [i](int bit) { return (i >> bit) % 2 == 0 ? 1.0 : -1.0; };
    const double a = sign(0);
    const double b = sign(1);
    const double c = sign(2);
    const double d = sign(3);
    if (count == kMost) {
      corners.col(i) << a, b, c, d, a * b * c, b * c * d;
    } else {
      corners.col(i) << a, b, c, a * b, a * c, b * c;
    }
  }
  return corners;
}

// Groups of contacts; each column is one group.
struct Groups {
  /// Mean position (relative to the mean of all contacts, in units of the patch's radius) and mean normal of each
  /// group.
  Columns6 spread;
  Eigen::Array<double, 1, kMost> share;  ///< fraction of the stiffness
  Eigen::Array<double, 1, kMost> depth_m;

  int count() const { return static_cast<int>(spread.cols()); }
};

// One number for each group. Single precision suffices, because positions of groups matter little and bend() corrects
// their errors.
using Numbers = Eigen::Array<float, kMost, 1>;

// Divides the stiffness `whole` of one contact among the groups, and returns their fractions, whose sum is `whole`. `z`
// is the position and normal of the contact. at[i] has component i of the positions and normals of all groups.
Numbers shares(const std::array<Numbers, 6>& at, const Eigen::Matrix<float, 6, 1>& z, float whole) {
  Numbers squared = Numbers::Constant(kBlur);
  for (std::size_t row = 0; row < 6; ++row) squared += (at[row] - z[static_cast<int>(row)]).square();
  const Numbers nearness = squared.cube().inverse();
  return nearness * (whole / nearness.sum());
}

// Divides each contact among all groups, mostly among the near ones, and moves each group to the mean of its fractions
// of contacts. This is a step of k-means with soft assignment.
Groups shared_out(const Groups& from, std::span<const ContactPoint> contacts, double stiffness_n_per_m3,
                  const PatchMoments& m) {
  std::array<Numbers, 6> at;
  std::array<Numbers, 6> sum;
  for (int row = 0; row < 6; ++row) {
    // Unused columns are placed far from every contact, so that they get no part of it.
    at[static_cast<std::size_t>(row)].setConstant(1e4F);
    at[static_cast<std::size_t>(row)].head(from.count()) = from.spread.row(row).transpose().cast<float>();
    sum[static_cast<std::size_t>(row)].setZero();
  }
  Numbers share_sum = Numbers::Zero();
  Numbers depth_sum = Numbers::Zero();
  for (const ContactPoint& contact : contacts) {
    if (!(contact.depth_m > 0)) continue;
    Eigen::Matrix<float, 6, 1> z;
    z << ((contact.p_W - m.p_W) / m.radius_m).cast<float>(), contact.normal_W.cast<float>();
    const auto whole = static_cast<float>(stiffness_n_per_m3 * contact.area_m2 / m.stiffness);
    const Numbers share = shares(at, z, whole);
    share_sum += share;
    depth_sum += share * static_cast<float>(contact.depth_m);
    for (std::size_t row = 0; row < 6; ++row) sum[row] += share * z[static_cast<int>(row)];
  }
  Groups to{from.spread, share_sum.cast<double>(), (depth_sum / share_sum).cast<double>()};
  for (int row = 0; row < 6; ++row) {
    const Numbers mean = sum[static_cast<std::size_t>(row)] / share_sum;
    to.spread.row(row) = mean.head(from.count()).cast<double>().transpose();
  }
  return to;
}

// Places the groups according to the covariance of all contacts, then refines them with shared_out().
Groups grouped(std::span<const ContactPoint> contacts, double stiffness_n_per_m3, const PatchMoments& m, int count) {
  Groups groups{root(m.covariance) * pattern(count), {}, {}};
  groups.spread.bottomRows<3>().colwise() += m.normal_W;
  for (int round = 0; round < kSharings; ++round) groups = shared_out(groups, contacts, stiffness_n_per_m3, m);
  return groups;
}

// Changes the groups' lines of force w = (n, r × n) as little as necessary so that their stiffness matrix Σ s w wᵀ
// equals that of all contacts. `wanted_root` is the root of the wanted matrix. A new line may have a moment along its
// own direction, as a screw has. No single force has such a moment, so it is omitted. The lengths of the new normals
// are not 1 but contain a part of the stiffness.
void bend(Groups& groups, const Mat6& wanted_root) {
  const int count = groups.count();
  Columns6 lines(6, count);
  for (int i = 0; i < count; ++i) {
    const Vec3 normal = groups.spread.col(i).tail<3>();
    lines.col(i) << normal, groups.spread.col(i).head<3>().cross(normal);
    lines.col(i) *= std::sqrt(groups.share[i]);
  }
  const Mat6 have = lines * lines.transpose();
  const Mat6 both = wanted_root * have * wanted_root;
  const double zero = kEigenRounding * both.trace();
  const Mat6 stretch = applied(both, [zero](double value) { return value > zero ? 1 / std::sqrt(value) : 0.0; });
  lines = (wanted_root * stretch * wanted_root * lines).eval();
  for (int i = 0; i < count; ++i) {
    const Vec3 normal = lines.col(i).head<3>() / std::sqrt(groups.share[i]);
    const Vec3 moment = lines.col(i).tail<3>() / std::sqrt(groups.share[i]);
    const double squared = normal.squaredNorm();
    if (squared < 1e-6) continue;  // opposed normals cancel: no line of force
    const Vec3 r = groups.spread.col(i).head<3>();
    groups.spread.col(i) << (normal.cross(moment) + normal.dot(r) * normal) / squared, normal;
  }
}

void write_contacts(const Groups& groups, const PatchMoments& m, std::span<ReducedContact> out) {
  for (int i = 0; i < groups.count(); ++i) {
    const Vec3 normal = groups.spread.col(i).tail<3>();
    const double length = std::max(1e-12, normal.norm());
    ReducedContact& contact = out[static_cast<std::size_t>(i)];
    contact.p_W = m.p_W + m.radius_m * groups.spread.col(i).head<3>();
    contact.normal_W = length > 1e-6 ? Vec3(normal / length) : Vec3::UnitZ();
    contact.stiffness_n_per_m = m.stiffness * groups.share[i] * length * length;
    contact.force_on_a_W = m.stiffness * groups.share[i] * groups.depth_m[i] * normal;
  }
}

// Adds a small force to each contact, so that the net wrench becomes exact. The same force at all contacts corrects the
// net force. A force ω × r at each position r, with one vector ω, corrects the moment.
void correct_wrench(std::span<ReducedContact> contacts, const PatchMoments& m) {
  Vec3 middle = Vec3::Zero();
  for (const ReducedContact& contact : contacts) middle += contact.p_W / static_cast<double>(contacts.size());
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
  Wrench missing{m.wrench_W.f, m.wrench_W.t + (m.p_W - middle).cross(m.wrench_W.f)};
  for (const ReducedContact& contact : contacts) {
    const Vec3 r = contact.p_W - middle;
    missing = missing - Wrench{contact.force_on_a_W, r.cross(contact.force_on_a_W)};
    inertia += r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose();
  }
  // If all contacts are on one line, they have no moment about the line. The eigenvalue for its direction is then zero
  // and must not be inverted.
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(inertia);
  const double zero = kEigenRounding * inertia.trace();
  const Vec3 inverse = axes.eigenvalues().unaryExpr([zero](double value) { return value > zero ? 1 / value : 0.0; });
  const Vec3 turn = axes.eigenvectors() * inverse.asDiagonal() * (axes.eigenvectors().transpose() * missing.t);
  const Vec3 push = missing.f / static_cast<double>(contacts.size());
  for (ReducedContact& contact : contacts) contact.force_on_a_W += push + turn.cross(contact.p_W - middle);
}

std::size_t copy_pressing(std::span<const ContactPoint> contacts, double stiffness_n_per_m3,
                          std::span<ReducedContact> out) {
  std::size_t count = 0;
  for (const ContactPoint& contact : contacts) {
    if (!(contact.depth_m > 0)) continue;
    const double stiffness = stiffness_n_per_m3 * contact.area_m2;
    out[count++] = {contact.p_W, contact.normal_W, stiffness * contact.depth_m * contact.normal_W, stiffness};
  }
  return count;
}

}  // namespace

ContactWrench contact_wrench(std::span<const ContactPoint> contacts, double stiffness_n_per_m3, const Vec3& about_W) {
  ContactWrench net;
  for (const ContactPoint& contact : contacts) {
    if (!(contact.depth_m > 0)) continue;
    const double stiffness = stiffness_n_per_m3 * contact.area_m2;
    add(net, contact.p_W - about_W, contact.normal_W, stiffness * contact.depth_m * contact.normal_W, stiffness);
  }
  return net;
}

ContactWrench contact_wrench(std::span<const ReducedContact> contacts, const Vec3& about_W) {
  ContactWrench net;
  for (const ReducedContact& contact : contacts) {
    add(net, contact.p_W - about_W, contact.normal_W, contact.force_on_a_W, contact.stiffness_n_per_m);
  }
  return net;
}

std::size_t reduce_contacts(std::span<const ContactPoint> contacts, double stiffness_n_per_m3,
                            std::span<ReducedContact> out) noexcept {
  const auto pressing = static_cast<std::size_t>(
      std::count_if(contacts.begin(), contacts.end(), [](const ContactPoint& c) { return c.depth_m > 0; }));
  if (pressing <= out.size()) return copy_pressing(contacts, stiffness_n_per_m3, out);
  if (out.size() < kReducedContactsMin) return 0;
  const std::size_t count = out.size() < kReducedContacts ? kReducedContactsMin : kReducedContacts;
  const PatchMoments m = moments_of(contacts, stiffness_n_per_m3);
  if (!(m.stiffness > 0)) return 0;
  Groups groups = grouped(contacts, stiffness_n_per_m3, m, static_cast<int>(count));
  const Mat6 lines_root = root(m.lines);
  for (int round = 0; round < kBendings; ++round) bend(groups, lines_root);
  write_contacts(groups, m, out);
  correct_wrench(out.first(count), m);
  return count;
}

}  // namespace tandem::contact
