// Redocking by hands: two simulated users take a complex apart and reassemble it over a network.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "common/base/json.hpp"
#include "common/base/time.hpp"
#include "lab/report/check.hpp"
#include "tandem/scene.pb.h"

namespace tandem::lab {

/// A ligand is docked within this RMSD of the field's deepest minimum near the native pose [Å].
inline constexpr double kDocked_angstrom = 1;
/// Required share of seeds whose ligand is docked.
inline constexpr double kDockedShare = 0.8;
/// Largest RMSD of the minimum to the native pose [Å], the usual bound of successful redocking. Beyond it the field
/// has no minimum at the native pose, and a ligand in that minimum is not redocked.
inline constexpr double kNative_angstrom = 2;
/// Hands release at the first pose of the exit path whose RMSD to the minimum is at least the first value. If that
/// pose exceeds the second value, they release one pose earlier [Å].
inline constexpr double kRelease_angstrom = 1.5, kFarthestRelease_angstrom = 2;
/// Largest allowed excess of the force step over that at zero delay.
inline constexpr double kStepBeyond_n_per_ms = 0.1;

/// The minimum is the deepest one within kNative_angstrom of the native pose found by descents from that pose and from
/// 12 poses around it. For each seed the ligand's hand follows an exit path (exit_path()) from it and the same path
/// back, up to kRelease_angstrom from the minimum; then both hands relax for four seconds. The trial is repeated at
/// zero delay on the stage that displays the server's own force.
///
/// In      scene     scene of docking_scene()
///         guided    the ligand's hand does not relax: the distance of its end pose is then an offset, not a claim
///         threads   number of parallel trials
///         progress  called with the finished share of the trials, 0 to 1
/// Out     the pair and its minimum; "locked", true when the first five seeds find no exit path, then with the reason
///         as "lock"; "seeds", a row each, whose "end" is "docked", "deeper minimum" (the field prefers another pose),
///         "zero area" (no force is displayed there), "elsewhere" or "disconnected". The minimum and the end poses are
///         compared with the native pose by the measures of lab/metrics/capri.hpp
/// Fails   see server::load_scene_text(); std::invalid_argument: the parts form no complex in the poses of their files
boost::json::object redock(const wire::Scene& scene, std::uint64_t first_seed, std::size_t seeds, Duration round_trip,
                           bool guided, std::size_t threads, const std::function<void(double)>& progress = {});

/// Claims: the minimum is near the native pose. A locked pair fails the claim of an exit path. In other pairs the
/// ligands dock without large force steps or forces.
std::vector<Check> redock_checks(const boost::json::object& redocked);

}  // namespace tandem::lab
