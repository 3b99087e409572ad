#include "client/view/molecule/atom_pick.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/net/text.hpp"

namespace tandem::client {
namespace {

/// Upper limit of the van der Waals radii, for the search.
constexpr double kMaxRadiusAngstrom = 3.5;

/// Finds the nearest ball on a ray. All lengths are in Å, in the frame of the molecule.
struct NearestBall {
  const docking::Molecule& molecule;
  Vec3 from, along;
  double nearest = std::numeric_limits<double>::infinity();
  std::optional<std::size_t> atom{};

  void add(std::size_t candidate) {
    const Vec3 to = molecule.positions_angstrom[candidate] - from;
    const double at = to.dot(along), off2 = to.squaredNorm() - at * at;
    if (at < 0 || off2 > kMaxRadiusAngstrom * kMaxRadiusAngstrom) return;
    const double radius = van_der_waals_radius_angstrom(molecule, candidate);
    if (off2 > radius * radius) return;
    const double surface = at - std::sqrt(radius * radius - off2);
    if (surface >= nearest) return;
    nearest = surface;
    atom = candidate;
  }
};

bool has_names(const docking::Molecule& molecule, std::size_t atom) {
  return atom < std::min({molecule.atom_names.size(), molecule.residue_names.size(), molecule.residue_ids.size(),
                          molecule.chains.size()});
}

}  // namespace

const docking::Molecule* molecule_at(const DrawnScene& scene, const AtomPlace& place) {
  if (place.body >= scene.bodies.size()) return nullptr;
  const docking::Molecule* const molecule = scene.bodies[place.body].molecule.get();
  return molecule != nullptr && place.atom < molecule->size() ? molecule : nullptr;
}

std::optional<AtomPlace> first_atom(const DrawnScene& scene, std::span<const Pose> X_WB, double metres_per_angstrom,
                                    const Vec3& from_W, const Vec3& along_W,
                                    const std::optional<Eigen::Hyperplane<double, 3>>& cut_W) {
  std::optional<AtomPlace> found;
  Vec3 begin_W = from_W;
  if (const double depth_m = cut_W ? cut_W->signedDistance(from_W) : 0; depth_m < 0) {
    const double rate = cut_W->normal().dot(along_W);
    if (rate <= 0) return found;  // the whole ray is on the side of the plane that is not drawn
    begin_W -= depth_m / rate * along_W;
  }
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < std::min(scene.bodies.size(), X_WB.size()); ++i) {
    const docking::Molecule* const molecule = scene.bodies[i].molecule.get();
    if (molecule == nullptr) continue;
    NearestBall ball{.molecule = *molecule,
                     .from = X_WB[i].inverse() * begin_W / metres_per_angstrom,
                     .along = (X_WB[i].q.conjugate() * along_W).normalized(),
                     .nearest = nearest};
    for (std::size_t atom = 0; atom < molecule->size(); ++atom) ball.add(atom);
    nearest = ball.nearest;
    if (ball.atom) found = AtomPlace{i, *ball.atom};
  }
  return found;
}

std::string residue_text(const docking::Molecule& molecule, std::size_t atom) {
  if (!has_names(molecule, atom)) return "atom " + std::to_string(atom + 1);
  const std::string residue =
      net::printable(molecule.residue_names[atom]) + " " + net::printable(molecule.residue_ids[atom]);
  return molecule.chains[atom].empty() ? residue : residue + " of chain " + net::printable(molecule.chains[atom]);
}

std::string atom_text(const docking::Molecule& molecule, std::size_t atom) {
  if (!has_names(molecule, atom)) return residue_text(molecule, atom);
  return residue_text(molecule, atom) + ", atom " + net::printable(molecule.atom_names[atom]);
}

std::string short_atom_text(const docking::Molecule& molecule, std::size_t atom) {
  if (!has_names(molecule, atom)) return residue_text(molecule, atom);
  const std::string chain = molecule.chains[atom].empty() ? "" : net::printable(molecule.chains[atom]) + ":";
  return chain + net::printable(molecule.residue_names[atom]) + " " + net::printable(molecule.residue_ids[atom]) + " " +
         net::printable(molecule.atom_names[atom]);
}

}  // namespace tandem::client
