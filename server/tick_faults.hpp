// What went wrong in one room step: a bit mask, so that a step can report without logging or throwing.
#pragma once

#include <cstdint>
#include <string>

namespace tandem {

/// Each bit says what happened and what to do about it. Sent to clients in ServerUpdate::tick_faults.
enum TickFault : std::uint32_t {
  /// A pose or velocity became non-finite; the body was put back to its start at rest.
  /// Remedy: soften the coupling, raise the tool's mass, or look for a scene that starts in deep overlap.
  kFaultNotFinite = 1U << 0U,
  /// A body was faster than limits.body_speed_m_per_s and was slowed to it. Remedy: as above, or raise the limit.
  kFaultSpeedLimited = 1U << 1U,
  /// The coupling force or torque of a tool reached its limit. Remedy: none needed when rare; else soften it.
  kFaultCouplingSaturated = 1U << 2U,
  /// The molecular field was bounded by molecular_field.force_limit_n: the molecules overlap.
  kFaultFieldLimited = 1U << 3U,
  /// A user's input is older than 100 ms: its tool is held softly where it is. Remedy: look at that user's network.
  kFaultInputStale = 1U << 4U,
  /// A step ended after its deadline (live only). Remedy: fewer bodies, fewer rooms, a faster machine.
  kFaultOverrun = 1U << 5U,
};
using TickFaults = std::uint32_t;

/// "not_finite|speed_limited"; "none" for 0.
std::string describe_faults(TickFaults faults);

}  // namespace tandem
