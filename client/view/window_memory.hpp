// The window's settings kept from one run to the next, in a small JSON file of the user.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <string_view>

#include "client/view/panels.hpp"

namespace tandem::client {

/// XDG_STATE_HOME/tandem/window.json, otherwise below ~/.local/state; empty if neither is known.
std::filesystem::path window_memory_file();
/// Reads the switches; missing or invalid entries keep their defaults.
WindowSwitches remembered_switches(const std::filesystem::path& file);
/// Writes the switches, and replaces the file as a whole. Errors are ignored.
void remember_switches(const std::filesystem::path& file, const WindowSwitches& switches);

/// Sets `number` to the index of `name` in `names`; unchanged if there is none.
template <std::size_t kCount, class Number>
void apply_named(std::string_view name, const std::array<const char*, kCount>& names, Number& number) {
  for (std::size_t i = 0; i < kCount; ++i) {
    if (name == names[i]) number = static_cast<Number>(i);
  }
}

}  // namespace tandem::client
