// Messages to and from the service of the Inverse3, in JSON.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/spatial.hpp"

namespace tandem::devices {

/// State of the first Inverse3 and of the first grip in a message.
struct Inverse3State {
  std::string device_id;  ///< id as JSON text: "\"0417\"" or "3"
  std::optional<Vec3> cursor_m;
  Vec3 cursor_m_per_s = Vec3::Zero();
  std::optional<Quat> grip;   ///< orientation of the grip
  std::uint32_t buttons = 0;  ///< bits of Button: button a is grab, b and c are clutch
};

/// Parses a message. Returns nothing if the text is not JSON or contains no Inverse3 with an id. Other fields are
/// optional: a missing or invalid one stays empty.
std::optional<Inverse3State> read_inverse3_state(std::string_view text);

/// Returns the command that sets the force on the hand [N], given in the axes of the service.
std::string inverse3_command(std::string_view device_id, const Vec3& force_n);

}  // namespace tandem::devices
