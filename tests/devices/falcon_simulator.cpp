// Implementation of the simulator; see falcon_simulator.hpp.
#include "tests/devices/falcon_simulator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace tandem::devices {
namespace {

constexpr std::array<std::uint8_t, 2> kStatus{0x01, 0x60};
constexpr std::array<std::uint8_t, 3> kGreeting{0x0a, 0x43, 0x0d};
constexpr double kHomeStop_m = 0.08;

}  // namespace

bool FalconSimulator::control(std::uint8_t request, std::uint16_t value) {
  if (faults.is_unplugged) return false;
  if (request == 0 && value == kFtdiPurgeReceived) to_host_.clear();
  if (request == 3) baud_ = value;
  if (request == 1 && (value & 0x100U) != 0) {
    const bool is_high = (value & 1U) != 0;
    if (is_high && !is_dtr_high_) {
      has_dtr_risen_ = true;
      is_fast_ = false;
      uploaded.clear();
      loader_bytes_.clear();
    }
    is_dtr_high_ = is_high;
  }
  return true;
}

bool FalconSimulator::write(std::span<const std::uint8_t> bytes) {
  if (faults.is_unplugged) return false;
  for (const std::uint8_t byte : bytes) receive(byte);
  return true;
}

std::optional<std::vector<std::uint8_t>> FalconSimulator::read() {
  if (faults.is_unplugged) return std::nullopt;
  std::vector<std::uint8_t> packet(kStatus.begin(), kStatus.end());
  if (to_host_.empty()) return packet;
  packet.insert(packet.end(), to_host_.front().begin(), to_host_.front().end());
  to_host_.pop_front();
  return packet;
}

void FalconSimulator::cycle_power() {
  has_firmware = is_homed = has_dtr_risen_ = is_fast_ = false;
  motors.setZero();
  to_host_.clear();
}

void FalconSimulator::receive(std::uint8_t byte) {
  if (faults.is_mute) return;
  if (baud_ == kFtdiBaudLoader && has_dtr_risen_) return receive_in_loader(byte);
  if (baud_ == kFtdiBaudUpload && has_dtr_risen_) return receive_in_upload(byte);
  if (baud_ != kFtdiBaudRun || !has_firmware) return;
  if (const auto command = parser_.parse(byte)) receive_in_run(*command);
}

void FalconSimulator::receive_in_loader(std::uint8_t byte) {
  loader_bytes_.push_back(byte);
  if (loader_bytes_.size() < kGreeting.size()) return;
  const bool is_greeting = std::ranges::equal(loader_bytes_, kGreeting);
  loader_bytes_.clear();
  if (!is_greeting || --faults.greetings_ignored >= 0) return;
  constexpr std::array<std::uint8_t, 5> kAnswer{0x00, 0x0a, 0x44, 0x2c, 0x0d};
  queue_reply(std::span(kAnswer).subspan(faults.greets_with_zero ? 0 : 1));
}

void FalconSimulator::receive_in_upload(std::uint8_t byte) {
  if (!is_fast_) {
    is_fast_ = byte == 0x41;
    ++uploads_begun;
    return queue_reply(std::array{byte});
  }
  uploaded.push_back(byte);
  if (faults.stops_in_upload && uploaded.size() > 1000) return;
  const bool is_spoilt = faults.uploads_corrupted > 0 && uploaded.size() == 3000;
  if (is_spoilt) --faults.uploads_corrupted;
  const std::uint8_t back = is_spoilt ? static_cast<std::uint8_t>(byte ^ 0x10U) : byte;
  if (!to_host_.empty() && to_host_.back().size() < 62) {
    to_host_.back().push_back(back);
  } else {
    queue_reply(std::array{back});
  }
  has_firmware = uploaded.size() == firmware_size_;
}

void FalconSimulator::receive_in_run(const FalconReply& command) {
  motors = command.encoders;
  lights_and_home = command.bits;
  if ((lights_and_home & kFalconHome) != 0 && grip_m.z() < kHomeStop_m) is_homed = true;
  const FalconCounts counts = encoders();
  FalconPacket reply = falcon_request(counts, 0);
  reply[13] = static_cast<std::uint8_t>('A' + (buttons | (is_homed ? kFalconHomed : 0)));
  for (int i = 0; i < faults.replies_delayed_by; ++i) to_host_.emplace_back();
  constexpr std::array<std::uint8_t, 5> kGarbage{'<', 'x', 0x00, '<', 'A'};
  if (faults.sends_garbage) queue_reply(kGarbage);
  if (!faults.splits_replies) return queue_reply(reply);
  const std::span bytes(reply);
  queue_reply(bytes.subspan(0, 1));
  queue_reply(bytes.subspan(1, 9));
  queue_reply(bytes.subspan(10));
}

void FalconSimulator::queue_reply(std::span<const std::uint8_t> bytes) {
  to_host_.emplace_back(bytes.begin(), bytes.end());
}

FalconCounts FalconSimulator::encoders() {
  const auto angles = falcon_inverse(grip_m);
  if (!angles || faults.has_frozen_encoders) return encoders_;
  const Vec3 zero = falcon_angles(FalconCounts::Zero());
  const double a_count = falcon_angles(FalconCounts::Ones()).x() - zero.x();
  encoders_ = ((*angles - zero) / a_count).array().round().cast<int>().matrix();
  return encoders_;
}

}  // namespace tandem::devices
