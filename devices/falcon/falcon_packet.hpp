// Packets of the Falcon. They have 16 bytes in both directions: `<`, fourteen bytes of 0x41 + value, `>`.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "devices/falcon/falcon_kinematics.hpp"

namespace tandem::devices {

inline constexpr std::size_t kFalconPacketSize = 16;
using FalconPacket = std::array<std::uint8_t, kFalconPacketSize>;

/// Bits sent to the device: start of homing, and the colours of its lights.
inline constexpr std::uint8_t kFalconHome = 1, kFalconGreen = 2, kFalconBlue = 4, kFalconRed = 8;
/// Bits received from the device: buttons of the grip, and kFalconHomed for the three homed arms.
inline constexpr std::uint8_t kFalconRight = 1, kFalconForward = 2, kFalconCentre = 4, kFalconLeft = 8;
inline constexpr std::uint8_t kFalconHomed = 0x70;

/// Returns a packet from host to device; the motor commands are clamped to ±4095.
FalconPacket falcon_request(const FalconCounts& motors, std::uint8_t lights_and_home);

/// Content of a packet from the device to the host.
struct FalconReply {
  FalconCounts encoders = FalconCounts::Zero();
  std::uint8_t bits = 0;
};

/// Decodes the three numbers and the bits of a packet of either direction. Returns nothing if the bytes are no packet.
std::optional<FalconReply> read_falcon_packet(std::span<const std::uint8_t, kFalconPacketSize> bytes);

/// Finds packets in a byte stream. If a packet proves invalid, the search continues at the next `<` after its first
/// byte, even within the invalid packet.
class FalconPacketParser {
 public:
  /// Processes one byte. Returns the content of a packet if this byte completes one, otherwise nothing.
  std::optional<FalconReply> parse(std::uint8_t byte) noexcept;
  void reset() noexcept { length_ = 0; }
  /// Returns the number of bytes that belonged to no packet.
  std::uint64_t skipped() const { return skipped_; }

 private:
  void skip_to_next_start() noexcept;

  FalconPacket bytes_{};
  std::size_t length_ = 0;
  std::uint64_t skipped_ = 0;
};

}  // namespace tandem::devices
