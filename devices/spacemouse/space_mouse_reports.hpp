// Decodes the HID reports of a SpaceMouse.
#pragma once

#include <cstdint>
#include <span>

#include "common/base/spatial.hpp"

namespace tandem::devices {

/// Computes the newest deflection of the cap from reports. Id and length of a report determine its layout:
/// * joined: one report with id 1 and 13 bytes has all six numbers
/// * split: two reports with the ids 1 and 2 and 7 bytes have three numbers each
/// Numbers are little-endian int16.
///
/// Model   Converts from the device's axes (x right, y towards the user, z down) to the axes of D (x right, y away, z
///         up). This is a rotation by 180° about x, for translations and rotation vectors alike
class SpaceMouseReports {
 public:
  enum class Kind : std::uint8_t { kMotion, kButtons, kOther, kBad };

  /// Decodes a report. Reports other than motion and buttons have no effect.
  Kind parse(std::span<const std::uint8_t> report) noexcept;
  /// Sets the deflection to zero. Called when the report of a released cap was lost.
  void rest() noexcept { deflection_.setZero(); }
  /// Returns the deflection in D as (translation, rotation), each number −1 to 1. Small values are replaced by 0,
  /// because a released cap does not return exactly to the centre.
  const Vec6& deflection() const { return deflection_; }
  /// Returns the bits of Button: the left button is grab, the right one clutch.
  std::uint32_t buttons() const { return buttons_; }

 private:
  void read_three(std::span<const std::uint8_t> bytes, int first) noexcept;

  Vec6 deflection_ = Vec6::Zero();
  std::uint32_t buttons_ = 0;
};

}  // namespace tandem::devices
