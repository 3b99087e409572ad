// Faults of one simulation step of a room, as a bit mask. The step reports faults this way because it must neither log
// nor throw. The mask is sent to every user of the room.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace tandem {

/// Bits of ServerUpdate::tick_faults, which is sent to the clients. Each comment gives the cause and the remedy.
enum TickFault : std::uint32_t {
  /// A pose or velocity became non-finite; the body was reset to its initial pose at rest.
  /// Remedy: soften the coupling, raise the tool's mass, or check whether bodies overlap deeply at the start of the
  /// scene.
  kFaultNotFinite = 1U << 0U,
  /// The speed of a body exceeded limits.body_speed_m_per_s and was reduced to that value. Remedy: as for
  /// kFaultNotFinite, or raise the limit.
  kFaultSpeedLimited = 1U << 1U,
  /// The coupling force or torque of a tool was close to its limit. A smooth transition (soft clamp) leads to the
  /// limit; the value was in the upper half of this transition.
  /// Remedy: none if it occurs rarely; otherwise soften the coupling.
  kFaultCouplingSaturated = 1U << 2U,
  /// The force of the molecular field was limited to molecular_field.force_limit_n, because the molecules overlap.
  kFaultFieldLimited = 1U << 3U,
  /// The last input of a user is older than 115 ms, so the tool is held softly in place. Remedy: check the network of
  /// that user.
  kFaultInputStale = 1U << 4U,
  /// A step ended after its deadline (only in live rooms). Remedy: fewer bodies, fewer rooms or a faster machine.
  kFaultOverrun = 1U << 5U,
  /// Coupling, contact and friction are solved together by iteration. The iteration did not converge within the allowed
  /// number of steps, so the last finite solution was used.
  /// Remedy: none if it occurs rarely; otherwise softer surfaces (contact_stiffness_n_per_m3) or heavier tools.
  kFaultContactUnsolved = 1U << 6U,
  /// There were more contacts than limits.contact_points or limits.contact_pairs allow. Neighbouring points were
  /// represented by one point, or the last pairs of shapes were ignored. Remedy: raise the limit, or use shapes with
  /// fewer parts.
  kFaultContactCoarse = 1U << 7U,
  /// The result of the soft-body step was not ready in time (only in live rooms); the previous result stays in use.
  /// Remedy: fewer nodes or samples, a lower soft_step_rate_hz or a faster machine.
  kFaultSoftLate = 1U << 8U,
  /// A tool was limited, because it would have supplied more energy to the world than the user's hand had supplied to
  /// the tool. Remedy: a stage in which the hand supplies the tool's energy (local-model, wave), or a shorter delay.
  kFaultToolEnergyLimited = 1U << 9U,
  /// The room runs at less than 90 % of its step rate (only in live rooms); clients reduce the force to zero. Remedy:
  /// fewer bodies, contacts or atoms, a lower step_rate_hz, fewer rooms or a faster machine.
  kFaultRoomSlow = 1U << 10U,
  /// A body that no tool held was farther than limits.bounds_m from the origin, and was reset to its initial pose at
  /// rest. Remedy: none needed.
  kFaultOutOfBounds = 1U << 11U,
};
using TickFaults = std::uint32_t;
/// Number of fault bits defined above.
inline constexpr std::size_t kTickFaultBits = 12;

/// Returns the name of each bit that is set. A bit that this program does not define (from a newer server) is named by
/// its number, e.g. "bit_20".
std::vector<std::string> tick_fault_names(TickFaults faults);

/// Returns the names joined by "|", e.g. "not_finite|speed_limited"; "none" for 0.
std::string describe_faults(TickFaults faults);

}  // namespace tandem
