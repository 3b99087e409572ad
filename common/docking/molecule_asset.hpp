// A molecule ready for the field, as a client gets it: what the server read and typed, without the server's files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/docking/molecule.hpp"

namespace tandem::docking {

inline constexpr std::uint32_t kMoleculeAssetVersion = 3;
inline constexpr std::size_t kMaxMoleculeAssetAtoms = 1'000'000;

/// Positions, masses and the parameters of the field, in double precision, so that both ends compute the same forces; and, for
/// people to look at, atoms by name and element, in residues and chains. Types and notes stay behind.
///
/// Model   little-endian: "TMOL", version, flags (1: Molecule::mixes_arithmetically), count; for each atom x y z σ ε q m (Å,
///         kJ/mol, e, u); count of residues, none where the molecule has no names; for each its first atom, segment, chain,
///         name and id; for each atom its name and element; a checksum of all that. A text is its length and so many
///         printable ASCII characters, kMaxMoleculeTextBytes at most
/// In      molecule  longer texts are cut, and what is not printable ASCII becomes "?"
/// Fails   std::invalid_argument: see validate(), or more atoms than kMaxMoleculeAssetAtoms
std::vector<std::byte> molecule_asset_bytes(const Molecule& molecule);
inline constexpr std::size_t kMaxMoleculeTextBytes = 8;

/// Nothing for bytes that are not exactly such an asset, with numbers that the field can bear.
std::optional<Molecule> molecule_from(std::span<const std::byte> bytes);

}  // namespace tandem::docking
