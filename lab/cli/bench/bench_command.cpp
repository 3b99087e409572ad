// `tandem-lab bench`: what is fast here, each against a peer or a limit in the same run.

#include <CLI/CLI.hpp>

#include "lab/cli/bench/bench_commands.hpp"
#include "lab/cli/commands.hpp"

namespace tandem::lab {

void add_bench_command(CLI::App& app, int& exit_code) {
  CLI::App* bench = app.add_subcommand("bench", "Measures speed against a peer or a limit in the same run");
  bench->require_subcommand(1);
  add_client_bench(*bench, exit_code);
  add_coupling_bench(*bench, exit_code);
  add_field_bench(*bench, exit_code);
  add_proxy_bench(*bench, exit_code);
  add_room_bench(*bench, exit_code);
  add_server_bench(*bench, exit_code);
  add_contact_bench(*bench, exit_code);
  add_contact_scaling(*bench, exit_code);
}

}  // namespace tandem::lab
