// Redocking by hands: a complex taken apart and put together again by two simulated users over a network.
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
/// Largest RMSD of the minimum to the native pose [Å]. Beyond it the field has no minimum where the files have the ligand, and
/// a ligand in that minimum is not redocked. 2 Å is the usual bound of successful redocking.
inline constexpr double kNative_angstrom = 2;
/// Hands let go at the first pose of the way out whose RMSD to the minimum is at least the first value. Where that pose is beyond
/// the second, they let go at one before it [Å].
inline constexpr double kRelease_angstrom = 1.5, kFarthestRelease_angstrom = 2;
/// Largest force step beyond the one at zero delay.
inline constexpr double kStepBeyond_n_per_ms = 0.1;

/// The minimum is the deepest one within kNative_angstrom of the native pose that descents from there and from 12 poses around
/// it find. For each seed: a way out (exit_path()) from it, and the same way back by the ligand's hand, up
/// to kRelease_angstrom from the minimum; then both hands relax for four seconds. The same again at zero delay on the stage
/// that shows the server's own force.
///
/// In      scene     as docking_scene() makes it
///         guided    the ligand's hand does not relax: the distance of its end pose is an offset, and no claim
///         threads   trials at a time
///         progress  called with the finished share of the trials, 0 to 1
/// Out     the pair and its minimum; "locked" true when the first five seeds find no way out, then with "lock", the reason; "seeds", a row each, whose "end" is "docked", "deeper minimum" (the field prefers another pose), "zero area" (no force is
///         shown there), "elsewhere" or "disconnected". Minimum and
///         end poses are held against the native pose by the measures of lab/metrics/capri.hpp
/// Fails   as server::load_scene_text(); std::invalid_argument: the parts form no complex as the files have them
boost::json::object redock(const wire::Scene& scene, std::uint64_t first_seed, std::size_t seeds, Duration round_trip,
                           bool guided, std::size_t threads, const std::function<void(double)>& progress = {});

/// The claims: the minimum is near the native pose; and of a locked pair that there is a way out, of others that ligands dock
/// without large force steps or forces.
std::vector<Check> redock_checks(const boost::json::object& redocked);

}  // namespace tandem::lab
