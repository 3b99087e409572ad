// What a SpaceMouse says, byte by byte.
#pragma once

#include <cstdint>
#include <span>

#include "common/base/spatial.hpp"

namespace tandem::devices {

/// Puts reports together to the newest deflection of the cap. The layout is told by id and received length: joined
/// (id 1, 13 bytes: six numbers) or split (ids 1 and 2, 7 bytes: three each); numbers are int16, little-endian.
///
/// Model   from the device's axes (x right, y towards the user, z down) to D's (x right, y away, z up): a half turn
///         about x, for translations and for rotation vectors alike
class SpaceMouseReports {
 public:
  enum class Kind : std::uint8_t { kMotion, kButtons, kOther, kBad };

  /// Anything else than motion and buttons changes nothing.
  Kind take(std::span<const std::uint8_t> report) noexcept;
  /// As after a release that nobody reported.
  void rest() noexcept { deflection_.setZero(); }
  /// (translation, rotation) in D, each −1 to 1; small ones are 0, for caps do not return exactly.
  const Vec6& deflection() const { return deflection_; }
  /// Bits of Button: left is grab, right is clutch.
  std::uint32_t buttons() const { return buttons_; }

 private:
  void take_three(std::span<const std::uint8_t> bytes, int first) noexcept;

  Vec6 deflection_ = Vec6::Zero();
  std::uint32_t buttons_ = 0;
};

}  // namespace tandem::devices
