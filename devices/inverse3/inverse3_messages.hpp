// What the Inverse3's service says, and what it is told: JSON.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/spatial.hpp"

namespace tandem::devices {

/// Of the first Inverse3 of a message, and the first grip.
struct Inverse3State {
  std::string device_id;  ///< as JSON: "\"0417\"" or "3"
  std::optional<Vec3> cursor_m;
  Vec3 cursor_m_per_s = Vec3::Zero();
  std::optional<Quat> grip;   ///< its orientation
  std::uint32_t buttons = 0;  ///< bits of Button: a is grab, b and c are clutch
};

/// None: no JSON, or without an Inverse3 that has an id. What else is missing or no number is left out.
std::optional<Inverse3State> read_inverse3_state(std::string_view text);

/// A force on the hand [N], in the axes of the service.
std::string inverse3_command(std::string_view device_id, const Vec3& force_n);

}  // namespace tandem::devices
