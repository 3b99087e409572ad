// Messages that several tests of proto/ use: typical ones, which are also the golden ones, and the largest ones.
#pragma once

#include <string>
#include <vector>

#include "proto/control_framing.hpp"
#include "proto/datagram.hpp"
#include "proto/state.hpp"

namespace tandem::proto {

/// How a golden message is packed, and so which reader it is for.
enum class Packing { kClientControlFrame, kServerControlFrame, kClientDatagram, kServerDatagram };

/// A message as it goes onto the wire, with the name of its file in tests/golden/wire.
struct GoldenMessage {
  std::string name;
  Packing packing;
  Bytes bytes;
};

wire::ClientControl hello();
wire::ClientControl join();
wire::ClientControl grab();
wire::ClientControl get_asset();
wire::ClientControl reset_room();
wire::ClientControl ask_pose();
wire::ClientControl rename_pose();
wire::ServerControl kept_pose();
wire::ServerControl pose_deleted();
wire::ServerControl pose_progress();
wire::ServerControl pointed();
wire::ServerControl room_start();
wire::ServerControl welcome();
/// With a scene that has every kind of shape, and numbers that defaults would not give.
wire::ServerControl joined();
wire::ServerControl error();
wire::ServerControl goodbye();
wire::ServerControl asset_chunk();
wire::ServerControl room_reset();
/// A block that is pressed in at its middle.
wire::ServerControl soft_shape();
DatagramHeader client_header();
DatagramHeader server_header();
/// With a local model's tool.
ClientUpdate client_update();
SoftContact soft_contact();
/// Two bodies (one moving and held, one resting) and another user.
ServerUpdate server_update();

/// All of the above, packed by the project's own writers.
std::vector<GoldenMessage> golden_messages();

/// Every varint at its longest, every double with all its bytes, within what readers accept.
ClientUpdate largest_client_update(ClientMode mode = ClientMode::kLocalModel);
/// kMaxBodies moving bodies held by others and kMaxUsers moving users with the longest ids, and likewise all else.
/// The body with index `held` is held by the reader.
ServerUpdate largest_server_update(std::size_t held);

/// A pose and twist with no number that is zero or short, different for each `index`.
RigidState moving_state(std::size_t index);
RigidState resting_state(std::size_t index);

}  // namespace tandem::proto
