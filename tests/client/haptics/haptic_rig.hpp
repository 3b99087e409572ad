// Test rig: the haptic core under a virtual clock, with a scripted device and server states from the test.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <string_view>

#include "client/haptics/haptic_core.hpp"
#include "common/haptics/coupling/laws.hpp"
#include "tests/client/haptics/scripted_device.hpp"

namespace tandem::client {

inline constexpr Duration kTick{std::chrono::milliseconds(1)};
/// Returns the index of the coupling law with this name.
inline std::size_t law_index(std::string_view name) {
  return static_cast<std::size_t>(haptics::find_coupling_law(name) - haptics::coupling_laws().data());
}

/// The haptic core with its device and mailboxes. A server state arrives when the test publishes it.
struct HapticRig {
  explicit HapticRig(const std::string& stage = "late-pose", bool feeds_view = false,
                     const Vec3& workspace_m = Vec3::Zero())
      : device(workspace_m),
        core({.stage = {.name = stage, .passivity = false}, .feeds_view = feeds_view}, device, mailboxes) {
    scene.law = law_index("spring-damper");
  }

  void enter_scene() {
    ++scene.generation;
    scene.may_drive = scene.may_display = true;
    mailboxes.scene.publish(scene);
  }
  void receive() {
    ++received.update.step.value;
    received.received = now;
    mailboxes.inbox.publish(received);
  }
  void tick() {
    now += kTick;
    core.tick(now);
  }
  /// Runs `ticks` ticks. A new state arrives before each tick.
  void run(int ticks) {
    for (int i = 0; i < ticks; ++i) {
      receive();
      tick();
    }
  }
  const proto::ClientUpdate& sent() {
    EXPECT_TRUE(mailboxes.outbox.poll());
    return mailboxes.outbox.front();
  }
  Vec3 force() const { return core.record().displayed_on_hand_D.f; }

  ScriptedDevice device;
  ClientMailboxes mailboxes;
  HapticScene scene;
  ReceivedUpdate received;
  LocalTime now{std::chrono::seconds(1)};
  HapticCore core;
};

}  // namespace tandem::client
