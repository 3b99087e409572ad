#include "lab/session/live_session.hpp"

#include <algorithm>
#include <atomic>
#include <future>
#include <optional>
#include <stdexcept>
#include <thread>
#include <utility>

#include "client/haptics/stages/stage.hpp"
#include "client/net/client_io.hpp"
#include "common/realtime/ring.hpp"
#include "devices/sim/sim_device.hpp"
#include "lab/session/live_rows.hpp"
#include "lab/session/session_settings.hpp"
#include "lab/session/virtual_session.hpp"
#include "server/net/live_server.hpp"

namespace tandem::lab {
namespace {

constexpr Duration kMainPeriod = std::chrono::milliseconds(10);
constexpr Duration kLiveJoinTimeout = std::chrono::seconds(30);
/// Time from the decision to start the hands until their start. It is long enough for every haptic thread to read the
/// start time.
constexpr Duration kStartIn = std::chrono::milliseconds(50);
/// Capacity of the ring buffer in ticks, as in HapticLoopSettings::trace_capacity. Records are lost if the main thread
/// is late by more ticks than this.
constexpr std::size_t kRingTicks = 4096;
/// Real-time priority of the haptic thread minus that of the io thread, as in tandem-client.
constexpr int kIoPriorityBelow = 10;
constexpr Duration::rep kNotYet = -1;

LocalTime next_whole_millisecond(LocalTime time) {
  const Duration since = time.time_since_epoch();
  return LocalTime((since / kHapticPeriod + 1) * kHapticPeriod);
}

// Returns whether a link has neither delay nor disturbances. Such a link is not simulated: its packets only pass the
// loopback interface.
bool is_perfect(const net::LinkParameters& link) {
  return link.delay == Duration(0) && link.jitter == Duration(0) && link.trace.empty() &&
         link.delay_path.points.empty() && !link.spoils_datagrams() && link.rate_limit_bytes_per_s == 0;
}

client::ClientIoSettings io_settings(const Experiment& experiment, const ExperimentUser& user,
                                     const server::LoadedScene& scene, std::uint16_t port, std::uint64_t link_seed,
                                     int realtime_priority) {
  client::ClientIoSettings settings;
  settings.port = port;
  settings.client = client_settings(experiment, user, assets_of(experiment, scene));
  settings.client.session.may_reconnect = false;
  if (!is_perfect(user.up) || !is_perfect(user.down))
    settings.links = client::SimulatedLinks{user.up, user.down, link_seed};
  if (realtime_priority > 0) settings.realtime_priority = std::max(1, realtime_priority - kIoPriorityBelow);
  return settings;
}

std::vector<std::unique_ptr<server::Room>> one_room(const Experiment& experiment,
                                                    const std::shared_ptr<const server::LoadedScene>& scene) {
  std::vector<std::unique_ptr<server::Room>> rooms;
  rooms.push_back(std::make_unique<server::Room>(
      RoomId{1}, "lab", scene,
      server::RoomOptions{.steps_soft_aside = true, .controls_tool_passivity = experiment.controls_passivity()}));
  return rooms;
}

/// The server of a trial on a free loopback port. At each step it records the inputs that the step used
/// (note_answer()), and periodically the poses of the bodies.
class LiveTrialServer {
 public:
  /// Runs the server until stop().
  LiveTrialServer(const Experiment& experiment, const std::shared_ptr<const server::LoadedScene>& scene,
                  int realtime_priority);
  ~LiveTrialServer() { stop(); }

  std::uint16_t port() const { return server_.port(); }
  /// Records samples from `start` on, at most for the duration of the experiment.
  void record_from(LocalTime start) { start_ns_.store(start.time_since_epoch().count(), std::memory_order_release); }
  void stop();
  /// Moves the records into the trace. May be called only after stop().
  void collect(SessionTrace& trace, LiveTiming& timing);

 private:
  void record(const server::Room& room) noexcept;

  const Experiment& experiment_;
  server::LiveServer server_;
  std::atomic<Duration::rep> start_ns_{kNotYet};
  // Until stop(), only the room thread uses the following members. Their memory is reserved in advance, so that a step
  // of the room does not allocate.
  Duration next_bodies_{0};
  std::vector<BodiesSample> bodies_;
  std::size_t bodies_taken_ = 0;
  std::vector<std::vector<AnsweredInput>> answered_;  ///< indexed by tool
  std::future<void> serving_;
};

LiveTrialServer::LiveTrialServer(const Experiment& experiment, const std::shared_ptr<const server::LoadedScene>& scene,
                                 int realtime_priority)
    : experiment_(experiment),
      server_({.port = 0, .realtime_priority = realtime_priority, .hub = hub_settings(experiment.seed)},
              one_room(experiment, scene)) {
  BodiesSample blank;
  blank.X_WB.resize(scene->world.bodies.size());
  bodies_.resize(static_cast<std::size_t>(experiment.duration / experiment.sample_period) + 1, blank);
  const auto steps = static_cast<std::size_t>(experiment.duration / server_.rooms().front()->period()) + 2;
  answered_.resize(scene->world.tools.size());
  for (std::vector<AnsweredInput>& answered : answered_) answered.reserve(steps);
  server_.on_step = [this](const server::Room& room, LocalTime) { record(room); };
  serving_ = std::async(std::launch::async, [this] { server_.run(); });
}

void LiveTrialServer::record(const server::Room& room) noexcept {
  const Duration::rep start = start_ns_.load(std::memory_order_acquire);
  if (start == kNotYet) return;
  const Duration since = SteadyClock().now().time_since_epoch() - Duration(start);
  if (since < Duration(0) || since > experiment_.duration) return;
  const physics::World& world = room.world();
  for (std::size_t tool = 0; tool < answered_.size(); ++tool) {
    if (answered_[tool].size() < answered_[tool].capacity()) note_answer(room, tool, since, answered_[tool]);
  }
  if (since < next_bodies_ || bodies_taken_ == bodies_.size()) return;
  BodiesSample& sample = bodies_[bodies_taken_++];
  sample.time = since;
  for (std::size_t i = 0; i < sample.X_WB.size(); ++i) sample.X_WB[i] = world.body(body_id_at(i)).X;
  sample.field_energy_kj_per_mol = world.field_energy_kj_per_mol();
  while (next_bodies_ <= since) next_bodies_ += experiment_.sample_period;
}

void LiveTrialServer::stop() {
  if (!serving_.valid()) return;
  server_.abandon();
  serving_.get();
}

void LiveTrialServer::collect(SessionTrace& trace, LiveTiming& timing) {
  bodies_.resize(bodies_taken_);
  trace.bodies = std::move(bodies_);
  std::size_t tool = 0;
  for (UserTrace& user : trace.users) {
    if (server::has_tool(user.user.role)) user.answered = std::move(answered_[tool++]);
  }
  trace.room_steps = server_.rooms().front()->steps_done().value;
  trace.hub = server_.counters();
  timing.room = server_.room_timings().front();
}

/// A user with all client objects: device, client and haptic loop.
class LiveUser {
 public:
  LiveUser(const ExperimentUser& description, client::ClientIoSettings io, std::uint64_t hand_seed,
           int realtime_priority, const std::atomic<Duration::rep>& hands_start_ns);

  const ExperimentUser& user() const { return user_; }
  void watch(BodyId body) { io_.haptics().watch(body); }
  void connect() { io_.start(); }
  /// Starts the haptic thread at the user's phase within the millisecond. Returns the real-time permissions that were
  /// not granted.
  std::vector<std::string> start_loop();
  /// Moves the content of the ring buffer to ticks().
  void collect_ticks();
  void stop();

  client::ClientIoSnapshot io() const { return io_.snapshot(); }
  /// Returns the newest collected tick, or null if there is none.
  const client::TickRecord* newest() const { return ticks_.empty() ? nullptr : &ticks_.back().record; }
  const std::vector<LiveTick>& ticks() const { return ticks_; }
  /// Returns whether the haptic core has received the server's state and, if the stage needs one, has a local model.
  bool is_ready() const;
  /// Moves the content of the ring buffer to ticks() and discards all ticks except the newest.
  void collect_newest_tick();
  void forget_ticks_before(LocalTime time);

  // These functions may be called only after stop().
  const client::HapticCounters& counters() const { return io_.haptics().counters(); }
  const client::HapticCounters& counters_at_start() const { return at_start_; }
  double passivity_dissipated() const {
    return passivity_dissipated_j(io_.haptics(), user_.pipeline) - passivity_dissipated_at_start_j_;
  }
  const client::HapticLoopReport& loop_report() const { return loop_->report(); }
  std::uint64_t lost() const { return lost_.load(std::memory_order_relaxed); }

 private:
  void after_tick() noexcept;

  const ExperimentUser& user_;
  int realtime_priority_;
  const std::atomic<Duration::rep>& hands_start_ns_;
  devices::SimDevice device_;
  client::ClientIo io_;
  realtime::Ring<LiveTick> ring_{kRingTicks};
  std::atomic<std::uint64_t> lost_{0};
  std::vector<LiveTick> ticks_;  // used only by the caller's thread (main thread)
  bool is_hand_moving_ = false;  // this and the next two members are used only by the haptic thread until stop()
  client::HapticCounters at_start_;
  double passivity_dissipated_at_start_j_ = 0;
  std::optional<client::HapticLoop> loop_;  // declared last, so that it is destroyed before the objects that it uses
};

LiveUser::LiveUser(const ExperimentUser& description, client::ClientIoSettings io, std::uint64_t hand_seed,
                   int realtime_priority, const std::atomic<Duration::rep>& hands_start_ns)
    : user_(description),
      realtime_priority_(realtime_priority),
      hands_start_ns_(hands_start_ns),
      device_(description.device.spec, devices::holding(description.hand_parameters, description.device),
              description.hand, hand_seed),
      io_(std::move(io), device_) {
  device_.begin_path_at(LocalTime::max());
}

std::vector<std::string> LiveUser::start_loop() {
  client::HapticLoopSettings settings;
  settings.realtime_priority = realtime_priority_;
  // The trace of HapticLoop is not used, so it gets the minimum size. It would lack the true state of the hand, which
  // the records in ring_ contain.
  settings.trace_capacity = 1;
  loop_.emplace(settings, io_.haptics(), [this] { after_tick(); });
  std::this_thread::sleep_until(std::chrono::steady_clock::time_point(
      (next_whole_millisecond(SteadyClock().now()) + user_.tick_phase).time_since_epoch()));
  return loop_->start();
}

// Runs on the haptic thread.
void LiveUser::after_tick() noexcept {
  io_.notify();
  const LiveTick tick{io_.haptics().record(), device_.hand_pose(), device_.hand_twist(), Duration(0)};
  if (!ring_.push(tick)) lost_.fetch_add(1, std::memory_order_relaxed);
  const Duration::rep start = hands_start_ns_.load(std::memory_order_acquire);
  if (is_hand_moving_ || start == kNotYet || tick.record.at.time_since_epoch().count() < start) return;
  is_hand_moving_ = true;
  device_.begin_path_at(LocalTime(Duration(start)));
  at_start_ = io_.haptics().counters();
  passivity_dissipated_at_start_j_ = passivity_dissipated_j(io_.haptics(), user_.pipeline);
}

void LiveUser::collect_ticks() {
  const Duration round_trip = io_.snapshot().clock.round_trip;
  LiveTick tick;
  while (ring_.pop(tick)) {
    tick.round_trip = round_trip;
    ticks_.push_back(tick);
  }
}

bool LiveUser::is_ready() const {
  if (!server::has_tool(user_.role)) return true;
  if (newest() == nullptr || newest()->newest_step.value == 0) return false;
  const std::string& stage = user_.pipeline.stage;
  return newest()->is_local || !(client::needs_local_model(stage) || client::needs_proxy_world(stage));
}

void LiveUser::collect_newest_tick() {
  collect_ticks();
  if (ticks_.size() > 1) ticks_.erase(ticks_.begin(), ticks_.end() - 1);
}

void LiveUser::forget_ticks_before(LocalTime time) {
  const auto first = std::find_if(ticks_.begin(), ticks_.end(), [&](const LiveTick& t) { return t.record.at >= time; });
  ticks_.erase(ticks_.begin(), first);
}

void LiveUser::stop() {
  if (loop_) loop_->stop();
  io_.stop();
}

/// Returns the datagrams and bytes that one client sent and received. Datagrams lost on the way to the client are
/// counted, but their bytes are not.
TrafficCounters traffic_of(const client::ClientIoSnapshot& io) {
  TrafficCounters traffic;
  const bool has_link = io.links.up.sent > 0;
  traffic.datagrams =
      has_link ? io.links.up.sent + io.links.down.sent : io.counters.datagrams_sent + io.counters.datagrams_received;
  traffic.bytes = io.counters.bytes_sent + io.counters.bytes_received;
  return traffic;
}

struct LiveSession {
  LiveSession(const Experiment& its_experiment, std::shared_ptr<const server::LoadedScene> its_scene,
              const SessionTrace& its_beside, int its_priority, LiveTiming& its_timing, const OnTick& listener);

  void join_all();
  template <class IsDone>
  void wait_for(const LiveUser& user, const char* missing, const IsDone& is_done);
  void start_hands();
  void keep_going();
  void follow(std::size_t index);
  SessionTrace collect_trace();
  void collect_user(std::size_t index);

  const Experiment& experiment;
  std::shared_ptr<const server::LoadedScene> scene;
  const SessionTrace& beside;
  int priority;
  SteadyClock clock;
  std::atomic<Duration::rep> hands_start_ns{kNotYet};
  LocalTime begun{};
  LocalTime hands_started{};
  LiveTrialServer server;
  std::vector<std::unique_ptr<LiveUser>> users;
  std::vector<TrafficCounters> traffic_at_start;
  std::vector<std::size_t> reported;  // number of ticks of each user that were already passed to on_tick
  SessionTrace trace;
  LiveTiming& timing;
  const OnTick& on_tick;
};

LiveSession::LiveSession(const Experiment& its_experiment, std::shared_ptr<const server::LoadedScene> its_scene,
                         const SessionTrace& its_beside, int its_priority, LiveTiming& its_timing,
                         const OnTick& listener)
    : experiment(its_experiment),
      scene(std::move(its_scene)),
      beside(its_beside),
      priority(its_priority),
      server(experiment, scene, its_priority),
      timing(its_timing),
      on_tick(listener) {
  trace.watched_body = beside.watched_body;
  trace.body_names = beside.body_names;
  trace.body_can_move = beside.body_can_move;
  trace.field_kernel = beside.field_kernel;
  timing.users.resize(experiment.users.size());
  reported.resize(experiment.users.size());
  for (std::size_t i = 0; i < experiment.users.size(); ++i) {
    const ExperimentUser& user = experiment.users[i];
    if (user.pipeline.model != client::ModelErrors{}) {
      throw std::invalid_argument("experiment " + experiment.name +
                                  ": model has errors (mass_scale, friction_scale, shape_shift_m); tandem-client has "
                                  "no such setting: leave it out");
    }
    const UserTrace& virtual_user = beside.users[i];
    users.push_back(std::make_unique<LiveUser>(
        user, io_settings(experiment, user, *scene, server.port(), experiment.seed + i, priority),
        virtual_user.hand_seed, priority, hands_start_ns));
    if (trace.watched_body) users.back()->watch(body_id_at(*trace.watched_body));
    UserTrace& user_trace = trace.users.emplace_back();
    user_trace.user = user;
    user_trace.hand_seed = virtual_user.hand_seed;
    user_trace.hand_joules_per_world_joule = virtual_user.hand_joules_per_world_joule;
  }
}

/// Waits until `is_done` returns true. After kLiveJoinTimeout it throws an error that names the missing item. Ticks
/// that arrive meanwhile are discarded.
template <class IsDone>
void LiveSession::wait_for(const LiveUser& user, const char* missing, const IsDone& is_done) {
  const LocalTime give_up = clock.now() + kLiveJoinTimeout;
  while (!is_done()) {
    const client::SessionStatus status = user.io().status;
    if (status.state == client::SessionState::kEnded || clock.now() >= give_up) {
      throw CouldNotJoin("user " + user.user().name +
                         " could not join: " + (status.why.empty() ? missing : status.why));
    }
    std::this_thread::sleep_for(kMainPeriod);
    for (const auto& each : users) each->collect_newest_tick();
  }
}

// Users join in order, so that the n-th manipulator gets the n-th tool.
void LiveSession::join_all() {
  begun = clock.now();
  for (const auto& user : users) {
    user->connect();
    wait_for(*user, "no answer within 30 s", [&] {
      const client::ClientIoSnapshot io = user->io();
      return io.status.state == client::SessionState::kActive && io.joined != nullptr;
    });
    timing.realtime_not_granted = user->start_loop();
  }
  for (const auto& user : users) {
    wait_for(*user, "no state or no local model within 30 s", [&] { return user->is_ready(); });
  }
}

void LiveSession::start_hands() {
  for (const auto& user : users) traffic_at_start.push_back(traffic_of(user->io()));
  hands_started = next_whole_millisecond(clock.now() + kStartIn);
  server.record_from(hands_started);
  hands_start_ns.store(hands_started.time_since_epoch().count(), std::memory_order_release);
  trace.joined_after = hands_started - begun;
  while (clock.now() < hands_started) std::this_thread::sleep_for(kHapticPeriod);
}

void LiveSession::follow(std::size_t index) {
  LiveUser& user = *users[index];
  user.collect_ticks();
  // Removes ticks from before the start of the hands.
  if (reported[index] == 0) user.forget_ticks_before(hands_started);
  for (; reported[index] < user.ticks().size(); ++reported[index]) {
    const client::TickRecord& record = user.ticks()[reported[index]].record;
    if (record.at >= hands_started + experiment.duration) break;
    if (on_tick) on_tick(index, record, user.user().hand.phase_at(record.at - hands_started));
  }
  UserTrace& user_trace = trace.users[index];
  const client::SessionStatus status = user.io().status;
  if (!user_trace.stayed_connected || status.state == client::SessionState::kActive) return;
  user_trace.stayed_connected = false;
  user_trace.why_disconnected = status.why;
}

// Runs slightly longer than the trial, so that the last tick is recorded.
void LiveSession::keep_going() {
  const LocalTime end = hands_started + experiment.duration + kMainPeriod;
  while (clock.now() < end) {
    std::this_thread::sleep_for(kMainPeriod);
    for (std::size_t i = 0; i < users.size(); ++i) follow(i);
  }
}

void LiveSession::collect_user(std::size_t index) {
  LiveUser& live = *users[index];
  UserTrace& user = trace.users[index];
  const client::ClientIoSnapshot io = live.io();
  live.stop();
  std::uint64_t skipped = 0;
  user.ticks = live_rows(live.user(), live.ticks(), hands_started, experiment.duration, skipped);
  for (const TickSample& tick : user.ticks) trace.faults_seen |= tick.server_tick_faults;
  user.energy_to_hand_j = live.counters().energy_to_hand_j - live.counters_at_start().energy_to_hand_j;
  user.energy_from_hand_j = live.counters().energy_from_hand_j - live.counters_at_start().energy_from_hand_j;
  user.passivity_dissipated_j = live.passivity_dissipated();
  user.session = io.counters;
  user.link_up = io.links.up;
  user.link_down = io.links.down;
  user.traffic = traffic_of(io);
  user.traffic.datagrams -= traffic_at_start[index].datagrams;
  user.traffic.bytes -= traffic_at_start[index].bytes;
  timing.users[index] = {reported[index], skipped, live.lost(), live.loop_report()};
}

SessionTrace LiveSession::collect_trace() {
  for (std::size_t i = 0; i < users.size(); ++i) collect_user(i);
  server.stop();
  server.collect(trace, timing);
  return std::move(trace);
}

}  // namespace

SessionTrace run_live_session(const Experiment& experiment, const std::shared_ptr<const server::LoadedScene>& scene,
                              const SessionTrace& beside, int realtime_priority, LiveTiming& timing,
                              const OnTick& on_tick) {
  LiveSession session(experiment, scene, beside, realtime_priority, timing, on_tick);
  session.join_all();
  session.start_hands();
  session.keep_going();
  return session.collect_trace();
}

}  // namespace tandem::lab
