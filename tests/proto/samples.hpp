// Messages shared by several tests of proto/: typical ones, which are also the golden messages, and the largest ones.
#pragma once

#include <string>
#include <vector>

#include "proto/control_framing.hpp"
#include "proto/datagram.hpp"
#include "proto/state.hpp"

namespace tandem::proto {

/// Packing of a golden message; it selects the reader.
enum class Packing { kClientControlFrame, kServerControlFrame, kClientDatagram, kServerDatagram };

/// A message as sent, with the name of its file in tests/golden/wire.
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
/// Message with a scene that has every kind of shape. Its numbers differ from the defaults.
wire::ServerControl joined();
wire::ServerControl error();
wire::ServerControl goodbye();
wire::ServerControl asset_chunk();
wire::ServerControl room_reset();
/// Shape of a block that is pressed in at its centre.
wire::ServerControl soft_shape();
DatagramHeader client_header();
DatagramHeader server_header();
/// Update with the tool of a local model.
ClientUpdate client_update();
SoftContact soft_contact();
/// Update with two bodies (one moving and held, one resting) and another user.
ServerUpdate server_update();

/// All messages above, packed by the project's own writers.
std::vector<GoldenMessage> golden_messages();

/// Update with every varint at its longest and every double with all its bytes, within the limits of the readers.
ClientUpdate largest_client_update(ClientMode mode = ClientMode::kLocalModel);
/// Update with kMaxBodies moving bodies held by others and kMaxUsers moving users with the longest ids. All other
/// fields have their largest size too. The reader holds the body with index `held`.
ServerUpdate largest_server_update(std::size_t held);

/// Pose and twist without a zero or short number, different for each `index`.
RigidState moving_state(std::size_t index);
RigidState resting_state(std::size_t index);

}  // namespace tandem::proto
