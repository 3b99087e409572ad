#include "lab/studies/docking/exit_path.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "common/base/random.hpp"
#include "common/docking/molecular_field.hpp"
#include "lab/studies/docking/docking_trial.hpp"

namespace tandem::lab {
namespace {

constexpr int kQuarters = 4;
constexpr double kPenalty_angstrom = 0.05;
constexpr double kNoise = 1;
constexpr int kRelaxations = 4;
constexpr double kRelax_angstrom = 0.1;
constexpr std::array kLowerBounds_kcal_per_mol{10.0, 20.0, 30.0, 40.0};
constexpr std::size_t kNoParent = static_cast<std::size_t>(-1);

struct Node {
  Pose X_AB;
  Vec3 direction_A = Vec3::Zero();  ///< direction of the step that led to this node; zero at the root
  Vec3 turn_A = Vec3::Zero();
  std::size_t parent = kNoParent;
  double out_angstrom = 0;
  double energy_kcal_per_mol = 0;
  int trials = 0;
};

Vec3 noise(Random& random) {
  const double x = random.normal(), y = random.normal(), z = random.normal();
  return {x, y, z};
}

class Tree {
 public:
  Tree(const docking::Molecule& a, const docking::Molecule& b, const docking::FieldModel& model, const Pose& X_AB,
       std::uint64_t seed, double bound_kcal_per_mol)
      : field_(a, b, without_charges(model)), random_(seed, 1), bound_kcal_per_mol_(bound_kcal_per_mol) {
    for (const Vec3& position : b.positions_angstrom) radius_ = std::max(radius_, position.norm());
    gyration_ = b.gyration_radius_angstrom();
    nodes_.push_back({X_AB});
  }

  void grow(std::size_t effort) {
    while (evaluations_ < effort && !is_out_) {
      const Vec3 towards = noise(random_).normalized();
      const std::size_t from = farthest_towards(towards);
      Node next = step_from(from, towards);
      relax(next);
      if (is_free(nodes_[from].X_AB, next.X_AB)) {
        is_out_ = next.out_angstrom >= kExitDistance_angstrom && next.energy_kcal_per_mol >= -kHardlyHeld_kcal_per_mol;
        if (is_out_ || next.out_angstrom > nodes_[farthest_].out_angstrom) farthest_ = nodes_.size();
        nodes_.push_back(next);
      }
      ++nodes_[from].trials;
    }
  }

  bool is_out() const { return is_out_; }

  std::vector<Pose> way() const {
    std::vector<Pose> poses;
    for (std::size_t i = farthest_; i != kNoParent; i = nodes_[i].parent) poses.push_back(nodes_[i].X_AB);
    std::ranges::reverse(poses);
    return poses;
  }

 private:
  static docking::FieldModel without_charges(docking::FieldModel model) {
    model.dielectric = docking::Dielectric::kNone;
    model.has_far_grid = false;
    return model;
  }

  std::size_t farthest_towards(const Vec3& direction_A) const {
    std::size_t found = 0;
    double farthest = -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      const double here = direction_A.dot(nodes_[i].X_AB.p) - kPenalty_angstrom * nodes_[i].trials;
      if (here <= farthest) continue;
      farthest = here;
      found = i;
    }
    return found;
  }

  Node step_from(std::size_t from, const Vec3& towards_A) {
    const Node& node = nodes_[from];
    Node next;
    next.parent = from;
    next.direction_A = (node.direction_A + towards_A + kNoise * noise(random_)).normalized();
    next.turn_A = clamped_to_length(node.turn_A + noise(random_) * (kNoise * kExitStep_angstrom / radius_),
                                    kExitStep_angstrom / radius_);
    next.X_AB = {node.X_AB.p + kExitStep_angstrom * next.direction_A,
                 (quaternion_of(next.turn_A) * node.X_AB.q).normalized()};
    return next;
  }

  docking::FieldResult evaluate(const Pose& X_AB) {
    ++evaluations_;
    return field_.evaluate(X_AB);
  }

  /// Minimises the energy of a pose by rotation, and by translation perpendicular to the step. Thus a step that would
  /// end in a repelling wall of atoms slides along the wall.
  void relax(Node& node) {
    docking::FieldResult here = evaluate(node.X_AB);
    double way = kRelax_angstrom;
    for (int i = 0; i < kRelaxations; ++i) {
      const Vec3 push = here.force_on_b - here.force_on_b.dot(node.direction_A) * node.direction_A;
      const Vec3 twist = here.torque_on_b / gyration_;
      const double size = std::sqrt(push.squaredNorm() + twist.squaredNorm());
      if (!(size > 0) || !std::isfinite(size)) break;
      const Pose lower = {node.X_AB.p + way / size * push,
                          (quaternion_of(way / size / gyration_ * twist) * node.X_AB.q).normalized()};
      const docking::FieldResult there = evaluate(lower);
      if (there.lennard_jones_kj_per_mol < here.lennard_jones_kj_per_mol) {
        node.X_AB = lower;
        here = there;
      } else {
        way /= 2;
      }
    }
    node.energy_kcal_per_mol = here.lennard_jones_kj_per_mol / docking::kKilojoulesPerKilocalorie;
    node.out_angstrom = (node.X_AB.p - nodes_.front().X_AB.p).norm();
  }

  bool is_free(const Pose& from, const Pose& to) {
    // The last point of the step is evaluated first, because it is the most likely to be blocked.
    for (int quarter = kQuarters; quarter > 0; --quarter) {
      const double share = static_cast<double>(quarter) / kQuarters;
      const docking::FieldResult here = evaluate(pose_between(from, to, share));
      if (!(here.lennard_jones_kj_per_mol <= bound_kcal_per_mol_ * docking::kKilojoulesPerKilocalorie)) return false;
    }
    return true;
  }

  docking::MolecularField field_;
  Random random_;
  double bound_kcal_per_mol_;
  double radius_ = 1, gyration_ = 1;
  std::vector<Node> nodes_;
  std::size_t farthest_ = 0;
  std::size_t evaluations_ = 0;
  bool is_out_ = false;
};

}  // namespace

double way_out_angstrom(std::span<const Pose> way) {
  return (way.back().p - way.front().p).norm();
}

std::vector<Pose> exit_path(const docking::Molecule& a, const docking::Molecule& b, const docking::FieldModel& model,
                            const Pose& X_AB_angstrom, std::uint64_t seed, std::size_t effort) {
  const auto grown = [&](double bound_kcal_per_mol) {
    Tree tree(a, b, model, X_AB_angstrom, seed, bound_kcal_per_mol);
    tree.grow(effort);
    return tree;
  };
  // The highest energy bound is tried first. If the ligand cannot leave below it, lower bounds need not be tried.
  const Tree highest = grown(kExitBound_kcal_per_mol);
  if (!highest.is_out()) return highest.way();
  for (const double bound : kLowerBounds_kcal_per_mol) {
    const Tree tree = grown(bound);
    if (tree.is_out()) return tree.way();
  }
  return highest.way();
}

}  // namespace tandem::lab
