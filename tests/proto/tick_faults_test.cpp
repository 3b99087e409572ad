#include "common/base/tick_faults.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tandem::proto {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(TickFaults, AreDescribedInWords) {
  EXPECT_EQ(describe_faults(0), "none");
  EXPECT_EQ(describe_faults(kFaultNotFinite | kFaultInputStale), "not_finite|input_stale");
  EXPECT_EQ(describe_faults(kFaultContactUnsolved | kFaultContactCoarse), "contact_unsolved|contact_coarse");
  EXPECT_EQ(describe_faults(kFaultSoftLate), "soft_late");
  EXPECT_EQ(describe_faults(kFaultToolEnergyLimited), "tool_energy_limited");
}

TEST(TickFaults, BitsOfANewerServerAreShownByNumber) {
  EXPECT_EQ(describe_faults(kFaultOverrun | 1U << 20U), "overrun|bit_20");
  EXPECT_THAT(tick_fault_names(kFaultNotFinite | 1U << 31U), ElementsAre("not_finite", "bit_31"));
  EXPECT_THAT(tick_fault_names(0), IsEmpty());
}

}  // namespace
}  // namespace tandem::proto
