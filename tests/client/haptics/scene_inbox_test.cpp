// Tests the reception of scenes and states from the mailboxes: their order, and the range checks of data from the
// network.
#include "client/haptics/scene_inbox.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <memory>

#include "tests/client/haptics/haptic_rig.hpp"

namespace tandem::client {
namespace {

struct InboxRig {
  InboxRig() {
    scene.law = law_index("spring-damper");
    scene.may_drive = scene.may_display = true;
  }
  SceneNews enter() {
    ++scene.generation;
    return publish();
  }
  SceneNews publish() {
    mailboxes->scene.publish(scene);
    return inbox.poll();
  }

  std::unique_ptr<ClientMailboxes> mailboxes = std::make_unique<ClientMailboxes>();
  SceneInbox inbox{*mailboxes, HapticSettings{}.coupling_bounds};
  HapticScene scene;
};

TEST(SceneInbox, IsUnusableBeforeAScene) {
  InboxRig rig;
  rig.inbox.poll();
  EXPECT_FALSE(rig.inbox.is_usable());
  EXPECT_EQ(rig.inbox.newest(), nullptr);
  EXPECT_LT(rig.inbox.state_age(LocalTime{}), Duration{0});
}

TEST(SceneInbox, DistinguishesANewSceneFromAChangedOne) {
  InboxRig rig;
  EXPECT_TRUE(rig.enter().is_entered);
  EXPECT_TRUE(rig.inbox.is_displaying());
  ++rig.scene.places_shown;
  const SceneNews changed = rig.publish();
  EXPECT_FALSE(changed.is_entered);
  EXPECT_TRUE(changed.is_changed);
  EXPECT_TRUE(changed.is_place_shown);
  EXPECT_FALSE(rig.inbox.poll().is_changed);
  ++rig.scene.places_shown;
  EXPECT_FALSE(rig.enter().is_place_shown) << "of another scene";
}

TEST(SceneInbox, DiscardsAStateThatArrivedBeforeItsScene) {
  InboxRig rig;
  rig.mailboxes->inbox.publish(ReceivedUpdate{});
  rig.enter();
  EXPECT_EQ(rig.inbox.newest(), nullptr);
  EXPECT_FALSE(rig.inbox.has_new_state());
  rig.mailboxes->inbox.publish(ReceivedUpdate{});
  rig.inbox.poll();
  EXPECT_TRUE(rig.inbox.has_new_state());
  rig.inbox.poll();
  EXPECT_FALSE(rig.inbox.has_new_state());
  EXPECT_NE(rig.inbox.newest(), nullptr);
}

TEST(SceneInbox, TheAgeOfAStateIncludesItsAgeAtTheServer) {
  InboxRig rig;
  rig.enter();
  auto received = std::make_unique<ReceivedUpdate>();
  received->received = LocalTime(std::chrono::milliseconds(100));
  received->update.stepped = ServerTime(std::chrono::milliseconds(40));
  received->update.sent = ServerTime(std::chrono::milliseconds(45));
  rig.mailboxes->inbox.publish(*received);
  rig.inbox.poll();
  EXPECT_EQ(rig.inbox.state_age(LocalTime(std::chrono::milliseconds(103))), std::chrono::milliseconds(8));
}

TEST(SceneInbox, ASceneOutOfRangeIsNotDisplayed) {
  const std::function<void(HapticScene&)> spoils[] = {
      [](HapticScene& scene) { scene.law = 1000; },
      [](HapticScene& scene) { scene.workspace.position_scale = 0; },
      [](HapticScene& scene) { scene.workspace.force_scale = -1; },
      [](HapticScene& scene) { scene.workspace.X_WD.q.coeffs() *= 2; },
      [](HapticScene& scene) { scene.workspace.X_WD.p.x() = std::numeric_limits<double>::infinity(); },
  };
  for (const auto& spoil : spoils) {
    InboxRig rig;
    spoil(rig.scene);
    rig.enter();
    EXPECT_FALSE(rig.inbox.is_usable());
    EXPECT_FALSE(rig.inbox.is_driving());
  }
}

}  // namespace
}  // namespace tandem::client
