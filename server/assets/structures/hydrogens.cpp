// See hydrogens.hpp.
#include "server/assets/structures/hydrogens.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

namespace tandem::server {
namespace {

constexpr double kBondAngstrom = 1.0;
constexpr double kTetrahedral = 109.47122063449069 * std::numbers::pi / 180;
constexpr double kThird = 2 * std::numbers::pi / 3;
/// Longer than any bond between two of a rule's atoms: beyond it residues do not follow on each other.
constexpr double kMaxBondAngstrom = 2.5;

using Positions = std::map<std::string, Vec3>;

Positions positions_of(const PdbResidue& residue, const TypedResidue& typed) {
  Positions found;
  for (std::size_t i = 0; i < residue.atoms.size(); ++i) {
    found.emplace(typed.names[i], residue.atoms[i].position_angstrom);
  }
  return found;
}

/// Bonded to i, at an angle to i-j, at a dihedral angle about i-j to k.
Vec3 placed(const Vec3& i, const Vec3& j, const Vec3& k, double angle, double dihedral) {
  const Vec3 axis = (j - i).normalized();
  const Vec3 normal = axis.cross(k - j).normalized();
  const Vec3 towards_k = normal.cross(axis);
  return i + kBondAngstrom * (std::cos(angle) * axis +
                              std::sin(angle) * (std::cos(dihedral) * towards_k + std::sin(dihedral) * normal));
}

Vec3 away_from_mean(const std::vector<Vec3>& p) {
  Vec3 mean = Vec3::Zero();
  for (std::size_t n = 1; n < p.size(); ++n) mean += p[n];
  return p[0] - mean / static_cast<double>(p.size() - 1);
}

/// The hydrogens of a rule; p: its atoms. Empty for a rule that proteins do not have, and for atoms on a line, which
/// name no plane.
std::vector<Vec3> geometry(const HydrogenRule& rule, const std::vector<Vec3>& p) {
  constexpr double kMinSquareAngstrom2 = 0.01;
  std::vector<Vec3> made;
  if (p.size() < 3 || (p[0] - p[1]).cross(p[2] - p[1]).norm() < kMinSquareAngstrom2) return made;
  if (rule.kind == 1) {
    made.push_back(p[0] + kBondAngstrom * ((p[0] - p[1]).normalized() + (p[0] - p[2]).normalized()).normalized());
  } else if (rule.kind == 5) {
    made.push_back(p[0] + kBondAngstrom * away_from_mean(p).normalized());
  } else if (rule.kind == 6) {
    const Vec3 outwards = away_from_mean({p[0], p[1], p[2]}).normalized();
    const Vec3 across = (p[0] - p[1]).cross(p[0] - p[2]).normalized();
    for (const double side : {1.0, -1.0}) {
      made.push_back(p[0] + kBondAngstrom *
                                (std::cos(kTetrahedral / 2) * outwards + side * std::sin(kTetrahedral / 2) * across));
    }
  } else if (rule.kind == 3) {
    for (const double dihedral : {0.0, std::numbers::pi}) made.push_back(placed(p[0], p[1], p[2], kThird, dihedral));
  } else if (rule.kind == 2 || rule.kind == 4) {
    for (int n = 0; n < rule.count; ++n) {
      made.push_back(placed(p[0], p[1], p[2], kTetrahedral, std::numbers::pi - n * kThird));
    }
  }
  made.resize(std::min(made.size(), static_cast<std::size_t>(rule.count)));
  return made;
}

/// Where the rule's atoms are; nothing when one is missing or they are not bonded.
std::optional<std::vector<Vec3>> anchors_of(const HydrogenRule& rule, const Positions& own, const Positions* before) {
  std::vector<Vec3> found;
  for (const std::string& anchor : rule.anchors) {
    const bool is_before = anchor.starts_with('-');
    const Positions* where = is_before ? before : &own;
    if (where == nullptr) return std::nullopt;
    const auto at = where->find(is_before ? anchor.substr(1) : anchor);
    if (at == where->end()) return std::nullopt;
    if (is_before && found.size() == 1 && (at->second - found[0]).norm() > kMaxBondAngstrom) return std::nullopt;
    found.push_back(at->second);
  }
  if (found.size() < 2) return std::nullopt;
  return found;
}

void add_hydrogens(PdbResidue& residue, const TypedResidue& typed, const Positions& own, const Positions* before) {
  for (const HydrogenRule& rule : typed.rules) {
    const auto anchors = anchors_of(rule, own, before);
    if (!anchors) continue;
    const std::vector<Vec3> hydrogens = geometry(rule, *anchors);
    for (std::size_t n = 0; n < hydrogens.size(); ++n) {
      PdbAtom atom;
      atom.name = rule.hydrogen(static_cast<int>(n));
      atom.element = "H";
      atom.position_angstrom = hydrogens[n];
      if (is_finite(atom.position_angstrom)) residue.atoms.push_back(std::move(atom));
    }
  }
}

const char* united_type(const HydrogenRule& rule) {
  if (rule.kind == 1) return "opls_011";  // on a ring
  const bool is_alpha = rule.anchors.front() == "CA";
  if (rule.count == 1) return is_alpha ? "opls_006" : "opls_008";
  if (rule.count == 2) return is_alpha ? "opls_005" : "opls_009";
  return "opls_010";
}

}  // namespace

Hydrogens hydrogens_of(const std::string& text) {
  if (text == "given") return Hydrogens::kGiven;
  if (text == "build") return Hydrogens::kBuild;
  if (text == "united") return Hydrogens::kUnited;
  throw std::invalid_argument("hydrogens \"" + text + "\" must be given, build or united");
}

void build_hydrogens(const ForceField& force_field, std::vector<PdbResidue>& residues,
                     std::span<const ResidueContext> contexts) {
  Positions before;
  bool has_before = false;
  for (std::size_t r = 0; r < residues.size(); ++r) {
    PdbResidue& residue = residues[r];
    std::erase_if(residue.atoms, [](const PdbAtom& atom) { return atom.element == "H"; });
    const TypedResidue typed = type_residue(force_field, residue, contexts[r]);
    Positions own = positions_of(residue, typed);
    add_hydrogens(residue, typed, own, has_before && !contexts[r].first_of_chain ? &before : nullptr);
    before = std::move(own);
    has_before = true;
  }
}

void unite_hydrogens(const ForceField& force_field, PdbResidue& residue, TypedResidue& typed) {
  std::vector<bool> is_merged(residue.atoms.size(), false);
  const auto index_of = [&typed](const std::string& name) {
    return static_cast<std::size_t>(std::find(typed.names.begin(), typed.names.end(), name) - typed.names.begin());
  };
  for (const HydrogenRule& rule : typed.rules) {
    const std::size_t carbon = index_of(rule.anchors.front());
    if (carbon >= residue.atoms.size() || residue.atoms[carbon].element != "C") continue;
    if (force_field.types.find(united_type(rule)) == force_field.types.end()) continue;
    for (int n = 0; n < rule.count; ++n) {
      const std::size_t hydrogen = index_of(rule.hydrogen(n));
      if (hydrogen >= residue.atoms.size()) continue;
      typed.atoms[carbon].charge_e += typed.atoms[hydrogen].charge_e;
      typed.atoms[carbon].type = united_type(rule);
      is_merged[hydrogen] = true;
    }
  }
  for (std::size_t i = residue.atoms.size(); i-- > 0;) {
    if (!is_merged[i]) continue;
    const auto at = static_cast<std::ptrdiff_t>(i);
    residue.atoms.erase(residue.atoms.begin() + at);
    typed.atoms.erase(typed.atoms.begin() + at);
    typed.guesses.erase(typed.guesses.begin() + at);
    typed.names.erase(typed.names.begin() + at);
  }
}

}  // namespace tandem::server
