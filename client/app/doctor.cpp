// See doctor.hpp.
#include "client/app/doctor.hpp"

#include <time.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <memory>
#include <thread>
#include <utility>

#include "common/base/json.hpp"
#include "common/haptics/safety.hpp"
#include "common/realtime/keep_awake.hpp"
#include "common/realtime/realtime.hpp"
#include "devices/sim/sim_device.hpp"

namespace tandem::client {
namespace {

using std::chrono::milliseconds;

constexpr Duration kPeriod = milliseconds(1);
constexpr Duration kNearlyLate = std::chrono::microseconds(500);
constexpr Duration kLongRoundTrip = milliseconds(100), kUnknownRoundTrip = milliseconds(300);
constexpr Duration kSwing = milliseconds(30), kGap = milliseconds(50);
constexpr Duration kMaxJoin = std::chrono::seconds(10);
constexpr Duration kDoctorPollPeriod = milliseconds(2);

std::string ms_text(Duration duration) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.2f ms", to_milliseconds(duration));
  return text.data();
}

Finding device_finding(const devices::DeviceKind& kind, const devices::FoundDevice& found) {
  Finding finding;
  finding.check = "devices";
  finding.numbers = {{"device", kind.name}, {"where", found.where}};
  finding.text = std::string(kind.name) + ", " + found.where;
  finding.verdict = found.problem.empty() ? Verdict::kGood : Verdict::kBad;
  finding.text += found.problem.empty() ? ": can be opened" : ": cannot be opened";
  finding.remedy = found.problem;
  return finding;
}

Finding not_joined(const std::string& why) {
  return {"link",
          Verdict::kBad,
          "the server could not be joined: " + why,
          "start it (tandem-server), check --server and --room, and that nothing blocks its TCP and UDP port",
          {}};
}

/// Waits until the client has joined, the session has ended, or kMaxJoin has passed. Returns whether the client has
/// joined.
bool wait_for_join(const ClientIo& io) {
  const SteadyClock clock;
  const LocalTime give_up = clock.now() + kMaxJoin;
  ClientIoSnapshot now = io.snapshot();
  while (now.status.state != SessionState::kActive && now.status.state != SessionState::kEnded &&
         clock.now() < give_up) {
    std::this_thread::sleep_for(kDoctorPollPeriod);
    now = io.snapshot();
  }
  return now.status.state == SessionState::kActive;
}

LinkSample sample_link(const ClientIo& io, Duration length) {
  const SteadyClock clock;
  const LocalTime end = clock.now() + length;
  LinkSample link;
  const std::uint64_t before = io.snapshot().counters.datagrams_received;
  std::uint64_t received = before;
  LocalTime arrived = clock.now();
  bool has_clock = false;
  for (LocalTime now = arrived; now < end; now = clock.now()) {
    const ClientIoSnapshot seen = io.snapshot();
    if (seen.counters.datagrams_received != received) arrived = now;
    received = seen.counters.datagrams_received;
    link.longest_gap = std::max(link.longest_gap, now - arrived);
    if (seen.clock.is_known) {
      link.round_trip_min = seen.clock.minimum_round_trip;
      link.round_trip_max = has_clock ? std::max(link.round_trip_max, seen.clock.round_trip) : seen.clock.round_trip;
      has_clock = true;
    }
    std::this_thread::sleep_for(kDoctorPollPeriod);
  }
  link.states = received - before;
  return link;
}

Verdict worst(const std::vector<Finding>& findings) {
  Verdict verdict = Verdict::kGood;
  for (const Finding& finding : findings) verdict = std::max(verdict, finding.verdict);
  return verdict;
}

}  // namespace

std::string_view name_of(Verdict verdict) noexcept {
  constexpr std::array<std::string_view, 3> kNames{"good", "warning", "bad"};
  return kNames[static_cast<std::size_t>(verdict)];
}

std::vector<Finding> find_devices(const std::vector<devices::DeviceKind>& kinds) {
  std::vector<Finding> findings;
  for (const devices::DeviceKind& kind : kinds) {
    if (kind.find == nullptr) continue;
    for (const devices::FoundDevice& found : kind.find()) findings.push_back(device_finding(kind, found));
  }
  if (findings.empty()) {
    findings.push_back({"devices",
                        Verdict::kWarning,
                        "no device is plugged in",
                        "plug one in, or use the simulated hand: tandem-client --device sim",
                        {}});
  }
  return findings;
}

std::vector<Finding> judge_rights(const std::vector<std::string>& not_granted, int priority) {
  const std::string requested = "priority " + std::to_string(priority) + " and locked memory";
  if (not_granted.empty()) return {{"priority", Verdict::kGood, "this user may have " + requested, "", {}}};
  std::vector<Finding> findings;
  for (const std::string& line : not_granted) {
    const std::size_t colon = line.find(": ");
    const bool has_remedy = colon != std::string::npos;
    findings.push_back(
        {"priority", Verdict::kWarning, line.substr(0, colon), has_remedy ? line.substr(colon + 2) : "", {}});
  }
  return findings;
}

std::vector<Finding> judge_clocks(const std::filesystem::path& clocksource, Duration resolution) {
  std::string name;
  std::ifstream(clocksource) >> name;
  Finding clock{"clock", Verdict::kGood, "the kernel's clock is \"" + name + "\"", "", {{"clocksource", name}}};
  if (name.empty()) {
    clock.verdict = Verdict::kWarning;
    clock.text = "the kernel does not report its clock";
    clock.remedy = "check " + clocksource.string();
  } else if (name != "tsc" && name != "arch_sys_counter" && name != "kvm-clock") {
    clock.verdict = Verdict::kWarning;
    clock.text += ", which takes a microsecond and more to read";
    clock.remedy = "boot with tsc=reliable if the processor's counter is sound; see dmesg | grep -i tsc";
  }
  Finding timers{"timers", Verdict::kGood, "timers have high resolution", "", {}};
  timers.numbers["resolution_us"] = 1e6 * to_seconds(resolution);
  if (resolution > std::chrono::microseconds(1)) {
    timers.verdict = Verdict::kBad;
    timers.text = "timers are good to " + ms_text(resolution) + " only";
    timers.remedy = "use a kernel with CONFIG_HIGH_RES_TIMERS, as Debian's are, and boot without highres=off";
  }
  return {std::move(clock), std::move(timers)};
}

Finding judge_idle(bool gives_idle_to_host, bool has_priority, bool has_quota) {
  Finding finding;
  finding.check = "idle";
  const bool keeps_awake = gives_idle_to_host && has_priority && !has_quota;
  finding.numbers = {{"gives_idle_to_host", gives_idle_to_host}, {"keeps_awake", keeps_awake}};
  if (!gives_idle_to_host) {
    finding.text = "no host takes idle processors away";
    return finding;
  }
  finding.text =
      "this machine is virtual, and its host may take an idle processor away for a millisecond: tandem-client ";
  if (keeps_awake) {
    finding.text += "keeps the haptic thread's awake, which costs the host a processor's time (--keep-awake off: not)";
    return finding;
  }
  finding.verdict = Verdict::kWarning;
  if (has_quota) {
    finding.text += "does not keep the haptic thread's awake, as that would use up the quota of processor time here";
    finding.remedy = "lift the quota of the container or cgroup (cpu.max, docker run --cpus)";
  } else {
    finding.text += "keeps the haptic thread's awake only with a priority";
    finding.remedy =
        "allow this user the priority (see the check \"priority\"), or start tandem-client with --keep-awake on";
  }
  return finding;
}

Finding judge_lateness(const Histogram& lateness, std::uint64_t missed) {
  const Duration tail = lateness.quantile(0.999);
  Finding finding;
  finding.check = "lateness";
  finding.numbers = {{"p50_us", 1e6 * to_seconds(lateness.quantile(0.5))},
                     {"p99_us", 1e6 * to_seconds(lateness.quantile(0.99))},
                     {"p999_us", 1e6 * to_seconds(tail)},
                     {"max_us", 1e6 * to_seconds(lateness.max())},
                     {"ticks", lateness.count()},
                     {"missed", missed}};
  finding.text = "a loop of 1 kHz is late by " + ms_text(tail) + " in one tick of a thousand, by " +
                 ms_text(lateness.max()) + " at most, and missed " + std::to_string(missed) + " of " +
                 std::to_string(lateness.count() + missed);
  const bool is_bad = lateness.count() == 0 || tail >= kPeriod ||
                      lateness.max() >= haptics::SafetySettings{}.late_tick || missed * 1000 > lateness.count();
  if (is_bad || tail >= kNearlyLate) {
    finding.verdict = is_bad ? Verdict::kBad : Verdict::kWarning;
    finding.remedy =
        "grant the priority above, end other programs, plug in the power supply, choose the performance governor "
        "(cpupower frequency-set -g performance); in a virtual machine expect no better";
  }
  return finding;
}

Finding judge_link(const LinkSample& link) {
  const Duration swing = link.round_trip_max - link.round_trip_min;
  Finding finding;
  finding.check = "link";
  finding.numbers = {{"round_trip_min_ms", to_milliseconds(link.round_trip_min)},
                     {"round_trip_max_ms", to_milliseconds(link.round_trip_max)},
                     {"longest_gap_ms", to_milliseconds(link.longest_gap)},
                     {"states", link.states}};
  finding.text = "round trip " + ms_text(link.round_trip_min) + " to " + ms_text(link.round_trip_max) +
                 ", longest gap " + ms_text(link.longest_gap) + ", " + std::to_string(link.states) + " states";
  const bool is_bad = link.states == 0 || link.longest_gap >= haptics::SafetySettings{}.silence_start ||
                      link.round_trip_min > kUnknownRoundTrip;
  if (is_bad) {
    finding.verdict = Verdict::kBad;
    finding.remedy = link.states == 0
                         ? "UDP seems to be blocked: use tandem-client --transport tcp, or open the server's port"
                         : "use a cable instead of wireless, or a server that is nearer";
  } else if (link.round_trip_min > kLongRoundTrip || swing > kSwing || link.longest_gap > kGap) {
    finding.verdict = Verdict::kWarning;
    finding.remedy = "keep the stage local-model, which bears it; a cable or a nearer server would feel better";
  }
  return finding;
}

Finding watch_link(ClientIoSettings settings, Duration length) {
  settings.client.session.role = wire::ROLE_OBSERVER;
  settings.client.session.user_name = "doctor";
  devices::SimDevice hand(devices::SimDevice::default_spec(), {}, devices::named_hand_path("rest"), 1);
  ClientIo io(std::move(settings), hand);
  io.start();
  if (!wait_for_join(io)) {
    const std::string why = io.snapshot().status.why;
    return not_joined(why.empty() ? "it does not answer" : why);
  }
  return judge_link(sample_link(io, length));
}

std::vector<Finding> run_loop(int priority, Duration length) {
  std::vector<Finding> findings;
  std::thread loop([&] {
    findings = judge_rights(realtime::request_realtime(priority), priority);
    findings.push_back(
        judge_idle(realtime::gives_idle_to_host(), realtime::has_realtime_priority(), realtime::has_processor_quota()));
    const std::shared_ptr<const void> awake = realtime::should_keep_awake() ? realtime::keep_awake() : nullptr;
    const SteadyClock clock;
    const LocalTime end = clock.now() + length;
    realtime::PeriodicTimer timer(kPeriod, clock.now());
    while (timer.wait() < end) {
    }
    findings.push_back(judge_lateness(timer.lateness(), timer.missed()));
  });
  loop.join();
  return findings;
}

std::string doctor_text(const std::vector<Finding>& findings) {
  std::string text;
  for (const Finding& finding : findings) {
    text += std::string(name_of(finding.verdict)) + std::string(9 - name_of(finding.verdict).size(), ' ') +
            finding.check + std::string(10 - std::min<std::size_t>(9, finding.check.size()), ' ') + finding.text + "\n";
    if (!finding.remedy.empty()) text += std::string(19, ' ') + "→ " + finding.remedy + "\n";
  }
  return text;
}

boost::json::object doctor_json(const std::vector<Finding>& findings) {
  boost::json::array list;
  for (const Finding& finding : findings) {
    list.push_back(boost::json::object{{"check", finding.check},
                                       {"verdict", name_of(finding.verdict)},
                                       {"text", finding.text},
                                       {"remedy", finding.remedy},
                                       {"numbers", finding.numbers}});
  }
  return {{"verdict", name_of(worst(findings))}, {"findings", std::move(list)}};
}

int doctor_exit_code(const std::vector<Finding>& findings) {
  return worst(findings) == Verdict::kBad ? 1 : 0;
}

}  // namespace tandem::client
