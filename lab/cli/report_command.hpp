// `tandem-lab report`: from the folders that a demonstration left behind to one HTML file and a verdict.
#pragma once

namespace CLI {
class App;
}

namespace tandem::lab {

/// Adds the subcommand to `app`. Parsing it runs it: `exit_code` becomes 0 when all checks hold, else 1.
///
/// Fails   (while parsing) std::invalid_argument for bad input, which the program answers with exit code 2
void add_report_command(CLI::App& app, int& exit_code);

}  // namespace tandem::lab
