// A molecule prepared for the field and sent to clients, which do not have the server's files.
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

/// Encodes positions, masses and field parameters in double precision, so that both ends compute the same forces. For
/// display it adds atoms by name and element, in residues and chains. Excludes types and notes.
///
/// Model   little-endian: "TMOL", version, flags (1: Molecule::mixes_arithmetically), count; for each atom x y z σ ε q
///         m (Å, kJ/mol, e, u); count of residues, 0 if the molecule has no names; for each its first atom, segment,
///         chain, name and id; for each atom its name and element; a checksum of all. A text is its length and as many
///         printable ASCII characters, at most kMaxMoleculeTextBytes
/// In      molecule  longer texts are cut, and "?" replaces characters other than printable ASCII
/// Fails   std::invalid_argument: see validate(), or more atoms than kMaxMoleculeAssetAtoms
std::vector<std::byte> molecule_asset_bytes(const Molecule& molecule);
inline constexpr std::size_t kMaxMoleculeTextBytes = 8;

/// Decodes an asset; empty for bytes that are not exactly such an asset, or with numbers outside the field's limits.
std::optional<Molecule> molecule_from(std::span<const std::byte> bytes);

}  // namespace tandem::docking
