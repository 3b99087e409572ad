#include "common/docking/molecule_asset.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "common/base/byte_io.hpp"

namespace tandem::docking {
namespace {

constexpr std::uint32_t kKind = 0x4C4F4D54;  // "TMOL"
constexpr std::size_t kAtomBytes = 7 * sizeof(double);
constexpr double kMaxMass_u = 1e4;

bool has_sound_masses(const Molecule& molecule) {
  return std::all_of(molecule.mass_u.begin(), molecule.mass_u.end(),
                     [](double mass) { return mass >= 0 && mass <= kMaxMass_u; });
}

bool is_sound(const Molecule& molecule) {
  try {
    validate(molecule);
  } catch (const std::invalid_argument&) {
    return false;
  }
  return molecule.size() > 0 && has_sound_masses(molecule);
}

void write_atom(const Molecule& molecule, std::size_t atom, ByteWriter& writer) {
  for (const double coordinate : molecule.positions_angstrom[atom]) writer.f64(coordinate);
  writer.f64(molecule.sigma_angstrom[atom]);
  writer.f64(molecule.epsilon_kj_per_mol[atom]);
  writer.f64(molecule.charge_e[atom]);
  writer.f64(molecule.mass_u[atom]);
}

void read_atom(ByteReader& reader, Molecule& molecule) {
  const double x = reader.f64(), y = reader.f64(), z = reader.f64();
  molecule.positions_angstrom.emplace_back(x, y, z);
  molecule.sigma_angstrom.push_back(reader.f64());
  molecule.epsilon_kj_per_mol.push_back(reader.f64());
  molecule.charge_e.push_back(reader.f64());
  molecule.mass_u.push_back(reader.f64());
}

}  // namespace

std::vector<std::byte> molecule_asset_bytes(const Molecule& molecule) {
  const std::size_t count = molecule.size();
  const bool is_complete = molecule.charge_e.size() == count && molecule.mass_u.size() == count;
  if (!is_complete || count > kMaxMoleculeAssetAtoms || !is_sound(molecule)) {
    throw std::invalid_argument("molecule: " + std::to_string(count) + " atoms cannot be made an asset: each needs " +
                                "position, parameters, charge and mass within their ranges, and 1 to " +
                                std::to_string(kMaxMoleculeAssetAtoms) + " are allowed");
  }
  std::vector<std::uint8_t> octets =
      begin_asset(kKind, molecule.mixes_arithmetically ? kArithmeticMoleculeAssetVersion : kMoleculeAssetVersion);
  ByteWriter writer(octets);
  writer.u32(static_cast<std::uint32_t>(count));
  for (std::size_t atom = 0; atom < count; ++atom) write_atom(molecule, atom, writer);
  end_asset(octets);
  return bytes_of(octets);
}

std::optional<Molecule> molecule_from(std::span<const std::byte> bytes) {
  auto content = asset_content(octets_of(bytes), kKind, kMoleculeAssetVersion);
  const bool is_arithmetic = !content;
  if (is_arithmetic) content = asset_content(octets_of(bytes), kKind, kArithmeticMoleculeAssetVersion);
  if (!content) return std::nullopt;
  ByteReader reader(*content);
  const std::uint32_t count = reader.count(kAtomBytes);
  if (!reader.ok() || count > kMaxMoleculeAssetAtoms) return std::nullopt;
  Molecule molecule;
  molecule.mixes_arithmetically = is_arithmetic;
  for (std::uint32_t atom = 0; atom < count; ++atom) read_atom(reader, molecule);
  if (!reader.ok() || !content->empty() || !is_sound(molecule)) return std::nullopt;
  return molecule;
}

}  // namespace tandem::docking
