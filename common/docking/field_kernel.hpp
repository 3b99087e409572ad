// Interface of the vectorised field kernels, which are compiled once per instruction set.
//
// Only plain structs of pointers may be passed to a kernel, and this header must not include anything that defines
// inline functions. Reason: a file compiled for AVX-512 contains its own copy of each inline function, and the linker
// could use this copy in the whole program. On a CPU without AVX-512, the program would then stop with an illegal
// instruction.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tandem::docking {

/// Number of floats in the widest vector register. Atom counts of tiles are padded to a multiple of it.
inline constexpr std::size_t kLanes = 16;
/// Number of atoms in a tile. The atoms of a tile have a common local origin. Neighbours in a file are usually
/// neighbours in space, so a tile spans only a few residues. A float coordinate relative to the tile's origin has a
/// precision of about 5e-7 Å, for any size of the molecule.
inline constexpr std::size_t kTileAtoms = 128;
/// Number of tiles after which the float sums are added to the double sums, to limit rounding errors.
inline constexpr std::size_t kDrainTiles = 8;
/// Square of (core radius / σ). A pair at a smaller distance is inside the core (exact_field.hpp).
inline constexpr float kCoreFractionSquared = 0.0625F;

/// A double as the sum of two floats, so that the difference of two such numbers has the full precision of a float.
struct SplitFloat {
  float high = 0, low = 0;
};

/// A tile: consecutive atoms of A with a common local origin. Padding atoms have the position of the last atom, and no
/// parameters.
struct Tile {
  std::size_t begin = 0;
  std::size_t end = 0;   ///< index after the last atom including padding: begin plus a multiple of kLanes
  SplitFloat origin[3];  ///< origin of the tile's float positions, the centre of its box [Å]
  float half[3] = {};    ///< half edge lengths of a box about the origin that contains all atoms [Å]
  float core2 = 0;       ///< upper bound of the squared core radii of all pairs [Å²]
  /// Squared distance from the origin beyond which an atom of B is outside the cores of all atoms of the tile [Å²].
  float reach2 = 0;
};

/// The atoms of molecule A, as arrays of floats aligned to 64 bytes.
struct Target {
  const float* x = nullptr;  ///< position relative to the origin of the atom's tile [Å]
  const float* y = nullptr;
  const float* z = nullptr;
  const float* c6 = nullptr;      ///< factor of the atom in C6 of a pair: 2 √ε σ³; for arithmetic mixing 2 √ε
  const float* s3 = nullptr;      ///< factor of the atom in σ³ of a pair: σ³; for arithmetic mixing σ/2
  const float* sigma = nullptr;   ///< σ of the atom [Å]
  const float* charge = nullptr;  ///< charge of the atom [e]
  const Tile* tiles = nullptr;    ///< tiles with a Lennard-Jones term come first
  std::size_t lj_tiles = 0;
  std::size_t tile_count = 0;
};

/// Coordinate of the padding atoms of B [Å].
inline constexpr double kFarAwayAngstrom = 1e12;
/// The atoms of molecule B in A's frame; those with a Lennard-Jones term come first. The arrays are padded to a
/// multiple of kLanes by atoms without parameters at kFarAwayAngstrom.
struct Probes {
  std::size_t lj_count = 0;
  std::size_t count = 0;
  const double* x = nullptr;  ///< position in A's frame [Å]
  const double* y = nullptr;
  const double* z = nullptr;
  const double* arm_x = nullptr;  ///< position relative to the origin of B's frame, in A's axes [Å]
  const double* arm_y = nullptr;
  const double* arm_z = nullptr;
  const float* c6 = nullptr;
  const float* s3 = nullptr;
  const float* sigma = nullptr;
  const float* charge = nullptr;  ///< k · charge/ε of the atom, with Coulomb's constant k and the permittivity ε
};

/// The terms of the field to be evaluated, and the cut-off.
struct KernelModel {
  bool has_charges = false;
  bool is_distance_dependent = false;
  bool is_arithmetic = false;  ///< whether the mixing rule of σ is arithmetic
  float charge_core_squared = 0;
  // Coefficients of force_switch(), only for fields with a cut-off: a12 etc. for r^−12, a6 etc. for r^−6, and aq etc.
  // for the charge term. Forces are switched off between the distances `start` and `cutoff` [Å].
  float start = 0;
  float cutoff = 0;
  float a12 = 0, b12 = 0, c12 = 0;
  float a6 = 0, b6 = 0, c6 = 0;
  float aq = 0, bq = 0, cq = 0;
  float third_a12 = 0, quarter_b12 = 0, third_a6 = 0, quarter_b6 = 0, third_aq = 0, quarter_bq = 0;
};

/// Sums for molecule B in kJ/mol and Å; the torque is about the origin of B's frame.
struct FieldSums {
  double lennard_jones = 0;
  double coulomb = 0;
  double force[3] = {};
  double torque[3] = {};
  // Numbers of operations in a field with a cut-off:
  // * boxes: comparisons of an atom with the box of a tile
  // * distances: comparisons of two atoms
  // * pairs: computed pairs. If one pair of a register is within the cut-off, all pairs of the register are computed
  //   and counted.
  std::size_t boxes = 0, distances = 0, pairs = 0;
  std::size_t on_grid = 0;  ///< number of atoms for which the far grid was evaluated
};

/// Atoms [first, last) of B, at most kLanes, and the tiles of A close to them. Each of these tiles has kLanes atoms.
struct NearWork {
  std::size_t first = 0;
  std::size_t last = 0;
  const std::uint32_t* tiles = nullptr;
  std::size_t tile_count = 0;
};

/// Adds the terms of all pairs to `sums`, without a cut-off.
using AllPairsKernel = void (*)(const Target&, const Probes&, const KernelModel&, FieldSums& sums) noexcept;
/// Adds those pairs of `work` that are within the cut-off to `sums`. Every atom may have a Lennard-Jones term.
using NearKernel = void (*)(const Target&, const Probes&, const KernelModel&, const NearWork& work,
                            FieldSums& sums) noexcept;

/// Factor of the squared cut-off in the search for close boxes. It exceeds 1 so much that rounding errors cannot
/// exclude a pair within the cut-off.
inline constexpr float kReachMargin = 1.0001F;
/// Number of children of a node of a ClusterTree.
inline constexpr std::size_t kChildren = 8;
/// Boxes of a node's children [Å].
struct alignas(32) ChildBoxes {
  float centre[3][kChildren];
  float half[3][kChildren];  ///< half of the box's edge lengths
};

/// Finds close children: those whose squared distance from another box (`centre`, `half`) is below `reach2` [Å²]. Only
/// the children of the nodes with the indices `chosen` are tested. Writes the children's indices, kChildren · node + l
/// for child l, in ascending order to `found` and returns their number. It may overwrite up to kChildren further
/// elements of `found`.
using NearChildren = std::size_t (*)(const ChildBoxes* nodes, const std::uint32_t* chosen, std::size_t count,
                                     const float centre[3], const float half[3], float reach2,
                                     std::uint32_t* found) noexcept;

/// Computes the three potentials of A beyond the cut-off (for q, √C6 and √C12, see far_grid.hpp) at `places` [Å]. The
/// coordinates have the same origin as the float positions of A's atoms. Each array has `count` floats, a multiple of
/// kLanes, and is aligned to 64 bytes.
using FarPointsKernel = void (*)(const Target&, std::size_t atoms, const KernelModel&, std::size_t count,
                                 const float* const places[3], float* const potentials[3]) noexcept;

/// Nodes of a far grid, with four floats each; x varies fastest.
struct GridNodes {
  const float* nodes = nullptr;  ///< four floats for each node: potentials for q, √C6 and √C12, and an unused one
  std::size_t count[3] = {};
  double origin[3] = {};  ///< position of the first node [Å]
  /// Largest position at which the grid may be evaluated, relative to `origin`, in grid spacings. The smallest position
  /// is 1.
  double last[3] = {};
  double per_angstrom = 1;
};
/// Adds the part of the far grid for each atom of B. c6 and s3 are 2 √ε σ³ and σ³, padded like the arrays of B.
using GridKernel = void (*)(const GridNodes&, const Probes&, const float* c6, const float* s3,
                            FieldSums& sums) noexcept;

void all_pairs_portable(const Target&, const Probes&, const KernelModel&, FieldSums&) noexcept;
void near_portable(const Target&, const Probes&, const KernelModel&, const NearWork&, FieldSums&) noexcept;
std::size_t near_children_portable(const ChildBoxes*, const std::uint32_t*, std::size_t, const float*, const float*,
                                   float, std::uint32_t*) noexcept;
void far_points_portable(const Target&, std::size_t, const KernelModel&, std::size_t, const float* const[3],
                         float* const[3]) noexcept;
void grid_portable(const GridNodes&, const Probes&, const float*, const float*, FieldSums&) noexcept;
/// Executes 12 × count × lanes multiply-adds in registers only, to measure the arithmetic peak rate of the processor.
double multiply_adds_portable(std::size_t count) noexcept;
#ifdef TANDEM_FIELD_X86
void all_pairs_avx2(const Target&, const Probes&, const KernelModel&, FieldSums&) noexcept;
void near_avx2(const Target&, const Probes&, const KernelModel&, const NearWork&, FieldSums&) noexcept;
std::size_t near_children_avx2(const ChildBoxes*, const std::uint32_t*, std::size_t, const float*, const float*, float,
                               std::uint32_t*) noexcept;
void far_points_avx2(const Target&, std::size_t, const KernelModel&, std::size_t, const float* const[3],
                     float* const[3]) noexcept;
void grid_avx2(const GridNodes&, const Probes&, const float*, const float*, FieldSums&) noexcept;
double multiply_adds_avx2(std::size_t count) noexcept;
void all_pairs_avx512(const Target&, const Probes&, const KernelModel&, FieldSums&) noexcept;
void near_avx512(const Target&, const Probes&, const KernelModel&, const NearWork&, FieldSums&) noexcept;
void far_points_avx512(const Target&, std::size_t, const KernelModel&, std::size_t, const float* const[3],
                       float* const[3]) noexcept;
void grid_avx512(const GridNodes&, const Probes&, const float*, const float*, FieldSums&) noexcept;
double multiply_adds_avx512(std::size_t count) noexcept;
#endif

}  // namespace tandem::docking
