#include "lab/session/virtual_session.hpp"

#include <stdexcept>
#include <utility>

#include "client/client.hpp"
#include "common/docking/molecular_field.hpp"
#include "devices/sim/sim_device.hpp"
#include "lab/session/session_settings.hpp"
#include "lab/session/virtual_network.hpp"
#include "server/room/server_world.hpp"

namespace tandem::lab {
namespace {

/// Number of the first stream of random numbers for hands; smaller numbers are used by the links (virtual_network.cpp).
/// All streams derive from the seed of the experiment.
constexpr std::uint64_t kHandStreams = 1U << 16U;
constexpr Duration kJoinTimeout = std::chrono::seconds(30);

std::uint64_t hand_seed(std::uint64_t seed, std::size_t user) {
  return Random(seed, kHandStreams + user).next_u64();
}

// Returns the watched body: the body of the outcome rule, otherwise the first graspable body, otherwise the first
// movable one.
std::optional<std::size_t> watched_body(const Experiment& experiment, const server::LoadedScene& scene) {
  std::optional<std::size_t> movable;
  std::optional<std::size_t> graspable;
  for (int i = scene.description.bodies_size() - 1; i >= 0; --i) {
    const auto& body = scene.description.bodies(i);
    const auto index = static_cast<std::size_t>(i);
    if (experiment.outcome && body.name() == experiment.outcome->body) return index;
    if (body.mass_kg() > 0) movable = index;
    if (body.graspable()) graspable = index;
  }
  if (experiment.outcome) {
    throw std::invalid_argument("experiment " + experiment.name + ": outcome.body is \"" + experiment.outcome->body +
                                "\"; the scene has no such body");
  }
  return graspable ? graspable : movable;
}

devices::DeviceSpec spec_of(const ExperimentUser& user) {
  devices::DeviceSpec spec = user.device.spec;
  if (user.is_bounded) spec.workspace_m = user.device.workspace_m;
  return spec;
}

/// A user with all client objects: device, transport and client.
struct VirtualUser {
  VirtualUser(const ExperimentUser& description, const client::ClientSettings& settings,
              VirtualClientTransport& its_transport, std::uint64_t seed)
      : user(description),
        transport(its_transport),
        device(spec_of(description), devices::holding(description.hand_parameters, description.device),
               description.hand, seed),
        client(settings, device, transport),
        seed_of_hand(seed) {
    device.begin_path_at(LocalTime::max());
  }

  /// Corrects the hand's path by the error of the displayed pose of the handle. A real user does the same when watching
  /// the tool.
  void steer(const WorkspaceMapping& scene) {
    const client::TickRecord& seen = client.haptics().record();
    if (seen.scene_generation == 0 || !seen.sample.is_valid) return;
    const Vec3 handle = scene.X_WD.q.conjugate() * (seen.handle_W.X.p - scene.X_WD.p) / scene.position_scale;
    device.steer(handle / user.motion_scale - seen.sample.X_DH.p, user.motion_scale);
  }
  /// Returns the local model in use, or null if the stage has none.
  const client::LocalModel* model() const { return client.haptics().local_model(); }

  const ExperimentUser& user;
  VirtualClientTransport& transport;
  devices::SimDevice device;
  client::Client client;
  std::optional<std::size_t> tool;  ///< index into the scene's tools; empty for users without a tool
  std::uint64_t seed_of_hand;
  client::HapticCounters at_start;
  TrafficCounters traffic_at_start;
  double passivity_dissipated_at_start_j = 0;
};

TickSample sample_of(VirtualUser& user, Duration time, LocalTime now) {
  TickSample sample = lab::sample_of(user.client.haptics().record());
  sample.time = time;
  sample.phase = user.device.path().phase_at(user.device.path_time());
  sample.hand_D = user.device.hand_pose();
  sample.hand_twist_D = user.device.hand_twist();
  sample.intended_D = user.device.path().pose_at(user.device.path_time()).p;
  sample.input_age = now - user.transport.received_at_server();
  sample.round_trip = user.client.session().clock_sync().round_trip();
  return sample;
}

std::string field_kernel_of(const server::LoadedScene& scene) {
  std::size_t molecules = 0;
  for (const physics::BodyDescription& body : scene.world.bodies) molecules += body.molecule != nullptr ? 1 : 0;
  return molecules < 2 ? std::string() : std::string(docking::MolecularField::default_kernel());
}

struct VirtualSession {
  VirtualSession(const Experiment& its_experiment, std::shared_ptr<const server::LoadedScene> its_scene,
                 const OnTick& listener, const OnClient& user_at_window);

  void run_slot();
  void run_client_slot(std::size_t index, LocalTime now);
  void join_all();
  void start_hands();
  void record_tick(std::size_t index);
  void record_bodies();
  void record_step();
  SessionTrace collect_trace();

  const Experiment& experiment;
  const OnTick& on_tick;
  const OnClient& on_client;
  std::shared_ptr<const server::LoadedScene> scene;
  VirtualClock clock;
  VirtualNetwork network{clock};
  server::Room room;
  server::SessionHub hub;
  std::vector<std::unique_ptr<VirtualUser>> users;
  std::int64_t slot = 0;
  LocalTime next_room_step;
  bool are_hands_moving = false;
  LocalTime hands_started;
  LocalTime next_sample;
  SessionTrace trace;
};

VirtualSession::VirtualSession(const Experiment& its_experiment, std::shared_ptr<const server::LoadedScene> its_scene,
                               const OnTick& listener, const OnClient& user_at_window)
    : experiment(its_experiment),
      on_tick(listener),
      on_client(user_at_window),
      scene(std::move(its_scene)),
      room(RoomId{1}, "lab", scene, {.controls_tool_passivity = experiment.controls_passivity()}),
      hub(hub_settings(experiment.seed), {&room}, network),
      next_room_step(LocalTime(experiment.server_phase)) {
  check_manipulators(experiment, *scene);
  const std::optional<std::size_t> watched = watched_body(experiment, *scene);
  trace.watched_body = watched;
  const std::shared_ptr<client::AssetStore> assets = assets_of(experiment, *scene);
  std::size_t tool = 0;
  for (std::size_t i = 0; i < experiment.users.size(); ++i) {
    const ExperimentUser& user = experiment.users[i];
    VirtualClientTransport& transport = network.add_client(user.up, user.down, experiment.seed);
    users.push_back(std::make_unique<VirtualUser>(user, client_settings(experiment, user, assets), transport,
                                                  hand_seed(experiment.seed, i)));
    if (watched) users.back()->client.haptics().watch(body_id_at(*watched));
    UserTrace& user_trace = trace.users.emplace_back();
    user_trace.user = user;
    user_trace.hand_seed = users.back()->seed_of_hand;
    if (server::has_tool(user.role)) {
      users.back()->tool = tool;
      user_trace.hand_joules_per_world_joule = scene->workspaces[tool++].hand_joules_per_world_joule();
    }
    user_trace.ticks.reserve(static_cast<std::size_t>(experiment.duration / kHapticPeriod) + 1);
  }
  for (const auto& body : scene->description.bodies()) {
    trace.body_names.push_back(body.name());
    trace.body_can_move.push_back(body.mass_kg() > 0);
  }
  trace.field_kernel = field_kernel_of(*scene);
}

void VirtualSession::run_slot() {
  const LocalTime now{kSlot * ++slot};
  clock.advance_to(now);
  network.collect(now);
  network.deliver(hub, now);
  if (now >= next_room_step) {
    room.step(server_time_of_own_clock(now));
    next_room_step += room.period();
    if (are_hands_moving) record_step();
  }
  hub.poll(VirtualClock(now));
  for (std::size_t i = 0; i < users.size(); ++i) run_client_slot(i, now);
  if (are_hands_moving && now >= next_sample) record_bodies();
}

void VirtualSession::run_client_slot(std::size_t index, LocalTime now) {
  VirtualUser& user = *users[index];
  user.transport.deliver(user.client.session(), now);
  if ((now.time_since_epoch() - user.user.tick_phase) % kHapticPeriod == Duration(0)) {
    const bool is_steered = user.user.is_bounded || user.user.motion_scale != 1;
    if (are_hands_moving && user.tool && is_steered) user.steer(scene->workspaces[*user.tool]);
    if (are_hands_moving && on_client) on_client(index, now - hands_started, user.client);
    user.client.haptics().tick(now);
    if (are_hands_moving) record_tick(index);
  }
  user.client.poll(now);
  if (user.client.model_problem().empty()) return;
  throw std::runtime_error("user " + user.user.name + " cannot be shown the scene: " + user.client.model_problem());
}

void VirtualSession::join_all() {
  for (const auto& user : users) {
    user->client.session().start(clock.now());
    const LocalTime give_up = clock.now() + kJoinTimeout;
    while (user->client.session().status().state != client::SessionState::kActive) {
      const client::SessionStatus& status = user->client.session().status();
      if (status.state == client::SessionState::kEnded || clock.now() >= give_up) {
        throw CouldNotJoin("user " + user->user.name +
                           " could not join: " + (status.why.empty() ? "no answer within 30 s" : status.why));
      }
      run_slot();
    }
  }
  // The hands start only after every manipulator has received a state of the world, which takes one more round trip.
  for (const auto& user : users) {
    const LocalTime give_up = clock.now() + kJoinTimeout;
    const bool is_manipulator = server::has_tool(user->user.role);
    while (is_manipulator && user->client.haptics().record().newest_step.value == 0 && clock.now() < give_up)
      run_slot();
  }
}

// Starts the hands at a whole millisecond, so that the ticks of a hand have the same times in two trials.
void VirtualSession::start_hands() {
  while (clock.now().time_since_epoch() % kHapticPeriod != Duration(0)) run_slot();
  hands_started = clock.now();
  next_sample = hands_started;
  are_hands_moving = true;
  trace.joined_after = hands_started.time_since_epoch();
  for (const auto& user : users) {
    user->device.read(hands_started);
    user->device.begin_path_at(hands_started);
    user->at_start = user->client.haptics().counters();
    user->traffic_at_start = user->transport.traffic();
    user->passivity_dissipated_at_start_j = passivity_dissipated_j(user->client.haptics(), user->user.pipeline);
  }
  record_bodies();
  record_step();
}

void VirtualSession::record_step() {
  for (std::size_t i = 0; i < users.size(); ++i) {
    if (users[i]->tool) note_answer(room, *users[i]->tool, clock.now() - hands_started, trace.users[i].answered);
  }
}

void VirtualSession::record_tick(std::size_t index) {
  const TickSample sample = sample_of(*users[index], clock.now() - hands_started, clock.now());
  trace.faults_seen |= sample.server_tick_faults;
  UserTrace& user = trace.users[index];
  const client::SessionStatus& status = users[index]->client.session().status();
  if (user.stayed_connected && status.state != client::SessionState::kActive) {
    user.stayed_connected = false;
    user.why_disconnected = status.why;
  }
  if (!user.local_after) user.local_after = users[index]->client.local_after();
  if (!user.full_local_after && users[index]->client.full_local_after()) {
    user.full_local_after = users[index]->client.full_local_after();
    user.state_waits = users[index]->transport.waits_down();
  }
  user.ticks.push_back(sample);
  if (on_tick) on_tick(index, users[index]->client.haptics().record(), sample.phase);
}

void VirtualSession::record_bodies() {
  BodiesSample sample;
  sample.time = clock.now() - hands_started;
  for (std::size_t i = 0; i < scene->world.bodies.size(); ++i) {
    sample.X_WB.push_back(room.world().body(body_id_at(i)).X);
  }
  sample.field_energy_kj_per_mol = room.world().field_energy_kj_per_mol();
  trace.bodies.push_back(std::move(sample));
  next_sample += experiment.sample_period;
}

SessionTrace VirtualSession::collect_trace() {
  for (std::size_t i = 0; i < users.size(); ++i) {
    UserTrace& user = trace.users[i];
    const client::HapticCounters& end = users[i]->client.haptics().counters();
    user.energy_to_hand_j = end.energy_to_hand_j - users[i]->at_start.energy_to_hand_j;
    user.energy_from_hand_j = end.energy_from_hand_j - users[i]->at_start.energy_from_hand_j;
    user.passivity_dissipated_j = passivity_dissipated_j(users[i]->client.haptics(), users[i]->user.pipeline) -
                                  users[i]->passivity_dissipated_at_start_j;
    if (experiment.assets == "here" || !user.full_local_after) user.state_waits = users[i]->transport.waits_down();
    user.stream_bytes = users[i]->transport.traffic().stream_bytes;
    user.traffic = users[i]->transport.traffic();
    user.traffic.datagrams -= users[i]->traffic_at_start.datagrams;
    user.traffic.bytes -= users[i]->traffic_at_start.bytes;
    user.session = users[i]->client.session().counters();
    user.link_up = users[i]->transport.datagrams_up();
    user.link_down = users[i]->transport.datagrams_down();
  }
  trace.hub = hub.counters();
  trace.room_steps = room.steps_done().value;
  return std::move(trace);
}

}  // namespace

SessionTrace run_virtual_session(const Experiment& experiment, const std::shared_ptr<const server::LoadedScene>& scene,
                                 const OnTick& on_tick, const OnClient& on_client) {
  VirtualSession session(experiment, scene, on_tick, on_client);
  session.join_all();
  session.start_hands();
  const LocalTime end = session.clock.now() + experiment.duration;
  while (session.clock.now() < end) session.run_slot();
  return session.collect_trace();
}

}  // namespace tandem::lab
