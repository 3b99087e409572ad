// A molecule prepared for the field, in the format that is sent to clients. Clients do not have the server's structure
// files.
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

/// Encodes positions, masses and field parameters in double precision, so that server and client compute equal forces.
/// Names and elements of atoms, residues and chains are included for display. Force-field types and notices are not.
///
/// Model   Little-endian, in this order:
///         1. "TMOL"; version; flags (1: Molecule::mixes_arithmetically)
///         2. number of atoms; for each atom x y z σ ε q m (Å, kJ/mol, e, u)
///         3. number of residues, 0 if the molecule has no names; for each residue its first atom, segment, chain, name
///            and id
///         4. for each atom its name and element
///         5. a checksum over everything
///         A text is encoded as its length, followed by that number of printable ASCII characters, at most
///         kMaxMoleculeTextBytes
/// In      molecule  its texts may be longer than kMaxMoleculeTextBytes, and are then truncated; "?" replaces
///         characters other than printable ASCII
/// Fails   throws std::invalid_argument: see validate(), or more atoms than kMaxMoleculeAssetAtoms
std::vector<std::byte> molecule_asset_bytes(const Molecule& molecule);
inline constexpr std::size_t kMaxMoleculeTextBytes = 8;

/// Decodes an asset. Returns nothing if the bytes are not exactly one asset, or if a value is outside the limits of
/// validate().
std::optional<Molecule> molecule_from(std::span<const std::byte> bytes);

}  // namespace tandem::docking
