// What this machine has for a session by touch, and what it lacks: the checks behind tandem-doctor.
#pragma once

#include <boost/json/object.hpp>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "client/net/client_io.hpp"
#include "common/base/histogram.hpp"
#include "devices/registry.hpp"

namespace tandem::client {

enum class Verdict : std::uint8_t {
  kGood,
  kWarning,  ///< it works, and worse than it could
  kBad       ///< a session will suffer from it
};
/// "good", "warning", "bad".
std::string_view name_of(Verdict verdict) noexcept;

struct Finding {
  std::string check;  ///< "devices", "priority", "clock", "timers", "idle", "lateness", "link"
  Verdict verdict = Verdict::kGood;
  std::string text;             ///< what was found
  std::string remedy;           ///< what would help; empty: nothing is needed
  boost::json::object numbers;  ///< for programs, named with their units
};

/// Each device that is plugged in, and why one cannot be opened; one finding when there is none.
std::vector<Finding> find_devices(const std::vector<devices::DeviceKind>& kinds);

/// What was not granted of priority and locked memory, to a thread that asked as the haptic one does.
std::vector<Finding> judge_rights(const std::vector<std::string>& not_granted, int priority);

/// `clocksource` is the kernel's file /sys/devices/system/clocksource/clocksource0/current_clocksource, `resolution` that of
/// its timers.
std::vector<Finding> judge_clocks(const std::filesystem::path& clocksource, Duration resolution);

/// A warning where a host takes idle processors and the haptic thread's is not kept awake, for want of a priority or under a
/// quota (realtime::should_keep_awake()).
Finding judge_idle(bool gives_idle_to_host, bool has_priority, bool has_quota);

/// Of a loop of 1 ms. Bad when one tick in a thousand is late by a period or a tick by 20 ms, at which the force is let
/// go; a warning from half a period on.
Finding judge_lateness(const Histogram& lateness, std::uint64_t missed);

/// What was seen of the way to a server.
struct LinkSample {
  Duration round_trip_min{0};
  Duration round_trip_max{0};
  Duration longest_gap{0};  ///< between two arrivals, or up to the end
  std::uint64_t states = 0;
};
/// Bad where nothing comes, or gaps are as long as those after which the force falls (SafetySettings::silence_start), or the
/// round trip is above 300 ms, for which nothing was measured; a warning above 100 ms, or where it swings by more than
/// 30 ms, or with gaps above 50 ms.
Finding judge_link(const LinkSample& link);

/// Joins as an observer, and watches the states for `length`. A server that cannot be joined is a bad finding.
Finding watch_link(ClientIoSettings settings, Duration length);

/// Ticks a loop of 1 ms for `length` on a thread of its own, kept awake as tandem-client's is, and gives rights and lateness.
std::vector<Finding> run_loop(int priority, Duration length);

/// A line each, and the remedy below what needs one.
std::string doctor_text(const std::vector<Finding>& findings);
boost::json::object doctor_json(const std::vector<Finding>& findings);
/// 1 when anything is bad, else 0.
int doctor_exit_code(const std::vector<Finding>& findings);

}  // namespace tandem::client
