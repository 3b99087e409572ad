// The window's settings that are stored from one run to the next, in a small JSON file of the user.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <string_view>

#include "client/view/panels.hpp"

namespace tandem::client {

/// Returns XDG_STATE_HOME/tandem/window.json, otherwise the same file below ~/.local/state. Empty if neither folder is
/// known.
std::filesystem::path window_memory_file();
/// Reads the switches. Missing or invalid entries leave the defaults unchanged.
WindowSwitches remembered_switches(const std::filesystem::path& file);
/// Writes the switches by replacing the whole file. Errors are ignored.
void remember_switches(const std::filesystem::path& file, const WindowSwitches& switches);

/// Sets `number` to the index of `name` in `names`. If the name is not found, `number` is unchanged.
template <std::size_t kCount, class Number>
void apply_named(std::string_view name, const std::array<const char*, kCount>& names, Number& number) {
  for (std::size_t i = 0; i < kCount; ++i) {
    if (name == names[i]) number = static_cast<Number>(i);
  }
}

}  // namespace tandem::client
