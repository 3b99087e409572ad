// A room with a game, and scripted hands for its tools.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "common/base/buttons.hpp"
#include "server/room/room.hpp"
#include "tests/common/physics/scene_support.hpp"

namespace tandem::server {

/// Text of a scene with a table, a ball and a tool above it.
inline std::string small_game(const std::string& game, const std::string& more_bodies = "",
                              const std::string& rest = "") {
  return physics::scene_json(
      {.bodies =
           R"({"name": "table", "shapes": [{"box": {"size_m": [1, 1, 0.1]}}], "placement": {"position_m": [0, 0, -0.05]}},
         {"name": "ball", "shapes": [{"sphere": {"radius_m": 0.02}}], "mass_kg": 0.1, "graspable": true,
          "placement": {"position_m": [0, 0, 0.02]}})" +
           more_bodies,
       .tools = R"({"name": "t", "placement": {"position_m": [0, 0, 0.06]}},
                   {"name": "u", "placement": {"position_m": [0.3, 0.3, 0.2]}})",
       .rest = R"("game": )" + game + rest});
}

/// A hand that moves in straight lines at a limited speed.
struct ScriptedHand {
  Vec3 p = Vec3::Zero();
  bool is_pressed = false;
};

class GameRoom {
 public:
  explicit GameRoom(std::shared_ptr<const LoadedScene> scene, const RoomOptions& options = {})
      : room(RoomId{1}, "game", std::move(scene), options) {
    for (std::size_t i = 0; i < hands.size(); ++i) {
      if (i < room.scene().world.tools.size()) hands[i].p = room.scene().world.tools[i].X_WT.p;
    }
  }

  void join(std::uint8_t tool) {
    ASSERT_TRUE(room.post({.seat = {tool, UserId{tool + 1U}, UserRole::kManipulator, tool}}));
    is_here.at(tool) = true;
  }
  void leave(std::uint8_t tool) {
    ASSERT_TRUE(room.post({.kind = RoomCommand::Kind::kLeave, .seat = {tool, UserId{tool + 1U}}}));
    is_here.at(tool) = false;
  }
  void command(RoomCommand command, std::uint8_t tool = 0) {
    command.seat = {tool, UserId{tool + 1U}};
    ASSERT_TRUE(room.post(command));
  }
  void step() {
    for (std::size_t tool = 0; tool < hands.size(); ++tool) {
      if (!is_here.at(tool)) continue;
      proto::ClientUpdate update;
      update.input_tick = Tick{ticks + 1};
      update.handle.X.p = hands.at(tool).p;
      update.handle_valid = true;
      update.buttons = hands.at(tool).is_pressed ? std::uint32_t{kButtonGrab} : 0;
      room.input(tool).publish(update);
    }
    ++ticks;
    room.step(ServerTime(room.period() * static_cast<Duration::rep>(ticks)));
    for (const GameEvent& event : room.game()->events()) events.push_back(event);
  }
  void run(double seconds) {
    const auto count = static_cast<int>(std::lround(seconds / to_seconds(room.period())));
    for (int i = 0; i < count; ++i) step();
  }
  /// Moves a hand to a place in a straight line at 0.2 m/s.
  void move(std::uint8_t tool, const Vec3& to) {
    constexpr double kSpeed_m_per_s = 0.2;
    const Vec3 from = hands.at(tool).p;
    const int count = std::max(1, static_cast<int>((to - from).norm() / (kSpeed_m_per_s * to_seconds(room.period()))));
    for (int i = 1; i <= count; ++i) {
      hands.at(tool).p = from + (to - from) * i / count;
      step();
    }
  }
  const GameStatus& status() const { return room.game()->status(); }
  std::vector<GameEvent::Kind> kinds() const {
    std::vector<GameEvent::Kind> out;
    for (const GameEvent& event : events) out.push_back(event.kind);
    return out;
  }

  Room room;
  std::array<ScriptedHand, 2> hands;
  std::array<bool, 2> is_here{};
  std::vector<GameEvent> events;
  std::uint64_t ticks = 0;
};

/// Takes the ball of the scene `ring` and puts it into the ring.
inline void play_ring(GameRoom& game) {
  game.move(0, {-0.08, 0, 0.03});
  game.hands[0].is_pressed = true;
  game.run(0.3);
  game.move(0, {-0.08, 0, 0.09});
  game.move(0, {0.12, 0, 0.09});
  game.move(0, {0.12, 0, 0.035});
  game.hands[0].is_pressed = false;
  game.run(0.3);
  game.move(0, {0.12, 0, 0.12});
}

}  // namespace tandem::server
