// How many generated scenes a test runs.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <string>

namespace tandem::physics {

/// Of each kind.
inline constexpr std::uint64_t kScenesByDay = 24, kScenesByNight = 200;

/// Of a test: TANDEM_TEST_SCENES, or as many as usual.
inline std::uint64_t scenes(std::uint64_t usual) {
  const char* const given = std::getenv("TANDEM_TEST_SCENES");
  return given != nullptr ? std::stoull(given) : usual;
}

}  // namespace tandem::physics
