// A Falcon at protocol level: bytes and requests of its FTDI bridge in, bytes out, with faults on request.
//
//   LOADER  (9600)    once DTR went from low to high: 0A 44 2C 0D to 0A 43 0D; then it waits for the upload's speed
//   UPLOAD  (0x0015)  41 comes back, then each byte of the firmware
//   RUN     (0x0002)  with its firmware: a packet for each packet; without: nothing
//
// When it answers, and that it is homed when the grip passes z = 0.08 m while it is asked to home, is this simulator's
// choice, fitted to what the host does; no hardware was looked at.
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
  int greetings_ignored = 0;      ///< of the loader, at first
  bool greets_with_zero = false;  ///< a 00 before its answer
  int uploads_corrupted = 0;      ///< of the first so many one byte comes back wrong
  bool stops_in_upload = false;   ///< after 1000 bytes it says nothing more
  bool sends_garbage = false;     ///< before each reply
  bool splits_replies = false;    ///< over three packets of the bus
  int replies_delayed_by = 0;     ///< packets of the bus without data before each
  bool has_frozen_encoders = false;
  bool is_mute = false;
  bool is_unplugged = false;
};

class FalconSimulator {
 public:
  explicit FalconSimulator(std::size_t firmware_size) : firmware_size_(firmware_size) {}

  /// False: gone.
  bool control(std::uint8_t request, std::uint16_t value);
  bool write(std::span<const std::uint8_t> bytes);
  /// The next packet of the bus: two bytes of status, then data if there are any. None: gone.
  std::optional<std::vector<std::uint8_t>> read();
  /// Without power its firmware is gone.
  void cycle_power();

  FalconFaults faults;
  Vec3 grip_m = Vec3(0, 0, 0.125);  ///< in the device's own frame
  std::uint8_t buttons = 0;
  FalconCounts motors = FalconCounts::Zero();  ///< told last
  std::uint8_t lights_and_home = 0;
  bool has_firmware = false;
  bool is_homed = false;
  std::vector<std::uint8_t> uploaded;
  int uploads_begun = 0;

 private:
  void take(std::uint8_t byte);
  void take_in_loader(std::uint8_t byte);
  void take_in_upload(std::uint8_t byte);
  void take_in_run(const FalconReply& command);
  void say(std::span<const std::uint8_t> bytes);
  FalconCounts encoders();

  std::size_t firmware_size_;
  std::uint16_t baud_ = 0;
  bool is_dtr_high_ = false;
  bool has_dtr_risen_ = false;
  bool is_fast_ = false;
  std::vector<std::uint8_t> said_to_loader_;
  FalconPacketParser parser_;
  std::deque<std::vector<std::uint8_t>> to_host_;
  FalconCounts encoders_ = FalconCounts::Zero();
};

}  // namespace tandem::devices
