#include "client/view/window_memory.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <string>

namespace tandem::client {
namespace {

class WindowMemory : public testing::Test {
 protected:
  std::filesystem::path file_ = std::filesystem::path(testing::TempDir()) / "window_memory" / "window.json";

  void SetUp() override { std::filesystem::remove_all(file_.parent_path()); }
  void write(const std::string& text) const {
    std::filesystem::create_directories(file_.parent_path());
    std::ofstream(file_) << text;
  }
};

TEST_F(WindowMemory, KeepsWhatUsersSwitched) {
  WindowSwitches switches;
  switches.shows_ghosts = true;
  switches.shows_contacts = false;
  switches.cuts = true;
  switches.cut_share = 0.25;
  switches.molecules = {MoleculeStyle::kSticks, MoleculeStyle::kByChain};
  switches.is_open[3] = false;
  switches.guide = {.is_on = true, .step = GuideStep::kHold};
  remember_switches(file_, switches);
  const WindowSwitches again = remembered_switches(file_);
  EXPECT_TRUE(again.shows_ghosts);
  EXPECT_FALSE(again.shows_contacts);
  EXPECT_TRUE(again.cuts);
  EXPECT_EQ(again.cut_share, 0.25);
  EXPECT_EQ(again.molecules, (MoleculeStyle{MoleculeStyle::kSticks, MoleculeStyle::kByChain}));
  EXPECT_TRUE(again.is_open[2]);
  EXPECT_FALSE(again.is_open[3]);
  EXPECT_EQ(again.guide, switches.guide);
}

TEST_F(WindowMemory, KeepsEachWayToDrawMolecules) {
  for (const auto shape :
       {MoleculeStyle::kSurface, MoleculeStyle::kSticks, MoleculeStyle::kRibbon, MoleculeStyle::kBalls}) {
    for (const auto colors : {MoleculeStyle::kByResidue, MoleculeStyle::kByChain, MoleculeStyle::kByElement}) {
      WindowSwitches switches;
      switches.molecules = {shape, colors};
      remember_switches(file_, switches);
      EXPECT_EQ(remembered_switches(file_).molecules, switches.molecules);
    }
  }
  // Files of earlier versions must be readable, and invalid files ignored.
  write("{\"molecules\": \"sticks\"}");
  EXPECT_EQ(remembered_switches(file_).molecules.shape, MoleculeStyle::kSticks);
  write("{\"molecules\": \"ribbons\"}");
  EXPECT_EQ(remembered_switches(file_).molecules, MoleculeStyle{});
}

TEST_F(WindowMemory, AFileThatIsNoneIsANewWindow) {
  const std::string texts[] = {"",
                               "{",
                               "[]",
                               "null",
                               "{\"shows_panels\": 7, \"cut_share\": \"far\"}",
                               std::string(100'000, '['),
                               std::string(1'000'000, ' ') + "{\"shows_panels\": false}"};
  for (const std::string& text : texts) {
    write(text);
    const WindowSwitches switches = remembered_switches(file_);
    EXPECT_TRUE(switches.shows_panels) << text.substr(0, 40);
    EXPECT_EQ(switches.cut_share, 0.5);
  }
  EXPECT_TRUE(remembered_switches(file_.parent_path()).shows_panels) << "a folder";
  EXPECT_TRUE(remembered_switches(file_ / "nothing").shows_panels);
}

TEST_F(WindowMemory, NumbersAreBounded) {
  write("{\"cut_share\": 1e300}");
  EXPECT_EQ(remembered_switches(file_).cut_share, 1);
  write("{\"guide_is_on\": 3, \"guide_step\": \"nowhere\"}");
  EXPECT_EQ(remembered_switches(file_).guide, GuideProgress{});
  write("{\"cut_share\": -3}");
  EXPECT_EQ(remembered_switches(file_).cut_share, 0);
}

TEST_F(WindowMemory, WhereNothingCanBeWrittenNothingHappens) {
  remember_switches("/proc/nowhere/window.json", {});
  remember_switches({}, {});
}

}  // namespace
}  // namespace tandem::client
