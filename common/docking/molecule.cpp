// Functions of a molecule: its centre of mass, its residues, and the validation on which every field kernel relies.
#include "common/docking/molecule.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace tandem::docking {
namespace {

constexpr double kMaxCoordinateAngstrom = 1e6;
constexpr double kMinSigmaAngstrom = 0.1;
constexpr double kMaxSigmaAngstrom = 20;
constexpr double kMaxEpsilonKjPerMol = 1e4;
constexpr double kMaxCharge_e = 100;

[[noreturn]] void refuse(std::size_t atom, const std::string& field, double value, const std::string& range) {
  throw std::invalid_argument("molecule: atom " + std::to_string(atom) + ": " + field + " = " + std::to_string(value) +
                              ", must be " + range);
}

}  // namespace

Vec3 Molecule::centre_of_mass_angstrom() const {
  Vec3 weighted = Vec3::Zero();
  Vec3 sum = Vec3::Zero();
  double mass = 0;
  for (std::size_t i = 0; i < size(); ++i) {
    const double mass_i = i < mass_u.size() ? mass_u[i] : 0.0;
    weighted += mass_i * positions_angstrom[i];
    sum += positions_angstrom[i];
    mass += mass_i;
  }
  if (mass > 0) return weighted / mass;
  return size() == 0 ? sum : Vec3(sum / static_cast<double>(size()));
}

Vec3 Molecule::centre() {
  const Vec3 before = centre_of_mass_angstrom();
  for (Vec3& position : positions_angstrom) position -= before;
  return before;
}

double Molecule::gyration_radius_angstrom() const {
  double sum = 0;
  for (const Vec3& position : positions_angstrom) sum += position.squaredNorm();
  return std::max(1.0, std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, size()))));
}

std::vector<std::size_t> residue_starts(const Molecule& molecule) {
  const std::size_t count = molecule.size();
  for (const auto* texts :
       {&molecule.atom_names, &molecule.elements, &molecule.residue_names, &molecule.residue_ids, &molecule.chains}) {
    if (texts->size() != count || molecule.segments.size() != count) {
      throw std::invalid_argument("molecule: " + std::to_string(count) +
                                  " atoms, but not for each a name, element, residue and chain; read it from its file");
    }
  }
  std::vector<std::size_t> starts;
  for (std::size_t i = 0; i < count; ++i) {
    const bool continues = i > 0 && molecule.residue_ids[i] == molecule.residue_ids[i - 1] &&
                           molecule.residue_names[i] == molecule.residue_names[i - 1] &&
                           molecule.chains[i] == molecule.chains[i - 1] &&
                           molecule.segments[i] == molecule.segments[i - 1];
    if (!continues) starts.push_back(i);
  }
  return starts;
}

void validate(const Molecule& molecule) {
  const std::size_t count = molecule.size();
  if (molecule.sigma_angstrom.size() != count || molecule.epsilon_kj_per_mol.size() != count ||
      molecule.charge_e.size() != count) {
    throw std::invalid_argument("molecule: " + std::to_string(count) + " positions, but " +
                                std::to_string(molecule.sigma_angstrom.size()) + " sigma, " +
                                std::to_string(molecule.epsilon_kj_per_mol.size()) + " epsilon and " +
                                std::to_string(molecule.charge_e.size()) + " charge values");
  }
  for (std::size_t i = 0; i < count; ++i) {
    for (const double coordinate : molecule.positions_angstrom[i]) {
      if (!(std::abs(coordinate) <= kMaxCoordinateAngstrom)) refuse(i, "coordinate", coordinate, "within 1e6 Å");
    }
    const double sigma = molecule.sigma_angstrom[i];
    if (sigma != 0 && !(sigma >= kMinSigmaAngstrom && sigma <= kMaxSigmaAngstrom)) {
      refuse(i, "sigma", sigma, "0 or 0.1 to 20 Å");
    }
    const double epsilon = molecule.epsilon_kj_per_mol[i];
    if (!(epsilon >= 0 && epsilon <= kMaxEpsilonKjPerMol)) refuse(i, "epsilon", epsilon, "0 to 1e4 kJ/mol");
    const double charge = molecule.charge_e[i];
    if (!(std::abs(charge) <= kMaxCharge_e)) refuse(i, "charge", charge, "within 100 e");
  }
}

}  // namespace tandem::docking
