// tandem-lab: runs experiments in virtual time and benchmarks, and writes reports of the results.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <iostream>
#include <string>

#include "lab/cli/commands.hpp"

namespace {

/// Returns a parsing error as a message of one line. If the subcommand is missing, the message lists the subcommands.
std::string complaint(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App* command = &app;
  std::string path = "tandem-lab";
  while (!command->get_subcommands().empty()) {
    command = command->get_subcommands().front();
    path += " " + command->get_name();
  }
  std::string text = error.what();
  const auto subcommands = command->get_subcommands([](const CLI::App*) { return true; });
  if (!subcommands.empty() && dynamic_cast<const CLI::RequiredError*>(&error) != nullptr) {
    text = "a subcommand is required: ";
    for (const CLI::App* one : subcommands) text += (one == subcommands.front() ? "" : " or ") + one->get_name();
  }
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text + "; see " + path + " --help";
}

}  // namespace

int main(int argument_count, char** arguments) {
  CLI::App app{"tandem-lab: experiments with simulated hands and links in virtual time, benchmarks and reports",
               "tandem-lab"};
  app.set_version_flag("--version", "tandem-lab " TANDEM_VERSION);
  app.require_subcommand(1);
  app.footer("Exit code: 0 done, 1 a checked claim failed, 2 bad input or set-up.");
  int exit_code = 0;
  tandem::lab::add_run_command(app, exit_code);
  tandem::lab::add_random_command(app, exit_code);
  tandem::lab::add_live_command(app, exit_code);
  tandem::lab::add_link_command(app, exit_code);
  tandem::lab::add_bench_command(app, exit_code);
  tandem::lab::add_calibrate_command(app, exit_code);
  tandem::lab::add_check_command(app, exit_code);
  tandem::lab::add_mesh_command(app, exit_code);
  tandem::lab::add_reproduce_command(app, exit_code);
  tandem::lab::add_energy_command(app, exit_code);
  tandem::lab::add_redock_command(app, exit_code);
  tandem::lab::add_fit_order_command(app, exit_code);
  tandem::lab::add_report_command(app, exit_code);
  tandem::lab::add_therapy_command(app, exit_code);
  try {
    app.parse(argument_count, arguments);
    return exit_code;
  } catch (const CLI::Success& help_or_version) {
    return app.exit(help_or_version);
  } catch (const CLI::ParseError& error) {
    std::cerr << "tandem-lab: " << complaint(app, error) << '\n';
    return 2;
  } catch (const std::exception& error) {
    std::cerr << "tandem-lab: " << error.what() << '\n';
    return 2;
  }
}
