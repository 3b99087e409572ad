// Devices of 3D Systems (Touch, Touch X, Phantom), used through the HD layer of the manufacturer's OpenHaptics. This
// code follows the public documentation and has not been tested on hardware.
#pragma once

#include <memory>
#include <string>

#include "devices/threaded_device.hpp"
#include "devices/vendor_library.hpp"

namespace tandem::devices {

/// The HD functions in use. Units: millimetres, newtons. Axes: x right, y up, z towards the user.
struct HdFunctions {
  struct Error {
    unsigned code = 0;  ///< error code of the SDK; 0: no error
    int internal_code = 0;
    unsigned device = 0;
  };
  unsigned (*init_device)(const char*) = nullptr;
  void (*disable_device)(unsigned) = nullptr;
  void (*make_current)(unsigned) = nullptr;
  void (*enable)(unsigned) = nullptr;
  void (*start_scheduler)() = nullptr;
  void (*stop_scheduler)() = nullptr;
  /// Calls the given function once on the SDK's servo thread, and waits until this call has ended.
  void (*schedule)(unsigned (*)(void*), void*, unsigned short) = nullptr;
  void (*begin_frame)(unsigned) = nullptr;
  void (*end_frame)(unsigned) = nullptr;
  void (*get_doubles)(unsigned, double*) = nullptr;
  void (*get_integers)(unsigned, int*) = nullptr;
  void (*set_doubles)(unsigned, const double*) = nullptr;
  Error (*get_error)() = nullptr;
};
/// Loads the library and looks up the functions.
/// Fails   std::runtime_error: see VendorLibrary
HdFunctions hd_functions(const std::filesystem::path& library, const std::string& setting = "--library");

/// Driver of one device. Base frame D: x right, y away from the user, z up. The first button is grab, the second
/// clutch. Torque is not displayed.
///
/// Thread  the thread of the device. Each step waits for the next tick of the SDK's servo thread, up to a millisecond
class OpenHapticsDriver final : public DeviceDriver {
 public:
  OpenHapticsDriver(DeviceSpec spec, const HdFunctions& hd);
  ~OpenHapticsDriver() override;
  OpenHapticsDriver(const OpenHapticsDriver&) = delete;
  OpenHapticsDriver& operator=(const OpenHapticsDriver&) = delete;

  const DeviceSpec& spec() const noexcept override { return spec_; }
  DeviceSample step(LocalTime now, const Wrench& wrench_on_hand_D) override;
  bool may_be_on() const noexcept override { return may_be_on_; }

 private:
  /// Data exchanged with the servo thread in one tick.
  struct Frame {
    const HdFunctions* hd = nullptr;
    unsigned device = 0;
    double force_n[3] = {};
    double velocity_mm_per_s[3] = {};
    double transform[16] = {};  ///< column-major 4 × 4 matrix; position in mm
    int buttons = 0;
    bool is_good = false;
  };
  static unsigned exchange(void* frame);
  bool open(LocalTime now);
  void close();
  bool run(const Vec3& force_on_hand_D);

  DeviceSpec spec_;
  HdFunctions hd_;
  Absence absence_;
  bool is_open_ = false;
  bool may_be_on_ = false;
  Frame frame_;
};

}  // namespace tandem::devices
