#include "server/assets/molecular_scale.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "common/docking/exact_field.hpp"
#include "common/docking/far_grid.hpp"
#include "common/docking/molecular_field.hpp"
#include "common/physics/world_description.hpp"
#include "proto/scene_ranges.hpp"
#include "server/assets/field_choice.hpp"
#include "server/assets/pose_minimiser.hpp"

namespace tandem::server {
namespace {

using docking::FieldModel;
using docking::kKilojoulesPerKilocalorie;
using docking::Molecule;

constexpr double kStrongestPull_n = 1;
/// Force scale for molecules without attraction to each other [N per kcal/mol/Å].
constexpr double kScaleWithoutPull = 0.03;
constexpr double kTouching_kcal_per_mol = 5;
/// Largest number of atom pairs for which the energy is minimised. The minimisation of so many pairs takes 1 or 2 s.
constexpr std::size_t kMaxToMinimise = 1'000'000;
constexpr double kCoarseStep_angstrom = 1, kFineStep_angstrom = 0.1;
constexpr double kSearchOut_angstrom = 4, kSearchIn_angstrom = 2;
constexpr double kAside_angstrom = 6;
constexpr int kSides = 6;
/// Parameters of the simulation in which one molecule is pulled out of the other: kExits directions, kSettlingSteps
/// descent steps at the start, and kSlidingSteps descent steps after each displacement.
constexpr int kExits = 24, kSettlingSteps = 40, kSlidingSteps = 10;
constexpr double kBlocked_kcal_per_mol = 50, kHopeless_kj_per_mol = 1e9;
constexpr double kDrawStep_angstrom = 0.25, kSlide_angstrom = 0.1;
/// Attraction below which two molecules are treated as not attracting each other [kcal/mol/Å].
constexpr double kNoPull = 1e-3;
/// Minimum depth at which an attraction is displayed [kT]. A scene may have a zero area, a range of energies near the
/// minimum in which no force is displayed. The depth is the energy difference between the upper end of that range and
/// molecules far apart. With less depth, no attraction could be felt.
constexpr double kFelt_kt = 3;

double extent_angstrom(const Molecule& molecule) {
  double extent = 0;
  for (const Vec3& position : molecule.positions_angstrom) extent = std::max(extent, position.norm());
  return extent;
}

/// Rounds to four significant digits. Kernels of the field differ in the last digits of a float, but a scene must be
/// the same on all machines.
double rounded(double value) {
  const double step = std::pow(10, std::floor(std::log10(std::max(1e-12, std::abs(value)))) - 3);
  return std::round(value / step) * step;
}

/// Returns one of `count` evenly spread unit vectors (Fibonacci spiral).
Vec3 side(int index, int count) {
  const double z = 1 - (2 * index + 1.0) / count, turn = index * std::numbers::pi * (3 - std::sqrt(5.0));
  const double r = std::sqrt(1 - z * z);
  return {r * std::cos(turn), r * std::sin(turn), z};
}

docking::MolecularField field_of(const Molecule& a, const Molecule& b, FieldModel model, bool has_charges) {
  if (!has_charges) model.dielectric = docking::Dielectric::kNone;
  model.has_far_grid = model.has_far_grid && has_charges;
  // The portable kernel gives the same numbers on every CPU, so a recording or checkpoint fits the scene on other
  // machines, too. With a far-field grid it would take seconds. The default kernel is used then, and rounding to four
  // digits removes the differences between kernels.
  return {a, b, model, model.has_far_grid ? "" : "portable"};
}

/// Result of the approach of two molecules along a line. `contact` and `best` are distances between their centres [Å].
struct Way {
  Vec3 direction_A;
  double contact = 0;
  double strongest_pull = 0;  ///< strongest attraction along the line [kcal/mol/Å]
  double best = 0, least_kcal_per_mol = 0;
};

/// Returns the pose of B displaced by `step`, in the coordinates of the 6×6 gradient: translation, then rotation.
Pose moved(const Pose& X, const Eigen::Matrix<double, 6, 1>& step) {
  return {X.p + step.head<3>(), (quaternion_of(step.tail<3>()) * X.q).normalized()};
}

/// Approach of one pair of molecules along a line.
class Approach {
 public:
  Approach(const Molecule& a, const Molecule& b, const FieldModel& model)
      : field_(field_of(a, b, model, true)),
        repulsion_(field_of(a, b, model, false)),
        farthest_(extent_angstrom(a) + extent_angstrom(b) + kAside_angstrom),
        gyration_(b.gyration_radius_angstrom()) {}

  /// Returns the distance at contact. Only the Lennard-Jones energy is used, because charges may repel at much larger
  /// distances.
  double contact(const Vec3& direction_A) {
    double distance = farthest_;
    while (distance > 0 && at(repulsion_, direction_A, distance).first < kTouching_kcal_per_mol)
      distance -= kCoarseStep_angstrom;
    while (distance < farthest_ && at(repulsion_, direction_A, distance).first >= kTouching_kcal_per_mol)
      distance += kFineStep_angstrom;
    return distance;
  }

  Way along(const Vec3& direction_A) {
    Way way{direction_A, contact(direction_A)};
    way.best = way.contact;
    for (double out = 0; out < kSearchOut_angstrom; out += kFineStep_angstrom) {
      const auto [energy, pushes] = at(field_, direction_A, way.contact + out);
      way.strongest_pull = std::max(way.strongest_pull, -pushes);
      if (energy >= way.least_kcal_per_mol) continue;
      way.least_kcal_per_mol = energy;
      way.best = way.contact + out;
    }
    return way;
  }

  /// Returns how strongly A holds B at `place` [kcal/mol/Å]. B is pulled out in several directions, with free sideways
  /// motion and rotation. Each pull has a largest resisting force, and the result is the smallest of these forces. It
  /// is 0 if nothing holds B, or if every direction is blocked.
  ///
  /// In      report  called with the completed fraction, 0 to 1
  template <class Report>
  double hold(const Vec3& place, const Report& report) {
    Pose inside{place, Quat::Identity()};
    // Interpenetrating molecules, e.g. two copies of one file, have no bound pose. Their search would take minutes.
    if (field_.evaluate(inside).energy_kj_per_mol() > kHopeless_kj_per_mol) {
      report(1.0);
      return 0;
    }
    descend(inside, Vec3::Zero(), kSettlingSteps);
    double easiest = std::numeric_limits<double>::infinity();
    for (int i = 0; i < kExits; ++i) {
      const Vec3 direction_A = side(i, kExits);
      Pose X = inside;
      double strongest = 0, energy = 0;
      for (double out = 0; out < kSearchOut_angstrom && energy < kBlocked_kcal_per_mol && strongest < easiest;
           out += kDrawStep_angstrom) {
        X.p += kDrawStep_angstrom * direction_A;
        const docking::FieldResult here = descend(X, direction_A, kSlidingSteps);
        energy = here.energy_kj_per_mol() / kKilojoulesPerKilocalorie;
        strongest = std::max(strongest, -here.force_on_b.dot(direction_A) / kKilojoulesPerKilocalorie);
      }
      if (energy < kBlocked_kcal_per_mol) easiest = std::min(easiest, strongest);
      report((i + 1.0) / kExits);
    }
    return std::isfinite(easiest) ? easiest : 0;
  }

  /// Returns the energy [kcal/mol] at the first point of the approach at which the repulsive force reaches `push`
  /// [kcal/mol/Å].
  double energy_of_push(const Way& way, double push) {
    double energy = 0;
    for (double in = -kSearchOut_angstrom; in < kSearchIn_angstrom; in += kFineStep_angstrom) {
      const auto [here, pushes] = at(field_, way.direction_A, way.contact - in);
      energy = here;
      if (pushes >= push) break;
    }
    return energy;
  }

 private:
  /// Returns energy [kcal/mol] and outward force [kcal/mol/Å].
  static std::pair<double, double> at(docking::MolecularField& field, const Vec3& direction_A, double distance) {
    const docking::FieldResult result = field.evaluate({distance * direction_A, Quat::Identity()});
    return {result.energy_kj_per_mol() / kKilojoulesPerKilocalorie,
            result.force_on_b.dot(direction_A) / kKilojoulesPerKilocalorie};
  }

  /// Lowers the energy by steps perpendicular to `held_A`, so that the displacement along `held_A` does not change.
  /// Returns the field at the last pose.
  docking::FieldResult descend(Pose& X, const Vec3& held_A, int steps) {
    docking::FieldResult here = field_.evaluate(X);
    double way = kSlide_angstrom;
    for (int i = 0; i < steps; ++i) {
      const Vec3 push = here.force_on_b - here.force_on_b.dot(held_A) * held_A, twist = here.torque_on_b / gyration_;
      const double size = std::sqrt(push.squaredNorm() + twist.squaredNorm());
      if (!(size > 0) || !std::isfinite(size)) break;
      Eigen::Matrix<double, 6, 1> step;
      step << way / size * push, way / size / gyration_ * twist;
      const Pose lower = moved(X, step);
      const docking::FieldResult there = field_.evaluate(lower);
      if (there.energy_kj_per_mol() < here.energy_kj_per_mol()) {
        X = lower;
        here = there;
      } else {
        way /= 2;
      }
    }
    return here;
  }

  docking::MolecularField field_;
  docking::MolecularField repulsion_;
  double farthest_;
  double gyration_;  ///< radius of gyration of B [Å]
};

std::vector<Vec3> ways(const Vec3& offset) {
  std::vector<Vec3> directions;
  if (offset.norm() > 1) directions.push_back(offset.normalized());
  for (int i = 0; i < kSides; ++i) directions.push_back(side(i, kSides));
  return directions;
}

/// Rounds a value, and clamps it to the range of this field in scene files.
double bounded(double value, std::string_view field) {
  const proto::SceneRange& range = proto::scene_range(field);
  return rounded(std::clamp(value, range.low, range.high));
}

/// Probes each pair of molecules from several sides.
class Probe {
 public:
  Probe(std::span<const Molecule* const> molecules, std::span<const Vec3> centres_angstrom, const FieldModel& model,
        const ScaleProgress& progress)
      : model_(model), progress_(progress) {
    for (std::size_t a = 0; a < molecules.size(); ++a) {
      for (std::size_t b = a + 1; b < molecules.size(); ++b) {
        const Vec3 offset = centres_angstrom[b] - centres_angstrom[a];
        pairs_.push_back({molecules[a],
                          molecules[b],
                          offset,
                          {},
                          Approach(*molecules[a], *molecules[b], probed(*molecules[a], *molecules[b], model))});
        const std::vector<Vec3> directions = ways(offset);
        for (const Vec3& way : directions) {
          pairs_.back().ways.push_back(pairs_.back().approach.along(way));
          report(pairs_.back(),
                 kPartOfWays * static_cast<double>(pairs_.back().ways.size()) / static_cast<double>(directions.size()));
        }
      }
    }
  }

  double strongest_pull() {
    double strongest = 0;
    for (Pair& pair : pairs_) {
      for (const Way& way : pair.ways) strongest = std::max(strongest, way.strongest_pull);
      const double hold =
          pair.approach.hold(pair.offset, [&](double done) { report(pair, kPartOfWays + (1 - kPartOfWays) * done); });
      strongest = std::max(strongest, hold);
    }
    return strongest;
  }

  double energy_of_push(double push) {
    double least = std::numeric_limits<double>::infinity();
    for (Pair& pair : pairs_) {
      for (const Way& way : pair.ways) least = std::min(least, pair.approach.energy_of_push(way, push));
    }
    return least;
  }

  /// Returns the lowest energy that two descents find [kcal/mol]. One starts at the pose in the files, the other at the
  /// best position of all approaches. Returns 0 if the molecules do not attract each other.
  /// Fails   std::invalid_argument: a pair of molecules has more than kMaxToMinimise pairs of atoms
  double minimum() const {
    double least = 0;
    for (const Pair& pair : pairs_) {
      if (pair.a->size() * pair.b->size() > kMaxToMinimise) {
        throw std::invalid_argument(
            "has a zero area and no minimum_kcal_per_mol, which takes too long to be found for " +
            std::to_string(pair.a->size()) + " x " + std::to_string(pair.b->size()) +
            " atoms; give it, or leave out zero_area_kt");
      }
      const Way& best = *std::ranges::min_element(pair.ways, {}, &Way::least_kcal_per_mol);
      for (const Vec3& start : {pair.offset, Vec3(best.best * best.direction_A)})
        least = std::min(least, minimum_near(*pair.a, *pair.b, model_, {start, Quat::Identity()}).second);
    }
    return least;
  }

 private:
  struct Pair {
    const Molecule* a;
    const Molecule* b;
    Vec3 offset;
    std::vector<Way> ways;
    Approach approach;
  };
  /// Fraction of the total work that the approaches need; used for the progress report.
  static constexpr double kPartOfWays = 0.3;

  /// Returns the field model with which the molecules are probed. If the pairs are too many to be all evaluated in a
  /// simulation step, the model gets a cut-off and a far-field grid. The probe needs thousands of evaluations, which
  /// would otherwise take minutes.
  static FieldModel probed(const Molecule& a, const Molecule& b, FieldModel model) {
    if (model.cutoff_angstrom == 0) docking::choose_cutoff(a, b, model);
    return model;
  }

  void report(const Pair& pair, double done) const {
    if (progress_ && pair.a->size() * pair.b->size() > docking::kMaxAllPairs) {
      progress_("finding the scale of the forces between " + std::to_string(pair.a->size()) + " and " +
                    std::to_string(pair.b->size()) + " atoms",
                done);
    }
  }

  FieldModel model_;
  const ScaleProgress& progress_;
  std::vector<Pair> pairs_;
};

}  // namespace

double contact_distance_angstrom(const Molecule& a, const Molecule& b, const FieldModel& model,
                                 const Vec3& direction_A) {
  return Approach(a, b, model).contact(direction_A);
}

std::pair<Pose, double> minimum_near(const Molecule& a, const Molecule& b, const FieldModel& model,
                                     const Pose& X_AB_angstrom) {
  PoseMinimiser minimiser(a, b, model, X_AB_angstrom);
  while (minimiser.step()) {
  }
  return {minimiser.pose(), minimiser.energy_kj_per_mol() / kKilojoulesPerKilocalorie};
}

namespace {

/// Returns a note for the user: which pairs of atoms are summed in each step.
std::string method_note(std::span<const Molecule* const> molecules, const FieldModel& model) {
  std::size_t pairs = 0;
  bool is_too_large = false;
  for (std::size_t a = 0; a < molecules.size(); ++a) {
    for (std::size_t b = a + 1; b < molecules.size(); ++b) {
      pairs += molecules[a]->size() * molecules[b]->size();
      const bool is_b_first = docking::comes_first(*molecules[b], *molecules[a]);
      const Molecule& first = *molecules[is_b_first ? b : a];
      is_too_large = is_too_large || (model.has_far_grid && !docking::far_grid_spacing_angstrom(first));
    }
  }
  if (model.cutoff_angstrom == 0) return "all " + std::to_string(pairs) + " pairs of atoms act on each other";
  const std::string within =
      "atoms within " + proto::number_text(model.cutoff_angstrom) + " angstrom act on each other";
  if (is_too_large) return within + "; a molecule is too large for the grid of the part beyond";
  return within + (model.has_far_grid ? ", and those beyond by a grid" : "");
}

}  // namespace

std::vector<std::string> complete_molecular_scale(wire::MolecularField& field,
                                                  std::span<const Molecule* const> molecules,
                                                  std::span<const Vec3> centres_angstrom, const FieldModel& model,
                                                  const ScaleProgress& progress) {
  std::vector<std::string> notes;
  if (molecules.size() < 2) return notes;
  notes.push_back(method_note(molecules, model));
  if (molecules.size() == 2 && model.cutoff_angstrom > 0) {
    const Vec3 line = line_of_centres(centres_angstrom[1] - centres_angstrom[0]);
    notes.push_back(well_note(way_in(*molecules[0], *molecules[1], model, line)(model)));
  }
  std::optional<Probe> made;  // made on first use, because probing takes time and may be unnecessary
  const auto probe = [&]() -> Probe& {
    return made ? *made : made.emplace(molecules, centres_angstrom, model, progress);
  };
  if (field.newtons_per_kcal_per_mol_angstrom() == 0) {
    const double pull = probe().strongest_pull();
    field.set_newtons_per_kcal_per_mol_angstrom(rounded(pull > kNoPull ? kStrongestPull_n / pull : kScaleWithoutPull));
  }
  if (field.knee_kcal_per_mol() == 0) {
    const double push = physics::kKneeOfLimit * field.force_limit_n() / field.newtons_per_kcal_per_mol_angstrom();
    field.set_knee_kcal_per_mol(bounded(probe().energy_of_push(push), "MolecularField.knee_kcal_per_mol"));
  }
  // Conversion: 1 kcal/mol/Å is 69.477 pN.
  constexpr double kNanonewtons = 0.0694770;
  notes.push_back("1 N in the hand is " + proto::number_text(kNanonewtons / field.newtons_per_kcal_per_mol_angstrom()) +
                  " nN between the molecules, and 1 cm is " + proto::number_text(0.01 / field.metres_per_angstrom()) +
                  " angstrom");
  if (field.zero_area_kt() == 0) return notes;
  if (field.minimum_kcal_per_mol() == 0) {
    field.set_minimum_kcal_per_mol(bounded(probe().minimum(), "MolecularField.minimum_kcal_per_mol"));
  }
  const double minimum = field.minimum_kcal_per_mol();
  if (minimum < -(field.zero_area_kt() + kFelt_kt) * docking::kThermalEnergy_kcal_per_mol) {
    notes.push_back("no force within " + proto::number_text(field.zero_area_kt()) + " kT of the least energy, " +
                    proto::number_text(minimum) + " kcal/mol");
  } else {
    notes.push_back("no zero area: the least energy that was found is " + proto::number_text(minimum) +
                    " kcal/mol, and nothing would be left to be felt");
    field.set_zero_area_kt(0);
  }
  return notes;
}

}  // namespace tandem::server
