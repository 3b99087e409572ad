#include "lab/session/field_depth.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/physics/molecular_forces.hpp"

namespace tandem::lab {
namespace {

constexpr int kMaxSteps = 400;
constexpr double kFirstStep_m = 5e-4;
constexpr double kLastStep_m = 1e-7;
/// A turn counts as a way at this lever.
constexpr double kLever_m = 0.05;

/// The field at poses of all bodies.
class Landscape {
 public:
  explicit Landscape(const physics::WorldDescription& world) : forces_(world), wrenches_W_(world.bodies.size()) {
    for (const physics::BodyDescription& body : world.bodies)
      can_move_.push_back(body.mass.mass_kg > 0 && body.molecule);
  }

  double energy_j(const std::vector<Pose>& X_WB) {
    std::fill(wrenches_W_.begin(), wrenches_W_.end(), Wrench{});
    forces_.add_wrenches(X_WB, wrenches_W_);
    return forces_.energy_j();
  }
  /// Along the wrenches of the last energy_j(); the farthest goes by `step_m`.
  std::vector<Pose> moved(const std::vector<Pose>& X_WB, double step_m) const {
    double strongest = 0;
    for (std::size_t i = 0; i < X_WB.size(); ++i) {
      if (can_move_[i]) strongest = std::max(strongest, strength(wrenches_W_[i]));
    }
    std::vector<Pose> result = X_WB;
    for (std::size_t i = 0; i < X_WB.size() && strongest > 0; ++i) {
      if (!can_move_[i]) continue;
      const Wrench way = wrenches_W_[i] * (step_m / strongest);
      result[i].p += way.f;
      result[i].q = (quaternion_of(way.t / (kLever_m * kLever_m)) * X_WB[i].q).normalized();
    }
    return result;
  }

 private:
  static double strength(const Wrench& wrench) { return std::hypot(wrench.f.norm(), wrench.t.norm() / kLever_m); }

  physics::MolecularForces forces_;
  std::vector<Wrench> wrenches_W_;
  std::vector<bool> can_move_;
};

double lowest_j(Landscape& landscape, std::vector<Pose> X_WB) {
  double lowest = landscape.energy_j(X_WB);
  double step_m = kFirstStep_m;
  for (int i = 0; i < kMaxSteps && step_m > kLastStep_m; ++i) {
    const std::vector<Pose> next = landscape.moved(X_WB, step_m);
    const double energy = landscape.energy_j(next);
    if (energy < lowest) {
      lowest = energy;
      X_WB = next;
      step_m *= 1.2;
    } else {
      step_m /= 2;
      landscape.energy_j(X_WB);
    }
  }
  return lowest;
}

}  // namespace

double field_depth_j(const physics::WorldDescription& world, std::span<const BodiesSample> samples) {
  if (samples.empty()) return 0;
  const auto deepest = std::min_element(samples.begin(), samples.end(), [](const auto& a, const auto& b) {
    return a.field_energy_kj_per_mol < b.field_energy_kj_per_mol;
  });
  Landscape landscape(world);
  const double start_j = landscape.energy_j(samples.front().X_WB);
  return std::max(0.0, start_j - lowest_j(landscape, deepest->X_WB));
}

}  // namespace tandem::lab
