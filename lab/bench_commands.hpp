// The measurements of `tandem-lab bench`, one file each, registered in bench_command.cpp.
#pragma once

namespace CLI {
class App;
}

namespace tandem::lab {

/// field [--scene NAME] [--seconds S] [--json]
void add_field_bench(CLI::App& bench, int& exit_code);
/// room [--scene NAME] [--users N] [--json]
void add_room_bench(CLI::App& bench, int& exit_code);

}  // namespace tandem::lab
