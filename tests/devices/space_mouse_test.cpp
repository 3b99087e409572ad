// Tests a SpaceMouse from the bytes of its reports to the pose of the handle. A scripted device is behind the port.
#include "devices/spacemouse/space_mouse.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <deque>
#include <string>

#include "common/base/buttons.hpp"
#include "devices/device_reader.hpp"

namespace tandem::devices {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::ElementsAre;
using testing::HasSubstr;
using Bytes = std::vector<std::uint8_t>;
using Kind = SpaceMouseReports::Kind;

/// A simulated SpaceMouse on a table: the reports that it will send, and the bytes that it has received.
struct Table {
  std::deque<Bytes> reports;
  std::vector<Bytes> writes;
  bool is_plugged_in = true;
  int ports_open = 0;
};

class TablePort final : public HidPort {
 public:
  explicit TablePort(Table& table) : table_(table) { ++table_.ports_open; }
  ~TablePort() override { --table_.ports_open; }
  TablePort(const TablePort&) = delete;
  TablePort& operator=(const TablePort&) = delete;
  int read(std::span<std::uint8_t> report, Duration) override {
    if (!table_.is_plugged_in) return -1;
    if (table_.reports.empty()) return 0;
    const Bytes next = table_.reports.front();
    table_.reports.pop_front();
    std::copy(next.begin(), next.end(), report.begin());
    return static_cast<int>(next.size());
  }
  bool write(std::span<const std::uint8_t> report) override {
    if (table_.is_plugged_in) table_.writes.emplace_back(report.begin(), report.end());
    return table_.is_plugged_in;
  }

 private:
  Table& table_;
};

OpenHid opener(Table& table) {
  return [&table](std::string_view& reason) -> std::unique_ptr<HidPort> {
    if (table.is_plugged_in) return std::make_unique<TablePort>(table);
    reason = "none is plugged in";
    return nullptr;
  };
}

struct Rig {
  explicit Rig(CapControl control = CapControl::kRate)
      : driver(control, opener(table), std::make_unique<TablePort>(table)) {}

  DeviceSample step() { return driver.step(now += milliseconds(1), {}); }
  /// Sends one pair of reports every 16 ms, like a SpaceNavigator. Returns the last sample.
  DeviceSample hold(const Bytes& translation, const Bytes& rotation, int steps) {
    DeviceSample sample;
    for (int i = 0; i < steps; ++i) {
      if (i % 16 == 0) table.reports.push_back(translation);
      if (i % 16 == 8) table.reports.push_back(rotation);
      sample = step();
    }
    return sample;
  }
  DeviceSample idle(int steps) {
    DeviceSample sample;
    for (int i = 0; i < steps; ++i) sample = step();
    return sample;
  }

  Table table;
  SpaceMouseDriver driver;
  LocalTime now{seconds(100)};
};

const Bytes kNoTranslation{1, 0, 0, 0, 0, 0, 0}, kNoRotation{2, 0, 0, 0, 0, 0, 0};
const Bytes kFullRight{1, 0x5e, 0x01, 0, 0, 0, 0};  // x = 350 counts: full deflection to the right

TEST(SpaceMouseReports, ReadsTheSamplesOfASpaceNavigator) {
  SpaceMouseReports reports;
  EXPECT_EQ(reports.parse(kNoTranslation), Kind::kMotion);
  EXPECT_TRUE(reports.deflection().isZero(0));
  EXPECT_EQ(reports.parse(Bytes{2, 0, 0, 0xe2, 0xff, 0, 0}), Kind::kMotion);  // Ry = −30 counts
  EXPECT_EQ(reports.deflection(), (Vec6() << 0, 0, 0, 0, 30.0 / 350, 0).finished()) << "y of D is away from the user";
  EXPECT_EQ(reports.parse(Bytes{3, 1, 0}), Kind::kButtons);
  EXPECT_EQ(reports.buttons(), kButtonGrab);
  EXPECT_EQ(reports.parse(Bytes{3, 3, 0}), Kind::kButtons);
  EXPECT_EQ(reports.buttons(), kButtonGrab | kButtonClutch);
  EXPECT_EQ(reports.parse(Bytes{3, 0, 0}), Kind::kButtons);
  EXPECT_EQ(reports.buttons(), 0U);
}

TEST(SpaceMouseReports, DistinguishesTheTwoLayoutsByTheirLength) {
  SpaceMouseReports joined, split;
  joined.parse(Bytes{1, 35, 0, 70, 0, 105, 0, 140, 0, 175, 0, 210, 0});
  split.parse(Bytes{1, 35, 0, 70, 0, 105, 0});
  EXPECT_TRUE(split.deflection().tail<3>().isZero(0));
  split.parse(Bytes{2, 140, 0, 175, 0, 210, 0});
  EXPECT_EQ(joined.deflection(), split.deflection());
  EXPECT_TRUE(joined.deflection().isApprox((Vec6() << 0.1, -0.2, -0.3, 0.4, -0.5, -0.6).finished(), 1e-12));
}

TEST(SpaceMouseReports, AnythingElseChangesNothing) {
  SpaceMouseReports reports;
  reports.parse(Bytes{1, 35, 0, 70, 0, 105, 0, 140, 0, 175, 0, 210, 0});
  const Vec6 before = reports.deflection();
  for (const Bytes& bad : {Bytes{}, Bytes{1}, Bytes{1, 0, 0, 0, 0, 0}, Bytes{2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0},
                           Bytes{3}, Bytes(64, 1)}) {
    EXPECT_EQ(reports.parse(bad), Kind::kBad) << bad.size();
  }
  EXPECT_EQ(reports.parse(Bytes{0x17, 80, 0}), Kind::kOther) << "battery";
  EXPECT_EQ(reports.deflection(), before);
  EXPECT_EQ(reports.buttons(), 0U);
}

TEST(SpaceMouseReports, IsNeverBeyondFullDeflection) {
  SpaceMouseReports reports;
  reports.parse(Bytes{1, 0x00, 0x80, 0xff, 0x7f, 8, 0});
  EXPECT_EQ(reports.deflection().head<3>(), Vec3(-1, -1, 0)) << "and eight counts are rest";
}

TEST(SpaceMouse, DeflectionIsTheHandlesVelocityWithoutAStep) {
  Rig rig;
  const DeviceSample before = rig.hold(kFullRight, kNoRotation, 400);
  EXPECT_EQ(before.state, DeviceState::kReady);
  EXPECT_NEAR(before.V_DH.v.x(), 0.15, 1e-6);
  DeviceSample last = before;
  for (int i = 0; i < 500; ++i) {
    const DeviceSample sample = rig.hold(kFullRight, kNoRotation, 1);
    EXPECT_LT((sample.V_DH.v - last.V_DH.v).norm(), 0.01);
    EXPECT_NEAR(sample.X_DH.p.x(), last.X_DH.p.x() + 1e-3 * sample.V_DH.v.x(), 1e-12);
    last = sample;
  }
  EXPECT_NEAR(last.X_DH.p.x() - before.X_DH.p.x(), 0.075, 1e-4);
  last = rig.hold(kFullRight, kNoRotation, 5000);
  EXPECT_EQ(last.X_DH.p.x(), 0.2) << "the end of its room";
  EXPECT_EQ(last.V_DH.v.x(), 0);
}

TEST(SpaceMouse, InPoseControlTheHandleReturnsWithTheCap) {
  Rig rig(CapControl::kPose);
  // Deflects the cap fully: z = −350 counts, Rz = 350 counts.
  DeviceSample sample = rig.hold({1, 0, 0, 0, 0, 0xa2, 0xfe}, {2, 0, 0, 0, 0, 0x5e, 0x01}, 400);
  EXPECT_TRUE(sample.X_DH.p.isApprox(Vec3(0, 0, 0.04), 1e-4)) << "pulled up";
  EXPECT_TRUE(rotation_vector(sample.X_DH.q).isApprox(Vec3(0, 0, -0.5), 1e-4));
  sample = rig.hold(kNoTranslation, kNoRotation, 400);
  EXPECT_LT(sample.X_DH.p.norm(), 1e-6);
}

TEST(SpaceMouse, SilenceIsRestAndALostReleaseIsNotForEver) {
  Rig rig;
  rig.hold(kFullRight, kNoRotation, 100);
  const DeviceSample released = rig.idle(400);
  EXPECT_EQ(released.state, DeviceState::kReady);
  EXPECT_LT(released.V_DH.v.norm(), 1e-6) << "no zero came, but 150 ms went by";
  const DeviceSample later = rig.idle(60'000);
  EXPECT_EQ(later.state, DeviceState::kReady);
  EXPECT_NEAR((later.X_DH.p - released.X_DH.p).norm(), 0, 1e-6);
  EXPECT_EQ(later.taken, rig.now);
}

TEST(SpaceMouse, UnpluggedItIsLostAndPluggedInAgainReadyWhereItWas) {
  Rig rig;
  const DeviceSample before = rig.hold(kFullRight, kNoRotation, 300);
  rig.table.reports.push_back({3, 1, 0});
  EXPECT_EQ(rig.step().buttons, kButtonGrab);
  rig.table.is_plugged_in = false;
  DeviceSample sample = rig.step();
  EXPECT_EQ(sample.state, DeviceState::kLost);
  EXPECT_THAT(std::string(sample.reason), HasSubstr("plug it in again"));
  EXPECT_FALSE(sample.is_valid);
  EXPECT_EQ(rig.table.ports_open, 0);
  sample = rig.idle(3000);
  EXPECT_EQ(sample.state, DeviceState::kLost);
  rig.table.is_plugged_in = true;
  rig.table.reports.clear();
  rig.table.writes.clear();
  sample = rig.idle(1100);
  EXPECT_EQ(sample.state, DeviceState::kReady);
  EXPECT_EQ(sample.buttons, 0U) << "buttons must be released after the reconnection";
  EXPECT_EQ(sample.V_DH.v, Vec3::Zero());
  EXPECT_NEAR(sample.X_DH.p.x(), before.X_DH.p.x(), 2e-3);
  EXPECT_THAT(rig.table.writes, ElementsAre(Bytes{4, 1})) << "its light is on again";
}

TEST(SpaceMouse, LightIsOnWhileItIsUsed) {
  Table table;
  {
    const SpaceMouseDriver driver(CapControl::kRate, opener(table), std::make_unique<TablePort>(table));
    EXPECT_THAT(table.writes, ElementsAre(Bytes{4, 1}));
  }
  EXPECT_THAT(table.writes, ElementsAre(Bytes{4, 1}, Bytes{4, 1}, Bytes{4, 0})) << "some obey an off only after an on";
}

TEST(SpaceMouse, ItsSamplesAreAcceptedWhenItRunsOnAThread) {
  Table table;
  for (int i = 0; i < 1000; ++i) table.reports.push_back(kFullRight);
  ThreadedDevice device(
      std::make_unique<SpaceMouseDriver>(CapControl::kRate, opener(table), std::make_unique<TablePort>(table)));
  EXPECT_FALSE(device.spec().has_force());
  DeviceReader reader(device);
  const SteadyClock clock;
  const LocalTime give_up = clock.now() + seconds(30);
  DeviceSample sample;
  while (!(sample.is_valid && sample.X_DH.p.x() > 1e-4) && clock.now() < give_up) sample = reader.read(clock.now());
  EXPECT_TRUE(sample.is_valid) << describe(sample);
  EXPECT_GT(sample.X_DH.p.x(), 1e-4);
}

}  // namespace
}  // namespace tandem::devices
