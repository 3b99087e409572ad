#include "lab/results/results.hpp"

#include <charconv>

#include "client/app/parameters_json.hpp"
#include "lab/metrics/metrics.hpp"
#include "lab/report/csv.hpp"
#include "proto/drop_reason.hpp"

namespace tandem::lab {
namespace {

namespace json = boost::json;

// Lists only the drop reasons that occurred; proto/drop_reason.hpp lists all.
json::object drops_json(const proto::DropCounters& drops) {
  json::object result;
  for (std::size_t i = 0; i < static_cast<std::size_t>(proto::DropReason::kCount); ++i) {
    const auto reason = static_cast<proto::DropReason>(i);
    if (drops.count(reason) > 0) result[proto::name_of(reason)] = drops.count(reason);
  }
  return result;
}

json::object link_counters_json(const net::LinkCounters& counters) {
  return {{"sent", counters.sent},
          {"delivered", counters.delivered},
          {"lost", counters.lost},
          {"duplicated", counters.duplicated},
          {"queue_full", counters.queue_full}};
}

json::object parameters_json(const UserTrace& trace) {
  const ExperimentUser& user = trace.user;
  return {{"role", role_name(user.role)},
          {"device", user.device.name},
          {"hand", user.hand_name},
          {"hand_parameters", client::to_json(user.hand_parameters)},
          {"hand_seed", trace.hand_seed},
          {"pipeline", pipeline_json(user.pipeline)},
          {"transport", user.state_over_tcp ? "tcp" : "udp"},
          {"tick_phase_ms", to_milliseconds(user.tick_phase)},
          {"uplink", link_json(user.up)},
          {"downlink", link_json(user.down)}};
}

json::object user_json(const UserTrace& user) {
  json::object metrics;
  for (const UserMetric& metric : user_metrics()) metrics[metric.name] = metric.value_of(user);
  haptics::SafetyFaults safety_faults = 0;
  for (const TickSample& tick : user.ticks) safety_faults |= tick.safety_faults;
  return {{"name", user.user.name},
          {"outcome", user.stayed_connected ? "completed" : "lost"},
          {"why_lost", user.why_disconnected},
          {"parameters", parameters_json(user)},
          {"metrics", metrics},
          {"safety_faults_seen", haptics::describe_safety_faults(safety_faults)},
          {"datagrams_sent", user.session.datagrams_sent},
          {"datagrams_received", user.session.datagrams_received},
          {"received_drops", drops_json(user.session.received_drops)},
          {"sent_drops", drops_json(user.session.sent_drops)},
          {"uplink", link_counters_json(user.link_up)},
          {"downlink", link_counters_json(user.link_down)}};
}

json::array bodies_json(const SessionTrace& trace) {
  json::array bodies;
  for (std::size_t i = 0; i < trace.body_names.size(); ++i) {
    if (!trace.body_can_move[i]) continue;
    std::vector<double> travel_m = body_travel_m(trace, i);
    if (travel_m.empty()) travel_m.push_back(0);
    bodies.push_back(json::object{{"name", trace.body_names[i]},
                                  {"travel_max_m", *std::max_element(travel_m.begin(), travel_m.end())},
                                  {"travel_final_m", travel_m.back()}});
  }
  return bodies;
}

json::object server_json(const SessionTrace& trace) {
  return {{"room_steps", trace.room_steps},
          {"joined_after_ms", to_milliseconds(trace.joined_after)},
          {"tick_faults_seen", describe_faults(trace.faults_seen)},
          {"datagrams_sent", trace.hub.datagrams_sent},
          {"datagrams_received", trace.hub.datagrams_received},
          {"received_drops", drops_json(trace.hub.received_drops)},
          {"sent_drops", drops_json(trace.hub.sent_drops)},
          {"bodies_thinned", trace.hub.bodies_thinned},
          {"field_kernel", trace.field_kernel}};
}

// Appends a cell with nine significant digits, as in the traces of clients (client/app/trace.cpp).
void append_cell(double value, std::string& line) {
  char text[32];
  line += ',';
  line.append(text, std::to_chars(text, text + sizeof text, value, std::chars_format::general, 9).ptr);
}

}  // namespace

bool is_complete(const SessionTrace& trace) {
  for (const UserTrace& user : trace.users) {
    if (!user.stayed_connected) return false;
  }
  return true;
}

json::object results_json(const Experiment& experiment, const SessionTrace& trace) {
  json::array users;
  for (const UserTrace& user : trace.users) users.push_back(user_json(user));
  return {{"experiment", experiment.name},
          {"description", experiment.description},
          {"scene", experiment.scene.stem().string()},
          {"duration_s", to_seconds(experiment.duration)},
          {"seed", experiment.seed},
          {"server_phase_ms", to_milliseconds(experiment.server_phase)},
          {"outcome", is_complete(trace) ? "completed" : "a user was lost"},
          {"users", users},
          {"bodies", bodies_json(trace)},
          {"server", server_json(trace)}};
}

std::string bodies_csv(const SessionTrace& trace) {
  std::string text = "t_s,field_energy_kj_per_mol";
  for (std::size_t i = 0; i < trace.body_names.size(); ++i) {
    if (!trace.body_can_move[i]) continue;
    for (const char* part : {"_x_m", "_y_m", "_z_m", "_qw", "_qx", "_qy", "_qz"}) {
      text.append(",").append(csv_name(trace.body_names[i])).append(part);
    }
  }
  for (const BodiesSample& sample : trace.bodies) {
    text += '\n';
    std::string line;
    append_cell(to_seconds(sample.time), line);
    append_cell(sample.field_energy_kj_per_mol, line);
    for (std::size_t i = 0; i < sample.X_WB.size(); ++i) {
      if (!trace.body_can_move[i]) continue;
      const Pose& X = sample.X_WB[i];
      for (const double value : {X.p.x(), X.p.y(), X.p.z(), X.q.w(), X.q.x(), X.q.y(), X.q.z()}) {
        append_cell(value, line);
      }
    }
    text.append(line, 1);
  }
  text += '\n';
  return text;
}

}  // namespace tandem::lab
