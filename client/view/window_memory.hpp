// Stores settings of the window in a small JSON file of the user, so that the next run of the program starts with them.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <string_view>

#include "client/view/panels.hpp"

namespace tandem::client {

/// Returns the path of the file: XDG_STATE_HOME/tandem/window.json, or ~/.local/state/tandem/window.json if
/// XDG_STATE_HOME is not set. Empty if neither folder is known.
std::filesystem::path window_memory_file();
/// Reads the settings of the window. A missing or invalid entry gets its default.
WindowSwitches remembered_switches(const std::filesystem::path& file);
/// Writes the settings of the window. The whole file is replaced. Errors are ignored.
void remember_switches(const std::filesystem::path& file, const WindowSwitches& switches);

/// Sets `number` to the index of `name` in `names`. If the name is not found, `number` is unchanged.
template <std::size_t kCount, class Number>
void apply_named(std::string_view name, const std::array<const char*, kCount>& names, Number& number) {
  for (std::size_t i = 0; i < kCount; ++i) {
    if (name == names[i]) number = static_cast<Number>(i);
  }
}

}  // namespace tandem::client
