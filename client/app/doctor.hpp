// Checks of tandem-doctor: whether this machine is fit for a haptic session, and how to improve it.
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
  kWarning,  ///< usable, with reduced quality
  kBad       ///< a session will have faults
};
/// "good", "warning", "bad".
std::string_view name_of(Verdict verdict) noexcept;

struct Finding {
  std::string check;  ///< "devices", "priority", "clock", "timers", "idle", "lateness", "link"
  Verdict verdict = Verdict::kGood;
  std::string text;             ///< result of the check
  std::string remedy;           ///< how to improve it; empty: nothing is needed
  boost::json::object numbers;  ///< the figures for programs; names carry units
};

/// One finding for each device that is plugged in, with the reason if it cannot be opened; one finding if there is
/// none.
std::vector<Finding> find_devices(const std::vector<devices::DeviceKind>& kinds);

/// Findings about priority and locked memory: one for each right that request_realtime() did not obtain.
std::vector<Finding> judge_rights(const std::vector<std::string>& not_granted, int priority);

/// Findings about the kernel's clock and timers.
/// In      clocksource  the file /sys/devices/system/clocksource/clocksource0/current_clocksource
///         resolution   of the kernel's timers
std::vector<Finding> judge_clocks(const std::filesystem::path& clocksource, Duration resolution);

/// Warns if a host takes idle processors and the haptic thread's processor is not kept awake: no priority, or a quota
/// (realtime::should_keep_awake()).
Finding judge_idle(bool gives_idle_to_host, bool has_priority, bool has_quota);

/// Evaluates a loop of 1 ms. Bad: one tick in a thousand is late by a period or is missed, or a tick is late by 20 ms,
/// at which the force is released. Warning: from half a period on.
Finding judge_lateness(const Histogram& lateness, std::uint64_t missed);

/// Figures of a connection to a server.
struct LinkSample {
  Duration round_trip_min{0};
  Duration round_trip_max{0};
  Duration longest_gap{0};  ///< between two arrivals, or from the last one to the end
  std::uint64_t states = 0;
};
/// Evaluates a link. Bad: no states, gaps as long as those after which the force falls (SafetySettings::silence_start),
/// or a round trip above 300 ms, for which there are no measurements. Warning: a round trip above 100 ms or varying by
/// more than 30 ms, or gaps above 50 ms.
Finding judge_link(const LinkSample& link);

/// Joins as an observer and samples the states for `length`. A server that cannot be joined is a bad finding.
Finding watch_link(ClientIoSettings settings, Duration length);

/// Runs a loop of 1 ms for `length` in a thread kept awake like that of tandem-client. Returns rights, idle and
/// lateness.
std::vector<Finding> run_loop(int priority, Duration length);

/// One line per finding, followed by its remedy if there is one.
std::string doctor_text(const std::vector<Finding>& findings);
boost::json::object doctor_json(const std::vector<Finding>& findings);
/// 1 if any finding is bad, else 0.
int doctor_exit_code(const std::vector<Finding>& findings);

}  // namespace tandem::client
