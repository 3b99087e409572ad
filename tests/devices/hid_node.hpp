// Emulates the hidraw node of a SpaceNavigator with umockdev, for use with hidapi. A program that uses this file must
// run under umockdev-wrapper.
#pragma once

#include <glib.h>
#include <linux/hidraw.h>
#include <sys/ioctl.h>
#include <umockdev.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace tandem::devices {

inline constexpr const char* kHidPath =
    "/sys/devices/pci0000:00/0000:00:14.0/usb1/1-3/1-3:1.0/0003:046D:C626.0001/hidraw/hidraw5";
inline constexpr const char* kHidNode = "/dev/hidraw5";
// Report descriptor. hidapi reads only its first usage: multi-axis controller.
inline std::uint8_t kHidDescriptor[] = {0x05, 0x01, 0x09, 0x08, 0xa1, 0x01, 0xc0};
inline constexpr const char* kHidDevice =
    R"(P: /devices/pci0000:00/0000:00:14.0/usb1/1-3/1-3:1.0/0003:046D:C626.0001/hidraw/hidraw5
N: hidraw5=00
E: DEVNAME=/dev/hidraw5
E: SUBSYSTEM=hidraw
L: device=../../../0003:046D:C626.0001

P: /devices/pci0000:00/0000:00:14.0/usb1/1-3/1-3:1.0/0003:046D:C626.0001
E: SUBSYSTEM=hid
E: DRIVER=hid-generic
E: HID_ID=0003:0000046D:0000C626
E: HID_NAME=3Dconnexion SpaceNavigator
E: HID_UNIQ=
H: report_descriptor=05010908A101C0

P: /devices/pci0000:00/0000:00:14.0/usb1/1-3/1-3:1.0
E: DEVTYPE=usb_interface
E: SUBSYSTEM=usb
A: bInterfaceNumber=00\n

P: /devices/pci0000:00/0000:00:14.0/usb1/1-3
E: DEVTYPE=usb_device
E: SUBSYSTEM=usb
A: idVendor=046d\n
A: idProduct=c626\n
A: bcdDevice=0435\n
A: manufacturer=3Dconnexion\n
A: product=SpaceNavigator\n
)";

/// Sends the current report every 8 ms and records the commands to the device's light.
class HidNode {
 public:
  HidNode() : testbed_(umockdev_testbed_new()) {
    GError* error = nullptr;
    umockdev_testbed_add_from_string(testbed_, kHidDevice, &error);
    if (error != nullptr) throw std::runtime_error(error->message);
    handler_ = UMOCKDEV_IOCTL_BASE(g_object_new(UMOCKDEV_TYPE_IOCTL_BASE, nullptr));
    g_signal_connect(handler_, "handle-ioctl", G_CALLBACK(&HidNode::on_ioctl), this);
    g_signal_connect(handler_, "handle-read", G_CALLBACK(&HidNode::on_read), this);
    g_signal_connect(handler_, "handle-write", G_CALLBACK(&HidNode::on_write), this);
    umockdev_testbed_attach_ioctl(testbed_, kHidNode, handler_, &error);
    if (error != nullptr) throw std::runtime_error(error->message);
  }
  ~HidNode() {
    umockdev_testbed_detach_ioctl(testbed_, kHidNode, nullptr);
    g_object_unref(handler_);
    g_object_unref(testbed_);
  }
  HidNode(const HidNode&) = delete;
  HidNode& operator=(const HidNode&) = delete;

  /// Sets the current report. An empty report stops the sending.
  void hold(std::vector<std::uint8_t> report) {
    const std::lock_guard lock(mutex_);
    report_ = std::move(report);
  }
  void unplug() { is_unplugged_ = true; }
  void plug_in() { is_unplugged_ = false; }
  int light() const { return light_; }

 private:
  static gboolean on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
    return static_cast<HidNode*>(self)->describe(client);
  }
  static gboolean on_read(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
    return static_cast<HidNode*>(self)->read(client);
  }
  static gboolean on_write(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
    return static_cast<HidNode*>(self)->write(client);
  }
  static gboolean done(UMockdevIoctlClient* client, glong result, int error = 0) {
    umockdev_ioctl_client_complete(client, result, error);
    return TRUE;
  }
  gboolean describe(UMockdevIoctlClient* client) {
    if (is_unplugged_) return done(client, -1, ENODEV);
    const gulong request = umockdev_ioctl_client_get_request(client);
    UMockdevIoctlData* const argument = umockdev_ioctl_client_get_arg(client);
    if (request == HIDIOCGRDESCSIZE) {
      int size = sizeof kHidDescriptor;
      UMockdevIoctlData* const data = umockdev_ioctl_data_resolve(argument, 0, sizeof size, nullptr);
      umockdev_ioctl_data_update(data, 0, reinterpret_cast<guint8*>(&size), sizeof size);
      return done(client, 0);
    }
    if (request != HIDIOCGRDESC) return done(client, -1, ENOTTY);
    UMockdevIoctlData* const data = umockdev_ioctl_data_resolve(argument, 0, sizeof(hidraw_report_descriptor), nullptr);
    umockdev_ioctl_data_update(data, offsetof(hidraw_report_descriptor, value), kHidDescriptor, sizeof kHidDescriptor);
    return done(client, 0);
  }
  gboolean read(UMockdevIoctlClient* client) {
    if (is_unplugged_) return done(client, -1, EIO);
    std::this_thread::sleep_for(std::chrono::milliseconds(8));
    const std::lock_guard lock(mutex_);
    if (report_.empty()) return done(client, -1, EAGAIN);
    UMockdevIoctlData* const buffer = umockdev_ioctl_client_get_arg(client);
    umockdev_ioctl_data_update(buffer, 0, report_.data(), static_cast<int>(report_.size()));
    return done(client, static_cast<glong>(report_.size()));
  }
  gboolean write(UMockdevIoctlClient* client) {
    if (is_unplugged_) return done(client, -1, EIO);
    const UMockdevIoctlData* const buffer = umockdev_ioctl_client_get_arg(client);
    if (buffer->data_len == 2 && buffer->data[0] == 4) light_ = buffer->data[1];
    return done(client, static_cast<glong>(buffer->data_len));
  }

  UMockdevTestbed* testbed_;
  UMockdevIoctlBase* handler_ = nullptr;
  std::mutex mutex_;
  std::vector<std::uint8_t> report_;
  std::atomic<bool> is_unplugged_{false};
  std::atomic<int> light_{-1};
};

}  // namespace tandem::devices
