// `tandem-lab bench`: measures speed. Each measurement is compared with a competing method or with a limit of the
// machine, both measured in the same run.

#include <CLI/CLI.hpp>

#include "lab/cli/bench/bench_commands.hpp"
#include "lab/cli/commands.hpp"

namespace tandem::lab {

double microseconds(Duration duration) {
  return to_seconds(duration) * 1e6;
}

boost::json::object quantiles_us(const Histogram& histogram) {
  return {{"p50", microseconds(histogram.quantile(0.5))},
          {"p99", microseconds(histogram.quantile(0.99))},
          {"p999", microseconds(histogram.quantile(0.999))},
          {"max", microseconds(histogram.max())}};
}

void add_bench_command(CLI::App& app, int& exit_code) {
  CLI::App* bench = app.add_subcommand("bench", "Measures speed against a peer or a limit in the same run");
  bench->require_subcommand(1);
  add_client_bench(*bench, exit_code);
  add_coupling_bench(*bench, exit_code);
  add_docking_bench(*bench, exit_code);
  add_field_bench(*bench, exit_code);
  add_goals_bench(*bench, exit_code);
  add_join_bench(*bench, exit_code);
  add_loop_bench(*bench, exit_code);
  add_proxy_bench(*bench, exit_code);
  add_room_bench(*bench, exit_code);
  add_server_bench(*bench, exit_code);
  add_contact_bench(*bench, exit_code);
  add_contact_scaling(*bench, exit_code);
}

}  // namespace tandem::lab
