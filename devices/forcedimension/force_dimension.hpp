// Devices of Force Dimension (omega, delta, sigma), used through the manufacturer's SDK. This code follows the public
// documentation and has not been tested on hardware.
#pragma once

#include <memory>
#include <string>

#include "common/haptics/velocity_estimator.hpp"
#include "devices/threaded_device.hpp"
#include "devices/vendor_library.hpp"

namespace tandem::devices {

/// The functions of the SDK that this driver calls. A negative result means failure. Units: metres, radians, newtons,
/// newton metres. The last argument of each function selects the device; −1 is the device that was opened last.
struct DhdFunctions {
  int (*open)() = nullptr;
  int (*close)(char) = nullptr;
  int (*enable_force)(unsigned char, char) = nullptr;
  int (*get_pose)(double*, double*, double*, double (*)[3], char) = nullptr;
  int (*set_force)(double, double, double, double, double, double, char) = nullptr;
  int (*get_button)(int, char) = nullptr;
  int (*set_watchdog)(unsigned char, char) = nullptr;
};
/// Loads the library and looks up the functions.
/// Fails   std::runtime_error: see VendorLibrary
DhdFunctions dhd_functions(const std::filesystem::path& library, const std::string& setting = "--library");

/// Driver of one device. Base frame D: x right, y away from the user, z up. (In the SDK, x is towards the user, y
/// right, z up.) The first button is grab, the second clutch. The device must have been initialised with the
/// manufacturer's program (autoinit).
///
/// Thread  the thread of the device
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
  int id_ = -1;  ///< id of the device in the SDK; negative: not open
  bool may_be_on_ = false;
  haptics::VelocityEstimator velocity_;
};

}  // namespace tandem::devices
