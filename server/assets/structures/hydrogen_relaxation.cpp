// See hydrogen_relaxation.hpp.
#include "server/assets/structures/hydrogen_relaxation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "common/docking/atom_contacts.hpp"
#include "common/docking/atom_radii.hpp"
#include "server/assets/structures/atom_grid.hpp"
#include "server/assets/structures/chain_links.hpp"
#include "server/assets/structures/elements.hpp"

namespace tandem::server {
namespace {

constexpr std::size_t kNoAtom = std::numeric_limits<std::size_t>::max();
constexpr double kDegree = std::numbers::pi / 180;
/// A group is moved if an atom distance, divided by the contact distance, is below this value. The value is slightly
/// larger than the limit of a reported clash, so that no moved group ends just below that limit.
constexpr double kMovedShare = 0.72;
constexpr double kOverlapAngstrom = 1.0;
constexpr double kGivenHydrogenBondAngstrom = 1.5;  // largest distance of a hydrogen in the file from its heavy atom
constexpr double kMaxCovalentBondAngstrom = 2.6;
/// Distances from the carrier (the heavy atom to which a group's hydrogens are bonded) up to which other atoms are
/// considered: kReachAngstrom for heavy atoms, and kReachOfCarriersAngstrom for the carriers of other hydrogens.
constexpr double kReachAngstrom = 4.6, kReachOfCarriersAngstrom = 5.6;
constexpr std::size_t kMaxGroups = 5000;
constexpr int kMaxRounds = 40;
/// Limit of the number of pair energies; their evaluation takes about 2 s. A structure of 44,000 atoms (4JSV) needs 31
/// million. A damaged or hostile file with overlapping atoms could otherwise need any number.
constexpr std::size_t kMaxPairs = 50'000'000;
/// Displacements below which a search ends, far below the resolution of coordinates in files.
constexpr double kMinTurn_rad = 1e-7, kMinBend_angstrom = 1e-7;

// Parameters of the energy in relax_hydrogens(): kWell, kHydrogenBondWell and the barriers in kJ/mol, the bending
// stiffness kBendPerAngstrom2 in kJ/mol/Å².
constexpr double kWell = 0.2, kHydrogenBondWell = 4, kHydrogenBondAngstrom = 1.85;
constexpr double kNearest_angstrom = 0.5;  // nearer pairs get the energy at this distance
constexpr double kBarrier = 12, kHydroxylBarrier = 6, kPlanarBarrier = 14;
constexpr double kBendPerAngstrom2 = 100;

struct RelaxedAtom {
  Vec3 p = Vec3::Zero();
  double radius_angstrom = 0;
  double covalent_angstrom = 0;
  std::size_t part = 0;
  const PdbResidue* residue = nullptr;
  const PdbAtom* source = nullptr;
  bool is_hydrogen = false;
  bool is_polar = false;           ///< whether the atom is N, O or S, or a hydrogen bonded to one of them
  std::size_t carrier = kNoAtom;   ///< heavy atom to which a hydrogen is bonded
  std::vector<std::size_t> bonds;  ///< heavy neighbours of a heavy atom
  std::size_t hydrogens = 0;       ///< number of hydrogens bonded to this atom
};

struct RelaxedGroup {
  std::size_t part = 0;
  const BuiltGroup* built = nullptr;
  std::vector<std::size_t> atoms;
  std::vector<PdbAtom*> targets;  ///< parallel to `atoms`: atoms that finally receive the positions
  std::size_t carrier = kNoAtom;
  std::vector<std::size_t> near;  ///< atoms more than three bonds away that may come near the group's hydrogens
  std::vector<Vec3> built_places;
  double turn_rad = 0;
  double periods = 3, barrier = kBarrier;
  double energy = 0;  ///< energy of the group's nearest pair

  Vec3 turned(std::size_t n, double angle_rad) const {
    if (!built->turns) return built_places[n];
    const Vec3 axis = (built->carrier_angstrom - built->axis_angstrom).normalized();
    return built->carrier_angstrom + Eigen::AngleAxisd(angle_rad, axis) * (built_places[n] - built->carrier_angstrom);
  }
};

bool is_water(const PdbResidue& residue) {
  return residue.name == "HOH" || residue.name == "WAT" || residue.name == "DOD";
}

class Relaxation {
 public:
  explicit Relaxation(std::span<const RelaxedPart> parts) {
    for (std::size_t part = 0; part < parts.size(); ++part) {
      if (part > 0 && overlaps_first(parts[part])) continue;
      add_part(parts[part], part);
    }
    link_atoms();
    find_neighbours();
  }

  RelaxedHydrogens run() {
    std::vector<RelaxedGroup*> active;
    for (RelaxedGroup& group : groups_) {
      if (clashes(group, kMovedShare)) active.push_back(&group);
    }
    sort_by_energy(active);
    if (active.size() > kMaxGroups) active.resize(kMaxGroups);
    for (int round = 0; round < kMaxRounds; ++round) {
      bool has_moved = false;
      for (RelaxedGroup* group : active) has_moved |= group->built->turns && may_continue() && turn(*group);
      if (!has_moved) break;
    }
    std::erase_if(active, [this](RelaxedGroup* group) { return !clashes(*group, kMovedShare); });
    for (int round = 0; round < kMaxRounds; ++round) {
      bool has_moved = false;
      for (RelaxedGroup* group : active) has_moved |= may_continue() && bend(*group);
      if (!has_moved) break;
    }
    write_back();
    return {texts_of_moved(), texts_of_clashes()};
  }

 private:
  bool overlaps_first(const RelaxedPart& part) const {
    std::vector<Vec3> heavy;
    for (const RelaxedAtom& atom : atoms_) {
      if (!atom.is_hydrogen) heavy.push_back(atom.p);
    }
    const AtomGrid grid(kOverlapAngstrom, heavy);
    bool overlaps = false;
    for (const PdbResidue& residue : *part.chains) {
      for (const PdbAtom& atom : residue.atoms) {
        if (atom.element == "H") continue;
        grid.visit_near(atom.position_angstrom, [&](std::size_t i) {
          overlaps |= (heavy[i] - atom.position_angstrom).norm() < kOverlapAngstrom;
        });
      }
    }
    return overlaps;
  }

  void add_part(const RelaxedPart& part, std::size_t index) {
    std::vector<std::size_t> first_of_residue;
    for (const PdbResidue& residue : *part.chains) {
      first_of_residue.push_back(atoms_.size());
      add_residue(residue, index);
    }
    for (const PdbResidue& residue : *part.others) {
      if (!is_water(residue)) add_residue(residue, index);
    }
    for (const BuiltGroup& built : *part.groups) {
      PdbResidue& residue = (*part.chains)[built.residue];
      const std::size_t first = first_of_residue[built.residue];
      RelaxedGroup group;
      group.part = index;
      group.built = &built;
      for (std::size_t i = 0; i < residue.atoms.size(); ++i) {
        if (std::ranges::find(built.names, residue.atoms[i].name) != built.names.end()) {
          group.atoms.push_back(first + i);
          group.targets.push_back(&residue.atoms[i]);
          group.built_places.push_back(residue.atoms[i].position_angstrom);
        } else if (residue.atoms[i].position_angstrom == built.carrier_angstrom) {
          group.carrier = first + i;
        }
      }
      if (group.carrier == kNoAtom || group.atoms.empty()) continue;
      for (const std::size_t atom : group.atoms) atoms_[atom].carrier = group.carrier;
      groups_.push_back(std::move(group));
    }
  }

  void add_residue(const PdbResidue& residue, std::size_t part) {
    for (const PdbAtom& atom : residue.atoms) {
      const ChemicalElement* const element = find_element(atom.element);
      const docking::AtomRadii& radii = docking::atom_radii(atom.element, element ? element->mass_u : 0);
      RelaxedAtom added;
      added.p = atom.position_angstrom;
      added.radius_angstrom = radii.van_der_waals_angstrom;
      added.covalent_angstrom = radii.covalent_angstrom;
      added.part = part;
      added.residue = &residue;
      added.source = &atom;
      added.is_hydrogen = atom.element == "H";
      added.is_polar = atom.element == "N" || atom.element == "O" || atom.element == "S";
      atoms_.push_back(std::move(added));
    }
  }

  std::vector<Vec3> positions() const {
    std::vector<Vec3> all;
    for (const RelaxedAtom& atom : atoms_) all.push_back(atom.p);
    return all;
  }

  /// Finds the bonds between heavy atoms by distance. Bonds each hydrogen of the file to the nearest heavy atom.
  void link_atoms() {
    const AtomGrid grid(kMaxCovalentBondAngstrom, positions());
    for (std::size_t i = 0; i < atoms_.size(); ++i) {
      RelaxedAtom& atom = atoms_[i];
      if (atom.is_hydrogen && atom.carrier != kNoAtom) continue;
      double nearest = kGivenHydrogenBondAngstrom;
      grid.visit_near(atom.p, [&](std::size_t j) {
        const RelaxedAtom& other = atoms_[j];
        if (other.is_hydrogen || i == j) return;
        const double apart = (other.p - atom.p).norm();
        if (atom.is_hydrogen) {
          if (apart >= nearest) return;
          nearest = apart;
          atom.carrier = j;
        } else if (apart < atom.covalent_angstrom + other.covalent_angstrom + docking::kBondSlackAngstrom) {
          atom.bonds.push_back(j);
        }
      });
    }
    for (RelaxedAtom& atom : atoms_) {
      if (!atom.is_hydrogen || atom.carrier == kNoAtom) continue;
      ++atoms_[atom.carrier].hydrogens;
      atom.is_polar = atoms_[atom.carrier].is_polar;
    }
  }

  void find_neighbours() {
    const AtomGrid grid(kReachOfCarriersAngstrom + 1, positions());
    for (RelaxedGroup& group : groups_) {
      const RelaxedAtom& carrier = atoms_[group.carrier];
      std::vector<std::size_t> bonded = carrier.bonds, second = bonded;
      bonded.push_back(group.carrier);
      second.push_back(group.carrier);
      for (const std::size_t i : carrier.bonds) {
        second.insert(second.end(), atoms_[i].bonds.begin(), atoms_[i].bonds.end());
      }
      grid.visit_near(carrier.p, [&](std::size_t i) {
        const RelaxedAtom& atom = atoms_[i];
        const bool is_bonded = atom.is_hydrogen ? std::ranges::find(bonded, atom.carrier) != bonded.end()
                                                : std::ranges::find(second, i) != second.end();
        if (is_bonded || (atom.is_hydrogen && atom.carrier == kNoAtom)) return;
        const bool is_near = atom.is_hydrogen ? (atoms_[atom.carrier].p - carrier.p).norm() < kReachOfCarriersAngstrom
                                              : (atom.p - carrier.p).norm() < kReachAngstrom;
        if (is_near) group.near.push_back(i);
      });
      if (group.built->turns) choose_barrier(group, carrier);
    }
  }

  /// Selects the rotation barrier of a group. It depends on the atom at the other end of the rotation axis, which is
  /// planar if it has three neighbours.
  void choose_barrier(RelaxedGroup& group, const RelaxedAtom& carrier) {
    if (group.atoms.size() == 1) group.barrier = kHydroxylBarrier;
    for (const std::size_t i : carrier.bonds) {
      if (atoms_[i].p != group.built->axis_angstrom || atoms_[i].bonds.size() + atoms_[i].hydrogens != 3) continue;
      group.periods = 2;
      group.barrier = kPlanarBarrier;
    }
  }

  /// Returns whether an atom accepts hydrogen bonds. A nitrogen or sulphur with hydrogens accepts none, because its
  /// hydrogens point towards the approaching atom.
  bool is_acceptor(const RelaxedAtom& atom) const {
    return atom.is_polar && !atom.is_hydrogen && (atom.source->element == "O" || atom.hydrogens == 0);
  }

  bool may_bond(const RelaxedAtom& one, const RelaxedAtom& other) const {
    return (one.is_hydrogen && one.is_polar && is_acceptor(other)) ||
           (other.is_hydrogen && other.is_polar && is_acceptor(one));
  }

  double contact_angstrom(const RelaxedAtom& one, const RelaxedAtom& other) const {
    return may_bond(one, other) ? kHydrogenBondAngstrom : one.radius_angstrom + other.radius_angstrom;
  }

  double pair_energy(std::size_t hydrogen, const Vec3& place, std::size_t other) const {
    const RelaxedAtom& h = atoms_[hydrogen];
    const RelaxedAtom& atom = atoms_[other];
    const double r = std::max(kNearest_angstrom, (place - atom.p).norm());
    const double ratio = contact_angstrom(h, atom) / r, cube = ratio * ratio * ratio, sixth = cube * cube;
    return (may_bond(h, atom) ? kHydrogenBondWell : kWell) * sixth * (sixth - 2);
  }

  bool may_continue() const { return pairs_ < kMaxPairs; }

  double energy_at(const RelaxedGroup& group, std::size_t n, const Vec3& place) {
    pairs_ += group.near.size();
    double energy = 0;
    for (const std::size_t i : group.near) energy += pair_energy(group.atoms[n], place, i);
    return energy;
  }

  bool clashes(RelaxedGroup& group, double share) const {
    bool found = false;
    group.energy = 0;
    for (const std::size_t atom : group.atoms) {
      for (const std::size_t i : group.near) {
        if (atoms_[i].residue == atoms_[atom].residue) continue;
        if ((atoms_[atom].p - atoms_[i].p).norm() >= share * contact_angstrom(atoms_[atom], atoms_[i])) continue;
        found = true;
        group.energy = std::max(group.energy, pair_energy(atom, atoms_[atom].p, i));
      }
    }
    return found;
  }

  /// Sorts the groups by decreasing energy. Groups with equal energy, such as two that clash with each other, are
  /// sorted by their distance from the centre of all atoms. The order thus depends neither on the order of atoms in the
  /// file nor on its frame.
  void sort_by_energy(std::vector<RelaxedGroup*>& groups) const {
    Vec3 middle = Vec3::Zero();
    for (const RelaxedAtom& atom : atoms_) middle += atom.p / static_cast<double>(atoms_.size());
    std::ranges::stable_sort(groups, [&middle](const RelaxedGroup* one, const RelaxedGroup* other) {
      if (one->energy != other->energy) return one->energy > other->energy;
      return (one->built->carrier_angstrom - middle).norm() < (other->built->carrier_angstrom - middle).norm();
    });
  }

  double energy_turned(const RelaxedGroup& group, double angle_rad) {
    double energy = group.barrier / 2 * (1 - std::cos(group.periods * angle_rad));
    for (std::size_t n = 0; n < group.atoms.size(); ++n) energy += energy_at(group, n, group.turned(n, angle_rad));
    return energy;
  }

  /// Rotates the group: finds the best angle in steps of 5°, and then the energy minimum near it. Returns whether the
  /// group has moved.
  bool turn(RelaxedGroup& group) {
    constexpr double kStep = 5 * kDegree;
    double best = group.turn_rad, least = energy_turned(group, best);
    for (int step = 0; step < 72; ++step) {
      const double energy = energy_turned(group, step * kStep);
      // If several angles are equally good, the first is chosen. A methyl group has three equal angles.
      if (energy >= least - 1e-9 * (1 + std::abs(least))) continue;
      least = energy;
      best = step * kStep;
    }
    for (double half = kStep; half > kMinTurn_rad / 2; half /= 2) {
      for (const double angle : {best - half / 2, best + half / 2}) {
        const double energy = energy_turned(group, angle);
        if (energy >= least) continue;
        least = energy;
        best = angle;
      }
    }
    const bool has_moved = std::abs(best - group.turn_rad) > kMinTurn_rad;
    group.turn_rad = best;
    for (std::size_t n = 0; n < group.atoms.size(); ++n) atoms_[group.atoms[n]].p = group.turned(n, best);
    return has_moved;
  }

  double energy_bent(const RelaxedGroup& group, std::size_t n, const Vec3& place) {
    return energy_at(group, n, place) + kBendPerAngstrom2 * (place - group.turned(n, group.turn_rad)).squaredNorm();
  }

  /// Moves each hydrogen along the negative energy gradient, on the sphere around its carrier, as long as the energy
  /// decreases. Returns whether a hydrogen has moved.
  bool bend(RelaxedGroup& group) {
    constexpr double kDifference = 1e-4, kFirstStep = 0.08;
    double farthest = 0;
    const Vec3& carrier = group.built->carrier_angstrom;
    for (std::size_t n = 0; n < group.atoms.size(); ++n) {
      Vec3& place = atoms_[group.atoms[n]].p;
      const double length = (place - carrier).norm();
      const Vec3 before = place;
      double least = energy_bent(group, n, place);
      for (double step = kFirstStep; step > kMinBend_angstrom / 2;) {
        Vec3 slope;
        for (int axis = 0; axis < 3; ++axis) {
          const Vec3 shift = kDifference * Vec3::Unit(axis);
          slope[axis] = energy_bent(group, n, place + shift) - energy_bent(group, n, place - shift);
        }
        const Vec3 out = (place - carrier).normalized();
        slope -= slope.dot(out) * out;
        const double steepness = slope.norm();
        if (!(steepness > 0)) break;
        const Vec3 moved = carrier + length * (place - step / steepness * slope - carrier).normalized();
        const double energy = energy_bent(group, n, moved);
        if (energy < least) {
          least = energy;
          place = moved;
        } else {
          step /= 2;
        }
      }
      farthest = std::max(farthest, (place - before).norm());
    }
    return farthest > kMinBend_angstrom;
  }

  void write_back() const {
    for (const RelaxedGroup& group : groups_) {
      for (std::size_t n = 0; n < group.atoms.size(); ++n) {
        group.targets[n]->position_angstrom = atoms_[group.atoms[n]].p;
      }
    }
  }

  std::vector<std::string> texts_of_moved() const {
    constexpr double kMinMoveAngstrom = 0.01;
    std::vector<std::string> texts;
    for (const RelaxedGroup& group : groups_) {
      if (group.part != 0) continue;
      double farthest = 0, bent = 0;
      for (std::size_t n = 0; n < group.atoms.size(); ++n) {
        const Vec3& place = atoms_[group.atoms[n]].p;
        farthest = std::max(farthest, (place - group.built_places[n]).norm());
        bent = std::max(bent, (place - group.turned(n, group.turn_rad)).norm());
      }
      if (farthest < kMinMoveAngstrom) continue;
      const double turned = std::abs(std::remainder(group.turn_rad, 2 * std::numbers::pi)) / kDegree;
      const RelaxedAtom& first = atoms_[group.atoms.front()];
      std::string text = place_text(*first.residue, first.source->name);
      if (turned > 0.1) text += fmt::format(", turned by {:.0f}°", turned);
      if (bent >= kMinMoveAngstrom) text += fmt::format(", bent by {:.2f} Å", bent);
      texts.push_back(std::move(text));
    }
    return texts;
  }

  std::vector<std::string> texts_of_clashes() const {
    std::vector<std::string> texts;
    for (const RelaxedGroup& group : groups_) {
      for (const std::size_t atom : group.atoms) {
        for (const std::size_t i : group.near) {
          const RelaxedAtom &h = atoms_[atom], &other = atoms_[i];
          const double apart = (h.p - other.p).norm(), sum = h.radius_angstrom + other.radius_angstrom;
          if (group.part != 0 || other.part != 0 || h.residue == other.residue) continue;
          if (apart >= docking::kClashShare * contact_angstrom(h, other)) continue;
          texts.push_back(place_text(*h.residue, h.source->name) + " and " +
                          place_text(*other.residue, other.source->name) +
                          fmt::format(": {:.2f} Å, {:.2f} of their radii", apart, apart / sum));
        }
      }
    }
    return texts;
  }

  std::vector<RelaxedAtom> atoms_;
  std::vector<RelaxedGroup> groups_;
  std::size_t pairs_ = 0;  ///< number of pair energies evaluated so far
};

}  // namespace

RelaxedHydrogens relax_hydrogens(std::span<const RelaxedPart> parts) {
  return Relaxation(parts).run();
}

}  // namespace tandem::server
