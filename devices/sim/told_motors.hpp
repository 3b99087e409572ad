// A simulated device that writes its commands to a file or pipe, too, and has a watchdog like a real device.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "devices/device.hpp"
#include "devices/watchdog.hpp"

namespace tandem::devices {

/// Makes motor commands, including those of the watchdog, observable without hardware. A command consists of three
/// doubles in native format: the force on the hand [N]. A command is shorter than PIPE_BUF, so it is written at once
/// and as a whole. If the write fails, the command is lost, and the motors keep the previous command.
class ToldMotors final : public Device {
 public:
  /// In      file     a pipe with a reader, or a file to which commands are appended
  ///         setting  how messages name the setting that gives the file
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
