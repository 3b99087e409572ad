// Actions of a server towards a client, encoded as bytes: the input of hostile_server_fuzz.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace tandem::fuzz {

/// One action. Unknown kinds are treated as kTime.
enum class ServerAct : std::uint8_t {
  kMessage,   ///< sends a control message in a frame
  kStream,    ///< sends raw bytes on the control stream
  kDatagram,  ///< sends a datagram of raw bytes
  kState,     ///< sends a state after a valid header
  kHangUp,    ///< ends the connection
  kTime,      ///< advances the time by one millisecond for each byte
};

struct ScriptedAct {
  ServerAct act = ServerAct::kTime;
  std::span<const std::byte> bytes;
};

/// Reads the next action from the front of `script`.
/// Model   kind of the action (1 byte), size (2 bytes, little-endian), content; truncated at the end of the input
inline ScriptedAct next_act(std::span<const std::byte>& script) {
  constexpr std::size_t kHead = 3;
  const auto number = [&script](std::size_t i) { return std::to_integer<std::size_t>(script[i]); };
  if (script.size() < kHead) {
    script = {};
    return {};
  }
  const ServerAct act{static_cast<std::uint8_t>(number(0))};
  const std::size_t size = std::min(number(1) + 256 * number(2), script.size() - kHead);
  const ScriptedAct next{act, script.subspan(kHead, size)};
  script = script.subspan(kHead + size);
  return next;
}

inline void append_act(ServerAct act, std::span<const std::byte> bytes, std::vector<std::byte>& script) {
  for (const std::size_t number : {static_cast<std::size_t>(act), bytes.size() % 256, bytes.size() / 256})
    script.push_back(static_cast<std::byte>(number));
  script.insert(script.end(), bytes.begin(), bytes.end());
}

}  // namespace tandem::fuzz
