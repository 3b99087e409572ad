// See summary.hpp.
#include "client/app/summary.hpp"

#include <cmath>

#include "client/app/parameters_json.hpp"
#include "client/session/scene_from_wire.hpp"
#include "common/base/tick_faults.hpp"

namespace tandem::client {
namespace {

namespace json = boost::json;

json::object quantiles_us(const Histogram& histogram) {
  const auto us = [&histogram](double q) { return to_seconds(histogram.quantile(q)) * 1e6; };
  return {{"p50", us(0.5)}, {"p99", us(0.99)}, {"p999", us(0.999)}, {"max", us(1)}};
}

json::array array_of(const std::vector<std::string>& texts) {
  json::array result;
  for (const std::string& text : texts) result.emplace_back(text);
  return result;
}

double root_mean(double square_sum, std::uint64_t count) {
  return count > 0 ? std::sqrt(square_sum / static_cast<double>(count)) : 0.0;
}

json::object drops_of(const proto::DropCounters& counters) {
  json::object result;
  for (std::size_t i = 1; i < static_cast<std::size_t>(proto::DropReason::kCount); ++i) {
    const auto reason = static_cast<proto::DropReason>(i);
    if (counters.count(reason) > 0) result[proto::name_of(reason)] = counters.count(reason);
  }
  return result;
}

json::object link_of(const net::LinkCounters& link) {
  return {{"sent", link.sent},
          {"delivered", link.delivered},
          {"lost", link.lost},
          {"duplicated", link.duplicated},
          {"queue_full", link.queue_full}};
}

/// Adds the settings of the run. Together with the scene and the program version they suffice to repeat the run.
void add_setup(const RunSummary& s, json::object& out) {
  const ClientOptions& options = s.options;
  const SessionSettings& session = options.io.client.session;
  out["program"] = "tandem-client";
  out["version"] = TANDEM_VERSION;
  out["room"] = s.io.joined ? json::value(s.io.room) : json::value();
  out["scene"] = s.io.joined ? json::value(s.io.joined->scene().name()) : json::value();
  out["notes"] = json::array();
  if (s.io.joined) {
    for (const std::string& note : shown_notes(*s.io.joined)) out["notes"].as_array().emplace_back(note);
  }
  out["user"] = session.user_name;
  out["role"] = role_name(session.role);
  out["transport"] = session.state_over_tcp ? "tcp" : "udp";
  out["stage"] = options.stage.name;
  out["predictor"] = options.stage.predictor;
  out["passivity"] = options.stage.passivity;
  out["wave_impedance"] = {{"linear_n_s_per_m", options.stage.wave.linear_n_s_per_m},
                           {"angular_n_m_s_per_rad", options.stage.wave.angular_n_m_s_per_rad}};
  out["driver"] = options.device.name;
  out["device"] = options.device.profile.name;
  out["hand"] = options.device.hand;
  out["hand_parameters"] = to_json(options.device.hand_parameters);
  out["seed"] = options.seed;
  out["link_parameters"] = nullptr;
  if (options.io.links) {
    out["link_parameters"] = {{"up", to_json(options.io.links->up)}, {"down", to_json(options.io.links->down)}};
  }
}

json::value finite_or_null(double value) {
  return std::isfinite(value) ? json::value(value) : json::value();
}

void add_coupling_check(const RunSummary& s, json::object& out) {
  json::array findings;
  for (const haptics::StabilityFinding& finding : s.coupling_findings) {
    findings.emplace_back(json::object{{"is_unstable", finding.verdict == haptics::StabilityVerdict::kUnstable},
                                       {"parameter", finding.parameter},
                                       {"value", finite_or_null(finding.value)},
                                       {"rendered_value", finite_or_null(finding.rendered_value)},
                                       {"remedy", finite_or_null(finding.remedy)},
                                       {"remedy_damping", finite_or_null(finding.remedy_damping)},
                                       {"spectral_radius", finite_or_null(finding.spectral_radius)},
                                       {"text", finding.text}});
  }
  out["coupling_check"] = {{"is_refused", s.io.coupling_check.is_refused}, {"findings", std::move(findings)}};
}

void add_loop(const RunSummary& s, json::object& out) {
  out["ticks_run"] = s.loop.ticks_run;
  out["ticks_expected"] = s.loop.ticks_expected;
  out["tick_rate_hz"] = s.loop.tick_rate_hz;
  out["lateness_us"] = quantiles_us(s.loop.lateness);
  out["late_by_1_ms_share"] = s.loop.lateness.share_above(std::chrono::milliseconds(1));
  out["tick_us"] = quantiles_us(s.loop.tick);
  out["missed"] = s.loop.missed;
  out["throttle_suspects"] = s.loop.throttle_suspects;
  out["keeps_awake"] = s.loop.keeps_awake;
  out["realtime_not_granted"] = array_of(s.realtime_not_granted);
  out["trace_overflows"] = s.trace_overflows;
  out["became_quiet"] = s.loop.became_quiet;
}

/// Returns the state of the session as JSON. An active session that has received no state is reported as "silent".
json::object status_of(const ClientIoSnapshot& io, const SessionSettings& session) {
  const bool is_silent = io.status.state == SessionState::kActive && !io.has_state;
  if (is_silent) return {{"state", "silent"}, {"why", problem_at_end(io, session)}};
  return {{"state", name_of(io.status.state)}, {"why", io.status.why}};
}

void add_network(const ClientIoSnapshot& io, json::object& out) {
  out["reconnects"] = io.counters.reconnects;
  const auto known_ms = [&io](Duration value) {
    return io.clock.is_known ? json::value(to_milliseconds(value)) : json::value();
  };
  out["round_trip_ms"] = {{"newest", known_ms(io.clock.round_trip)},
                          {"minimum", known_ms(io.clock.minimum_round_trip)}};
  out["clock_offset_ms"] = known_ms(io.clock.offset);
  out["datagrams"] = {{"sent", io.counters.datagrams_sent},
                      {"received", io.counters.datagrams_received},
                      {"suppressed", io.counters.updates_suppressed},
                      {"paced", io.counters.updates_paced}};
  out["bytes"] = {{"sent", io.counters.bytes_sent}, {"received", io.counters.bytes_received}};
  out["drops"] = {{"sent", drops_of(io.counters.sent_drops)}, {"received", drops_of(io.counters.received_drops)}};
  out["links"] = {{"up", link_of(io.links.up)},
                  {"down", link_of(io.links.down)},
                  {"control_up", link_of(io.links.control_up)},
                  {"control_down", link_of(io.links.control_down)}};
  out["asset_bytes"] = io.asset_bytes;
  out["events_dropped"] = io.events_dropped;
  const auto seconds = [](const std::optional<Duration>& after) {
    return after ? json::value(to_seconds(*after)) : json::value();
  };
  out["local_after_s"] = seconds(io.rendering.local_after);
  out["full_local_after_s"] = seconds(io.rendering.full_local_after);
}

void add_forces(const RunSummary& s, json::object& out) {
  const HapticCounters& c = s.counters;
  out["force_n"] = {{"rms", root_mean(c.force_square_sum, c.ticks)}, {"max", c.force_max_n}};
  out["torque_n_m"] = {{"rms", root_mean(c.torque_square_sum, c.ticks)}, {"max", c.torque_max_n_m}};
  out["force_limit_n"] = s.device.force_limit_n;
  out["torque_limit_n_m"] = s.device.torque_limit_n_m;
  // Checks the displayed forces too, not only the computed ones: a single displayed NaN makes these sums of squares
  // NaN.
  out["all_forces_finite"] =
      c.not_finite_ticks == 0 && std::isfinite(c.force_square_sum) && std::isfinite(c.torque_square_sum);
  out["not_finite_ticks"] = c.not_finite_ticks;
  out["clamped_fraction"] = c.ticks > 0 ? static_cast<double>(c.clamped_ticks) / static_cast<double>(c.ticks) : 0.0;
  out["slew_limited_ticks"] = c.slew_limited_ticks;
  out["silent_ticks"] = c.silent_ticks;
  out["not_displaying_ticks"] = c.not_displaying_ticks;
  out["invalid_samples"] = c.invalid_samples;
  out["write_failures"] = c.write_failures;
  out["safety_faults"] = array_of(haptics::safety_fault_names(c.faults_seen));
  out["server_tick_faults"] = array_of(tick_fault_names(s.run.server_tick_faults_seen()));
  out["passivity_withheld_j"] = c.passivity_withheld_j;
  out["passivity_limited_ticks"] = c.passivity_limited_ticks;
  out["bad_energy_reports"] = c.bad_energy_reports;
  out["energy_to_hand_j"] = c.energy_to_hand_j;
  out["energy_from_hand_j"] = c.energy_from_hand_j;
}

/// Adds the statistics of a range of ticks, as fields whose names begin with `prefix`. They are null for an empty
/// range.
void add_stretch(const StretchStatistics& stretch, const std::string& prefix, json::object& out) {
  const auto add = [&](const char* name, double value) {
    out[prefix + name] = stretch.ticks() > 0 ? json::value(value) : json::value();
  };
  out[prefix + "ticks"] = stretch.ticks();
  add("hand_speed_max_m_per_s", stretch.hand_speed_max_m_per_s());
  add("hand_speed_rms_m_per_s", stretch.hand_speed_rms_m_per_s());
  add("force_mean_n", stretch.force_mean_n());
  add("force_mean_vector_n", stretch.force_mean_vector_n());
  add("force_max_n", stretch.force_max_n());
  add("torque_mean_n_m", stretch.torque_mean_n_m());
  add("torque_mean_vector_n_m", stretch.torque_mean_vector_n_m());
  add("torque_max_n_m", stretch.torque_max_n_m());
  add("holding_fraction", stretch.holding_fraction());
}

json::array phases_of(const RunReport& run) {
  json::array result;
  for (const PhaseReport& phase : run.phases()) {
    json::object entry{{"name", phase.name}, {"duration_s", to_seconds(phase.duration)}};
    add_stretch(phase.whole, "", entry);
    add_stretch(phase.settled, "settled_", entry);
    result.emplace_back(std::move(entry));
  }
  return result;
}

json::array silences_of(const RunReport& run) {
  json::array result;
  for (const Silence& silence : run.silences()) {
    json::object entry{{"last_arrival_s", to_seconds(silence.last_arrival)}, {"why", silence.why}};
    entry["zero_after_ms"] = silence.zero_after ? json::value(to_milliseconds(*silence.zero_after)) : json::value();
    result.emplace_back(std::move(entry));
  }
  return result;
}

/// Returns the result of the room's game as JSON; null if the scene has no game.
json::value game_of(const ClientIoSnapshot& io) {
  if (!io.game || !io.joined) return nullptr;
  const wire::Game& game = io.joined->scene().game();
  const wire::GameState& state = io.game->state;
  json::array events;
  for (const wire::GameEvent& event : io.game->events) {
    events.emplace_back(json::object{{"kind", wire::GameEvent::Kind_Name(event.kind())},
                                     {"level", event.level() + 1},
                                     {"goal", event.goal() + 1},
                                     {"score", event.score()},
                                     {"step", event.step()},
                                     {"by_time", event.by_time()},
                                     {"text", text_of(event, game)}});
  }
  json::array signals;
  for (int i = 0; i < std::min(game.signals_size(), state.signals_size()); ++i) {
    const wire::SignalReport& signal = state.signals(i);
    signals.emplace_back(json::object{{"name", game.signals(i).name()},
                                      {"fresh", signal.fresh()},
                                      {"value", signal.value()},
                                      {"confidence", signal.confidence()},
                                      {"age_s", signal.age_s()}});
  }
  return json::object{{"title", game.title()},          {"phase", wire::GameState::Phase_Name(state.phase())},
                      {"level", state.level() + 1},     {"score", state.score()},
                      {"elapsed_s", state.elapsed_s()}, {"events", std::move(events)},
                      {"signals", std::move(signals)}};
}

json::value watched_of(const RunSummary& s) {
  if (!s.watched.is_valid() || !s.run.has_seen_body()) return nullptr;
  return json::object{{"id", s.watched.value},
                      {"name", s.watched_name},
                      {"displacement_m", s.run.body_displacement_m()},
                      {"rotation_rad", s.run.body_rotation_rad()}};
}

}  // namespace

std::vector<std::string> shown_notes(const wire::Joined& joined) {
  constexpr int kMaxNotes = 20;
  std::vector<std::string> notes;
  for (int i = 0; i < std::min(joined.notes_size(), kMaxNotes); ++i) notes.push_back(printable(joined.notes(i)));
  return notes;
}

std::string joined_line(const wire::Joined& joined) {
  const std::string scene = "joined " + printable(joined.scene().name()) + " as user " + std::to_string(joined.user());
  if (!has_tool(joined.role())) return scene + ", an observer";
  return scene + ", with tool " + printable(joined.scene().tools(static_cast<int>(joined.tool())).name());
}

std::string missing_of(const devices::DeviceSpec& device) {
  if (device.has_torque()) return {};
  const std::string name = "device " + device.name;
  if (!device.has_force()) return name + " shows no force: you move and see, and feel nothing";
  const std::string turning = device.sensed_rotations > 0 ? "turns with your hand" : "keeps its orientation";
  return name + " shows no torque: you feel forces in three directions, and your tool " + turning;
}

BodyId watched_body(const wire::Joined& joined) {
  const wire::Scene& scene = joined.scene();
  const bool may_hold = has_tool(joined.role()) && joined.tool() < static_cast<std::uint32_t>(scene.tools_size());
  const std::string held = may_hold ? scene.tools(static_cast<int>(joined.tool())).holds() : std::string();
  for (int i = 0; i < scene.bodies_size() && !held.empty(); ++i) {
    if (scene.bodies(i).name() == held) return body_id_at(static_cast<std::size_t>(i));
  }
  for (int i = 0; i < joined.scene().bodies_size(); ++i) {
    if (joined.scene().bodies(i).graspable()) return body_id_at(static_cast<std::size_t>(i));
  }
  return {};
}

std::string status_line(const ClientIoSnapshot& io, Duration length, const TickRecord& newest) {
  char round_trip[16] = "     -";  // shown if the session is not active
  if (io.status.state == SessionState::kActive) {
    std::snprintf(round_trip, sizeof round_trip, "%6.1f", to_seconds(io.clock.round_trip) * 1e3);
  }
  char line[512];
  std::snprintf(line, sizeof line,
                "%6.1f s  %-10s round trip %s ms  state age %6.1f ms  force %5.2f N  torque %6.3f N·m  safety %s\n",
                to_seconds(length), std::string(name_of(io.status.state)).c_str(), round_trip,
                to_seconds(newest.state_age) * 1e3, newest.displayed_on_hand_D.f.norm(),
                newest.displayed_on_hand_D.t.norm(), haptics::describe_safety_faults(newest.safety_faults).c_str());
  return line;
}

std::string problem_at_end(const ClientIoSnapshot& io, const SessionSettings& session) {
  if (io.status.state != SessionState::kActive) return "the session was lost and not regained: " + io.status.why;
  if (io.has_state) return {};
  return "joined, but no state was received from the server before the end" +
         std::string(session.state_over_tcp ? "" : "; is UDP blocked? state can go over TCP instead (--transport tcp)");
}

boost::json::object to_json(const RunSummary& summary) {
  json::object out;
  add_setup(summary, out);
  out["duration_s"] = to_seconds(summary.run.length());
  add_coupling_check(summary, out);
  out["status"] = status_of(summary.io, summary.options.io.client.session);
  add_network(summary.io, out);
  add_loop(summary, out);
  add_forces(summary, out);
  out["watched_body"] = watched_of(summary);
  out["game"] = game_of(summary.io);
  out["phases"] = phases_of(summary.run);
  out["silences"] = silences_of(summary.run);
  return out;
}

}  // namespace tandem::client
