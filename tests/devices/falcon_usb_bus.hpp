// Emulates the kernel's side of a Falcon on USB with umockdev. The simulator receives every URB. A program that uses
// this file must run under umockdev-wrapper.
#pragma once

#include <glib.h>
#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>
#include <umockdev.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <deque>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "tests/devices/falcon_simulator.hpp"

namespace tandem::devices {

inline constexpr const char* kFalconPath = "/sys/devices/pci0000:00/0000:00:14.0/usb1/1-2";
inline constexpr const char* kFalconNode = "/dev/bus/usb/001/011";
// Device and configuration descriptors with one interface and two bulk endpoints of 64 bytes, as in an FTDI bridge.
inline constexpr const char* kFalconUsbDevice = R"(P: /devices/pci0000:00/0000:00:14.0/usb1/1-2
N: bus/usb/001/011
E: DEVNAME=/dev/bus/usb/001/011
E: DEVTYPE=usb_device
E: SUBSYSTEM=usb
E: BUSNUM=001
E: DEVNUM=011
A: busnum=1\n
A: devnum=11\n
A: bConfigurationValue=1\n
A: speed=12\n
A: idVendor=0403\n
A: idProduct=cb48\n
H: descriptors=1201100100000008030448CB0004010203010902200001010080FA0904000002FFFFFF000705810240000007050202400000
)";

/// The kernel's side of one USB device. It accepts URBs (USB request blocks) from libusb and returns each of them when
/// it is complete.
class UsbBus {
 public:
  explicit UsbBus(FalconSimulator& falcon) : falcon_(falcon), testbed_(umockdev_testbed_new()) {
    GError* error = nullptr;
    umockdev_testbed_add_from_string(testbed_, kFalconUsbDevice, &error);
    if (error != nullptr) throw std::runtime_error(error->message);
    handler_ = UMOCKDEV_IOCTL_BASE(g_object_new(UMOCKDEV_TYPE_IOCTL_BASE, nullptr));
    g_signal_connect(handler_, "handle-ioctl", G_CALLBACK(&UsbBus::on_ioctl), this);
    umockdev_testbed_attach_ioctl(testbed_, kFalconNode, handler_, &error);
    if (error != nullptr) throw std::runtime_error(error->message);
  }
  ~UsbBus() {
    umockdev_testbed_detach_ioctl(testbed_, kFalconNode, nullptr);
    forget_urbs();
    g_object_unref(handler_);
    g_object_unref(testbed_);
  }
  UsbBus(const UsbBus&) = delete;
  UsbBus& operator=(const UsbBus&) = delete;

  /// Calls `use` with the simulator while holding the lock of the bus.
  template <class Use>
  auto with_falcon(Use use) {
    const std::lock_guard lock(mutex_);
    return use(falcon_);
  }
  void unplug() {
    with_falcon([](FalconSimulator& falcon) { falcon.faults.is_unplugged = true; });
    umockdev_testbed_uevent(testbed_, kFalconPath, "remove");
  }
  void plug_in() {
    with_falcon([](FalconSimulator& falcon) { falcon.faults.is_unplugged = false; });
    umockdev_testbed_uevent(testbed_, kFalconPath, "add");
  }
  std::atomic<int> urbs{0};
  std::atomic<int> cancelled{0};
  std::atomic<int> outstanding{0};

 private:
  struct Urb {
    UMockdevIoctlData* data;  ///< the program's struct usbdevfs_urb
    UMockdevIoctlData* buffer;
    bool is_cancelled = false;
  };

  static gboolean on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
    static_cast<UsbBus*>(self)->answer(client);
    return TRUE;
  }
  void answer(UMockdevIoctlClient* client) {
    const std::lock_guard lock(mutex_);
    const gulong request = umockdev_ioctl_client_get_request(client);
    if (falcon_.faults.is_unplugged) {
      forget_urbs();
      return umockdev_ioctl_client_complete(client, -1, ENODEV);
    }
    switch (request) {
      case USBDEVFS_CLAIMINTERFACE:
      case USBDEVFS_RELEASEINTERFACE:
      case USBDEVFS_DISCONNECT_CLAIM:
        return umockdev_ioctl_client_complete(client, 0, 0);
      case USBDEVFS_SUBMITURB:
        return submit(client);
      case USBDEVFS_BULK:
        return transfer(client);
      case USBDEVFS_REAPURBNDELAY:
        return reap(client);
      case USBDEVFS_DISCARDURB:
        return discard(client);
      default:
        return umockdev_ioctl_client_complete(client, -1, request == USBDEVFS_GETDRIVER ? ENODATA : ENOTTY);
    }
  }
  void forget_urbs() {
    for (Urb& urb : waiting_) {
      g_object_unref(urb.buffer);
      g_object_unref(urb.data);
    }
    waiting_.clear();
    outstanding = 0;
  }
  static usbdevfs_urb& urb_of(UMockdevIoctlData* data) { return *reinterpret_cast<usbdevfs_urb*>(data->data); }
  void submit(UMockdevIoctlClient* client) {
    UMockdevIoctlData* const data =
        umockdev_ioctl_data_resolve(umockdev_ioctl_client_get_arg(client), 0, sizeof(usbdevfs_urb), nullptr);
    UMockdevIoctlData* const buffer = umockdev_ioctl_data_resolve(
        data, offsetof(usbdevfs_urb, buffer), static_cast<gsize>(urb_of(data).buffer_length), nullptr);
    ++urbs;
    ++outstanding;
    waiting_.push_back({data, buffer});
    umockdev_ioctl_client_complete(client, 0, 0);
  }
  /// Completes a synchronous bulk transfer at once. The watchdog uses such transfers; libusb uses URBs.
  void transfer(UMockdevIoctlClient* client) {
    UMockdevIoctlData* const data =
        umockdev_ioctl_data_resolve(umockdev_ioctl_client_get_arg(client), 0, sizeof(usbdevfs_bulktransfer), nullptr);
    const auto fields = *reinterpret_cast<usbdevfs_bulktransfer*>(data->data);
    UMockdevIoctlData* const buffer =
        umockdev_ioctl_data_resolve(data, offsetof(usbdevfs_bulktransfer, data), fields.len, nullptr);
    const bool is_out = fields.ep == 0x02U;
    if (is_out) falcon_.write({buffer->data, fields.len});
    umockdev_ioctl_client_complete(client, is_out ? static_cast<glong>(fields.len) : -1, is_out ? 0 : EINVAL);
    g_object_unref(buffer);
    g_object_unref(data);
  }
  void discard(UMockdevIoctlClient* client) {
    gulong address = 0;
    std::memcpy(&address, umockdev_ioctl_client_get_arg(client)->data, sizeof address);
    const auto found =
        std::ranges::find_if(waiting_, [address](const Urb& urb) { return urb.data->client_addr == address; });
    if (found == waiting_.end()) return umockdev_ioctl_client_complete(client, -1, EINVAL);
    found->is_cancelled = true;
    ++cancelled;
    umockdev_ioctl_client_complete(client, 0, 0);
  }
  void reap(UMockdevIoctlClient* client) {
    const auto done = std::ranges::find_if(waiting_, [this](Urb& urb) { return finish(urb); });
    if (done == waiting_.end()) {
      // No URB is complete. In this emulation, poll() always reports the device's file as ready. Without a pause,
      // libusb would call poll() in a busy loop.
      std::this_thread::sleep_for(std::chrono::microseconds(200));
      return umockdev_ioctl_client_complete(client, -1, EAGAIN);
    }
    UMockdevIoctlData* const address =
        umockdev_ioctl_data_resolve(umockdev_ioctl_client_get_arg(client), 0, sizeof(void*), nullptr);
    umockdev_ioctl_data_set_ptr(address, 0, done->data);
    umockdev_ioctl_client_complete(client, 0, 0);
    --outstanding;
    waiting_.erase(done);
  }
  /// Completes the URB with its result if it is due. Returns whether it was due.
  bool finish(Urb& urb) {
    usbdevfs_urb& fields = urb_of(urb.data);
    if (urb.is_cancelled) return end(urb, -ENOENT, 0);
    if (fields.type == USBDEVFS_URB_TYPE_CONTROL) {
      const std::uint8_t* const setup = urb.buffer->data;
      falcon_.control(setup[1], static_cast<std::uint16_t>(setup[2] | setup[3] << 8U));
      return end(urb, 0, 0);
    }
    if (fields.endpoint == 0x02) {
      falcon_.write({urb.buffer->data, static_cast<std::size_t>(fields.buffer_length)});
      return end(urb, 0, fields.buffer_length);
    }
    const auto now = std::chrono::steady_clock::now();
    if (now < next_in_) return false;
    next_in_ = now + std::chrono::milliseconds(1);  // 1 ms, the latency timer of the bridge
    const auto packet = falcon_.read();
    const int length = std::min(static_cast<int>(packet->size()), fields.buffer_length);
    umockdev_ioctl_data_update(urb.buffer, 0, const_cast<guint8*>(packet->data()), length);
    return end(urb, 0, length);
  }
  static bool end(Urb& urb, int status, int length) {
    usbdevfs_urb fields = urb_of(urb.data);
    fields.status = status;
    fields.actual_length = length;
    std::array<guint8, sizeof fields> bytes{};
    std::memcpy(bytes.data(), &fields, sizeof fields);
    constexpr std::size_t kFrom = offsetof(usbdevfs_urb, status), kActual = offsetof(usbdevfs_urb, actual_length);
    umockdev_ioctl_data_update(urb.data, kFrom, bytes.data() + kFrom, sizeof fields.status);
    umockdev_ioctl_data_update(urb.data, kActual, bytes.data() + kActual, sizeof fields.actual_length);
    return true;
  }

  FalconSimulator& falcon_;
  UMockdevTestbed* testbed_;
  UMockdevIoctlBase* handler_ = nullptr;
  std::mutex mutex_;
  std::deque<Urb> waiting_;
  std::chrono::steady_clock::time_point next_in_;
};

}  // namespace tandem::devices
