// See trace.hpp. One function writes both the names and the values of the cells, so that header and rows always match.
#include "client/app/trace.hpp"

#include <charconv>
#include <concepts>
#include <optional>
#include <stdexcept>
#include <string_view>

namespace tandem::client {
namespace {

// Number of significant digits. Nine digits resolve 1 nm in 1 m, far below the resolution of any device. Compared with
// full precision, they halve the size of the files.
constexpr int kDigits = 9;
constexpr int kTimeDecimals = 6;

/// Appends cells to a line: names in the header row, values in the other rows.
class Row {
 public:
  enum class Kind { kNames, kValues };
  Row(std::string& line, Kind kind) : line_(line), kind_(kind) { line_.clear(); }

  void number(std::string_view name, double value, bool is_known = true) {
    cell(name, is_known, [value](char* from, char* to) {
      return std::to_chars(from, to, value, std::chars_format::general, kDigits).ptr;
    });
  }
  void time(std::string_view name, Duration value, bool is_known = true) {
    cell(name, is_known, [value](char* from, char* to) {
      return std::to_chars(from, to, to_seconds(value), std::chars_format::fixed, kTimeDecimals).ptr;
    });
  }
  template <std::integral T>
  void whole(std::string_view name, T value) {
    cell(name, true, [value](char* from, char* to) { return std::to_chars(from, to, value).ptr; });
  }
  void vector(std::string_view name, std::string_view unit, const Vec3& a, bool is_known = true) {
    constexpr std::string_view kAxes = "xyz";
    for (int i = 0; i < 3; ++i) {
      number(joined(name, kAxes.substr(static_cast<std::size_t>(i), 1), unit), a[i], is_known);
    }
  }
  void pose(std::string_view frame, const Pose& X, bool is_known) {
    vector(joined(frame, "p"), "m", X.p, is_known);
    number(joined(frame, "q_w"), X.q.w(), is_known);
    vector(joined(frame, "q"), "", X.q.vec(), is_known);
  }
  void rigid_state(std::string_view frame, const Pose& X, const Twist& V, bool is_known) {
    pose(frame, X, is_known);
    vector(joined(frame, "v"), "m_per_s", V.v, is_known);
    vector(joined(frame, "w"), "rad_per_s", V.w, is_known);
  }
  void rigid_state(std::string_view frame, const std::optional<RigidState>& state) {
    const RigidState known = state.value_or(RigidState{});
    rigid_state(frame, known.X, known.V, state.has_value());
  }
  void wrench(std::string_view name, const Wrench& F, bool is_known = true) {
    vector(joined(name, "force"), "n", F.f, is_known);
    vector(joined(name, "torque"), "n_m", F.t, is_known);
  }

 private:
  /// Joins the parts of a column name. For a row of values it returns an empty string, to save time.
  std::string joined(std::string_view a, std::string_view b, std::string_view c = "") const {
    std::string name;
    if (kind_ == Kind::kValues) return name;
    name.append(a).append("_").append(b);
    if (!c.empty()) name.append("_").append(c);
    return name;
  }
  template <class Format>
  void cell(std::string_view name, bool is_known, Format format) {
    if (!is_first_) line_.push_back(',');
    is_first_ = false;
    if (kind_ == Kind::kNames) {
      line_.append(name);
    } else if (is_known) {
      char text[40];
      line_.append(text, static_cast<std::size_t>(format(text, text + sizeof(text)) - text));
    }
  }

  std::string& line_;
  Kind kind_;
  bool is_first_ = true;
};

void fill(Row& row, const TickRecord& r, LocalTime start, int phase) {
  const bool has_state = r.state_age >= Duration{0};
  const bool has_hand = r.sample.is_valid;
  row.time("t_s", r.at - start);
  row.whole("local_ns", r.at.time_since_epoch().count());
  row.whole("tick", r.tick.value);
  row.whole("phase", phase);
  row.time("sample_taken_s", r.sample.taken - start);
  row.whole("sample_is_valid", static_cast<int>(r.sample.is_valid));
  row.whole("buttons", r.sample.buttons);
  row.rigid_state("device", r.sample.X_DH, r.sample.V_DH, has_hand);
  row.rigid_state("handle", r.handle_W.X, r.handle_W.V, has_hand);
  row.rigid_state("tool", r.tool_W.X, r.tool_W.V, has_state);
  row.wrench("stage", r.stage_wrench_on_hand_D);
  row.wrench("displayed", r.displayed_on_hand_D);
  row.wrench("server", r.server_wrench_on_hand_W, has_state);
  row.time("state_age_s", r.state_age, has_state);
  row.whole("newest_step", r.newest_step.value);
  row.whole("server_tick_faults", r.server_tick_faults);
  row.whole("held_body", r.held_body.value);
  row.number("field_energy_kj_per_mol", r.field_energy_kj_per_mol, has_state);
  row.rigid_state("body", r.watched_body_W);
  row.whole("is_local", static_cast<int>(r.is_local));
  row.rigid_state("local_tool", r.local_tool_W.X, r.local_tool_W.V, r.is_local);
  row.rigid_state("local_body", r.local_body_W);
  row.whole("is_predicting", static_cast<int>(r.is_predicting));
  row.number("passivity_gain", r.passivity_gain);
  row.number("passivity_withheld_world_j", r.passivity_withheld_j);
  row.whole("scene_generation", r.scene_generation);
  row.whole("safety_faults", r.safety_faults);
  row.whole("is_clamped", static_cast<int>(r.is_clamped));
}

}  // namespace

std::string trace_header() {
  std::string line;
  Row row(line, Row::Kind::kNames);
  fill(row, TickRecord{}, LocalTime{}, -1);
  return line;
}

std::string trace_row(const TickRecord& record, LocalTime start, int phase) {
  std::string line;
  Row row(line, Row::Kind::kValues);
  fill(row, record, start, phase);
  return line;
}

TraceWriter::TraceWriter(const std::filesystem::path& file, std::uint64_t every) : out_(file), every_(every) {
  if (every == 0) throw std::invalid_argument("a trace of every 0th tick makes no sense; use 1 or more");
  if (!out_) {
    throw std::invalid_argument("trace file '" + file.string() + "' cannot be created; check its folder and rights");
  }
  out_ << trace_header() << '\n';
}

void TraceWriter::write(const TickRecord& record, int phase) {
  if (seen_ == 0) start_ = record.at;
  if (seen_++ % every_ != 0) return;
  Row row(line_, Row::Kind::kValues);
  fill(row, record, start_, phase);
  out_ << line_ << '\n';
}

bool TraceWriter::flush() {
  return static_cast<bool>(out_.flush());
}

}  // namespace tandem::client
