// `tandem-lab fit-order SERIES`: how many coefficients a force series is worth.
#pragma once

namespace CLI {
class App;
}

namespace tandem::lab {

/// fit-order SERIES.csv|.traj [--most P] [--fit F] [--values] [--rate Hz] [--time-unit s|ms] [--columns …] [--json]
void add_fit_order_command(CLI::App& app, int& exit_code);

}  // namespace tandem::lab
