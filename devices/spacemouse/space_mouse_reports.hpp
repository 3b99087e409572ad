// Decodes the HID reports of a SpaceMouse.
#pragma once

#include <cstdint>
#include <span>

#include "common/base/spatial.hpp"

namespace tandem::devices {

/// Combines reports to the newest deflection of the cap. The id and the length of a report determine its layout: joined
/// (id 1, 13 bytes: six numbers) or split (ids 1 and 2, 7 bytes: three numbers each). Numbers are int16, little-endian.
///
/// Model   Converts from the device's axes (x right, y towards the user, z down) to the axes of D (x right, y away, z
///         up). This is a rotation by 180° about x, for translations and rotation vectors alike
class SpaceMouseReports {
 public:
  enum class Kind : std::uint8_t { kMotion, kButtons, kOther, kBad };

  /// Decodes a report. Reports other than motion and buttons have no effect.
  Kind parse(std::span<const std::uint8_t> report) noexcept;
  /// Sets the deflection to zero, for a released cap whose report of the release was lost.
  void rest() noexcept { deflection_.setZero(); }
  /// Returns (translation, rotation) in D, each number −1 to 1. Small values are set to 0, because caps do not return
  /// exactly to the centre.
  const Vec6& deflection() const { return deflection_; }
  /// Returns the bits of Button: the left button is grab, the right one clutch.
  std::uint32_t buttons() const { return buttons_; }

 private:
  void read_three(std::span<const std::uint8_t> bytes, int first) noexcept;

  Vec6 deflection_ = Vec6::Zero();
  std::uint32_t buttons_ = 0;
};

}  // namespace tandem::devices
