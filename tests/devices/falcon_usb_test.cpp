// The Falcon's driver by the real libusb: umockdev stands for the kernel's USB devices, and the simulator behind it gets
// every URB. Run by umockdev-wrapper, which comes between libusb and the system.
#include <glib.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>
#include <umockdev.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstring>
#include <deque>
#include <mutex>
#include <string>
#include <thread>

#include "devices/device_profile.hpp"
#include "devices/device_reader.hpp"
#include "devices/device_writer.hpp"
#include "devices/falcon/falcon_driver.hpp"
#include "tests/devices/falcon_simulator.hpp"

namespace tandem::devices {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

constexpr std::size_t kFirmwareSize = 7914;
constexpr const char* kPath = "/sys/devices/pci0000:00/0000:00:14.0/usb1/1-2";
constexpr const char* kNode = "/dev/bus/usb/001/011";
// A device and a configuration with an interface and two bulk endpoints of 64 bytes, as an FTDI bridge has them.
constexpr const char* kDevice = R"(P: /devices/pci0000:00/0000:00:14.0/usb1/1-2
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

/// The kernel's side of one USB device: takes URBs, gives them back when they are done.
class UsbBus {
 public:
  explicit UsbBus(FalconSimulator& falcon) : falcon_(falcon), testbed_(umockdev_testbed_new()) {
    GError* error = nullptr;
    umockdev_testbed_add_from_string(testbed_, kDevice, &error);
    EXPECT_EQ(error, nullptr) << error->message;
    handler_ = UMOCKDEV_IOCTL_BASE(g_object_new(UMOCKDEV_TYPE_IOCTL_BASE, nullptr));
    g_signal_connect(handler_, "handle-ioctl", G_CALLBACK(&UsbBus::on_ioctl), this);
    umockdev_testbed_attach_ioctl(testbed_, kNode, handler_, &error);
    EXPECT_EQ(error, nullptr) << error->message;
  }
  ~UsbBus() {
    umockdev_testbed_detach_ioctl(testbed_, kNode, nullptr);
    forget_urbs();
    g_object_unref(handler_);
    g_object_unref(testbed_);
  }
  UsbBus(const UsbBus&) = delete;
  UsbBus& operator=(const UsbBus&) = delete;

  /// The simulator, which the bus uses meanwhile.
  template <class Use>
  auto with_falcon(Use use) {
    const std::lock_guard lock(mutex_);
    return use(falcon_);
  }
  void unplug() {
    with_falcon([](FalconSimulator& falcon) { falcon.faults.is_unplugged = true; });
    umockdev_testbed_uevent(testbed_, kPath, "remove");
  }
  void plug_in() {
    with_falcon([](FalconSimulator& falcon) { falcon.faults.is_unplugged = false; });
    umockdev_testbed_uevent(testbed_, kPath, "add");
  }
  std::atomic<int> urbs{0};
  std::atomic<int> cancelled{0};
  std::atomic<int> outstanding{0};

 private:
  struct Urb {
    UMockdevIoctlData* data;  ///< struct usbdevfs_urb of the program
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
      // The file behind the device can always be polled: without a pause libusb would ask without end.
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
  /// Whether it is done by now, and with what.
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
    next_in_ = now + milliseconds(1);  // the bridge's latency timer
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

FalconSettings settings() {
  const DeviceProfile profile = find_device_profile("falcon");
  FalconSettings result{profile.spec, {}, 10000};
  for (std::size_t i = 0; i < kFirmwareSize; ++i)
    result.firmware.push_back(static_cast<std::uint8_t>(i * 31 + i / 256));
  return result;
}

/// Ticks as the haptic loop does, with this force when the sample is believed, until `is_over`. False: not within 60 s.
template <class Over>
bool tick_until(Device& device, const Vec3& force, Over is_over) {
  DeviceReader reader(device);
  DeviceWriter writer(device);
  const SteadyClock clock;
  const LocalTime give_up = clock.now() + seconds(60);
  for (LocalTime now = clock.now(); now < give_up; now = clock.now()) {
    const DeviceSample sample = reader.read(now);
    writer.write(now, sample.is_valid ? Wrench{force, {}} : Wrench{});
    if (is_over(sample)) return true;
    std::this_thread::sleep_for(milliseconds(1));
  }
  return false;
}

bool tick_until_state(Device& device, DeviceState state) {
  return tick_until(device, Vec3::Zero(), [state](const DeviceSample& sample) { return sample.state == state; });
}

std::unique_ptr<ThreadedDevice> open_device() {
  std::string_view reason;
  auto port = open_falcon_usb_port(reason);
  EXPECT_NE(port, nullptr) << reason;
  return std::make_unique<ThreadedDevice>(
      std::make_unique<FalconDriver>(settings(), open_falcon_usb_port, std::move(port)));
}

struct FalconUsb : testing::Test {
  FalconUsb() { EXPECT_TRUE(umockdev_in_mock_environment()) << "run this by umockdev-wrapper"; }
  FalconSimulator falcon{kFirmwareSize};
  UsbBus bus{falcon};
};

TEST_F(FalconUsb, IsFoundAndCanBeOpened) {
  const auto found = find_falcons();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].where, "USB bus 1, device 11");
  EXPECT_EQ(found[0].problem, "");
}

TEST_F(FalconUsb, LoadsHomesAndShowsAForceAndItsEndIsZero) {
  auto device = open_device();
  ASSERT_TRUE(tick_until_state(*device, DeviceState::kHoming));
  EXPECT_EQ(bus.with_falcon([](FalconSimulator& f) { return f.uploaded; }), settings().firmware);
  bus.with_falcon([](FalconSimulator& f) { f.grip_m = Vec3(0, 0, 0.078); });
  ASSERT_TRUE(tick_until_state(*device, DeviceState::kReady));
  bus.with_falcon([](FalconSimulator& f) { f.grip_m = Vec3(0, 0, 0.13); });
  int believed = 0;
  EXPECT_TRUE(tick_until(*device, Vec3(0, 0, 2), [&believed](const DeviceSample& sample) {
    believed += sample.is_valid ? 1 : 0;
    return believed >= 300;
  }));
  EXPECT_FALSE(bus.with_falcon([](FalconSimulator& f) { return f.motors.isZero(); }));
  device.reset();
  EXPECT_TRUE(bus.with_falcon([](FalconSimulator& f) { return f.motors.isZero(); }));
  EXPECT_GE(bus.cancelled, 1);
  EXPECT_EQ(bus.outstanding, 0) << "each transfer was waited for";
}

TEST_F(FalconUsb, GarbageAndSplitRepliesCostNothing) {
  bus.with_falcon([](FalconSimulator& f) {
    f.has_firmware = f.is_homed = true;
    f.faults.sends_garbage = f.faults.splits_replies = true;
  });
  auto device = open_device();
  int believed = 0;
  EXPECT_TRUE(tick_until(*device, Vec3::Zero(), [&believed](const DeviceSample& sample) {
    believed += sample.is_valid ? 1 : 0;
    return believed >= 50;
  }));
}

TEST_F(FalconUsb, UnpluggedItIsLostAndComesBack) {
  bus.with_falcon([](FalconSimulator& f) { f.has_firmware = f.is_homed = true; });
  auto device = open_device();
  ASSERT_TRUE(tick_until_state(*device, DeviceState::kReady));
  bus.unplug();
  ASSERT_TRUE(tick_until_state(*device, DeviceState::kLost));
  bus.plug_in();
  EXPECT_TRUE(tick_until_state(*device, DeviceState::kReady));
}

}  // namespace
}  // namespace tandem::devices
