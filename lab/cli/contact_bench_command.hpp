// `tandem-lab bench contact` and `bench contact-scaling`.
#pragma once

namespace CLI {
class App;
}

namespace tandem::lab {

/// Adds both to `bench`. Parsing the command line runs them: `exit_code` 0 done, 1 a bound does not hold.
///
/// Fails   (while parsing) std::invalid_argument for bad input
void add_contact_bench_commands(CLI::App& bench, int& exit_code);

}  // namespace tandem::lab
