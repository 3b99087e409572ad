// Tests the update that a tick sends to the server.
#include "client/haptics/outgoing_update.hpp"

#include <gtest/gtest.h>

#include <chrono>

namespace tandem::client {
namespace {

using std::chrono::milliseconds;

/// Writes one update per millisecond. If `is_driving` is true, the hand may act on the scene.
struct Sender {
  const proto::ClientUpdate& write(bool is_driving = true) {
    ++record.tick.value;
    record.at += milliseconds(1);
    outgoing.write(update, record, output, has_state ? &newest : nullptr, is_driving, requested);
    return update;
  }

  Sender() {
    record.at = LocalTime(std::chrono::seconds(1));
    record.sample.is_valid = true;
  }
  OutgoingUpdate outgoing;
  TickRecord record;
  StageOutput output;
  ReceivedUpdate newest;
  bool has_state = true;
  PortWork requested;
  proto::ClientUpdate update;
};

TEST(OutgoingUpdate, HasHandleButtonsAndEnergyOfTheTick) {
  Sender sender;
  sender.record.handle_W.X.p = Vec3(1, 2, 3);
  sender.record.sample.buttons = kButtonGrab;
  sender.requested.move_to({});
  sender.requested.hold({Vec3(0, 0, 2), Vec3::Zero()});
  sender.requested.move_to({Vec3(0, 0, 0.5), Quat::Identity()});
  const proto::ClientUpdate& update = sender.write();
  EXPECT_EQ(update.input_tick, sender.record.tick);
  EXPECT_EQ(update.handle.X.p, Vec3(1, 2, 3));
  EXPECT_TRUE(update.handle_valid);
  EXPECT_EQ(update.buttons, kButtonGrab);
  EXPECT_EQ(update.energy_to_hand_j, 1);
  EXPECT_EQ(update.energy_from_hand_j, 0);
}

TEST(OutgoingUpdate, OfAHandThatMayNotActHasNoHandleAndNoButtons) {
  Sender sender;
  sender.record.sample.buttons = kButtonGrab;
  EXPECT_FALSE(sender.write(false).handle_valid);
  EXPECT_EQ(sender.update.buttons, 0U);
}

TEST(OutgoingUpdate, InvalidSamplesKeepTheButtonsForAHundredMillisecondsAndThenLetGo) {
  Sender sender;
  sender.record.sample.buttons = kButtonGrab;
  sender.write();
  sender.record.sample.is_valid = false;
  sender.record.sample.buttons = 0;  // ignored, because the sample is invalid
  for (int i = 1; i <= 200; ++i) {
    ASSERT_FALSE(sender.write().handle_valid);
    ASSERT_EQ(sender.update.buttons, i <= 100 ? kButtonGrab : 0U) << i << " ms";
  }
  sender.record.sample.is_valid = true;
  EXPECT_EQ(sender.write().buttons, 0U);
}

TEST(OutgoingUpdate, ForgetsTheButtonsOfAnotherScene) {
  Sender sender;
  sender.record.sample.buttons = kButtonGrab;
  sender.write();
  sender.record.sample.is_valid = false;
  sender.outgoing.forget_buttons();
  EXPECT_EQ(sender.write().buttons, 0U);
}

TEST(OutgoingUpdate, HasTheRoundTripOfTheNewestExchangeUnlessTheStageKnowsIt) {
  Sender sender;
  EXPECT_EQ(sender.write().round_trip, Duration{0}) << "no exchange yet";
  sender.newest.received = sender.record.at;
  sender.newest.update.echoed_sent = sender.record.at - milliseconds(40);
  sender.newest.update.received = ServerTime(std::chrono::hours(1));
  sender.newest.update.sent = ServerTime(std::chrono::hours(1) + milliseconds(3));
  EXPECT_EQ(sender.write().round_trip, milliseconds(37));
  sender.output.round_trip = milliseconds(52);
  EXPECT_EQ(sender.write().round_trip, milliseconds(52));
  sender.output.round_trip = 2 * proto::kMaxDelay;
  EXPECT_EQ(sender.write().round_trip, proto::kMaxDelay);
}

}  // namespace
}  // namespace tandem::client
