#include "lab/results/study_results.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iomanip>
#include <limits>
#include <map>
#include <set>
#include <sstream>

#include "common/base/json_pretty.hpp"
#include "lab/metrics/trial_metrics.hpp"
#include "lab/report/format.hpp"

namespace tandem::lab {
namespace {

namespace json = boost::json;

std::string csv_cell(const json::value& value) {
  if (value.is_null()) return "";
  std::string text = value.is_string() ? std::string(value.get_string()) : compact_json(value);
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted.append(c == '"' ? "\"\"" : std::string(1, c));
  return quoted + '"';
}

bool is_of_single_users(std::string_view name) {
  return name == "users";
}

std::string group_key(const json::object& row) {
  json::object key;
  for (const char* name :
       {"experiment", "stage", "predictor", "passivity", "deadband", "rtt_ms", "jitter_ms", "loss", "overrides"}) {
    if (const json::value* value = row.if_contains(name)) key[name] = *value;
  }
  key["was_silent"] = was_silent(row);
  return compact_json(key);
}

/// A column of the printed table.
struct PrintedColumn {
  const char* header;
  const char* name;
  double scale;
  int decimals;
};
constexpr std::array<PrintedColumn, 13> kPrinted{{{"drag N", "free_drag_rms_n", 1, 3},
                                                  {"force N", "contact_force_mean_n", 1, 2},
                                                  {"of truth", "contact_force_ratio", 1, 2},
                                                  {"error N", "contact_error_rms_n", 1, 3},
                                                  {"path %", "path_error_of_peak", 100, 1},
                                                  {"torque %", "path_torque_error_of_peak", 100, 1},
                                                  {"stiff", "felt_stiffness_ratio", 1, 2},
                                                  {"mass", "felt_mass_ratio", 1, 2},
                                                  {"cycle mm/s", "limit_cycle_m_per_s", 1e3, 2},
                                                  {"step N/ms", "force_step_max_n_per_ms", 1, 3},
                                                  {"made mJ", "energy_created_max_j", 1e3, 2},
                                                  {"apart mm", "view_divergence_max_m", 1e3, 2},
                                                  {"kB/s", "bytes_per_s", 1e-3, 1}}};
constexpr int kColumnWidth = 11;
constexpr int kTrialWidth = 31;  ///< width of the columns that identify the trial [characters]

std::string overrides_text(const json::object& row) {
  const json::value* overrides = row.if_contains("overrides");
  if (overrides == nullptr || !overrides->is_object()) return "";
  std::string text;
  for (const auto& each : overrides->get_object()) {
    text += "  " + std::string(each.key()) + "=" +
            (each.value().is_string() ? std::string(each.value().get_string()) : compact_json(each.value()));
  }
  return text;
}

/// A function that computes one value of a group for the table.
using OfGroup = double (*)(const SeedGroup& group, std::string_view metric);

void print_values(std::ostream& out, const SeedGroup& group, OfGroup of) {
  for (const PrintedColumn& column : kPrinted) {
    const double value = of(group, column.name);
    std::ostringstream cell;
    if (std::isfinite(value)) {
      cell << std::fixed << std::setprecision(column.decimals) << value * column.scale;
    } else {
      cell << '-';
    }
    out << std::setw(kColumnWidth) << cell.str();
  }
}

void print_group(std::ostream& out, const SeedGroup& group) {
  const json::object& row = *group.front();
  const bool has_controller = row.at("passivity") == json::value(true);
  const std::string predictor = text_in(row, "predictor");
  const std::string stage = text_in(row, "stage") +
                            (predictor == client::StageSettings{}.predictor ? "" : "/" + predictor) +
                            (has_controller ? "" : " -p");
  out << std::left << std::setw(20) << stage << std::right << std::setw(6) << number_in(row, "rtt_ms") << std::setw(5)
      << number_in(row, "jitter_ms") << std::setw(6) << number_in(row, "loss");
  print_values(out, group, mean_of);
  out << "  " << outcomes_of(group) << (was_silent(row) ? "  after a silence" : "") << overrides_text(row) << '\n';
  if (group.size() == 1) return;
  out << std::left << std::setw(kTrialWidth) << ("  worst of " + std::to_string(group.size())) << std::right;
  print_values(out, group, worst_of);
  out << '\n';
}

}  // namespace

json::object study_json(std::span<const TrialResult> results) {
  json::array trials;
  for (const TrialResult& result : results) trials.push_back(result.row);
  return {{"trials", std::move(trials)}};
}

std::string study_csv(std::span<const TrialResult> results) {
  if (results.empty()) return "";
  std::string text;
  std::vector<std::string> names;
  for (const auto& field : results.front().row) {
    if (!is_of_single_users(field.key())) names.emplace_back(field.key());
  }
  for (const std::string& name : names) text.append(text.empty() ? "" : ",").append(name);
  text += '\n';
  for (const TrialResult& result : results) {
    for (std::size_t i = 0; i < names.size(); ++i) {
      const json::value* value = result.row.if_contains(names[i]);
      text.append(i == 0 ? "" : ",").append(value == nullptr ? "" : csv_cell(*value));
    }
    text += '\n';
  }
  return text;
}

json::object study_timing_json(std::span<const TrialResult> results, double wall_s) {
  json::array trials;
  double virtual_s = 0;
  std::size_t reused = 0;
  for (const TrialResult& result : results) {
    trials.push_back(json::object{{"key", result.key},
                                  {"virtual_s", result.virtual_s},
                                  {"wall_s", result.wall_s},
                                  {"times_faster_than_real_time", result.virtual_s / result.wall_s},
                                  {"was_there", result.was_done}});
    reused += result.was_done ? 1 : 0;
    virtual_s += result.was_done ? 0 : result.virtual_s;
  }
  return {{"wall_s", wall_s},
          {"virtual_s", virtual_s},
          {"times_faster_than_real_time", virtual_s / wall_s},
          {"reused", reused},
          {"trials", std::move(trials)}};
}

double number_in(const json::object& row, std::string_view name) {
  const json::value* value = row.if_contains(name);
  if (value == nullptr || !value->is_number()) return std::numeric_limits<double>::quiet_NaN();
  return value->to_number<double>();
}

std::string text_in(const json::object& row, std::string_view name) {
  const json::value* value = row.if_contains(name);
  return value != nullptr && value->is_string() ? std::string(value->get_string()) : std::string();
}

bool was_silent(const json::object& row) {
  return number_in(row, "silence_max_ms") > kLongSilence_ms;
}

double mean_of(const SeedGroup& group, std::string_view name) {
  double sum = 0;
  int count = 0;
  for (const json::object* row : group) {
    const double value = number_in(*row, name);
    if (!std::isfinite(value)) continue;
    sum += value;
    ++count;
  }
  return count == 0 ? std::numeric_limits<double>::quiet_NaN() : sum / count;
}

double worst_of(const SeedGroup& group, std::string_view name) {
  std::vector<double> values;
  for (const json::object* row : group) {
    const double value = number_in(*row, name);
    if (std::isfinite(value)) values.push_back(value);
  }
  return worst_value(trial_metric_called(name), values);
}

std::string outcomes_of(const SeedGroup& group) {
  std::map<std::string, int> seen;
  for (const json::object* row : group) ++seen[text_in(*row, "outcome")];
  std::string text;
  for (const auto& [outcome, count] : seen) {
    text.append(text.empty() ? "" : "/").append(outcome);
    if (seen.size() > 1) text.append(" ").append(std::to_string(count));
  }
  return text;
}

std::vector<SeedGroup> seed_groups(std::span<const TrialResult> results) {
  std::vector<SeedGroup> groups;
  std::map<std::string, std::size_t> index;
  for (const TrialResult& result : results) {
    const auto [place, is_new] = index.emplace(group_key(result.row), groups.size());
    if (is_new) groups.emplace_back();
    groups[place->second].push_back(&result.row);
  }
  return groups;
}

void print_study(std::ostream& out, std::span<const TrialResult> results) {
  std::string experiment;
  for (const SeedGroup& group : seed_groups(results)) {
    if (text_in(*group.front(), "experiment") != experiment) {
      experiment = text_in(*group.front(), "experiment");
      out << '\n'
          << experiment << " (means over seeds, then the worst; -p: without passivity controller)\n"
          << std::left << std::setw(20) << "stage" << std::right << std::setw(6) << "rtt" << std::setw(5) << "jit"
          << std::setw(6) << "loss";
      for (const PrintedColumn& column : kPrinted) out << std::setw(kColumnWidth) << column.header;
      out << "  outcome\n";
    }
    print_group(out, group);
  }
}

bool has_lost_users(std::span<const TrialResult> results) {
  return std::any_of(results.begin(), results.end(), [](const TrialResult& result) {
    const std::string outcome = text_in(result.row, "outcome");
    return outcome == "lost" || outcome == "not-joined";
  });
}

}  // namespace tandem::lab
