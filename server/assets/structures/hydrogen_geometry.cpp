// See hydrogen_geometry.hpp.
#include "server/assets/structures/hydrogen_geometry.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tandem::server {
namespace {

constexpr double kBondAngstrom = 1.0;
constexpr double kTetrahedral = 109.47122063449069 * std::numbers::pi / 180;
constexpr double kThird = 2 * std::numbers::pi / 3;
/// Longest distance between two atoms of a rule that counts as a bond. A longer distance between atoms of two residues
/// means that residues between them are missing.
constexpr double kMaxBondAngstrom = 2.5;

/// Returns the position of an atom that is bonded to i. `angle` is the angle between this bond and i-j, and `dihedral`
/// is the dihedral angle about i-j relative to k.
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

/// Returns the hydrogens of a rule for anchor atoms at the positions p. The result is empty if the kind of the rule
/// does not occur in proteins, or if the anchor atoms are collinear and define no plane.
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

/// Returns the positions of the rule's atoms; nothing if one of them is missing or not bonded.
std::optional<std::vector<Vec3>> anchors_of(const HydrogenRule& rule, const AtomPlaces& own, const AtomPlaces* before) {
  std::vector<Vec3> found;
  for (const std::string& anchor : rule.anchors) {
    const bool is_before = anchor.starts_with('-');
    const AtomPlaces* where = is_before ? before : &own;
    if (where == nullptr) return std::nullopt;
    const auto at = where->find(is_before ? anchor.substr(1) : anchor);
    if (at == where->end()) return std::nullopt;
    if (is_before && found.size() == 1 && (at->second - found[0]).norm() > kMaxBondAngstrom) return std::nullopt;
    found.push_back(at->second);
  }
  if (found.size() < 2) return std::nullopt;
  return found;
}

/// Returns a heavy atom of the residue that is bonded to the carrier (the rule's first atom) but is not the rule's
/// second atom; nothing if there is none.
std::optional<Vec3> other_neighbour(const HydrogenRule& rule, const AtomPlaces& own) {
  constexpr double kMaxNeighbourAngstrom = 1.8;
  if (rule.anchors.size() < 2) return std::nullopt;
  const auto carrier = own.find(rule.anchors[0]);
  if (carrier == own.end()) return std::nullopt;
  for (const auto& [name, place] : own) {
    if (name.starts_with('H') || name == rule.anchors[0] || name == rule.anchors[1]) continue;
    if ((place - carrier->second).norm() < kMaxNeighbourAngstrom) return place;
  }
  return std::nullopt;
}

}  // namespace

bool turns(const HydrogenRule& rule, const AtomPlaces& own) {
  return (rule.kind == 2 || rule.kind == 4) && !other_neighbour(rule, own);
}

std::vector<Vec3> hydrogen_places(const HydrogenRule& rule, const AtomPlaces& own, const AtomPlaces* before) {
  auto anchors = anchors_of(rule, own, before);
  if (!anchors) return {};
  HydrogenRule placed_by = rule;
  const std::optional<Vec3> other = other_neighbour(rule, own);
  if (rule.kind == 4 && rule.count == 2 && other) {
    placed_by.kind = 6;
    anchors = {(*anchors)[0], (*anchors)[1], *other};
  }
  std::vector<Vec3> places = geometry(placed_by, *anchors);
  if (!std::ranges::all_of(places, [](const Vec3& place) { return is_finite(place); })) places.clear();
  return places;
}

std::optional<Vec3> carbon_before_gap(const AtomPlaces& own) {
  // The angle C-N-CA is 121.7°. The dihedral angle φ is that of a helix. Only the direction of the bond matters, so the
  // bond length is arbitrary.
  constexpr double kAngle = 121.7 * std::numbers::pi / 180, kPhi = -63 * std::numbers::pi / 180;
  const auto n = own.find("N"), ca = own.find("CA"), c = own.find("C");
  if (n == own.end() || ca == own.end() || c == own.end()) return std::nullopt;
  const Vec3 place = placed(n->second, ca->second, c->second, kAngle, kPhi);
  return is_finite(place) ? std::optional(place) : std::nullopt;
}

}  // namespace tandem::server
