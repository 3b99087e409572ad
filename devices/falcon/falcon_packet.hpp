// The Falcon's packets: 16 bytes both ways, `<`, fourteen of 0x41 + value, `>`.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "devices/falcon/falcon_kinematics.hpp"

namespace tandem::devices {

inline constexpr std::size_t kFalconPacketSize = 16;
using FalconPacket = std::array<std::uint8_t, kFalconPacketSize>;

/// Bits to the device.
inline constexpr std::uint8_t kFalconHome = 1, kFalconGreen = 2, kFalconBlue = 4, kFalconRed = 8;
/// Bits from the device: buttons of the grip, and the arms that know their zero.
inline constexpr std::uint8_t kFalconRight = 1, kFalconForward = 2, kFalconCentre = 4, kFalconLeft = 8;
inline constexpr std::uint8_t kFalconHomed = 0x70;

/// What the host says; numbers are cut to ±4095.
FalconPacket falcon_request(const FalconCounts& motors, std::uint8_t lights_and_home);

/// What the device says.
struct FalconReply {
  FalconCounts encoders = FalconCounts::Zero();
  std::uint8_t bits = 0;
};

/// The three numbers and the bits of a packet, from either side. None: it is no packet.
std::optional<FalconReply> read_falcon_packet(std::span<const std::uint8_t, kFalconPacketSize> bytes);

/// Finds packets in a stream of bytes: what is none is skipped to the next `<`, not by a packet's length.
class FalconPacketParser {
 public:
  /// The packet that this byte ends, if it does.
  std::optional<FalconReply> take(std::uint8_t byte) noexcept;
  void reset() noexcept { length_ = 0; }
  /// Bytes that belonged to no packet.
  std::uint64_t skipped() const { return skipped_; }

 private:
  void skip_to_next_start() noexcept;

  FalconPacket bytes_{};
  std::size_t length_ = 0;
  std::uint64_t skipped_ = 0;
};

}  // namespace tandem::devices
