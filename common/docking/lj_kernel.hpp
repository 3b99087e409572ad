// The border between the field and its kernels, which are compiled once per instruction set.
//
// Only plain structs of pointers may cross it, and this header may include nothing that defines inline functions: an
// inline function emitted by the AVX-512 file could be the copy that the linker keeps for the whole program, which
// then stops with an illegal instruction on a CPU without AVX-512.
#pragma once

#include <cstddef>

namespace tandem::docking {

/// Lanes of the widest kernel; atom counts are padded to a multiple.
inline constexpr std::size_t kLanes = 16;
/// Atoms that share one local origin. Neighbours in a file are neighbours in space, so a tile is small (a few
/// residues) and a float coordinate in it keeps about 3e-7 Å, however large the molecule.
inline constexpr std::size_t kTileAtoms = 64;
/// Atoms after which the float lanes are emptied into doubles.
inline constexpr std::size_t kDrainAtoms = 1024;
/// Distances are bounded from below at this fraction of σ, squared (see lennard_jones.hpp).
inline constexpr float kCoreFractionSquared = 0.0625F;

/// Molecule A, arrays of `padded_count` floats aligned to 64 bytes; padding has sqrt_epsilon = 0.
struct Target {
  std::size_t padded_count = 0;
  const float* x = nullptr;  ///< Å, relative to the atom's tile origin
  const float* y = nullptr;
  const float* z = nullptr;
  const float* inverse_sigma = nullptr;  ///< 1/Å
  const float* sqrt_epsilon = nullptr;
  const double* tile_origin = nullptr;  ///< Å, x y z of each tile
};

/// Atoms of molecule B in A's frame, and the sums of each; √ε_b is left to the caller, who multiplies them with it.
struct Probes {
  std::size_t count = 0;
  const double* x = nullptr;  ///< Å
  const double* y = nullptr;
  const double* z = nullptr;
  const float* sigma = nullptr;  ///< Å
  double* energy = nullptr;      ///< out: V/(4 √ε_b)
  double* fx = nullptr;          ///< out: f/(24 √ε_b)
  double* fy = nullptr;
  double* fz = nullptr;
};

using Kernel = void (*)(const Target&, const Probes&) noexcept;

void evaluate_portable(const Target& target, const Probes& probes) noexcept;
#ifdef TANDEM_LJ_X86
void evaluate_avx2(const Target& target, const Probes& probes) noexcept;
void evaluate_avx512(const Target& target, const Probes& probes) noexcept;
#endif

}  // namespace tandem::docking
