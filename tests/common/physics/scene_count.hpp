// Number of generated scenes that a test runs.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <string>

namespace tandem::physics {

/// Numbers of random scenes of each kind in daytime runs and in nightly runs.
inline constexpr std::uint64_t kScenesByDay = 24, kScenesByNight = 200;

/// Returns the number of scenes for a test: TANDEM_TEST_SCENES if it is set, otherwise `usual`.
inline std::uint64_t scenes(std::uint64_t usual) {
  const char* const given = std::getenv("TANDEM_TEST_SCENES");
  return given != nullptr ? std::stoull(given) : usual;
}

}  // namespace tandem::physics
