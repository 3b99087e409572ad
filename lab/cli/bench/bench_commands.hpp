// Registration of the subcommands of `tandem-lab bench`. Each subcommand has a source file of its own;
// bench_command.cpp calls these functions. The comment at each function shows the command line.
#pragma once

#include "common/base/histogram.hpp"
#include "common/base/json.hpp"

namespace CLI {
class App;
}

namespace tandem::lab {

double microseconds(Duration duration);
/// Returns {"p50", "p99", "p999", "max"} in microseconds.
boost::json::object quantiles_us(const Histogram& histogram);

/// Adds `client [--rtt-ms MS] [--repetitions N] [--check] [--json]`.
void add_client_bench(CLI::App& bench, int& exit_code);
/// Adds `contact --a MESH --b MESH … [--check N] [--json]`.
void add_contact_bench(CLI::App& bench, int& exit_code);
/// Adds `contact-scaling --mesh FILE --out DIR`.
void add_contact_scaling(CLI::App& bench, int& exit_code);
/// Adds `coupling [--seconds S] [--check] [--json]`.
void add_coupling_bench(CLI::App& bench, int& exit_code);
/// Adds `docking --receptor F --ligand F [--cutoff C] [--kernel K] [--json]`.
void add_docking_bench(CLI::App& bench, int& exit_code);
/// Adds `field [--scene NAME] [--seconds S] [--json]`.
void add_field_bench(CLI::App& bench, int& exit_code);
/// Adds `goals [--scene NAME] [--hand NAME] [--seconds S] [--check] [--json]`.
void add_goals_bench(CLI::App& bench, int& exit_code);
/// Adds `join [--experiment NAME] [--rate-mbit R...] [--loss SHARE...] [--rtt-ms MS] [--jitter-ms MS] [--json]`.
void add_join_bench(CLI::App& bench, int& exit_code);
/// Adds `loop [--seconds S] [--with-window] [--pairs N] [--scene NAME] [--rt-priority N] [--check] [--json]`.
void add_loop_bench(CLI::App& bench, int& exit_code);
/// Adds `proxy --mesh FILE [--size-mm S] [--radius-mm R] [--steps N] [--no-shading] [--check] [--json]`.
void add_proxy_bench(CLI::App& bench, int& exit_code);
/// Adds `room [--scene NAME] [--users N] [--json]`.
void add_room_bench(CLI::App& bench, int& exit_code);
/// Adds `server [--clients N] [--rooms N] [--overload] [--json]`.
void add_server_bench(CLI::App& bench, int& exit_code);

}  // namespace tandem::lab
