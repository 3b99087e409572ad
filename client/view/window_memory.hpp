// What a window remembers from one run to the next: a small JSON file of the user's.
#pragma once

#include <filesystem>

#include "client/view/panels.hpp"

namespace tandem::client {

/// XDG_STATE_HOME/tandem/window.json, or below ~/.local/state; empty: the user has neither.
std::filesystem::path window_memory_file();
/// What the file lacks, or says in a way that cannot be, is as in a new window.
WindowSwitches remembered_switches(const std::filesystem::path& file);
/// Quietly nothing where it cannot be written. The file is replaced as a whole.
void remember_switches(const std::filesystem::path& file, const WindowSwitches& switches);

}  // namespace tandem::client
