// What a window remembers from one run to the next: a small JSON file of the user's.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <string_view>

#include "client/view/panels.hpp"

namespace tandem::client {

/// XDG_STATE_HOME/tandem/window.json, or below ~/.local/state; empty: the user has neither.
std::filesystem::path window_memory_file();
/// What the file lacks, or says in a way that cannot be, is as in a new window.
WindowSwitches remembered_switches(const std::filesystem::path& file);
/// Quietly nothing where it cannot be written. The file is replaced as a whole.
void remember_switches(const std::filesystem::path& file, const WindowSwitches& switches);

/// Of some that are named, the one that is called so, by its number; as it was where none is.
template <std::size_t kCount, class Number>
void take_named(std::string_view name, const std::array<const char*, kCount>& names, Number& number) {
  for (std::size_t i = 0; i < kCount; ++i) {
    if (name == names[i]) number = static_cast<Number>(i);
  }
}

}  // namespace tandem::client
