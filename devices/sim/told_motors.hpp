// A simulated device whose commands also go where a real one's go: out of the program, with a watchdog.
#pragma once

#include <filesystem>
#include <memory>

#include "devices/device.hpp"
#include "devices/watchdog.hpp"

namespace tandem::devices {

/// Shows what the motors of a device receive, also from the watchdog, without hardware. Each command is three doubles of this
/// machine, the force on the hand [N]. It is written at once and whole (a pipe takes up to PIPE_BUF bytes so), or it is lost: then
/// the motors keep the command before.
class ToldMotors final : public Device {
 public:
  /// In      file  a pipe with a reader, or a file, to which is added
  /// Fails   std::runtime_error: the file cannot be written; as Watchdog
  ToldMotors(std::unique_ptr<Device> device, const std::filesystem::path& file, int realtime_priority);
  ~ToldMotors() override;
  ToldMotors(const ToldMotors&) = delete;
  ToldMotors& operator=(const ToldMotors&) = delete;

  const DeviceSpec& spec() const noexcept override { return device_->spec(); }
  DeviceSample read(LocalTime now) noexcept override { return device_->read(now); }
  bool write(LocalTime now, const Wrench& wrench_on_hand_D) noexcept override;
  void begin_path_at(LocalTime start) noexcept override { device_->begin_path_at(start); }
  bool has_let_go() noexcept override { return watchdog_.has_let_go(); }
  bool may_be_on() const noexcept override { return may_be_on_; }

 private:
  std::unique_ptr<Device> device_;
  int file_;
  Watchdog watchdog_;
  bool may_be_on_ = false;  ///< a force was given, and zero was not delivered since
};

}  // namespace tandem::devices
