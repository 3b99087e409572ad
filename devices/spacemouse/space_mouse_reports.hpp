// Decoder of a SpaceMouse's reports.
#pragma once

#include <cstdint>
#include <span>

#include "common/base/spatial.hpp"

namespace tandem::devices {

/// Combines reports to the newest deflection of the cap. Id and received length determine the layout: joined (id 1, 13
/// bytes: six numbers) or split (ids 1 and 2, 7 bytes: three each); numbers are int16, little-endian.
///
/// Model   from the device's axes (x right, y towards the user, z down) to D's (x right, y away, z up): a half turn
///         about x, for translations and for rotation vectors alike
class SpaceMouseReports {
 public:
  enum class Kind : std::uint8_t { kMotion, kButtons, kOther, kBad };

  /// Decodes a report; reports other than motion and buttons change nothing.
  Kind parse(std::span<const std::uint8_t> report) noexcept;
  /// Sets the deflection to zero, after a release without a report.
  void rest() noexcept { deflection_.setZero(); }
  /// (translation, rotation) in D, each −1 to 1; small values are 0, because caps do not return exactly.
  const Vec6& deflection() const { return deflection_; }
  /// Bits of Button: left is grab, right is clutch.
  std::uint32_t buttons() const { return buttons_; }

 private:
  void read_three(std::span<const std::uint8_t> bytes, int first) noexcept;

  Vec6 deflection_ = Vec6::Zero();
  std::uint32_t buttons_ = 0;
};

}  // namespace tandem::devices
