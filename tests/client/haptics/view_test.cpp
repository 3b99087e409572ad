// Tests the data for a window: it must be complete and current. For values that an update omits, the last received ones
// are used.
#include "client/haptics/view.hpp"

#include <gtest/gtest.h>

#include "tests/client/haptics/haptic_rig.hpp"

namespace tandem::client {
namespace {

proto::ServerUpdate update_of(std::uint64_t step) {
  proto::ServerUpdate update;
  update.step = Step{step};
  update.stepped = ServerTime{std::chrono::milliseconds(step)};
  return update;
}

proto::BodyState body_at(std::uint32_t id, double x) {
  proto::BodyState body;
  body.id = BodyId{id};
  body.state.X.p.x() = x;
  return body;
}

proto::OtherUserState user_of(std::uint32_t id) {
  proto::OtherUserState user;
  user.id = UserId{id};
  return user;
}

const View* written(ViewFeed& feed) {
  const ReceivedUpdate newest;
  feed.write(TickRecord{}, WorkspaceMapping{}, &newest, nullptr);
  return feed.newest();
}

TEST(View, KeepsTheLastStateOfABodyThatTheNewestUpdateLeavesOut) {
  ViewFeed feed;
  EXPECT_EQ(feed.newest(), nullptr);
  proto::ServerUpdate update = update_of(1);
  update.bodies.push_back(body_at(1, 0.1));
  update.bodies.push_back(body_at(2, 0.2));
  feed.receive(update);
  update = update_of(2);
  update.bodies.push_back(body_at(2, 0.3));
  feed.receive(update);
  const View* const view = written(feed);
  ASSERT_EQ(view->bodies.size(), 2U);
  EXPECT_EQ(view->bodies[0].state.X.p.x(), 0.1);
  EXPECT_EQ(view->bodies[1].state.X.p.x(), 0.3);
  feed.reset();
  EXPECT_TRUE(written(feed)->bodies.empty()) << "another scene";
}

TEST(View, RemovesAUserOneSecondAfterTheLastUpdate) {
  ViewFeed feed;
  proto::ServerUpdate update = update_of(1);
  update.users.push_back(user_of(4));
  feed.receive(update);
  feed.receive(update_of(900));
  EXPECT_EQ(written(feed)->users.size(), 1U);
  feed.receive(update_of(1100));
  EXPECT_TRUE(written(feed)->users.empty());
}

TEST(View, IsBoundedForAHostileServer) {
  ViewFeed feed;
  for (std::uint32_t first = 1; first < 1000; first += 16) {
    proto::ServerUpdate update = update_of(first);
    for (std::uint32_t i = 0; i < 16; ++i) {
      update.users.push_back(user_of(first + i));
      update.bodies.push_back(body_at(first + i, 0));
    }
    feed.receive(update);
  }
  EXPECT_EQ(written(feed)->users.size(), proto::kMaxUsers);
  EXPECT_EQ(written(feed)->bodies.size(), proto::kMaxBodies);
}

TEST(View, OfTheHapticPathIsThereOnlyWhenAskedForAndShowsWhatIsDisplayed) {
  HapticRig blind("hold");
  blind.enter_scene();
  blind.run(20);
  EXPECT_EQ(blind.core.newest_view(), nullptr);

  HapticRig rig("hold", true);
  rig.enter_scene();
  rig.received.update.wrench_on_hand_W.f = Vec3(0, 0, 2);
  rig.received.update.bodies.push_back(body_at(3, 0.5));
  rig.run(700);
  const View* const view = rig.core.newest_view();
  ASSERT_NE(view, nullptr);
  EXPECT_TRUE(view->has_state);
  EXPECT_NEAR(view->record.displayed_on_hand_D.f.z(), 2, 1e-9);
  ASSERT_EQ(view->received_bodies.size(), 1U);
  EXPECT_LE(rig.core.record().tick.value - view->record.tick.value, kViewEvery);
}

}  // namespace
}  // namespace tandem::client
