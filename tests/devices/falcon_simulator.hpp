// Simulates the protocol of a Falcon. It receives the bytes and requests of the FTDI bridge, returns bytes, and can
// inject faults.
//
//   LOADER  baud rate 9600    after DTR rises: answers 0A 44 2C 0D with 0A 43 0D, then waits for the upload's baud rate
//   UPLOAD  baud rate 0x0015  echoes 41, then each byte of the firmware
//   RUN     baud rate 0x0002  with firmware: sends one packet for each received packet; without: sends nothing
//
// Two properties are not verified with hardware. The response times are chosen to suit the host's protocol. The device
// counts as homed when the grip passes z = 0.08 m while homing is requested.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "devices/falcon/falcon_packet.hpp"
#include "devices/falcon/falcon_port.hpp"

namespace tandem::devices {

struct FalconFaults {
  int greetings_ignored = 0;      ///< number of greetings that the loader ignores at first
  bool greets_with_zero = false;  ///< true: sends a byte 00 before its answer to a greeting
  int uploads_corrupted = 0;      ///< number of first uploads in which one byte is echoed wrongly
  bool stops_in_upload = false;   ///< true: sends nothing more after 1000 bytes
  bool sends_garbage = false;     ///< true: sends invalid bytes before each reply
  bool splits_replies = false;    ///< true: distributes each reply over three USB packets
  int replies_delayed_by = 0;     ///< number of empty USB packets before each reply
  bool has_frozen_encoders = false;
  bool is_mute = false;
  bool is_unplugged = false;
};

class FalconSimulator {
 public:
  explicit FalconSimulator(std::size_t firmware_size) : firmware_size_(firmware_size) {}

  /// Returns false if the device is disconnected.
  bool control(std::uint8_t request, std::uint16_t value);
  bool write(std::span<const std::uint8_t> bytes);
  /// Returns the next USB packet: two status bytes and any data. Empty if the device is disconnected.
  std::optional<std::vector<std::uint8_t>> read();
  /// Clears the firmware, as after a loss of power.
  void cycle_power();

  FalconFaults faults;
  Vec3 grip_m = Vec3(0, 0, 0.125);  ///< position in the device's coordinates [m]
  std::uint8_t buttons = 0;
  FalconCounts motors = FalconCounts::Zero();  ///< last received motor counts
  std::uint8_t lights_and_home = 0;
  bool has_firmware = false;
  bool is_homed = false;
  std::vector<std::uint8_t> uploaded;
  int uploads_begun = 0;

 private:
  void receive(std::uint8_t byte);
  void receive_in_loader(std::uint8_t byte);
  void receive_in_upload(std::uint8_t byte);
  void receive_in_run(const FalconReply& command);
  void queue_reply(std::span<const std::uint8_t> bytes);
  FalconCounts encoders();

  std::size_t firmware_size_;
  std::uint16_t baud_ = 0;
  bool is_dtr_high_ = false;
  bool has_dtr_risen_ = false;
  bool is_fast_ = false;
  std::vector<std::uint8_t> loader_bytes_;
  FalconPacketParser parser_;
  std::deque<std::vector<std::uint8_t>> to_host_;
  FalconCounts encoders_ = FalconCounts::Zero();
};

}  // namespace tandem::devices
