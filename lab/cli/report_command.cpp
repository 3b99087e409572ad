#include "lab/cli/commands.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/base/json_pretty.hpp"
#include "lab/report/session_checks.hpp"
#include "lab/report/session_data.hpp"
#include "lab/report/session_report.hpp"
#include "lab/report/session_task.hpp"
#include "lab/results/output_files.hpp"

namespace tandem::lab {
namespace {

struct ReportOptions {
  std::vector<std::string> sessions;  ///< each entry is NAME=DIR
  std::string tasks;                  ///< path of the file with the tasks; empty: no tasks
  std::string out;
  bool prints_json = false;
};

Session session_from_option(const std::string& option) {
  const std::size_t equals = option.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == option.size()) {
    throw std::invalid_argument("--session " + option + ": it must be NAME=DIR, e.g. peg_in_hole=demo/peg_in_hole");
  }
  return load_session(option.substr(0, equals), option.substr(equals + 1));
}

std::vector<Session> load_sessions(const std::vector<std::string>& options) {
  std::vector<Session> sessions;
  for (const std::string& option : options) {
    Session session = session_from_option(option);
    const bool is_second =
        std::any_of(sessions.begin(), sessions.end(), [&](const Session& other) { return other.name == session.name; });
    if (is_second) throw std::invalid_argument("--session " + option + ": there is a session of that name already");
    sessions.push_back(std::move(session));
  }
  return sessions;
}

/// Returns all checks. The checks of the tasks come first, because they are the most important: a session whose task
/// was not completed has failed, even if all forces were good.
std::vector<Check> all_checks(const std::vector<Session>& sessions, const SessionTasks& tasks) {
  for (const auto& [name, task] : tasks) {
    if (std::ranges::find(sessions, name, &Session::name) == sessions.end()) {
      throw std::invalid_argument("--tasks: there is a task for session " + name + ", but no --session of that name");
    }
  }
  std::vector<Check> checks;
  for (const Session& session : sessions) {
    const auto task = tasks.find(session.name);
    if (task == tasks.end()) continue;
    for (Check& check : check_task(session, task->second)) checks.push_back(std::move(check));
  }
  for (Check& check : check_sessions(sessions)) checks.push_back(std::move(check));
  return checks;
}

int run_report(const ReportOptions& options) {
  const std::vector<Session> sessions = load_sessions(options.sessions);
  const SessionTasks tasks = options.tasks.empty() ? SessionTasks{} : load_session_tasks(options.tasks);
  const std::vector<Check> checks = all_checks(sessions, tasks);
  const std::filesystem::path file = std::filesystem::absolute(options.out);
  write_all_files(file.parent_path().string(), with_report({}, session_report(sessions, checks), file.filename()));
  const bool holds = all_hold(checks);
  if (options.prints_json) {
    std::cout << pretty_json(
        boost::json::object{{"report", options.out}, {"holds", holds}, {"checks", to_json(checks)}});
  } else {
    print_checks(std::cout, checks);
  }
  return holds ? 0 : 1;
}

}  // namespace

void add_report_command(CLI::App& app, int& exit_code) {
  // The options are shared with the callback, which outlives this function.
  const auto options = std::make_shared<ReportOptions>();
  CLI::App* command = app.add_subcommand("report", "Checks sessions of tandem-client and writes an HTML report");
  command
      ->add_option("--session", options->sessions,
                   "NAME=DIR; DIR holds USER.json (--json) and USER.csv (--trace) of each client; may be repeated")
      ->required()
      ->expected(1)
      ->take_all();
  command
      ->add_option("--tasks", options->tasks,
                   "task of the hands, checked too: by session, where a body is in the phase \"hold\" [m], "
                   "whether it rests [m], the energy of the molecular field [kJ/mol] (lab/report/session_task.hpp)")
      ->type_name("FILE.json");
  command->add_option("--out", options->out, "the HTML file to write")->required();
  command->add_flag("--json", options->prints_json, "print the checks as JSON instead of as a table");
  command->footer("Exit code: 0 every check holds, 1 one does not, 2 bad input.");
  command->callback([options, &exit_code] { exit_code = run_report(*options); });
}

}  // namespace tandem::lab
