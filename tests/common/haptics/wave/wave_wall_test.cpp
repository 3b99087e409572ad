// Tests a wave line as used in a room: the client's port, a delay, and the virtual handle to which the coupling pulls
// the tool.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "common/haptics/wave/wave_port.hpp"

namespace tandem::haptics {
namespace {

constexpr double kWaveWallTick_s = 0.001;

CouplingParameters coupling_parameters() {
  CouplingParameters parameters;
  parameters.stiffness_n_per_m = 500;
  parameters.damping_n_s_per_m = 2;
  parameters.force_limit_n = 1e3;
  return parameters;
}

/// A hand of 0.3 kg is pulled by a spring of 200 N/m towards a point behind the surface of a wall. The wall has a
/// stiffness of 5 kN/m and acts on the tool. A line connects hand and tool, with a delay of `delay` ticks in each
/// direction.
struct PressedWall {
  void run(int ticks) {
    for (int i = 0; i < ticks; ++i) tick();
  }
  void tick() {
    Pose X_WH;
    X_WH.p.x() = x;
    const double f = port.tick(X_WH, kWaveWallTick_s).f.x();
    up.push_back(port.sum_towards_tool());
    places.push_back(x);
    if (k >= delay) {
      const auto sent = static_cast<std::size_t>(k - delay);
      tool.receive(std::chrono::milliseconds(k - delay), up[sent]);
      step(places[sent]);
    }
    down.push_back(tool.sum_towards_hand());
    if (k >= delay) port.receive(std::chrono::milliseconds(k - delay), down[static_cast<std::size_t>(k - delay)]);
    v += (f + 200 * (0.02 - x) - 2 * v) / 0.3 * kWaveWallTick_s;
    x += v * kWaveWallTick_s;
    taken_j += f * v * kWaveWallTick_s;
    most_taken_j = std::max(most_taken_j, taken_j);
    force = f;
    ++k;
  }
  void step(double x_hand) {
    const Pose X_WT = tool.move({{x_hand, 0, 0}, Quat::Identity()}, coupling_parameters(), kWaveWallTick_s);
    const RigidState target{X_WT, tool.velocity()};
    // The tool has no mass. At its new position, the forces of coupling and wall must balance.
    const double stretch = 500 * target.X.p.x() + 2 * target.V.v.x() + 2 / kWaveWallTick_s * x_tool;
    double x_next = stretch / (500 + 2 / kWaveWallTick_s);
    if (x_next > 0.005) x_next = (stretch + 5000 * 0.005) / (500 + 2 / kWaveWallTick_s + 5000);
    const double on_tool = 500 * (target.X.p.x() - x_next) + 2 * (target.V.v.x() - (x_next - x_tool) / kWaveWallTick_s);
    x_tool = x_next;
    tool.settle({Vec3(on_tool, 0, 0), Vec3::Zero()}, kWaveWallTick_s);
  }

  explicit PressedWall(int delay_ticks) : delay(delay_ticks) {}
  int delay, k = 0;
  WaveHandPort port{WaveImpedance{}, WavePlayer::Settings{}};
  WaveToolPort tool{WaveImpedance{}, WavePlayer::Settings{}};
  std::vector<Wave> up, down;
  std::vector<double> places;
  double x = 0, v = 0, x_tool = 0, force = 0, taken_j = 0, most_taken_j = 0;
};

TEST(WaveLine, APressedWallComesToRestAtEveryDelay) {
  for (const int delay : {1, 15, 50, 150}) {
    PressedWall wall(delay);
    wall.run(15000);
    double speed_square = 0;
    for (int i = 0; i < 1000; ++i) {
      wall.tick();
      speed_square += wall.v * wall.v / 1000;
    }
    EXPECT_LT(std::sqrt(speed_square), 1e-3) << delay << " ms each way";
    EXPECT_LT(wall.force, -0.5) << "and is felt";
    EXPECT_LT(wall.most_taken_j, 1e-5);
  }
}

TEST(WavePorts, TheSameWaveAgainIsNotCountedTwice) {
  const CouplingParameters slack{.stiffness_n_per_m = 0, .damping_n_s_per_m = 0};
  WaveToolPort tool{WaveImpedance{}, WavePlayer::Settings{}};
  tool.receive(Duration{0}, {});
  tool.move({}, slack, kWaveWallTick_s);
  Wave wave;
  wave.f.x() = 0.005;
  double x = 0;
  for (int step = 0; step < 20; ++step) {
    tool.receive(std::chrono::milliseconds(1), wave);
    x = tool.move({}, slack, kWaveWallTick_s).p.x();
    tool.settle({}, kWaveWallTick_s);
  }
  // Without a force, the wave u moves the handle with the velocity u √(2/b), with the impedance b. The integral of u is
  // 0.005 √W·s, so the handle moves by 2.24 mm. The tolerance allows for two losses: the filter still contains a
  // fraction of e⁻⁴, and the drift correction has removed 4 %.
  const double b = WaveImpedance{}.linear_n_s_per_m;
  EXPECT_NEAR(x, 0.005 * std::sqrt(2 / b), 0.08 * 0.005 * std::sqrt(2 / b));
}

}  // namespace
}  // namespace tandem::haptics
