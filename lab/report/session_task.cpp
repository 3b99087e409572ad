#include "lab/report/session_task.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>

#include "common/base/json_fields.hpp"
#include "lab/report/session_checks.hpp"

namespace tandem::lab {
namespace {

constexpr double kTask_mm = 1e3;  ///< number of millimetres in a metre
constexpr double kFarthest_m = 100;
constexpr double kMaxEnergy_kj_per_mol = 1e9;
/// Settling time at the start of a phase, as in the client's summary (client/app/run_report.cpp).
constexpr double kSettling_s = 1;

SessionTask task_of(JsonFields& fields) {
  SessionTask task;
  task.body = fields.text("body", "");
  if (fields.has("place_m")) {
    task.place_W = fields.vector("place_m", Vec3::Zero(), kFarthest_m);
    task.within_m = fields.required_number("within_m", 0, kFarthest_m);
  }
  if (fields.has("rest_m")) task.rest_m = fields.required_number("rest_m", 0, kFarthest_m);
  if (fields.has("energy_kj_per_mol")) {
    task.energy_kj_per_mol = fields.required_number("energy_kj_per_mol", -kMaxEnergy_kj_per_mol, kMaxEnergy_kj_per_mol);
  }
  fields.finish();
  return task;
}

/// Returns the rows of the trace in the settled part of the phase "hold".
std::vector<std::size_t> settled_rows(const Trace& trace) {
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < trace.time_s.size(); ++i) {
    const bool is_in = std::ranges::any_of(trace.phases, [&](const Band& phase) {
      return phase.label == kHoldPhase && trace.time_s[i] >= phase.begin + kSettling_s && trace.time_s[i] < phase.end;
    });
    if (is_in) rows.push_back(i);
  }
  return rows;
}

Vec3 at(const Axes& axes, std::size_t row) {
  return {axes[0][row], axes[1][row], axes[2][row]};
}

/// Returns the largest value over the rows, or NaN if there are no rows or any value is NaN.
template <class Value>
double largest(const std::vector<std::size_t>& rows, const Value& value) {
  double result = rows.empty() ? std::numeric_limits<double>::quiet_NaN() : -std::numeric_limits<double>::infinity();
  for (const std::size_t row : rows) {
    const double here = value(row);
    if (std::isnan(here) || std::isnan(result)) return std::numeric_limits<double>::quiet_NaN();
    result = std::max(result, here);
  }
  return result;
}

std::string place_text(const Vec3& place_m) {
  char text[96];
  std::snprintf(text, sizeof text, "(%.1f, %.1f, %.1f) mm", kTask_mm * place_m.x(), kTask_mm * place_m.y(),
                kTask_mm * place_m.z());
  return text;
}

void check_user(const std::string& scope, const ClientRun& user, const SessionTask& task, std::vector<Check>& out) {
  const std::vector<std::size_t> rows = settled_rows(user.trace);
  const std::string body = user.watched_body.empty() ? "the watched body" : user.watched_body;
  if (!task.body.empty() && task.body != user.watched_body) {
    throw std::invalid_argument("task of " + scope + ": body is \"" + task.body + "\", the client watched \"" +
                                user.watched_body + "\"");
  }
  if (task.place_W) {
    const double off_m =
        largest(rows, [&](std::size_t row) { return (at(user.trace.body_m, row) - *task.place_W).norm(); });
    out.push_back({scope, "task: " + body + " at " + place_text(*task.place_W) + ", largest distance from it",
                   off_m * kTask_mm, Relation::kAtMost, task.within_m * kTask_mm, "mm", 2});
  }
  if (task.rest_m) {
    Vec3 mean = Vec3::Zero();
    for (const std::size_t row : rows) mean += at(user.trace.body_m, row) / static_cast<double>(rows.size());
    const double moved_m = largest(rows, [&](std::size_t row) { return (at(user.trace.body_m, row) - mean).norm(); });
    out.push_back({scope, "task: " + body + " at rest, largest distance from its mean position", moved_m * kTask_mm,
                   Relation::kAtMost, *task.rest_m * kTask_mm, "mm", 2});
  }
  if (task.energy_kj_per_mol) {
    const double energy = largest(rows, [&](std::size_t row) { return user.trace.energy_kj_per_mol[row]; });
    out.push_back({scope, "task: molecules in contact, highest energy of their field", energy, Relation::kAtMost,
                   *task.energy_kj_per_mol, "kJ/mol", 1});
  }
}

}  // namespace

SessionTasks parse_session_tasks(std::string_view json, const std::string& origin) {
  const boost::json::value root = parse_json(json, origin);
  JsonFields file(root, origin);
  SessionTasks tasks;
  for (const auto& entry : root.get_object()) {
    JsonFields fields = file.object(entry.key());
    tasks.emplace(entry.key(), task_of(fields));
  }
  file.finish();
  return tasks;
}

SessionTasks load_session_tasks(const std::filesystem::path& file) {
  return parse_session_tasks(read_text_file(file), file.string());
}

std::vector<Check> check_task(const Session& session, const SessionTask& task) {
  std::vector<Check> checks;
  for (const ClientRun& user : session.users) check_user(session.name + " · " + user.name, user, task, checks);
  return checks;
}

}  // namespace tandem::lab
