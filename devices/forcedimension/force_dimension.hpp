// Devices of Force Dimension (omega, delta, sigma) by their maker's SDK. Written after its public documentation; no
// hardware was here.
#pragma once

#include <memory>

#include "common/haptics/velocity_estimator.hpp"
#include "devices/threaded_device.hpp"
#include "devices/vendor_library.hpp"

namespace tandem::devices {

/// What is used of the SDK; a result below 0 is a failure. Metres, radians, newtons, newton metres. The last argument is
/// the device, -1 the one opened last.
struct DhdFunctions {
  int (*open)() = nullptr;
  int (*close)(char) = nullptr;
  int (*enable_force)(unsigned char, char) = nullptr;
  int (*get_pose)(double*, double*, double*, double (*)[3], char) = nullptr;
  int (*set_force)(double, double, double, double, double, double, char) = nullptr;
  int (*get_button)(int, char) = nullptr;
  int (*set_watchdog)(unsigned char, char) = nullptr;
};
/// Fails   std::runtime_error: as VendorLibrary
DhdFunctions dhd_functions(const std::filesystem::path& library);

/// Base frame D: x right, y away from the user, z up. The SDK's: x towards the user, y right, z up.
/// First button grab, second clutch. The device must have been initialised by its maker's program (autoinit).
///
/// Thread  the device's
class ForceDimensionDriver final : public DeviceDriver {
 public:
  ForceDimensionDriver(DeviceSpec spec, const DhdFunctions& dhd);
  ~ForceDimensionDriver() override;
  ForceDimensionDriver(const ForceDimensionDriver&) = delete;
  ForceDimensionDriver& operator=(const ForceDimensionDriver&) = delete;

  const DeviceSpec& spec() const noexcept override { return spec_; }
  DeviceSample step(LocalTime now, const Wrench& wrench_on_hand_D) override;
  bool may_be_on() const noexcept override { return may_be_on_; }

 private:
  bool open(LocalTime now);
  bool show(const Wrench& wrench_on_hand_D);
  void close();

  DeviceSpec spec_;
  DhdFunctions dhd_;
  Absence absence_;
  int id_ = -1;  ///< below 0: not open
  bool may_be_on_ = false;
  haptics::VelocityEstimator velocity_;
};

}  // namespace tandem::devices
