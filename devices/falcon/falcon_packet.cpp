#include "devices/falcon/falcon_packet.hpp"

#include <algorithm>

namespace tandem::devices {
namespace {

constexpr std::uint8_t kStart = '<', kEnd = '>', kZero = 'A';
constexpr int kMaxNumber = 4095;
constexpr std::size_t kBits = 13;

// Writes a number in two's complement as four nibbles, lowest nibble first.
void write_number(int number, std::span<std::uint8_t, 4> bytes) {
  auto rest = static_cast<std::uint16_t>(std::clamp(number, -kMaxNumber, kMaxNumber));
  for (std::uint8_t& byte : bytes) {
    byte = static_cast<std::uint8_t>(kZero + (rest & 0xfU));
    rest = static_cast<std::uint16_t>(rest >> 4U);
  }
}

std::optional<int> read_number(std::span<const std::uint8_t, 4> bytes) {
  unsigned number = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    if (bytes[i] < kZero || bytes[i] > kZero + 0xfU) return std::nullopt;
    number |= (bytes[i] - unsigned{kZero}) << (4 * i);
  }
  return static_cast<std::int16_t>(number);
}

}  // namespace

FalconPacket falcon_request(const FalconCounts& motors, std::uint8_t lights_and_home) {
  FalconPacket packet;
  packet.fill(kZero);
  packet.front() = kStart;
  packet.back() = kEnd;
  const std::span bytes(packet);
  write_number(motors[0], bytes.subspan<1, 4>());
  write_number(motors[1], bytes.subspan<5, 4>());
  write_number(motors[2], bytes.subspan<9, 4>());
  packet[kBits] = static_cast<std::uint8_t>(kZero + (lights_and_home & 0xfU));
  return packet;
}

std::optional<FalconReply> read_falcon_packet(std::span<const std::uint8_t, kFalconPacketSize> bytes) {
  if (bytes.front() != kStart || bytes.back() != kEnd || bytes[kBits] < kZero) return std::nullopt;
  const auto first = read_number(bytes.subspan<1, 4>());
  const auto second = read_number(bytes.subspan<5, 4>());
  const auto third = read_number(bytes.subspan<9, 4>());
  if (!first || !second || !third) return std::nullopt;
  // The last byte holds the bits of buttons and homed arms. Unlike the number bytes, it is not limited to a nibble.
  return FalconReply{{*first, *second, *third}, static_cast<std::uint8_t>(bytes[kBits] - kZero)};
}

std::optional<FalconReply> FalconPacketParser::parse(std::uint8_t byte) noexcept {
  if (length_ == 0 && byte != kStart) {
    ++skipped_;
    return std::nullopt;
  }
  bytes_[length_++] = byte;
  if (length_ < kFalconPacketSize) return std::nullopt;
  const std::optional<FalconReply> reply = read_falcon_packet(bytes_);
  if (!reply) {
    skip_to_next_start();
    return std::nullopt;
  }
  length_ = 0;
  return reply;
}

void FalconPacketParser::skip_to_next_start() noexcept {
  const auto end = bytes_.begin() + static_cast<std::ptrdiff_t>(length_);
  const auto next = std::find(bytes_.begin() + 1, end, kStart);
  skipped_ += static_cast<std::uint64_t>(next - bytes_.begin());
  length_ = static_cast<std::size_t>(std::copy(next, end, bytes_.begin()) - bytes_.begin());
}

}  // namespace tandem::devices
