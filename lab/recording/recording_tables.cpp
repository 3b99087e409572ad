#include "lab/recording/recording_tables.hpp"

#include <limits>
#include <utility>

#include "client/app/trace.hpp"
#include "client/recording/tick_codec.hpp"
#include "proto/recording/exact_state.hpp"
#include "proto/recording/recorded_files.hpp"
#include "proto/recording/schema.hpp"
#include "tandem/recording.pb.h"

namespace tandem::lab {
namespace {

/// Fills one row of a table. The first row also defines the names of the columns.
class Row {
 public:
  explicit Row(CsvTable& table) : table_(table) {}

  void number(const std::string& name, double value) {
    if (at_ == table_.columns.size()) {
      table_.names.push_back(name);
      table_.columns.emplace_back();
    }
    table_.columns[at_++].push_back(value);
  }
  void vector(const std::string& name, const std::string& unit, const Vec3& a) {
    for (const int i : {0, 1, 2}) number(name + "xyz"[i] + unit, a[i]);
  }
  void state(const std::string& of, const RigidState& state) {
    vector(of + "_p_", "_m", state.X.p);
    number(of + "_q_w", state.X.q.w());
    vector(of + "_q_", "", state.X.q.vec());
    vector(of + "_v_", "_m_per_s", state.V.v);
    vector(of + "_w_", "_rad_per_s", state.V.w);
  }

 private:
  CsvTable& table_;
  std::size_t at_ = 0;
};

class Tables {
 public:
  bool receive(const std::string& topic, const recording::Message& message) {
    if (begun_ns_ == 0) begun_ns_ = message.log_ns;
    if (topic == "/room") proto::require_recorded(message, room_);
    if (topic == "/step") read_step(message);
    if (topic == "/states") read_states(message);
    if (topic == "/tick") read_tick(message);
    if (topic == "/link") read_link(message);
    return true;
  }
  void parse_ticks() {
    if (std::exchange(waiting_, 0) == 0) return;
    CsvTable rows = parse_csv(client::trace_header() + "\n" + std::exchange(lines_, {}), "ticks");
    CsvTable& table = tables["ticks"];
    if (table.names.empty()) {
      table = std::move(rows);
      return;
    }
    for (std::size_t i = 0; i < rows.columns.size(); ++i) {
      table.columns[i].insert(table.columns[i].end(), rows.columns[i].begin(), rows.columns[i].end());
    }
  }

  std::map<std::string, CsvTable> tables;

 private:
  static constexpr int kLinesAtOnce = 1000;

  Row row_of(const std::string& name, std::uint64_t log_ns) {
    Row row(tables[name]);
    row.number("t_s", static_cast<double>(log_ns - begun_ns_) * 1e-9);
    row.number("unix_s", static_cast<double>(log_ns) * 1e-9);
    return row;
  }

  void read_step(const recording::Message& message) {
    wire::RecordedStep step;
    proto::require_recorded(message, step);
    Row row = row_of("steps", message.log_ns);
    row.number("step", static_cast<double>(step.step()));
    row.number("tick_faults", step.tick_faults());
    row.number("commands", step.commands_size());
    row.number("inputs", step.inputs_size());
    for (const wire::RecordedCommand& command : step.commands()) {
      if (command.kind() == wire::RecordedCommand::JOIN) users_[command.seat()] = command.user();
    }
    for (const wire::RecordedInput& input : step.inputs()) read_input(message.log_ns, step.step(), input);
  }

  void read_input(std::uint64_t log_ns, std::uint64_t step, const wire::RecordedInput& input) {
    Row row = row_of("inputs", log_ns);
    const wire::ClientUpdate& update = input.update();
    row.number("step", static_cast<double>(step));
    const auto user = users_.find(input.seat());
    row.number("user", user == users_.end() ? std::numeric_limits<double>::quiet_NaN() : user->second);
    row.number("input_tick", static_cast<double>(update.input_tick()));
    row.number("sent_local_s", static_cast<double>(update.sent_local_ns()) * 1e-9);
    row.number("mode", update.mode());
    row.number("handle_valid", update.handle_valid() ? 1 : 0);
    row.number("buttons", update.buttons());
    row.state("handle", proto::read_exact(update.handle()));
    row.number("energy_to_hand_world_j", update.energy_to_hand_j());
    row.number("energy_from_hand_world_j", update.energy_from_hand_j());
    row.number("round_trip_s", static_cast<double>(update.round_trip_ns()) * 1e-9);
  }

  void read_states(const recording::Message& message) {
    wire::RecordedStates states;
    proto::require_recorded(message, states);
    Row row = row_of("bodies", message.log_ns);
    row.number("step", static_cast<double>(states.step()));
    row.number("field_energy_kj_per_mol", states.field_energy_kj_per_mol());
    for (const wire::RecordedBody& body : states.bodies()) {
      row.state(body_name(body.id()), proto::read_exact(body.state()));
    }
    for (const wire::RecordedTool& tool : states.tools()) read_tool(message.log_ns, states.step(), tool);
  }

  void read_tool(std::uint64_t log_ns, std::uint64_t step, const wire::RecordedTool& tool) {
    Row row = row_of("tools", log_ns);
    row.number("step", static_cast<double>(step));
    row.number("tool", tool.tool());
    row.number("user", tool.user());
    row.state("tool", proto::read_exact(tool.state()));
    const wire::WrenchOnHand& wrench = tool.wrench_on_hand();
    row.vector("force_on_hand_", "_n", {wrench.fx_n(), wrench.fy_n(), wrench.fz_n()});
    row.vector("torque_on_hand_", "_n_m", {wrench.tx_n_m(), wrench.ty_n_m(), wrench.tz_n_m()});
    row.number("held_body", tool.held_body());
  }

  std::string body_name(std::uint32_t id) const {
    const int index = static_cast<int>(id) - 1;
    const bool is_in_scene = index >= 0 && index < room_.scene().bodies_size();
    return is_in_scene ? csv_name(room_.scene().bodies(index).name()) : "body_" + std::to_string(id);
  }

  /// Converts a tick with the client's trace writer, so that the columns are those of --trace.
  void read_tick(const recording::Message& message) {
    wire::RecordedTick recorded;
    proto::require_recorded(message, recorded);
    const client::TickRecord tick = client::tick_of(recorded);
    if (ticks_begun_ == LocalTime{}) ticks_begun_ = tick.at;
    lines_ += client::trace_row(tick, ticks_begun_, recorded.phase()) + "\n";
    if (++waiting_ == kLinesAtOnce) parse_ticks();
  }

  void read_link(const recording::Message& message) {
    wire::RecordedLink link;
    proto::require_recorded(message, link);
    const double unknown = std::numeric_limits<double>::quiet_NaN();
    const auto seconds = [&](double ns) { return link.has_clock() ? ns * 1e-9 : unknown; };
    Row row = row_of("link", message.log_ns);
    row.number("clock_offset_s", seconds(static_cast<double>(link.clock_offset_ns())));
    row.number("round_trip_s", seconds(static_cast<double>(link.round_trip_ns())));
    row.number("minimum_round_trip_s", seconds(static_cast<double>(link.minimum_round_trip_ns())));
    row.number("datagrams_sent", static_cast<double>(link.datagrams_sent()));
    row.number("datagrams_received", static_cast<double>(link.datagrams_received()));
    row.number("datagrams_dropped", static_cast<double>(link.datagrams_dropped()));
    row.number("reconnects", static_cast<double>(link.reconnects()));
  }

  wire::RecordedRoom room_;
  std::uint64_t begun_ns_ = 0;
  LocalTime ticks_begun_{};
  std::string lines_;  ///< CSV lines of ticks that are not parsed yet
  int waiting_ = 0;
  std::map<std::uint32_t, std::uint32_t> users_;  ///< maps a seat to the id of its user
};

}  // namespace

std::map<std::string, CsvTable> recording_tables(const std::filesystem::path& file) {
  Tables tables;
  proto::read_recording(
      file, [&tables](const std::string& topic, const auto& message) { return tables.receive(topic, message); });
  tables.parse_ticks();
  return tables.tables;
}

}  // namespace tandem::lab
