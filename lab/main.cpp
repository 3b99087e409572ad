// tandem-lab: experiments in virtual time, benchmarks, and reports of what came out.

#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>

#include "lab/commands.hpp"
#include "lab/report/report_command.hpp"

int main(int argument_count, char** arguments) {
  CLI::App app{"tandem-lab: experiments with simulated hands and links in virtual time, benchmarks and reports",
               "tandem-lab"};
  app.set_version_flag("--version", "tandem-lab " TANDEM_VERSION);
  app.require_subcommand(1);
  app.footer("Exit code: 0 done, 1 a checked claim failed, 2 bad input or set-up.");
  int exit_code = 0;
  tandem::lab::add_run_command(app, exit_code);
  tandem::lab::add_bench_command(app, exit_code);
  tandem::report::add_report_command(app, exit_code);
  try {
    app.parse(argument_count, arguments);
    return exit_code;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const std::exception& error) {
    std::cerr << "tandem-lab: " << error.what() << '\n';
    return 2;
  }
}
