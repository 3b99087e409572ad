// Redocking with simulated hands: two users separate a complex and reassemble it over a network.
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

/// Largest RMSD from the field's deepest minimum near the native pose at which a ligand counts as docked [Å].
inline constexpr double kDocked_angstrom = 1;
/// Required fraction of seeds in which the ligand is docked.
inline constexpr double kDockedShare = 0.8;
/// Largest permitted RMSD of the field's minimum from the native pose [Å]: the usual criterion of successful redocking.
/// Above it the field has no minimum at the native pose, and a ligand in its minimum does not count as redocked.
inline constexpr double kNative_angstrom = 2;
/// Range of the release pose, at which the hands relax: its RMSD from the minimum. It is the first pose of the exit
/// path with an RMSD of at least kRelease_angstrom. If this RMSD exceeds kFarthestRelease_angstrom, the pose is
/// interpolated towards the previous one.
inline constexpr double kRelease_angstrom = 1.5, kFarthestRelease_angstrom = 2;
/// Largest permitted excess of a trial's largest force step over the largest force step of the same trial at zero
/// delay.
inline constexpr double kStepBeyond_n_per_ms = 0.1;

/// Runs the redocking trials. "The minimum" is the deepest energy minimum within kNative_angstrom of the native pose.
/// It is searched from that pose and from 12 poses around it. For each seed:
/// 1. An exit path is computed from the minimum (exit_path()).
/// 2. The ligand's hand starts at the end of this path and returns on it to a pose about kRelease_angstrom from the
///    minimum.
/// 3. Both hands relax for 4 s.
/// 4. The trial is repeated at zero delay on the stage that displays the server's own force.
///
/// In      scene     scene of docking_scene()
///         guided    true: the ligand's hand does not relax but continues to hold the ligand. The distance of the end
///         pose from the minimum is then reported only as a measured offset, without a claim
///         threads   number of trials that run in parallel
///         progress  called with the finished fraction of the trials, 0 to 1
/// Out     fields of the result:
///         * properties of the pair, settings, and the minimum
///         * "locked": true if the first five seeds find no exit path; "lock" then contains the reason
///         * "seeds": one row for each seed. Its "end" is "docked", "deeper minimum" (the field prefers another pose),
///           "zero area" (no force is displayed there), "elsewhere" or "disconnected"
///
///         The minimum and the end poses are compared with the native pose by the measures of lab/metrics/capri.hpp
/// Fails   see server::load_scene_text(); std::invalid_argument: the parts form no complex in the poses of their files
boost::json::object redock(const wire::Scene& scene, std::uint64_t first_seed, std::size_t seeds, Duration round_trip,
                           bool guided, std::size_t threads, const std::function<void(double)>& progress = {});

/// Returns the checked claims: the minimum is near the native pose, there is an exit path, and the ligands dock without
/// large forces or force steps. A pair without an exit path ("locked") fails the second claim, and the claims about
/// docking are omitted.
std::vector<Check> redock_checks(const boost::json::object& redocked);

}  // namespace tandem::lab
