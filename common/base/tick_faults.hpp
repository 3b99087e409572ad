// What went wrong in one room step: a bit mask, so that a step can report without logging or throwing, and every
// user can be told.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace tandem {

/// Each bit says what happened and what to do about it. Sent to clients in ServerUpdate::tick_faults.
enum TickFault : std::uint32_t {
  /// A pose or velocity became non-finite; the body was put back to its start at rest.
  /// Remedy: soften the coupling, raise the tool's mass, or look for a scene that starts in deep overlap.
  kFaultNotFinite = 1U << 0U,
  /// A body was faster than limits.body_speed_m_per_s and was slowed to it. Remedy: as above, or raise the limit.
  kFaultSpeedLimited = 1U << 1U,
  /// The coupling force or torque of a tool was at its limit: past half of the bend to it.
  /// Remedy: none needed when rare; else soften it.
  kFaultCouplingSaturated = 1U << 2U,
  /// The molecular field was bounded by molecular_field.force_limit_n: the molecules overlap.
  kFaultFieldLimited = 1U << 3U,
  /// A user's input is older than 115 ms: its tool is held softly where it is. Remedy: look at that user's network.
  kFaultInputStale = 1U << 4U,
  /// A step ended after its deadline (live only). Remedy: fewer bodies, fewer rooms, a faster machine.
  kFaultOverrun = 1U << 5U,
  /// Coupling, contact and friction did not come to one solution within the iterations allowed; the last, finite one
  /// was used. Remedy: none needed when rare; else softer surfaces (contact_stiffness_n_per_m3), or heavier tools.
  kFaultContactUnsolved = 1U << 6U,
  /// More contacts than limits.contact_points or limits.contact_pairs allow: points stood for their neighbours, or the
  /// last pairs of shapes were left out. Remedy: raise the limit, or use shapes with fewer parts.
  kFaultContactCoarse = 1U << 7U,
  /// The soft bodies' step is not done although its result is due (live only): the last one serves on. Remedy:
  /// fewer nodes or samples, a lower soft_step_rate_hz, a faster machine.
  kFaultSoftLate = 1U << 8U,
  /// A user's tool would have put more into the world than his hand put in, and was limited. Remedy: a stage whose
  /// hand supplies what its tool does (local-model, wave), or a shorter delay.
  kFaultToolEnergyLimited = 1U << 9U,
  /// The room steps at less than 90 % of its rate (live only): clients let the force go. Remedy: fewer bodies, contacts
  /// or atoms, a lower step_rate_hz, fewer rooms, a faster machine.
  kFaultRoomSlow = 1U << 10U,
  /// A body got beyond limits.bounds_m of the scene, and was put back to its start at rest. Remedy: none needed.
  kFaultOutOfBounds = 1U << 11U,
};
using TickFaults = std::uint32_t;
/// How many of them there are.
inline constexpr std::size_t kTickFaultBits = 12;

/// One name a bit. A newer server may send bits that this program does not know: they are shown ("bit_20"), not
/// hidden.
std::vector<std::string> tick_fault_names(TickFaults faults);

/// "not_finite|speed_limited"; "none" for 0.
std::string describe_faults(TickFaults faults);

}  // namespace tandem
