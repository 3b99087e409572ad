// A simulated device with a watchdog like a real device. It also writes its commands to a file or pipe, for tests.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "devices/device.hpp"
#include "devices/watchdog.hpp"

namespace tandem::devices {

/// Makes the motor commands of a simulated device observable, including those of the watchdog. A command consists of
/// three doubles in native format: the force on the hand [N]. It is shorter than PIPE_BUF, so each write is atomic. If
/// a write fails, its command is lost, and the previous command remains in effect.
class ToldMotors final : public Device {
 public:
  /// In      file     a pipe with a reader, or a file to which commands are appended
  ///         setting  name of the setting that gives the file, for error messages
  /// Fails   std::runtime_error: the file cannot be written; see also Watchdog
  ToldMotors(std::unique_ptr<Device> device, const std::filesystem::path& file, int realtime_priority,
             const std::string& setting = "--motors");
  ~ToldMotors() override;
  ToldMotors(const ToldMotors&) = delete;
  ToldMotors& operator=(const ToldMotors&) = delete;

  const DeviceSpec& spec() const noexcept override { return device_->spec(); }
  DeviceSample read(LocalTime now) noexcept override { return device_->read(now); }
  bool write(LocalTime now, const Wrench& wrench_on_hand_D) noexcept override;
  void begin_path_at(LocalTime start) noexcept override { device_->begin_path_at(start); }
  bool has_released_force() noexcept override { return watchdog_.has_released_force(); }
  bool may_be_on() const noexcept override { return may_be_on_; }

 private:
  std::unique_ptr<Device> device_;
  int file_;
  Watchdog watchdog_;
  bool may_be_on_ = false;  ///< whether a force was written after the last zero
};

}  // namespace tandem::devices
