#include "tests/proto/samples.hpp"

#include <limits>

#include "proto/soft_shape.hpp"
#include "proto/state_codec.hpp"

namespace tandem::proto {
namespace {

constexpr std::uint64_t kMaxVarint64 = std::numeric_limits<std::uint64_t>::max();
constexpr std::uint32_t kMaxVarint32 = std::numeric_limits<std::uint32_t>::max();

void add_numbers(google::protobuf::RepeatedField<double>& to, std::initializer_list<double> numbers) {
  to.Add(numbers.begin(), numbers.end());
}

Wrench largest_wave() {
  return {kMaxWaveSum * Vec3(0.3, -0.5, 0.7), kMaxWaveSum * Vec3(-0.7, 0.3, 0.6)};
}

std::string hash_bytes() {
  std::string hash;
  for (std::size_t i = 0; i < kAssetHashBytes; ++i) hash.push_back(static_cast<char>(7 * i + 1));
  return hash;
}

void fill_shapes(wire::Body& body) {
  body.add_shapes()->mutable_sphere()->set_radius_m(0.03);
  wire::Shape& box = *body.add_shapes();
  add_numbers(*box.mutable_placement()->mutable_position_m(), {0.01, -0.02, 0.03});
  add_numbers(*box.mutable_placement()->mutable_rotation_xyz_deg(), {10, 20, -30});
  add_numbers(*box.mutable_box()->mutable_size_m(), {0.1, 0.05, 0.04});
  body.add_shapes()->mutable_cylinder()->set_radius_m(0.02);
  body.mutable_shapes(2)->mutable_cylinder()->set_length_m(0.2);
  body.add_shapes()->mutable_capsule()->set_radius_m(0.01);
  body.add_shapes()->mutable_mesh()->set_file("bunny.obj");
  body.mutable_shapes(4)->mutable_mesh()->set_largest_size_m(0.15);
  body.add_shapes()->mutable_molecule()->set_file("1abc.pdb");
  body.mutable_shapes(5)->mutable_molecule()->add_chains(std::string("A"));
  body.mutable_shapes(5)->mutable_molecule()->set_asset_sha256(hash_bytes());
}

void fill_scene(wire::Scene& scene) {
  scene.set_name("golden");
  scene.set_description("every kind of shape");
  wire::Body& body = *scene.add_bodies();
  body.set_name("thing");
  body.set_mass_kg(0.25);
  body.set_friction(0.6);
  body.set_restitution(0);
  body.set_graspable(true);
  body.set_gravity(false);
  add_numbers(*body.mutable_placement()->mutable_position_m(), {0, 0, 0.5});
  add_numbers(*body.mutable_color_rgb(), {1, 0.5, 0.25});
  fill_shapes(body);
  wire::Tool& tool = *scene.add_tools();
  tool.set_name("left");
  tool.set_mass_kg(0.05);
  tool.set_holds("thing");
  tool.mutable_workspace()->set_position_scale(2.5);
  scene.mutable_coupling()->set_law("spring-damper");
  scene.mutable_coupling()->set_stiffness_n_per_m(300);
  scene.mutable_molecular_field()->set_metres_per_angstrom(0.01);
  scene.mutable_limits()->set_observers(4);
  add_numbers(*scene.mutable_gravity_m_per_s2(), {0, 0, -9.81});
  scene.set_step_rate_hz(1000);
}

template <class Message>
Bytes framed(const Message& message) {
  Bytes bytes;
  append_frame(message, bytes);
  return bytes;
}

Bytes client_datagram() {
  Bytes bytes;
  append_header(client_header(), bytes);
  append_client_update(client_update(), bytes);
  return bytes;
}

Bytes server_datagram() {
  Bytes bytes;
  append_header(server_header(), bytes);
  ServerUpdateEncoder().append(server_update(), bytes);
  return bytes;
}

}  // namespace

wire::ClientControl hello() {
  wire::ClientControl message;
  message.set_request(1);
  message.mutable_hello()->set_protocol_version(kProtocolVersion);
  message.mutable_hello()->set_program("tandem-client 0.1.0");
  message.mutable_hello()->add_capabilities("state-udp");
  message.mutable_hello()->add_capabilities("state-tcp");
  return message;
}

wire::ClientControl join() {
  wire::ClientControl message;
  message.set_request(2);
  message.mutable_join()->set_room("docking");
  message.mutable_join()->set_user_name("Zoë");
  message.mutable_join()->set_role(wire::ROLE_MANIPULATOR);
  message.mutable_join()->set_deadband(0.1);
  message.mutable_join()->mutable_coupling_bounds()->set_force_limit_n(2.5);
  return message;
}

wire::ClientControl grab() {
  wire::ClientControl message;
  message.set_request(300);
  message.mutable_grab()->set_body(5);
  return message;
}

wire::ClientControl get_asset() {
  wire::ClientControl message;
  message.set_request(301);
  message.mutable_get_asset()->set_sha256(hash_bytes());
  message.mutable_get_asset()->set_offset(65'536);
  message.mutable_get_asset()->set_max_bytes(1750);
  return message;
}

wire::ClientControl reset_room() {
  wire::ClientControl message;
  message.set_request(11);
  message.mutable_reset_room();
  return message;
}

wire::ClientControl ask_pose() {
  wire::ClientControl message;
  message.set_request(12);
  message.mutable_ask_pose()->set_kind(wire::AskPose::KEEP);
  message.mutable_ask_pose()->set_name("near");
  return message;
}

wire::ClientControl sent_signal() {
  wire::ClientControl message;
  message.set_request(15);
  message.mutable_signal()->set_name("valence");
  message.mutable_signal()->set_value(-0.25);
  message.mutable_signal()->set_confidence(0.75);
  message.mutable_signal()->set_age_s(0.5);
  return message;
}

wire::ServerControl room_start() {
  wire::ServerControl message;
  message.mutable_room_start()->set_starts_server_ns(7'000'000'000);
  return message;
}

wire::ServerControl pointed() {
  wire::ServerControl message;
  message.set_request(8);
  message.mutable_pointed()->set_user(2);
  wire::Point& point = *message.mutable_pointed()->mutable_point();
  point.set_body(1);
  for (const double number : {0.25, -0.5, 0.125}) {
    point.add_place(number);
    point.add_place_w(2 * number);
  }
  return message;
}

wire::ServerControl kept_pose() {
  wire::ServerControl message;
  message.set_request(12);
  wire::KeptPose& pose = *message.mutable_kept_pose();
  pose.set_number(1);
  pose.set_name("near");
  pose.set_user_name("ada");
  for (const double number : {0.25, -10.5, 0.125, 0.5, 0.5, 0.5, -0.5}) pose.add_in_first(number);
  pose.set_lj_kj_per_mol(-120.5);
  pose.set_coulomb_kj_per_mol(-62.25);
  pose.set_rmsd_angstrom(0.75);
  pose.set_contacts(33);
  pose.set_hydrogen_bonds(2);
  pose.set_kept_ms(1'700'000'000'000);
  pose.set_is_news(true);
  return message;
}

wire::ClientControl rename_pose() {
  wire::ClientControl message;
  message.set_request(14);
  message.mutable_ask_pose()->set_kind(wire::AskPose::RENAME);
  message.mutable_ask_pose()->set_number(7);
  message.mutable_ask_pose()->set_name("bound");
  return message;
}

wire::ServerControl pose_deleted() {
  wire::ServerControl message;
  message.set_request(13);
  message.mutable_pose_deleted()->set_number(7);
  message.mutable_pose_deleted()->set_user(2);
  return message;
}

wire::ServerControl pose_progress() {
  wire::ServerControl message;
  wire::PoseProgress& progress = *message.mutable_pose_progress();
  progress.set_user(2);
  progress.set_steps(41);
  progress.set_max_steps(201);
  progress.set_energy_kj_per_mol(-310.25);
  progress.set_is_over(true);
  return message;
}

wire::ServerControl welcome() {
  wire::ServerControl message;
  message.set_request(1);
  wire::Welcome& welcome = *message.mutable_welcome();
  welcome.set_protocol_version(kProtocolVersion);
  welcome.set_program("tandem-server 0.1.0");
  welcome.add_capabilities("state-udp");
  welcome.set_connection_id(0x0123456789abcdefULL);
  welcome.set_epoch(5);
  welcome.set_datagram_port(47'600);
  welcome.add_rooms("docking");
  welcome.add_rooms("assembly");
  welcome.set_silence_timeout_ms(1500);
  return message;
}

wire::ServerControl joined() {
  wire::ServerControl message;
  message.set_request(2);
  wire::Joined& joined = *message.mutable_joined();
  joined.set_user(3);
  joined.set_role(wire::ROLE_MANIPULATOR);
  joined.set_tool(1);
  fill_scene(*joined.mutable_scene());
  wire::AssetInfo& asset = *joined.add_assets();
  asset.set_sha256(hash_bytes());
  asset.set_size_bytes(123'456);
  asset.set_kind("mesh");
  asset.set_name("bunny.obj");
  wire::AssetInfo& coarse = *joined.add_assets();
  coarse.set_sha256(std::string(32, 'c'));
  coarse.set_size_bytes(2345);
  coarse.set_kind("coarse-contact");
  coarse.set_name("bunny_100mm.coarse");
  coarse.set_coarse_of(hash_bytes());
  wire::MassProperties& mass = *joined.add_body_masses();
  mass.set_mass_kg(0.25);
  add_numbers(*mass.mutable_centre(), {0.01, 0, -0.02, 0.5, 0.5, 0.5, -0.5});
  add_numbers(*mass.mutable_principal_inertia_kg_m2(), {1e-4, 2e-4, 2.5e-4});
  joined.add_tool_masses()->set_mass_kg(0.05);
  joined.add_notes("bunny.obj: 2 holes closed with 7 triangles");
  return message;
}

wire::ServerControl error() {
  wire::ServerControl message;
  message.set_request(300);
  message.mutable_error()->set_code(wire::ERROR_OUT_OF_REACH);
  message.mutable_error()->set_text("body 5 is 0.12 m from the tool; reach is 0.02 m");
  return message;
}

wire::ServerControl goodbye() {
  wire::ServerControl message;
  message.mutable_goodbye()->set_reason(wire::DISCONNECT_SERVER_STOPPING);
  message.mutable_goodbye()->set_text("the server is stopping");
  return message;
}

wire::ServerControl asset_chunk() {
  wire::ServerControl message;
  message.set_request(9);
  wire::AssetChunk& chunk = *message.mutable_asset_chunk();
  chunk.set_sha256(hash_bytes());
  chunk.set_offset(65'536);
  chunk.set_total_bytes(65'600);
  chunk.set_data("v 0.0 0.0 0.0\nv 1.0 0.0 0.0\n");
  return message;
}

wire::ServerControl room_reset() {
  wire::ServerControl message;
  message.set_request(11);
  message.mutable_room_reset()->set_user(3);
  return message;
}

wire::ServerControl soft_shape() {
  wire::ServerControl message;
  std::vector<Vec3> offsets_W;
  for (const Vec3& point : soft_lattice()) offsets_W.emplace_back(0, 0, point.z() > 0 ? point.x() - 0.5 : 0.0);
  write_soft_shape(2, offsets_W, *message.mutable_soft_shape());
  return message;
}

DatagramHeader client_header() {
  return {.type = DatagramType::kClientUpdate,
          .epoch = 5,
          .connection = ConnectionId{0x0123456789abcdefULL},
          .sequence = 0x1122};
}

DatagramHeader server_header() {
  return {.type = DatagramType::kServerUpdate,
          .epoch = 5,
          .connection = ConnectionId{0x0123456789abcdefULL},
          .sequence = 0x334455};
}

// The components of the unit quaternions are exact binary fractions, so that encoding and decoding do not change them.
ClientUpdate client_update() {
  ClientUpdate update;
  update.input_tick = Tick{120'000};
  update.handle.X = {Vec3(0.125, -0.25, 0.5), Quat(0.5, -0.5, 0.5, 0.5)};
  update.handle.V = {Vec3(0.01, 0.02, -0.03), Vec3(1, -2, 3)};
  update.handle_valid = true;
  update.buttons = kButtonGrab | kButtonClutch;
  update.sent = LocalTime(std::chrono::nanoseconds(987'654'321'000));
  update.acknowledged_step = Step{119'970};
  update.acknowledged_sent = ServerTime(std::chrono::nanoseconds(123'456'789'000));
  update.acknowledged_held = std::chrono::microseconds(750);
  update.energy_to_hand_j = 1.25;
  update.energy_from_hand_j = 2.75;
  update.mode = ClientMode::kLocalModel;
  update.on_hand_W = {Vec3(0.5, -1.25, 2), Vec3(0.0625, 0, -0.03125)};
  update.round_trip = std::chrono::milliseconds(42);
  return update;
}

ServerUpdate server_update() {
  ServerUpdate update;
  update.step = Step{119'980};
  update.stepped = ServerTime(std::chrono::nanoseconds(123'466'000'000));
  update.answered_input = Tick{119'995};
  update.echoed_sent = LocalTime(std::chrono::nanoseconds(987'654'321'000));
  update.received = ServerTime(std::chrono::nanoseconds(123'465'500'000));
  update.sent = ServerTime(std::chrono::nanoseconds(123'466'100'000));
  update.tool.X = {Vec3(0.125, -0.25, 0.46875), Quat(0.5, 0.5, -0.5, 0.5)};
  update.tool.V = {Vec3(0.5, 0.25, -0.125), Vec3(-1, 2, -3)};
  update.wrench_on_hand_W = {Vec3(0, 0, 6.5), Vec3(0.125, -0.0625, 0)};
  update.held_body = BodyId{2};
  update.tick_faults = 0b101;
  update.energy_into_world_j = 0.5;
  update.energy_from_world_j = 0.75;
  update.field_energy_kj_per_mol = -42.5;
  update.X_BT = {Vec3(0.03125, 0, -0.0625), Quat(0.5, 0.5, 0.5, -0.5)};
  update.playout = std::chrono::microseconds(12'500);
  update.soft_contact = soft_contact();
  update.wave = {Vec3(0.5, -0.25, 0), Vec3(0.125, 0, 1)};
  BodyState held{BodyId{2}, update.tool, UserId{3}};
  BodyState resting{BodyId{7}, {}, UserId{}};
  resting.state.X.p = Vec3(0.25, 0.5, 0.75);
  update.bodies = {resting, held};
  update.users = {OtherUserState{UserId{4}, update.tool, BodyId{}, 2, true, update.tool, std::chrono::milliseconds(40),
                                 update.wrench_on_hand_W}};
  return update;
}

// Returns the contact with a cushion that acts like two springs. Each spring adds k gᵀg to the stiffness matrix, with
// its stiffness k and the row vector g of its direction. The elements of g are exact binary fractions, so that encoding
// does not change them.
SoftContact soft_contact() {
  SoftContact contact;
  contact.wrench_W = {Vec3(0, 0.5, 2), Vec3(0.0625, 0, -0.03125)};
  Eigen::Matrix<double, 1, 6> a, b;
  a << 0, 0, 1, 0.25, -0.125, 0;
  b << 0.5, 1, 0, 0, 0.0625, 0.25;
  contact.stiffness = 256.0 * a.transpose() * a + 64.0 * b.transpose() * b;
  contact.X_WT0 = {Vec3(0.125, -0.25, 0.46875), Quat(0.5, 0.5, -0.5, 0.5)};
  contact.trust_radius_m = 0.002;
  contact.lever_m = 0.015;
  return contact;
}

std::vector<GoldenMessage> golden_messages() {
  return {{"hello", Packing::kClientControlFrame, framed(hello())},
          {"join", Packing::kClientControlFrame, framed(join())},
          {"grab", Packing::kClientControlFrame, framed(grab())},
          {"get_asset", Packing::kClientControlFrame, framed(get_asset())},
          {"welcome", Packing::kServerControlFrame, framed(welcome())},
          {"joined", Packing::kServerControlFrame, framed(joined())},
          {"error", Packing::kServerControlFrame, framed(error())},
          {"goodbye", Packing::kServerControlFrame, framed(goodbye())},
          {"asset_chunk", Packing::kServerControlFrame, framed(asset_chunk())},
          {"reset_room", Packing::kClientControlFrame, framed(reset_room())},
          {"room_reset", Packing::kServerControlFrame, framed(room_reset())},
          {"soft_shape", Packing::kServerControlFrame, framed(soft_shape())},
          {"ask_pose", Packing::kClientControlFrame, framed(ask_pose())},
          {"rename_pose", Packing::kClientControlFrame, framed(rename_pose())},
          {"kept_pose", Packing::kServerControlFrame, framed(kept_pose())},
          {"pose_deleted", Packing::kServerControlFrame, framed(pose_deleted())},
          {"pose_progress", Packing::kServerControlFrame, framed(pose_progress())},
          {"pointed", Packing::kServerControlFrame, framed(pointed())},
          {"signal", Packing::kClientControlFrame, framed(sent_signal())},
          {"room_start", Packing::kServerControlFrame, framed(room_start())},
          {"client_update", Packing::kClientDatagram, client_datagram()},
          {"server_update", Packing::kServerDatagram, server_datagram()}};
}

RigidState moving_state(std::size_t index) {
  const double turn = 0.1 * static_cast<double>(index + 1);
  RigidState state;
  state.X.p = Vec3(100.1 + turn, -200.2, 300.3);
  state.X.q = quaternion_of(Vec3(turn, 0.7, -0.3));
  state.V = {Vec3(1.1, -2.2, 3.3), Vec3(-4.4, 5.5, turn)};
  return state;
}

RigidState resting_state(std::size_t index) {
  RigidState state = moving_state(index);
  state.V = {};
  return state;
}

ClientUpdate largest_client_update(ClientMode mode) {
  ClientUpdate update;
  update.input_tick = Tick{kMaxVarint64};
  update.handle = moving_state(0);
  update.handle_valid = true;
  update.buttons = kMaxVarint32;
  update.sent = LocalTime(kMaxTimestamp);
  update.acknowledged_step = Step{kMaxVarint64};
  update.acknowledged_sent = ServerTime(kMaxTimestamp);
  update.acknowledged_held = kMaxTimestamp;
  update.energy_to_hand_j = kMaxEnergyJ;
  update.energy_from_hand_j = kMaxEnergyJ;
  update.mode = mode;
  if (mode == ClientMode::kLocalModel) update.on_hand_W = {Vec3(5.1e4, -5.2e4, 5.3e4), Vec3(-5.4e4, 5.5e4, -5.6e4)};
  if (mode == ClientMode::kWave) update.wave = largest_wave();
  update.round_trip = kMaxDelay;
  return update;
}

ServerUpdate largest_server_update(std::size_t held) {
  ServerUpdate update;
  update.step = Step{kMaxVarint64};
  update.stepped = update.received = update.sent = ServerTime(kMaxTimestamp);
  update.answered_input = Tick{kMaxVarint64};
  update.echoed_sent = LocalTime(kMaxTimestamp);
  update.tool = moving_state(0);
  update.wrench_on_hand_W = {Vec3(5.1e4, -5.2e4, 5.3e4), Vec3(-5.4e4, 5.5e4, -5.6e4)};
  update.tick_faults = kMaxVarint32;
  update.energy_into_world_j = kMaxEnergyJ;
  update.energy_from_world_j = kMaxEnergyJ;
  update.field_energy_kj_per_mol = -kMaxFieldEnergyKjPerMol;
  for (std::size_t i = 0; i < kMaxBodies; ++i) {
    const auto id = static_cast<std::uint32_t>(kMaxVarint32 - i);
    update.bodies.push_back({BodyId{id}, moving_state(i), UserId{kMaxVarint32}});
  }
  for (std::size_t i = 0; i < kMaxUsers; ++i) {
    const auto id = static_cast<std::uint32_t>(kMaxVarint32 - i);
    update.users.push_back({UserId{id},
                            moving_state(i),
                            BodyId{kMaxVarint32},
                            kMaxVarint32,
                            true,
                            moving_state(i),
                            kMaxDelay,
                            {Vec3::Constant(1.0 / 3), Vec3::Constant(1.0 / 3)}});
  }
  update.held_body = update.bodies.at(held).id;
  update.X_BT = moving_state(2).X;
  update.playout = kMaxDelay;
  update.soft_contact = soft_contact();
  update.soft_contact.X_WT0 = moving_state(3).X;
  update.soft_contact.trust_radius_m = 0.1;
  update.wave = largest_wave();
  return update;
}

}  // namespace tandem::proto
