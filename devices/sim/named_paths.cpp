// Built-in hand paths, selected by name on a command line: the movements of the demonstrations and of the supplied
// experiments. Times are in s; positions are in m relative to the initial position of the hand, with z up.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/base/buttons.hpp"
#include "devices/sim/hand_path.hpp"

namespace tandem::devices {
namespace {

WayPoint point(double t_s, const Vec3& position_m, const char* phase = "", std::uint32_t buttons = 0) {
  return {from_seconds(t_s), {position_m, Quat::Identity()}, buttons, phase};
}

HandPath rest() {
  return HandPath({point(0, Vec3::Zero(), "hold")});
}

HandPath press_down() {
  return HandPath({point(0, Vec3::Zero(), "approach"), point(1, Vec3::Zero(), "move"),
                   point(2.5, {0, 0, -0.05}, "hold"), point(6.5, {0, 0, -0.05}, "retreat"), point(8, Vec3::Zero())});
}

// Moves twice around a circle with a radius of 30 mm, in 8 s each. The circle is approximated by a polygon with 16
// sides, because the minimum-jerk movement of each side needs a way point at its end.
HandPath circle() {
  constexpr int kSides = 16;
  constexpr double kRadius_m = 0.03;
  constexpr double kTurn_s = 8;
  std::vector<WayPoint> points{point(0, Vec3::Zero(), "approach")};
  for (int i = 0; i <= 2 * kSides; ++i) {
    const double angle = 2 * std::numbers::pi * i / kSides;
    const Vec3 position(kRadius_m * std::sin(angle), kRadius_m * (1 - std::cos(angle)), 0);
    points.push_back(point(1 + kTurn_s * i / kSides, position, i == 0 ? "move" : ""));
  }
  points.back().phase = "hold";
  return HandPath(std::move(points));
}

// Moves down 40 mm to a body, grabs it, raises the hand by 80 mm, waits, puts the body down and returns. The body rises
// by less than 80 mm, because its weight stretches the springs of the arm and of the coupling.
HandPath grab_and_lift() {
  const Vec3 on_it(0, 0, -0.04);
  const Vec3 lifted(0, 0, 0.04);
  return HandPath({point(0, Vec3::Zero(), "approach"), point(0.5, Vec3::Zero()), point(1.6, on_it),
                   point(1.9, on_it, "", kButtonGrab), point(2.4, on_it, "move", kButtonGrab),
                   point(4.4, lifted, "hold", kButtonGrab), point(7.4, lifted, "retreat", kButtonGrab),
                   point(9.4, on_it, "", kButtonGrab), point(9.9, on_it), point(11, Vec3::Zero())});
}

// Moves from a position above a body to one side of it and down. Then moves 80 mm along x against the body, and pushes
// it to 20 mm beyond the initial position of the hand. `sign` is the direction of the push; two users push in opposite
// directions.
HandPath push(double sign) {
  const Vec3 aside(-sign * 0.06, 0, 0);
  const Vec3 beside(-sign * 0.06, 0, -0.065);
  const Vec3 there(sign * 0.02, 0, -0.065);
  return HandPath({point(0, Vec3::Zero(), "approach"), point(0.5, Vec3::Zero()), point(1.5, aside), point(2.5, beside),
                   point(3, beside, "move"), point(5, there, "hold"), point(8, there, "retreat"), point(9, beside),
                   point(10, aside), point(11, Vec3::Zero())});
}

// For the scene peg_in_hole: two users carry one peg, which they hold at its near side (`side` = −1, at −y) and its far
// side (`side` = +1). They move it 100 mm to a position above the hole, and lower it 70 mm to the bottom. Then each
// user presses 15 mm downwards and pulls 10 mm towards the own side.
HandPath peg(double side) {
  const Vec3 over_hole(0.1, 0, 0);
  const Vec3 in_hole(0.1, 0, -0.07);
  const Vec3 pressing(0.1, side * 0.010, -0.085);
  return HandPath({point(0, Vec3::Zero(), "approach"), point(1, Vec3::Zero(), "move"), point(3, over_hole),
                   point(3.4, over_hole), point(4.9, in_hole), point(5.5, pressing, "hold"),
                   point(9, pressing, "retreat"), point(10, over_hole)});
}

// For the scene docking_helices: two users move their helices together along y and press them against each other.
HandPath dock(double sign) {
  const Vec3 there(0, sign * 0.045, 0);
  return HandPath({point(0, Vec3::Zero(), "approach"), point(1, Vec3::Zero(), "move"), point(5, there, "hold"),
                   point(9, there, "retreat"), point(10, Vec3::Zero())});
}

// Returns the components of a multisine with a period of 4 s. Amplitudes are inversely proportional to the frequency,
// so that all components have the same speed. The phases decrease quadratically (Schroeder phases), which keeps the
// peaks of the sum low.
std::vector<SineComponent> multisine_components(double speed_m_per_s) {
  constexpr std::array kFrequencies_hz = {0.5, 0.75, 1.25, 1.75, 2.5, 3.25, 4.0, 5.0};
  std::vector<SineComponent> components;
  for (std::size_t n = 0; n < kFrequencies_hz.size(); ++n) {
    const double number = static_cast<double>(n);
    const double amplitude_m = speed_m_per_s / (2 * std::numbers::pi * kFrequencies_hz[n]);
    const double phase_rad = -std::numbers::pi * number * number / static_cast<double>(kFrequencies_hz.size());
    components.push_back({Vec3::UnitX(), kFrequencies_hz[n], amplitude_m, phase_rad});
  }
  return components;
}

// Lets a user feel the inertia of a body: grabs a body 40 mm below the hand, lifts it by 80 mm, and shakes it along x
// with frequencies of 0.5 to 5 Hz for four periods of 4 s. Then holds it still and puts it down.
HandPath shake() {
  const Vec3 on_it(0, 0, -0.04);
  const Vec3 lifted(0, 0, 0.04);
  constexpr double kSpeed_m_per_s = 0.035;
  std::vector<WayPoint> points{point(0, Vec3::Zero(), "approach"),
                               point(0.5, Vec3::Zero()),
                               point(1.4, on_it),
                               point(1.6, on_it, "", kButtonGrab),
                               point(1.9, on_it, "", kButtonGrab),
                               point(3.2, lifted, "", kButtonGrab),
                               point(3.4, lifted, "shake", kButtonGrab),
                               point(20.4, lifted, "hold", kButtonGrab),
                               point(23.9, lifted, "retreat", kButtonGrab),
                               point(25.2, on_it, "", kButtonGrab),
                               point(25.5, on_it),
                               point(26.5, Vec3::Zero())};
  return HandPath(std::move(points),
                  {from_seconds(3.4), from_seconds(20.4), from_seconds(0.5), multisine_components(kSpeed_m_per_s)});
}

struct NamedPath {
  std::string_view name;
  HandPath (*make)();
};

constexpr std::array kNamedPaths = {
    NamedPath{"rest", rest},
    NamedPath{"press-down", press_down},
    NamedPath{"circle", circle},
    NamedPath{"grab-and-lift", grab_and_lift},
    NamedPath{"shake", shake},
    NamedPath{"push-right", [] { return push(1); }},
    NamedPath{"push-left", [] { return push(-1); }},
    NamedPath{"peg-left", [] { return peg(-1); }},
    NamedPath{"peg-right", [] { return peg(1); }},
    NamedPath{"dock-a", [] { return dock(1); }},
    NamedPath{"dock-b", [] { return dock(-1); }},
};

}  // namespace

HandPath named_hand_path(std::string_view name) {
  std::string known;
  for (const NamedPath& path : kNamedPaths) {
    if (path.name == name) return path.make();
    known += (known.empty() ? "" : ", ") + std::string(path.name);
  }
  throw std::invalid_argument("hand path \"" + std::string(name) + "\" is not known; known: " + known);
}

std::vector<std::string_view> hand_path_names() {
  std::vector<std::string_view> names;
  for (const NamedPath& path : kNamedPaths) names.push_back(path.name);
  return names;
}

}  // namespace tandem::devices
