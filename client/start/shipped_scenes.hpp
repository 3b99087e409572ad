// The shipped scenes that the start screen offers, in the order of display.
#pragma once

#include <span>
#include <string_view>

namespace tandem::client {

struct ShippedScene {
  std::string_view name;      ///< name of the file in server/scenes
  std::string_view title;     ///< title on the card, at most 24 bytes
  std::string_view sentence;  ///< one sentence about the task; at most 90 bytes
  /// Hand path of the scene's simulated partner: a built-in path or a file in the data folder; empty: no partner is
  /// needed.
  std::string_view partner{};
};

std::span<const ShippedScene> shipped_scenes();

/// Returns null if no shipped scene has this name.
const ShippedScene* find_shipped_scene(std::string_view name);

}  // namespace tandem::client
