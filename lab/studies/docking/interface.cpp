#include "lab/studies/docking/interface.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>

namespace tandem::lab {
namespace {

constexpr double kStepAngstrom = 2;
constexpr double kPlaceAngstrom = 1e-3;
constexpr int kMaxCells = 128;  ///< maximum number of cells of the grid along an axis

struct Facts {
  std::size_t atoms = 0;
  std::size_t pairs = 0;
  double min_distance2 = std::numeric_limits<double>::infinity();
};

/// Points sorted into the cells of a grid. A cell is at least as wide as the reach, the largest distance of neighbours.
/// Therefore all neighbours of a point are in its own cell or in an adjacent cell.
class Cells {
 public:
  Cells(const std::vector<Vec3>& points, double reach) : points_(points), origin_(points.front()) {
    Vec3 upper = origin_;
    for (const Vec3& p : points) {
      origin_ = origin_.cwiseMin(p);
      upper = upper.cwiseMax(p);
    }
    side_ = std::max(reach, (upper - origin_).maxCoeff() / kMaxCells);
    counts_ = ((upper - origin_) / side_).array().floor().cast<int>() + 1;
    members_.resize(static_cast<std::size_t>(counts_.prod()));
    for (std::size_t i = 0; i < points.size(); ++i) members_[index(cell_of(points[i]))].push_back(i);
    is_near_.resize(members_.size());
    Eigen::Array3i cell;
    for (cell[2] = 0; cell[2] < counts_[2]; ++cell[2]) {
      for (cell[1] = 0; cell[1] < counts_[1]; ++cell[1]) {
        for (cell[0] = 0; cell[0] < counts_[0]; ++cell[0]) {
          for_each_around(cell, [&](std::size_t) { is_near_[index(cell)] = true; });
        }
      }
    }
  }

  /// Calls found(i, distance²) for each point closer to p than the reach.
  template <class Found>
  void for_each_near(const Vec3& p, double reach, const Found& found) const {
    const Eigen::Array3i cell = cell_of(p);
    if ((cell < -1).any() || (cell > counts_).any()) return;
    const bool is_inside = (cell >= 0).all() && (cell < counts_).all();
    if (is_inside && !is_near_[index(cell)]) return;
    for_each_around(cell, [&](std::size_t i) {
      const double distance2 = (points_[i] - p).squaredNorm();
      if (distance2 < reach * reach) found(i, distance2);
    });
  }

 private:
  Eigen::Array3i cell_of(const Vec3& p) const {
    // Clamps the indices before the cast, because those of distant points exceed the range of int.
    return ((p - origin_) / side_).array().floor().max(-2.0).min(kMaxCells + 2.0).cast<int>();
  }
  std::size_t index(const Eigen::Array3i& cell) const {
    return static_cast<std::size_t>((cell[2] * counts_[1] + cell[1]) * counts_[0] + cell[0]);
  }

  template <class Found>
  void for_each_around(const Eigen::Array3i& cell, const Found& found) const {
    const Eigen::Array3i first = (cell - 1).max(0), last = (cell + 1).min(counts_ - 1);
    Eigen::Array3i at;
    for (at[2] = first[2]; at[2] <= last[2]; ++at[2]) {
      for (at[1] = first[1]; at[1] <= last[1]; ++at[1]) {
        for (at[0] = first[0]; at[0] <= last[0]; ++at[0]) {
          for (const std::size_t i : members_[index(at)]) found(i);
        }
      }
    }
  }

  const std::vector<Vec3>& points_;
  Vec3 origin_;
  double side_ = 1;
  Eigen::Array3i counts_;
  std::vector<std::vector<std::size_t>> members_;
  std::vector<bool> is_near_;  ///< whether a cell or an adjacent cell contains a point
};

class Interface {
 public:
  Interface(const docking::Molecule& a, const docking::Molecule& b, double reach)
      : b_(b), reach_(reach), cells_(a.positions_angstrom, reach), is_in_a_(a.size()) {}

  Facts at(const Pose& X_AB) {
    Facts facts;
    is_in_a_.assign(is_in_a_.size(), false);
    const Eigen::Matrix3d R_AB = X_AB.q.toRotationMatrix();
    for (const Vec3& p : b_.positions_angstrom) {
      const std::size_t before = facts.pairs;
      cells_.for_each_near(X_AB.p + R_AB * p, reach_, [&](std::size_t i, double distance2) {
        is_in_a_[i] = true;
        ++facts.pairs;
        facts.min_distance2 = std::min(facts.min_distance2, distance2);
      });
      if (facts.pairs > before) ++facts.atoms;
    }
    facts.atoms += static_cast<std::size_t>(std::count(is_in_a_.begin(), is_in_a_.end(), true));
    return facts;
  }

 private:
  const docking::Molecule& b_;
  double reach_;
  Cells cells_;
  std::vector<bool> is_in_a_;
};

Vec3 middle(const std::vector<Vec3>& points) {
  Vec3 lower = points.front(), upper = lower;
  for (const Vec3& p : points) {
    lower = lower.cwiseMin(p);
    upper = upper.cwiseMax(p);
  }
  return 0.5 * (lower + upper);
}

double extent(const std::vector<Vec3>& points, const Vec3& centre, const Vec3& direction) {
  double longest = 0;
  for (const Vec3& p : points) longest = std::max(longest, direction.dot(p - centre));
  return longest;
}

/// A line through the centres of both molecules, along which B approaches A.
class Line {
 public:
  Line(const docking::Molecule& a, const docking::Molecule& b, double reach, const Vec3& direction)
      : direction_(direction), centre_a_(middle(a.positions_angstrom)), centre_b_(middle(b.positions_angstrom)) {
    offset_ = extent(a.positions_angstrom, centre_a_, direction) + extent(b.positions_angstrom, centre_b_, -direction) +
              reach;
  }

  bool goes_on() const { return offset_ > 0; }

  /// Moves B inwards from its last position until `wanted` atoms are in the interface. Returns nullopt if the centres
  /// of the molecules coincide first.
  std::optional<Pose> come_near(Interface& interface, std::size_t wanted, std::size_t& most) {
    double outside = offset_;
    while (goes_on()) {
      const std::size_t atoms = interface.at(pose(offset_)).atoms;
      most = std::max(most, atoms);
      if (atoms >= wanted) break;
      outside = offset_;
      offset_ -= kStepAngstrom;
    }
    if (!goes_on()) return std::nullopt;
    while (outside - offset_ > kPlaceAngstrom) {
      const double half = 0.5 * (outside + offset_);
      (interface.at(pose(half)).atoms >= wanted ? offset_ : outside) = half;
    }
    return pose(offset_);
  }

 private:
  Pose pose(double offset) const { return {centre_a_ - centre_b_ + offset * direction_, Quat::Identity()}; }

  Vec3 direction_, centre_a_, centre_b_;
  double offset_;
};

std::vector<Vec3> directions() {
  std::vector<Vec3> found;
  for (int n = 0; n < 27; ++n) {
    if (n != 13) found.push_back(Vec3(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1).normalized());
  }
  return found;
}

}  // namespace

boost::json::object interface_facts(const docking::Molecule& a, const docking::Molecule& b, const Pose& X_AB,
                                    double reach_angstrom) {
  Facts facts;
  if (a.size() > 0) facts = Interface(a, b, reach_angstrom).at(X_AB);
  boost::json::value distance;
  if (facts.pairs > 0) distance = std::sqrt(facts.min_distance2);
  return {{"interface_atoms", facts.atoms}, {"pairs_within", facts.pairs}, {"min_distance_angstrom", distance}};
}

std::vector<Pose> poses_by_interface(const docking::Molecule& a, const docking::Molecule& b, double reach_angstrom,
                                     const std::vector<std::size_t>& sizes) {
  if (a.size() == 0 || b.size() == 0 || sizes.empty()) throw std::invalid_argument("interface: no atoms");
  Interface interface(a, b, reach_angstrom);
  std::optional<Vec3> best;
  double best_distance2 = -1;
  std::size_t most = 0;
  for (const Vec3& direction : directions()) {
    Line line(a, b, reach_angstrom, direction);
    const std::optional<Pose> X_AB = line.come_near(interface, sizes.back(), most);
    if (!X_AB) continue;
    const double distance2 = interface.at(*X_AB).min_distance2;
    if (distance2 <= best_distance2) continue;
    best = direction;
    best_distance2 = distance2;
  }
  if (!best) {
    throw std::invalid_argument("interface of " + std::to_string(sizes.back()) +
                                " atoms: on no line are there more than " + std::to_string(most));
  }
  Line line(a, b, reach_angstrom, *best);
  std::vector<Pose> poses;
  for (const std::size_t size : sizes) poses.push_back(line.come_near(interface, size, most).value());
  return poses;
}

}  // namespace tandem::lab
