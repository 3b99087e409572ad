#include "client/view/guide/guide.hpp"

#include <gtest/gtest.h>

#include <set>

#include "client/view/guide/guide_card.hpp"

namespace tandem::client {
namespace {

using std::chrono::milliseconds;

/// A session in virtual time, with 30 frames a second.
class GuideTest : public testing::Test {
 protected:
  GuideTest() { guide_.begin(); }

  void pass(Duration span) {
    for (const LocalTime end = now_ + span; now_ < end; now_ += milliseconds(33)) guide_.follow(state_, now_);
  }
  /// Moves the tool along a line within a second.
  void stroke(const Vec3& by) {
    const Vec3 from = state_.p_WT;
    for (int i = 1; i <= 30; ++i, now_ += milliseconds(33)) {
      state_.p_WT = from + i / 30.0 * by;
      guide_.follow(state_, now_);
    }
  }
  GuideStep step() const { return guide_.progress().step; }
  void go_to(GuideStep step) { guide_ = Guide({.is_on = true, .step = step}); }

  Guide guide_;
  GuideState state_{.stage = "local-model"};
  LocalTime now_{milliseconds(5000)};
};

TEST_F(GuideTest, LeadsFromTheFirstTouchToTheComparisonOfStages) {
  pass(milliseconds(2000));
  EXPECT_EQ(step(), GuideStep::kTouch) << "nothing has happened";
  state_.force_n = 0.8;
  pass(milliseconds(500));
  EXPECT_EQ(step(), GuideStep::kGrasp);
  state_.is_holding = true;
  pass(milliseconds(500));
  EXPECT_EQ(step(), GuideStep::kLift);
  stroke({0, 0, 0.03});
  EXPECT_EQ(step(), GuideStep::kDelay);
  state_.added_delay = milliseconds(200);
  pass(milliseconds(500));
  EXPECT_EQ(step(), GuideStep::kFeel);
  stroke({0.15, 0, 0});
  pass(milliseconds(500));
  EXPECT_EQ(step(), GuideStep::kHold);
  state_.stage = "hold";
  pass(milliseconds(500));
  EXPECT_EQ(step(), GuideStep::kCompare);
  stroke({-0.15, 0, 0});
  pass(milliseconds(500));
  EXPECT_EQ(step(), GuideStep::kBack);
  state_.stage = "local-model";
  pass(milliseconds(500));
  EXPECT_EQ(step(), GuideStep::kBack) << "the delay is still there";
  state_.added_delay = Duration{0};
  pass(milliseconds(500));
  EXPECT_EQ(step(), GuideStep::kEnd);
  EXPECT_TRUE(guide_.is_on()) << "the last card is read before it is closed";
}

TEST_F(GuideTest, ABounceOrASliderInMotionIsNoStep) {
  state_.force_n = 3;
  pass(milliseconds(100));
  state_.force_n = 0;
  pass(milliseconds(500));
  EXPECT_EQ(step(), GuideStep::kTouch);
  go_to(GuideStep::kBack);
  state_.added_delay = milliseconds(200);
  pass(milliseconds(500));
  state_.added_delay = milliseconds(10);
  pass(milliseconds(100));
  state_.added_delay = milliseconds(100);
  pass(milliseconds(500));
  EXPECT_EQ(step(), GuideStep::kBack);
}

TEST_F(GuideTest, SmallForcesOfFreeMotionAreNoTouch) {
  state_.force_n = 0.2;
  stroke({0, 0, 0.1});
  pass(milliseconds(2000));
  EXPECT_EQ(step(), GuideStep::kTouch);
}

TEST_F(GuideTest, LettingGoBeforeTheLiftLeadsBackToTheGrasp) {
  go_to(GuideStep::kLift);
  state_.is_holding = true;
  pass(milliseconds(500));
  state_.is_holding = false;
  pass(milliseconds(500));
  EXPECT_EQ(step(), GuideStep::kLift) << "it may be grabbed again at once";
  pass(milliseconds(1000));
  EXPECT_EQ(step(), GuideStep::kGrasp);
}

TEST_F(GuideTest, TheLiftIsMeasuredFromTheGrasp) {
  go_to(GuideStep::kLift);
  state_.p_WT = {0, 0, 0.3};
  state_.is_holding = true;
  pass(milliseconds(500));
  EXPECT_EQ(step(), GuideStep::kLift) << "grabbed above the table";
  stroke({0.2, 0, 0.01});
  EXPECT_EQ(step(), GuideStep::kLift) << "moved sideways";
  stroke({0, 0, 0.02});
  EXPECT_EQ(step(), GuideStep::kDelay);
}

TEST_F(GuideTest, MotionWithoutAForceIsNotFelt) {
  go_to(GuideStep::kFeel);
  state_.added_delay = milliseconds(200);
  stroke({0.4, 0, 0});
  EXPECT_EQ(step(), GuideStep::kFeel);
  state_.force_n = 1;
  stroke({0.15, 0, 0});
  pass(milliseconds(500));
  EXPECT_EQ(step(), GuideStep::kHold);
}

TEST_F(GuideTest, AToolThatIsPutElsewhereHasNotBeenMoved) {
  go_to(GuideStep::kFeel);
  state_.added_delay = milliseconds(200);
  state_.force_n = 1;
  pass(milliseconds(300));
  state_.p_WT = {0.5, 0, 0};
  pass(milliseconds(500));
  EXPECT_EQ(step(), GuideStep::kFeel);
}

TEST_F(GuideTest, ADelayThatIsRemovedIsAskedForAgain) {
  go_to(GuideStep::kFeel);
  pass(milliseconds(1500));
  EXPECT_EQ(step(), GuideStep::kDelay);
}

TEST_F(GuideTest, ASkippedStepLeadsToTheNextPossibleOne) {
  pass(milliseconds(100));
  guide_.skip();
  EXPECT_EQ(step(), GuideStep::kGrasp);
  guide_.skip();
  EXPECT_EQ(step(), GuideStep::kDelay) << "nothing is held that could be lifted";
  guide_.skip();
  EXPECT_EQ(step(), GuideStep::kHold) << "there is no delay to feel";
  guide_.skip();
  EXPECT_EQ(step(), GuideStep::kBack);
  guide_.skip();
  EXPECT_EQ(step(), GuideStep::kEnd);
  guide_.skip();
  EXPECT_EQ(step(), GuideStep::kEnd);
}

TEST_F(GuideTest, IsResumedWhereItWasAndBeginsAnewAfterTheEnd) {
  go_to(GuideStep::kDelay);
  guide_.end();
  state_.added_delay = milliseconds(200);
  pass(milliseconds(1000));
  EXPECT_EQ(guide_.progress(), (GuideProgress{.is_on = false, .step = GuideStep::kDelay})) << "it is off";
  guide_.resume();
  EXPECT_EQ(guide_.progress(), (GuideProgress{.is_on = true, .step = GuideStep::kDelay}));
  go_to(GuideStep::kEnd);
  guide_.end();
  guide_.resume();
  EXPECT_EQ(guide_.progress(), (GuideProgress{.is_on = true, .step = GuideStep::kTouch}));
}

TEST(GuideTexts, EachStepHasItsOwnTitleAndATaskForEachKindOfDevice) {
  std::set<std::string> titles, tasks;
  for (std::size_t i = 0; i < kGuideStepNames.size(); ++i) {
    const auto step = static_cast<GuideStep>(i);
    titles.insert(guide_title(step));
    tasks.insert(guide_text(step, true));
    EXPECT_EQ(std::string(guide_text(step, false)).find("mouse"), std::string::npos) << kGuideStepNames[i];
  }
  EXPECT_EQ(titles.size(), kGuideStepNames.size());
  EXPECT_EQ(tasks.size(), kGuideStepNames.size());
  EXPECT_EQ(guide_title(GuideStep::kTouch), "Step 1 of 8: Touch the crate");
}

}  // namespace
}  // namespace tandem::client
