// The subcommands of tandem-lab. Each subcommand has a source file of its own. Each function adds a subcommand to
// `app`; its comment shows the command line. When the command line is parsed, the chosen subcommand runs and sets
// `exit_code` (0: success, 1: a checked claim failed). For invalid input it throws an exception, and main returns 2.
#pragma once

namespace CLI {
class App;
}

namespace tandem::lab {

/// Adds `run [FILE|NAME …] --out DIR [--set NAME=VALUE,…] [--single|--full] [--seeds N] [--samples] [--json] …`.
void add_run_command(CLI::App& app, int& exit_code);
/// Adds `random --out DIR [--trials N] [--seed N] [--threads N]`.
void add_random_command(CLI::App& app, int& exit_code);
/// Adds `live FILE|NAME --out DIR [--set NAME=VALUE,…] [--stage S,…] [--single] [--seeds N] [--rt-priority N]
/// [--json]`.
void add_live_command(CLI::App& app, int& exit_code);
/// Adds `link [--listen A] [--server A] [--port P] [--delay T] [--jitter T] [--loss S] [--capture FILE]`.
void add_link_command(CLI::App& app, int& exit_code);
/// Adds the subcommands `bench …`; see bench_commands.hpp.
void add_bench_command(CLI::App& app, int& exit_code);
/// Adds `calibrate --profile NAME|FILE.json --out DIR [--masses KG,…] [--seed N] [--json]`.
void add_calibrate_command(CLI::App& app, int& exit_code);
/// Adds `check [--law L] [--stiffness N/m] [--damping N·s/m] [--tool-mass KG] [--profile NAME|FILE.json] … [--json]`.
void add_check_command(CLI::App& app, int& exit_code);
/// Adds `mesh [FILE …] [--all DIR …] [--picture F.png] [--largest-size M] [--up y|z] [--json]`.
void add_mesh_command(CLI::App& app, int& exit_code);
/// Adds `reproduce [NAME] --out DIR`.
void add_reproduce_command(CLI::App& app, int& exit_code);
/// Adds `energy --receptor F[:chains] --ligand F[:chains] [--hydrogens H] [--cutoff C] [--dielectric D] [--json] …`.
void add_energy_command(CLI::App& app, int& exit_code);
/// Adds `redock --receptor F[:chains] --ligand F[:chains] [--seeds N] [--rtt-ms T] [--guided] [--out DIR] [--json] …`.
void add_redock_command(CLI::App& app, int& exit_code);
/// Adds `fit-order SERIES.csv|.traj [--most P] [--fit F] [--values] [--rate Hz] [--time-unit s|ms] [--columns …]
/// [--json]`.
void add_fit_order_command(CLI::App& app, int& exit_code);
/// Adds `report --out FILE --session NAME=DIR …`. It checks live sessions, each stored in a folder, and writes one HTML
/// report about them.
void add_report_command(CLI::App& app, int& exit_code);
/// Adds `therapy new|list|add|report|delete [PSEUDONYM] [FILE] [--data DIR] …`.
void add_therapy_command(CLI::App& app, int& exit_code);

}  // namespace tandem::lab
