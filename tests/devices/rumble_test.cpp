// Tests the commands to the motors of a game pad that umockdev emulates. The test must run under umockdev-wrapper.
#include "devices/mouse/rumble.hpp"

#include <glib.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/input.h>
#include <umockdev.h>

#include <atomic>
#include <chrono>
#include <cstring>
#include <limits>
#include <memory>
#include <stdexcept>
#include <thread>

#include "devices/device_profile.hpp"
#include "devices/mouse/mouse_device.hpp"

namespace tandem::devices {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr const char* kNode = "/dev/input/event7";
constexpr const char* kPad = R"(P: /devices/pad/input/input7/event7
N: input/event7
E: DEVNAME=/dev/input/event7
E: SUBSYSTEM=input
)";

struct Pad : testing::Test {
  Pad() : testbed(umockdev_testbed_new()) {
    GError* error = nullptr;
    umockdev_testbed_add_from_string(testbed, kPad, &error);
    EXPECT_EQ(error, nullptr) << error->message;
    handler = UMOCKDEV_IOCTL_BASE(g_object_new(UMOCKDEV_TYPE_IOCTL_BASE, nullptr));
    g_signal_connect(handler, "handle-ioctl", G_CALLBACK(&Pad::on_ioctl), this);
    umockdev_testbed_attach_ioctl(testbed, kNode, handler, &error);
    EXPECT_EQ(error, nullptr) << error->message;
  }
  ~Pad() override {
    umockdev_testbed_detach_ioctl(testbed, kNode, nullptr);
    g_object_unref(handler);
    g_object_unref(testbed);
  }
  static gboolean on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
    static_cast<Pad*>(self)->answer(client);
    return TRUE;
  }
  void answer(UMockdevIoctlClient* client) {
    const gulong request = umockdev_ioctl_client_get_request(client);
    UMockdevIoctlData* const argument = umockdev_ioctl_client_get_arg(client);
    if (is_removed) return umockdev_ioctl_client_complete(client, -1, ENODEV);
    if (_IOC_NR(request) == _IOC_NR(EVIOCGBIT(EV_FF, 0))) {
      const std::size_t size = _IOC_SIZE(request);
      UMockdevIoctlData* const bits = umockdev_ioctl_data_resolve(argument, 0, size, nullptr);
      guint8 byte = rumbles ? 1U << (FF_RUMBLE % 8) : 0;
      umockdev_ioctl_data_update(bits, FF_RUMBLE / 8, &byte, 1);
      return umockdev_ioctl_client_complete(client, static_cast<glong>(size), 0);
    }
    if (request != EVIOCSFF) return umockdev_ioctl_client_complete(client, -1, ENOTTY);
    UMockdevIoctlData* const data = umockdev_ioctl_data_resolve(argument, 0, sizeof(ff_effect), nullptr);
    ff_effect effect{};
    std::memcpy(&effect, data->data, sizeof effect);
    is_of_one_effect = is_of_one_effect && (effect.id == -1 || effect.id == 3);
    length_ms = effect.replay.length;
    strong = effect.u.rumble.strong_magnitude;
    ++uploads;
    gint16 id = 3;
    umockdev_ioctl_data_update(data, offsetof(ff_effect, id), reinterpret_cast<guint8*>(&id), sizeof id);
    umockdev_ioctl_client_complete(client, 0, 0);
  }
  /// Waits until a condition is true, at most 10 s. Returns whether it became true.
  template <class Is>
  static bool comes(Is is) {
    return comes(is, [] {});
  }
  /// Waits until a condition is true, at most 10 s. Calls `show` every 10 ms while it waits, like a haptic loop.
  template <class Is, class Show>
  static bool comes(Is is, Show show) {
    for (int i = 0; i < 1000 && !is(); ++i) {
      show();
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return is();
  }

  UMockdevTestbed* testbed;
  UMockdevIoctlBase* handler;
  std::atomic<bool> rumbles{true}, is_removed{false}, is_of_one_effect{true};
  std::atomic<int> strong{-1}, uploads{0}, length_ms{0};
};

TEST_F(Pad, RumblesByTheShareOfTheForceAndStopsInTheEnd) {
  {
    const auto rumble = open_rumble(kNode);
    const auto show_half = [&] { rumble->show(0.5); };
    EXPECT_TRUE(comes([this] { return strong == 0xffff / 2; }, show_half)) << strong;
    EXPECT_EQ(length_ms, 200) << "a program that dies leaves no pad rumbling";
    const int before = uploads;
    EXPECT_TRUE(comes([&] { return uploads > before + 2 && strong > 0; }, show_half)) << "so it is sent again";
    for (const double wild : {7.0, std::numeric_limits<double>::infinity(), -1.0}) rumble->show(wild);
    EXPECT_TRUE(comes([this] { return strong == 0; }));
    EXPECT_TRUE(comes([this] { return strong == 0xffff; }, [&] { rumble->show(7); }));
  }
  EXPECT_EQ(strong, 0);
  EXPECT_TRUE(is_of_one_effect);
}

TEST_F(Pad, StopsWhenTheHapticLoopHangs) {
  const auto rumble = open_rumble(kNode);
  ASSERT_TRUE(comes([this] { return strong > 0; }, [&] { rumble->show(0.5); }));
  EXPECT_TRUE(comes([this] { return strong == 0; }));
  EXPECT_TRUE(comes([this] { return strong > 0; }, [&] { rumble->show(0.5); }))
      << "the rumble must work again after the time-out";
}

TEST_F(Pad, AnUnpluggedPadIsReopened) {
  const auto rumble = open_rumble("auto");
  ASSERT_NE(rumble, nullptr) << "found by itself";
  const auto show_half = [&] { rumble->show(0.5); };
  ASSERT_TRUE(comes([this] { return strong > 0; }, show_half));
  is_removed = true;
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  strong = -1;
  is_removed = false;
  EXPECT_TRUE(comes([this] { return strong == 0xffff / 2; }, show_half));
}

TEST_F(Pad, APadWithoutRumbleIsRefusedOrOmitted) {
  rumbles = false;
  EXPECT_THAT([] { open_rumble(kNode); }, ThrowsMessage<std::runtime_error>(HasSubstr("--rumble")));
  EXPECT_THAT([] { open_rumble("/dev/input/event99"); }, ThrowsMessage<std::runtime_error>(HasSubstr("event99")));
  EXPECT_EQ(open_rumble("auto"), nullptr);
  rumbles = true;
  EXPECT_EQ(open_rumble("off"), nullptr);
}

TEST_F(Pad, ShowsTheForceOfAMouse) {
  const DeviceProfile profile = find_device_profile("sim");
  MouseDevice mouse(profile.spec, MouseDevice::default_hand(), std::make_shared<Pointer>(), open_rumble(kNode));
  const Wrench most{Vec3(0, 0, -profile.spec.force_limit_n), Vec3::Zero()};
  EXPECT_TRUE(comes([this] { return strong == 0xffff; }, [&] { mouse.write(LocalTime{}, most); }));
  mouse.write(LocalTime{}, {});
  EXPECT_TRUE(comes([this] { return strong == 0; }));
}

}  // namespace
}  // namespace tandem::devices
