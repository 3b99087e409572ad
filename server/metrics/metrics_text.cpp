#include "server/metrics/metrics_text.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <concepts>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <string_view>
#include <utility>

namespace tandem::server {
namespace {

constexpr std::array kRoles{"manipulator", "observer", "operator"};  // indexed by UserRole

/// Bucket bounds of the histograms of step times and lateness, and of round trips [s].
constexpr std::array kStepBounds_s{25e-6,  50e-6, 100e-6, 200e-6, 300e-6, 500e-6, 700e-6, 1e-3,
                                   1.5e-3, 2e-3,  3e-3,   5e-3,   10e-3,  25e-3,  100e-3, 1.0};
constexpr std::array kRoundTripBounds_s{0.5e-3, 1e-3,   2e-3,   5e-3,   10e-3,  20e-3,  30e-3, 50e-3,
                                        75e-3,  100e-3, 150e-3, 200e-3, 300e-3, 500e-3, 1.0,   2.0};

std::string text_of(std::integral auto value) {
  return std::to_string(value);
}
/// Formats a number as the shortest text that parses to the same number.
std::string text_of(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general).ptr;
  return {text.data(), end};
}

std::string escaped(std::string_view value) {
  std::string text;
  for (const char c : value) {
    if (c == '\\' || c == '"') text += '\\';
    text += c == '\n' ? std::string("\\n") : std::string(1, c);
  }
  return text;
}

/// Removes `prefix` and converts the rest to lower case: "ERROR_BAD_TOKEN" with the prefix "ERROR_" gives "bad_token".
std::string plain(std::string name, std::string_view prefix) {
  if (name.starts_with(prefix)) name.erase(0, prefix.size());
  for (char& c : name) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return name;
}

using Labels = std::initializer_list<std::pair<std::string_view, std::string_view>>;

/// Builds the text of the metrics, one metric family after the other.
class Page {
 public:
  /// Begins a family. The samples added next belong to it.
  void family(std::string_view name, std::string_view type, std::string_view help) {
    name_ = name;
    text_.append("# HELP ").append(name).append(" ").append(help).append("\n# TYPE ");
    text_.append(name).append(" ").append(type).append("\n");
  }
  void sample(const Labels& labels, auto value, std::string_view suffix = "") {
    text_.append(name_).append(suffix);
    std::string_view before = "{";
    for (const auto& [label, of] : labels) {
      text_.append(before).append(label).append("=\"").append(escaped(of)).append("\"");
      before = ",";
    }
    text_.append(labels.size() > 0 ? "} " : " ").append(text_of(value)).append("\n");
  }
  /// Adds a family with one sample.
  void single(std::string_view name, std::string_view type, std::string_view help, auto value) {
    family(name, type, help);
    sample({}, value);
  }
  void histogram(const Histogram& histogram, std::span<const double> bounds_s, std::string_view room = "") {
    const auto bucket = [&](std::string_view bound, std::uint64_t count) {
      room.empty() ? sample({{"le", bound}}, count, "_bucket")
                   : sample({{"room", room}, {"le", bound}}, count, "_bucket");
    };
    for (const double bound_s : bounds_s)
      bucket(text_of(bound_s), histogram.count() - histogram.count_above(from_seconds(bound_s)));
    bucket("+Inf", histogram.count());
    const auto whole = [&](auto value, std::string_view suffix) {
      room.empty() ? sample({}, value, suffix) : sample({{"room", room}}, value, suffix);
    };
    whole(to_seconds(histogram.sum()), "_sum");
    whole(histogram.count(), "_count");
  }
  std::string finish() { return std::move(text_); }

 private:
  std::string text_;
  std::string name_;
};

/// Adds a family with one sample per room.
template <class Value>
void each_room(Page& page, const MetricsSnapshot& snapshot, std::string_view name, std::string_view type,
               std::string_view help, const Value& value) {
  page.family(name, type, help);
  for (const RoomFigures& room : snapshot.rooms) page.sample({{"room", room.name}}, value(room));
}

void add_users(Page& page, const MetricsSnapshot& snapshot) {
  const HubCounters& hub = snapshot.server.hub;
  page.family("tandem_users", "gauge", "Users who have joined.");
  for (std::size_t i = 0; i < snapshot.rooms.size(); ++i) {
    for (std::size_t role = 0; role < kRoles.size(); ++role)
      page.sample({{"room", snapshot.rooms[i].name}, {"role", kRoles[role]}}, snapshot.server.users[i][role]);
  }
  page.single("tandem_connections", "gauge", "TCP connections that are open, joined or not.",
              snapshot.server.connections);
  page.single("tandem_joins_total", "counter", "Users who have joined, each time.", hub.joins);
  page.family("tandem_refusals_total", "counter", "Connections and joins that were refused, by reason.");
  for (std::size_t code = 1; code < hub.refusals.size(); ++code)
    page.sample({{"reason", plain(wire::ErrorCode_Name(static_cast<int>(code)), "ERROR_")}}, hub.refusals[code]);
  page.family("tandem_disconnects_total", "counter", "Connections that have ended, by reason.");
  for (std::size_t reason = 1; reason < hub.ends.size(); ++reason) {
    const std::string name = plain(wire::DisconnectReason_Name(static_cast<int>(reason)), "DISCONNECT_");
    page.sample({{"reason", name}}, hub.ends[reason]);
  }
  page.single("tandem_tls_failures_total", "counter", "Connections whose TLS handshake failed, or whose TLS broke.",
              snapshot.server.failed_handshakes);
}

void add_datagrams(Page& page, const HubCounters& hub) {
  using proto::DropReason;
  page.family("tandem_datagrams_received_total", "counter", "Datagrams received, by result.");
  std::uint64_t dropped = 0;
  for (std::size_t i = 1; i < static_cast<std::size_t>(DropReason::kCount); ++i) {
    const auto reason = static_cast<DropReason>(i);
    // Reasons that concern only sending are skipped. kOverwritten is skipped because the datagram was accepted.
    if (reason == DropReason::kOverwritten || reason == DropReason::kSendFailed || reason == DropReason::kSimulatedLoss)
      continue;
    page.sample({{"result", proto::name_of(reason)}}, hub.received_drops.count(reason));
    dropped += hub.received_drops.count(reason);
  }
  page.sample({{"result", "accepted"}}, hub.datagrams_received - dropped);
  page.single("tandem_inputs_overwritten_total", "counter", "Inputs that a newer one replaced before a step used them.",
              hub.received_drops.count(DropReason::kOverwritten));
  page.single("tandem_datagrams_sent_total", "counter", "States that were sent.", hub.datagrams_sent);
  page.family("tandem_states_unsent_total", "counter",
              "States that were not sent: replaced by a newer one, refused by the socket, suppressed (deadband), too "
              "many for the link.");
  page.sample({{"reason", "overwritten"}}, hub.sent_drops.count(DropReason::kOverwritten));
  page.sample({{"reason", "send_failed"}}, hub.sent_drops.count(DropReason::kSendFailed));
  page.sample({{"reason", "suppressed"}}, hub.updates_suppressed);
  page.sample({{"reason", "paced"}}, hub.updates_paced);
  page.single("tandem_state_items_thinned_total", "counter", "Bodies and users that did not fit into a state.",
              hub.bodies_thinned);
  page.family("tandem_round_trip_seconds", "histogram",
              "Time from the send of a state to the first input that answers it, less the time at the client.");
  page.histogram(hub.round_trip, kRoundTripBounds_s);
}

void add_timing(Page& page, const MetricsSnapshot& snapshot) {
  using Room = const RoomFigures&;
  each_room(page, snapshot, "tandem_room_awake", "gauge", "1 while a user is in the room, or bodies are not back yet.",
            [](Room room) { return room.is_awake ? 1 : 0; });
  each_room(page, snapshot, "tandem_room_period_seconds", "gauge", "Time that a step has.",
            [](Room room) { return to_seconds(room.period); });
  each_room(page, snapshot, "tandem_room_steps_total", "counter", "Steps.",
            [](Room room) { return room.timing.steps; });
  each_room(page, snapshot, "tandem_room_overruns_total", "counter", "Steps that ended after the next deadline.",
            [](Room room) { return room.timing.overruns; });
  each_room(page, snapshot, "tandem_room_missed_deadlines_total", "counter", "Deadlines that were skipped.",
            [](Room room) { return room.timing.missed; });
  each_room(page, snapshot, "tandem_room_slow_steps_total", "counter",
            "Steps while the room did not keep 90 % of its rate, and the second after.",
            [](Room room) { return room.timing.slow; });
  page.family("tandem_room_step_seconds", "histogram", "Duration of a step.");
  for (Room room : snapshot.rooms) page.histogram(room.timing.step_time, kStepBounds_s, room.name);
  page.family("tandem_room_lateness_seconds", "histogram", "How late a step began.");
  for (Room room : snapshot.rooms) page.histogram(room.timing.lateness, kStepBounds_s, room.name);
}

void add_physics(Page& page, const MetricsSnapshot& snapshot) {
  page.family("tandem_room_fault_steps_total", "counter",
              "Steps with a fault; coupling_saturated: a force was at its limit, tool_energy_limited: passivity "
              "control acted.");
  for (const RoomFigures& room : snapshot.rooms) {
    for (std::size_t bit = 0; bit < kTickFaultBits; ++bit)
      page.sample({{"room", room.name}, {"fault", tick_fault_names(TickFaults{1} << bit).front()}},
                  room.fault_steps[bit]);
  }
  each_room(page, snapshot, "tandem_room_passivity_dissipated_joules_total", "counter",
            "Energy that passivity control removed from the motion of tools.",
            [](const RoomFigures& room) { return room.braked_j; });
  each_room(page, snapshot, "tandem_room_events_lost_total", "counter",
            "Answers to grabs and releases that found no place.",
            [](const RoomFigures& room) { return room.events_lost; });
}

void add_disk(Page& page, const MetricsSnapshot& snapshot) {
  using Room = const RoomFigures&;
  const bool is_recorded = std::ranges::any_of(snapshot.rooms, &RoomFigures::is_recorded);
  if (is_recorded) {
    each_room(page, snapshot, "tandem_recording_bytes_total", "counter", "Bytes written to recordings.",
              [](Room room) { return room.recorded_bytes; });
    each_room(page, snapshot, "tandem_recording_messages_lost_total", "counter",
              "Messages of recordings that could not be written.",
              [](Room room) { return room.recorded_messages_lost; });
    each_room(page, snapshot, "tandem_recording_steps_lost_total", "counter",
              "Steps that are not recorded, since their recorder did not keep up.",
              [](Room room) { return room.recorded_steps_lost; });
  }
  if (!snapshot.has_checkpoint) return;
  page.single("tandem_checkpoint_writes_total", "counter", "Checkpoints written.", snapshot.checkpoint_writes);
  page.single("tandem_checkpoint_failures_total", "counter", "Checkpoints that could not be written.",
              snapshot.checkpoint_failures);
}

}  // namespace

std::string metrics_text(const MetricsSnapshot& snapshot) {
  Page page;
  page.family("tandem_build_info", "gauge", "1, with the version.");
  page.sample({{"version", TANDEM_VERSION}}, 1);
  page.single("tandem_ready", "gauge", "1 while /readyz reports that the server is ready.", snapshot.is_ready ? 1 : 0);
  page.single("tandem_healthy", "gauge", "1 while /healthz reports that the server is healthy.",
              snapshot.is_healthy ? 1 : 0);
  add_users(page, snapshot);
  add_datagrams(page, snapshot.server.hub);
  add_timing(page, snapshot);
  add_physics(page, snapshot);
  add_disk(page, snapshot);
  return page.finish();
}

std::string process_metrics_text() {
  Page page;
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  page.single("process_cpu_seconds_total", "counter", "User and system processor time [s].",
              seconds(usage.ru_utime) + seconds(usage.ru_stime));
  std::uint64_t virtual_pages = 0, resident_pages = 0;
  std::ifstream("/proc/self/statm") >> virtual_pages >> resident_pages;
  const auto page_bytes = static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  page.single("process_virtual_memory_bytes", "gauge", "Virtual memory.", virtual_pages * page_bytes);
  page.single("process_resident_memory_bytes", "gauge", "Resident memory.", resident_pages * page_bytes);
  std::error_code error;
  std::uint64_t descriptors = 0;
  for (auto entry = std::filesystem::directory_iterator("/proc/self/fd", error);
       !error && entry != std::filesystem::directory_iterator(); entry.increment(error))
    ++descriptors;
  page.single("process_open_fds", "gauge", "Open file descriptors.", descriptors);
  return page.finish();
}

}  // namespace tandem::server
