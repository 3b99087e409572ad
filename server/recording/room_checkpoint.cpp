#include "server/recording/room_checkpoint.hpp"

#include <algorithm>

#include "proto/recording/exact_state.hpp"
#include "server/assets/scene_hash.hpp"
#include "server/goals/game_codec.hpp"

namespace tandem::server {
namespace {

constexpr int kNumbersPerPose = 7;

std::string hash_text(const LoadedScene& scene) {
  const proto::Sha256 hash = hash_of(scene);
  return {reinterpret_cast<const char*>(hash.data()), hash.size()};
}

}  // namespace

wire::RoomCheckpoint checkpoint_of(const Room& room) {
  RoomState state;
  room.describe(state);
  return checkpoint_of(room.name(), room.scene(), state);
}

wire::RoomCheckpoint checkpoint_of(const std::string& room, const LoadedScene& scene, const RoomState& state) {
  wire::RoomCheckpoint out;
  out.set_room(room);
  out.set_scene_sha256(hash_text(scene));
  for (const proto::BodyState& body : state.bodies) {
    wire::RecordedBody& to = *out.add_bodies();
    to.set_id(body.id.value);
    proto::write_exact(body.state, *to.mutable_state());
  }
  for (const RoomState::Tool& tool : state.tools) {
    wire::CheckpointTool& to = *out.add_tools();
    to.set_tool(tool.tool);
    proto::write_exact(tool.state, *to.mutable_state());
    to.set_held_body(tool.held.value);
    for (const double number : tool.X_BT.p) to.add_in_body(number);
    const Quat& q = tool.X_BT.q;
    for (const double number : {q.w(), q.x(), q.y(), q.z()}) to.add_in_body(number);
  }
  if (state.game) write_checkpoint(*state.game, *out.mutable_game());
  for (const Vec3& node_W : state.soft_nodes_W) {
    for (const double number : node_W) out.add_soft_nodes(number);
  }
  return out;
}

std::optional<RoomState> state_of(const wire::RoomCheckpoint& checkpoint, const LoadedScene& scene) {
  if (checkpoint.scene_sha256() != hash_text(scene)) return std::nullopt;
  RoomState state;
  if (checkpoint.bodies_size() > static_cast<int>(state.bodies.capacity()) ||
      checkpoint.tools_size() > static_cast<int>(state.tools.capacity())) {
    return std::nullopt;
  }
  for (const wire::RecordedBody& body : checkpoint.bodies()) {
    state.bodies.push_back({BodyId{body.id()}, proto::read_exact(body.state()), UserId{}});
  }
  for (const wire::CheckpointTool& tool : checkpoint.tools()) {
    const auto& numbers = tool.in_body();
    if (numbers.size() != kNumbersPerPose || tool.tool() >= proto::kMaxUsers) return std::nullopt;
    const Pose X_BT{{numbers[0], numbers[1], numbers[2]}, Quat(numbers[3], numbers[4], numbers[5], numbers[6])};
    state.tools.push_back(
        {static_cast<std::uint8_t>(tool.tool()), proto::read_exact(tool.state()), BodyId{tool.held_body()}, X_BT});
  }
  if (checkpoint.has_game()) state.game = read_checkpoint(checkpoint.game());
  const auto& soft = checkpoint.soft_nodes();
  if (soft.size() % 3 != 0) return std::nullopt;
  for (int i = 0; i < soft.size(); i += 3) state.soft_nodes_W.emplace_back(soft[i], soft[i + 1], soft[i + 2]);
  return state;
}

}  // namespace tandem::server
