// Checks of tandem-doctor: whether this machine is suitable for a haptic session, and otherwise how to improve it.
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
  kBad       ///< a session on this machine will have faults
};
/// Name of the verdict: "good", "warning" or "bad".
std::string_view name_of(Verdict verdict) noexcept;

struct Finding {
  std::string check;  ///< name of the check: "devices", "priority", "clock", "timers", "idle", "lateness" or "link"
  Verdict verdict = Verdict::kGood;
  std::string text;             ///< result of the check
  std::string remedy;           ///< suggested remedy; empty if none is needed
  boost::json::object numbers;  ///< values for other programs, with units in their names
};

/// Returns one finding per connected device, with the reason if it cannot be opened. Without a connected device,
/// returns a single finding that says so.
std::vector<Finding> find_devices(const std::vector<devices::DeviceKind>& kinds);

/// Returns findings about real-time priority and locked memory, one for each right that request_realtime() did not
/// obtain.
std::vector<Finding> judge_rights(const std::vector<std::string>& not_granted, int priority);

/// Returns findings about the kernel's clock and timers.
/// In      clocksource  path of /sys/devices/system/clocksource/clocksource0/current_clocksource
///         resolution   resolution of the kernel's timers
std::vector<Finding> judge_clocks(const std::filesystem::path& clocksource, Duration resolution);

/// Warns if both conditions hold: the host of this virtual machine takes back idle processors, and the haptic thread
/// cannot keep its processor awake. It can do so only with real-time priority and without a quota
/// (realtime::should_keep_awake()).
Finding judge_idle(bool gives_idle_to_host, bool has_priority, bool has_quota);

/// Evaluates the lateness of a loop with a period of 1 ms:
/// * bad: more than one tick in a thousand is missed or late by a period; or a single tick is late by 20 ms, after
///   which the safety chain releases the force;
/// * warning: more than one tick in a thousand is late by half a period.
Finding judge_lateness(const Histogram& lateness, std::uint64_t missed);

/// Measurements of a connection to a server.
struct LinkSample {
  Duration round_trip_min{0};
  Duration round_trip_max{0};
  Duration longest_gap{0};  ///< longest time without a received state, up to the end of the measurement
  std::uint64_t states = 0;
};
/// Evaluates a link:
/// * bad: no state is received; or a gap is so long that the force decays (SafetySettings::silence_start); or the round
///   trip is above 300 ms, the largest delay that was measured in the lab;
/// * warning: the round trip is above 100 ms or varies by more than 30 ms; or a gap is above 50 ms.
Finding judge_link(const LinkSample& link);

/// Joins as an observer, receives states for `length` and evaluates the link. If the server cannot be joined, the
/// verdict is bad.
Finding watch_link(ClientIoSettings settings, Duration length);

/// Runs a loop with a period of 1 ms for `length`, on a thread with the set-up of tandem-client's haptic thread.
/// Returns the findings about rights, idle processors and lateness.
std::vector<Finding> run_loop(int priority, Duration length);

/// Returns one line of text for each finding, followed by its remedy if there is one.
std::string doctor_text(const std::vector<Finding>& findings);
boost::json::object doctor_json(const std::vector<Finding>& findings);
/// Returns 1 if any finding is bad, otherwise 0.
int doctor_exit_code(const std::vector<Finding>& findings);

}  // namespace tandem::client
