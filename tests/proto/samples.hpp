// Messages for several tests of proto/: typical messages, which serve as golden messages, and the largest possible
// ones.
#pragma once

#include <string>
#include <vector>

#include "proto/control_framing.hpp"
#include "proto/datagram.hpp"
#include "proto/state.hpp"

namespace tandem::proto {

/// Framing of a golden message. It selects the function that reads the message.
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
wire::ClientControl sent_signal();
wire::ServerControl room_start();
wire::ServerControl welcome();
/// A message with a scene that has every kind of shape. Its numbers differ from the defaults, so that a lost field is
/// detected.
wire::ServerControl joined();
wire::ServerControl error();
wire::ServerControl goodbye();
wire::ServerControl asset_chunk();
wire::ServerControl room_reset();
/// The deformation of a block that is pressed in at its centre.
wire::ServerControl soft_shape();
DatagramHeader client_header();
DatagramHeader server_header();
/// An update that contains the tool of a local model.
ClientUpdate client_update();
SoftContact soft_contact();
/// An update with two bodies (one moving and held, one resting) and another user.
ServerUpdate server_update();

/// All messages above, packed by the project's own writers.
std::vector<GoldenMessage> golden_messages();

/// An update in which every varint has its maximum length and every double uses all its bytes, within the limits of the
/// readers.
ClientUpdate largest_client_update(ClientMode mode = ClientMode::kLocalModel);
/// An update with kMaxBodies moving bodies that other users hold, and kMaxUsers moving users with the longest ids. All
/// other fields have their largest size too. The receiving user holds the body with the index `held`.
ServerUpdate largest_server_update(std::size_t held);

/// Pose and twist without zeros or numbers with few digits, different for each `index`.
RigidState moving_state(std::size_t index);
RigidState resting_state(std::size_t index);

}  // namespace tandem::proto
