// A molecule ready for the field, as a client gets it: what the server read and typed, without the server's files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/docking/molecule.hpp"

namespace tandem::docking {

inline constexpr std::uint32_t kMoleculeAssetVersion = 1;
inline constexpr std::uint32_t kArithmeticMoleculeAssetVersion = 2;  ///< the same with Molecule::mixes_arithmetically
inline constexpr std::size_t kMaxMoleculeAssetAtoms = 1'000'000;

/// Positions, masses and the parameters of the field, in double precision, so that both ends compute the same forces;
/// names, types and notes stay behind.
///
/// Model   little-endian: "TMOL", version, count; for each atom x y z σ ε q m (Å, kJ/mol, e, u); a checksum of all that
/// Fails   std::invalid_argument: see validate(), or more atoms than kMaxMoleculeAssetAtoms
std::vector<std::byte> molecule_asset_bytes(const Molecule& molecule);

/// Nothing for bytes that are not exactly such an asset of one of these versions with numbers that the field can bear.
std::optional<Molecule> molecule_from(std::span<const std::byte> bytes);

}  // namespace tandem::docking
