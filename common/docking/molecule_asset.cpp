#include "common/docking/molecule_asset.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <stdexcept>
#include <string>
#include <utility>

#include "common/base/byte_io.hpp"

namespace tandem::docking {
namespace {

constexpr std::uint32_t kKind = 0x4C4F4D54;  // the characters "TMOL" at the start of an asset
constexpr std::size_t kAtomBytes = 7 * sizeof(double);
constexpr std::uint32_t kMixesArithmetically = 1;
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

bool has_names(const Molecule& molecule) {
  return std::ranges::all_of(
      std::array{&molecule.atom_names, &molecule.elements, &molecule.chains, &molecule.residue_names,
                 &molecule.residue_ids},
      [&molecule](const std::vector<std::string>* texts) { return texts->size() == molecule.size(); });
}

bool is_printable(char character) {
  return character >= ' ' && character <= '~';
}

std::string sent(const std::string& text) {
  std::string short_text = text.substr(0, kMaxMoleculeTextBytes);
  std::ranges::replace_if(short_text, std::not_fn(is_printable), '?');
  return short_text;
}

void write_text(const std::string& text, ByteWriter& writer) {
  writer.number(static_cast<std::uint8_t>(text.size()));
  writer.array(std::span<const char>(text));
}

std::string read_text(ByteReader& reader) {
  const auto length = reader.number<std::uint8_t>();
  if (length > kMaxMoleculeTextBytes) reader.fail();
  std::string text(reader.ok() ? length : 0, ' ');
  reader.array(std::span<char>(text));
  if (!std::ranges::all_of(text, is_printable)) reader.fail();
  return text;
}

/// A residue: consecutive atoms with equal chain, residue and segment.
struct Residue {
  std::uint32_t first = 0;
  std::int32_t segment = 0;
  std::string chain, name, id;

  bool is_same(const Residue& other) const {
    return segment == other.segment && chain == other.chain && name == other.name && id == other.id;
  }
};

Residue residue_of(const Molecule& molecule, std::size_t atom) {
  return {static_cast<std::uint32_t>(atom), atom < molecule.segments.size() ? molecule.segments[atom] : 0,
          sent(molecule.chains[atom]), sent(molecule.residue_names[atom]), sent(molecule.residue_ids[atom])};
}

std::vector<Residue> residues_of(const Molecule& molecule) {
  std::vector<Residue> residues;
  for (std::size_t atom = 0; atom < molecule.size(); ++atom) {
    Residue residue = residue_of(molecule, atom);
    if (residues.empty() || !residues.back().is_same(residue)) residues.push_back(std::move(residue));
  }
  return residues;
}

void write_names(const Molecule& molecule, ByteWriter& writer) {
  const std::vector<Residue> residues = has_names(molecule) ? residues_of(molecule) : std::vector<Residue>();
  writer.u32(static_cast<std::uint32_t>(residues.size()));
  for (const Residue& residue : residues) {
    writer.u32(residue.first);
    writer.number(residue.segment);
    for (const std::string* text : {&residue.chain, &residue.name, &residue.id}) write_text(*text, writer);
  }
  for (std::size_t atom = 0; !residues.empty() && atom < molecule.size(); ++atom) {
    write_text(sent(molecule.atom_names[atom]), writer);
    write_text(sent(molecule.elements[atom]), writer);
  }
}

/// Reads the residues. If they do not divide the atoms into consecutive ranges, reading fails (ByteReader::fail()).
std::vector<Residue> read_residues(ByteReader& reader, std::size_t atoms) {
  constexpr std::size_t kMinBytes = 2 * sizeof(std::uint32_t) + 3;
  std::vector<Residue> residues(reader.count(kMinBytes));
  if (residues.size() > atoms) reader.fail();
  for (std::size_t i = 0; reader.ok() && i < residues.size(); ++i) {
    Residue& residue = residues[i];
    residue.first = reader.u32();
    residue.segment = reader.number<std::int32_t>();
    for (std::string* text : {&residue.chain, &residue.name, &residue.id}) *text = read_text(reader);
    const bool is_next =
        i == 0 ? residue.first == 0 : residue.first > residues[i - 1].first && !residue.is_same(residues[i - 1]);
    if (!is_next || residue.first >= atoms) reader.fail();
  }
  return residues;
}

void read_names(ByteReader& reader, Molecule& molecule) {
  const std::vector<Residue> residues = read_residues(reader, molecule.size());
  std::size_t next = 0;
  for (std::size_t atom = 0; reader.ok() && !residues.empty() && atom < molecule.size(); ++atom) {
    if (next < residues.size() && residues[next].first == atom) ++next;
    const Residue& residue = residues[next - 1];
    molecule.segments.push_back(residue.segment);
    molecule.chains.push_back(residue.chain);
    molecule.residue_names.push_back(residue.name);
    molecule.residue_ids.push_back(residue.id);
    molecule.atom_names.push_back(read_text(reader));
    molecule.elements.push_back(read_text(reader));
  }
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
  std::vector<std::uint8_t> octets = begin_asset(kKind, kMoleculeAssetVersion);
  ByteWriter writer(octets);
  writer.u32(molecule.mixes_arithmetically ? kMixesArithmetically : 0);
  writer.u32(static_cast<std::uint32_t>(count));
  for (std::size_t atom = 0; atom < count; ++atom) write_atom(molecule, atom, writer);
  write_names(molecule, writer);
  end_asset(octets);
  return bytes_of(octets);
}

std::optional<Molecule> molecule_from(std::span<const std::byte> bytes) {
  auto content = asset_content(octets_of(bytes), kKind, kMoleculeAssetVersion);
  if (!content) return std::nullopt;
  ByteReader reader(*content);
  const std::uint32_t flags = reader.u32(), count = reader.count(kAtomBytes);
  if (!reader.ok() || flags > kMixesArithmetically || count > kMaxMoleculeAssetAtoms) return std::nullopt;
  Molecule molecule;
  molecule.mixes_arithmetically = flags == kMixesArithmetically;
  for (std::uint32_t atom = 0; atom < count; ++atom) read_atom(reader, molecule);
  read_names(reader, molecule);
  if (!reader.ok() || !content->empty() || !is_sound(molecule)) return std::nullopt;
  return molecule;
}

}  // namespace tandem::docking
