// Fuzz test of the client's stages. It passes the states of a real session to a client of each stage, with falsified
// times, steps, sequence numbers, counts, ids and numbers (timeline.hpp). The states take the same path through the
// client as received states. In addition to the checks of FuzzedClient, the force must be zero if no accepted state is
// younger than the silence limit.
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include "client/haptics/stages/stage.hpp"
#include "proto/state_codec.hpp"
#include "proto/world_from_wire.hpp"
#include "tests/fuzz/fuzzed_client.hpp"
#include "tests/fuzz/server_script.hpp"
#include "tests/fuzz/timeline.hpp"

namespace {

using namespace tandem;
using fuzz::check;
using fuzz::TimelineAct;

/// Limits of client/SAFETY.md: the maximum age of a state, and the maximum number of ticks from then until the force is
/// zero.
constexpr Duration kSilence = std::chrono::milliseconds(150);
constexpr int kTicksToZero = 25;

/// A recorded session of a hub with a client of one stage. `messages` are all messages up to the first state, `states`
/// the states that follow.
struct Recording {
  std::vector<proto::Bytes> messages;
  std::vector<proto::ServerUpdate> states;
  wire::Welcome welcome;
  /// shapes of the scene; all clients share them, so that they are built only once
  std::vector<std::shared_ptr<const contact::ContactShape>> shapes;
};

void keep_shapes(const wire::Joined& joined, Recording& recording) {
  const auto keep = [&recording](const auto& owners) {
    for (const auto& owner : owners) {
      for (const wire::Shape& shape : owner.shapes()) recording.shapes.push_back(proto::primitive_contact(shape));
    }
  };
  keep(joined.scene().bodies());
  keep(joined.scene().tools());
}

Recording recording_in(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  const std::vector<char> bytes{std::istreambuf_iterator<char>(stream), {}};
  std::span<const std::byte> script = std::as_bytes(std::span(bytes));
  Recording recording;
  while (!script.empty()) {
    const fuzz::ScriptedAct act = fuzz::next_act(script);
    wire::ServerControl message;
    if (act.act == fuzz::ServerAct::kMessage && recording.states.empty()) {
      recording.messages.emplace_back(act.bytes.begin(), act.bytes.end());
      if (!proto::parse_control(act.bytes, message)) continue;
      if (message.has_welcome()) recording.welcome = message.welcome();
      if (message.has_joined()) keep_shapes(message.joined(), recording);
    }
    const bool is_datagram = act.act == fuzz::ServerAct::kDatagram;
    if (!is_datagram && act.act != fuzz::ServerAct::kState) continue;
    proto::ServerUpdate state;
    const auto payload = is_datagram ? proto::payload_of(act.bytes) : act.bytes;
    if (proto::parse_server_update(payload, state) == proto::DropReason::kNone) recording.states.push_back(state);
  }
  if (recording.states.empty()) {
    std::cerr << file << " has no state; run session_corpus first\n";
    std::abort();
  }
  return recording;
}

const Recording& recording_of(const std::string& stage) {
  static std::map<std::string, Recording> known;
  const auto found = known.find(stage);
  if (found != known.end()) return found->second;
  const std::filesystem::path folder = TANDEM_FUZZ_SESSIONS;
  return known.emplace(stage, recording_in(folder / (stage + ".seed"))).first->second;
}

client::StageSettings stage_of(std::uint8_t stage, std::uint8_t predictor) {
  const auto stages = client::stage_names(), predictors = client::predictor_names();
  return {.name = std::string(stages[stage % stages.size()]),
          .predictor = std::string(predictors[predictor % predictors.size()])};
}

class Session {
 public:
  Session(fuzz::TimelineReader& in, std::uint8_t stage)
      : in_(in), settings_(stage_of(stage, stage / 16)), recording_(recording_of(settings_.name)), it_(settings_) {
    it_.connect();
    for (const proto::Bytes& message : recording_.messages) it_.deliver(message);
    it_.tick();
  }

  bool goes_on() const { return !in_.is_done() && it_.goes_on(); }

  void act() {
    switch (static_cast<TimelineAct>(in_.byte())) {
      case TimelineAct::kSilence:
        return wait(in_.byte());
      case TimelineAct::kSpoilt:
        send(spoilt(next()));
        return tick();
      case TimelineAct::kCrowd:
        send(crowded(next()));
        return tick();
      case TimelineAct::kSequence:
        sequence_ += in_.whole();
        return;
      case TimelineAct::kStall:
        return it_.stall(std::chrono::milliseconds(10) * in_.byte());
      case TimelineAct::kOffset:
        offset_ = Duration(in_.number());
        return;
      case TimelineAct::kStage: {
        const std::uint8_t stage = in_.byte();
        return it_.client().set_stage(stage_of(stage, in_.byte()));
      }
      default:
        for (int left = in_.byte(); left > 0 && it_.goes_on(); --left) {
          send(next());
          tick();
        }
    }
  }

 private:
  ServerTime server_time() const {
    // Limits the offset so that the sum is within the range of time stamps in the protocol.
    constexpr Duration kMost = proto::kMaxTimestamp;
    const Duration now = it_.now().time_since_epoch();
    return ServerTime(std::clamp(offset_, -now, kMost - now) + now);
  }

  /// Returns the next recorded state, with times and counts that fit the current time.
  proto::ServerUpdate next() {
    constexpr Duration kWay = std::chrono::milliseconds(10);
    proto::ServerUpdate update = recording_.states[played_++ % recording_.states.size()];
    update.step = Step{++step_};
    update.sent = update.stepped = server_time();
    update.echoed_sent = it_.now() - 2 * kWay;
    update.received = std::max(ServerTime{}, update.sent - kWay);
    const std::uint64_t tick = it_.client().haptics().record().tick.value;
    update.answered_input = Tick{tick > 20 ? tick - 20 : 0};
    return update;
  }

  Vec3 vector(double most) { return most * Vec3(in_.share(), in_.share(), in_.share()); }
  Quat rotation() { return quaternion_of(vector(3)); }
  /// Returns a random state. In about a tenth of the states, a vector exceeds the limits of the protocol.
  RigidState anywhere() {
    constexpr double kBeyond = 0.65;  // fraction of the limit per component; long vectors (√3 · 0.65) exceed it
    return {{vector(kBeyond * proto::kMaxPositionM), rotation()},
            {vector(kBeyond * proto::kMaxSpeedMPerS), vector(kBeyond * proto::kMaxTurnRadPerS)}};
  }
  Wrench any_wrench(double force, double torque) { return {vector(force), vector(torque)}; }

  static void move(ServerTime& time, Duration by) {
    const Duration since = time.time_since_epoch();
    time = ServerTime(std::clamp(by, -since, proto::kMaxTimestamp - since) + since);
  }

  proto::ServerUpdate spoilt(proto::ServerUpdate update) {
    const unsigned times = in_.byte(), numbers = in_.byte();
    const auto is_set = [](unsigned mask, unsigned bit) { return (mask >> bit & 1U) != 0; };
    if (is_set(times, 0)) move(update.stepped, Duration(in_.number()));
    if (is_set(times, 1)) move(update.sent, Duration(in_.number()));
    if (is_set(times, 2)) move(update.received, Duration(in_.number()));
    if (is_set(times, 3)) update.echoed_sent = LocalTime(std::min(Duration(in_.whole()), proto::kMaxTimestamp));
    if (is_set(times, 4)) step_ = update.step.value += in_.whole();
    if (is_set(times, 5)) update.answered_input = Tick{in_.whole()};
    if (is_set(times, 6)) update.playout = std::min(Duration(in_.whole()), proto::kMaxTimestamp);
    if (is_set(times, 7)) {
      const Duration by(in_.number());
      for (ServerTime* time : {&update.stepped, &update.received, &update.sent}) move(*time, by);
    }
    if (is_set(numbers, 0)) update.wrench_on_hand_W = any_wrench(proto::kMaxForceN, proto::kMaxTorqueNM);
    if (is_set(numbers, 1)) update.tool = anywhere();
    if (is_set(numbers, 2)) update.held_body = BodyId{static_cast<std::uint32_t>(in_.whole())};
    if (is_set(numbers, 3)) {
      update.energy_into_world_j = std::min(static_cast<double>(in_.whole()), proto::kMaxEnergyJ);
      update.energy_from_world_j = std::min(static_cast<double>(in_.whole()), proto::kMaxEnergyJ);
    }
    if (is_set(numbers, 4)) update.wave = any_wrench(proto::kMaxWaveSum, proto::kMaxWaveSum);
    if (is_set(numbers, 5)) spoil(update.soft_contact);
    if (is_set(numbers, 6)) {
      for (proto::BodyState& body : update.bodies) body.state = anywhere();
    }
    if (is_set(numbers, 7)) update.tick_faults = in_.byte() | static_cast<std::uint32_t>(in_.byte()) << 8U;
    return update;
  }

  void spoil(SoftContact& contact) {
    contact.wrench_W = any_wrench(proto::kMaxForceN, proto::kMaxTorqueNM);
    const double stiffness = std::abs(in_.share()) * proto::kMaxContactStiffness;
    contact.stiffness = stiffness * Mat6::Identity();
    contact.X_WT0 = anywhere().X;
    contact.trust_radius_m = std::abs(in_.share()) * proto::kMaxPositionM;
    contact.lever_m = std::abs(in_.share()) * proto::kMaxPositionM;
  }

  /// Replaces all bodies and users by up to the maximum number, with consecutive ids. The first id is arbitrary, so the
  /// client may know some of the ids, all or none.
  proto::ServerUpdate crowded(proto::ServerUpdate update) {
    const std::size_t bodies = in_.byte() % (proto::kMaxBodies + 1), users = in_.byte() % (proto::kMaxUsers + 1);
    const auto first = static_cast<std::uint32_t>(in_.whole());
    update.bodies.clear();
    update.users.clear();
    for (std::uint32_t i = 0; i < bodies; ++i) {
      update.bodies.push_back({BodyId{first + i}, anywhere(), UserId{first + i % 3}});
    }
    for (std::uint32_t i = 0; i < users; ++i) {
      proto::OtherUserState user;
      user.id = UserId{first + i};
      user.tool = anywhere();
      user.holds = BodyId{in_.byte() % 4U};
      user.tool_index = in_.byte() % 2 == 0 ? i % 3 : static_cast<std::uint32_t>(in_.whole());
      user.has_handle = in_.byte() % 4 != 0;
      user.handle = anywhere();
      user.handle_age = std::min(Duration(in_.whole()), proto::kMaxDelay);
      user.on_hand_W = any_wrench(proto::kMaxForceN, proto::kMaxTorqueNM);
      update.users.push_back(user);
    }
    return update;
  }

  void send(proto::ServerUpdate update) {
    proto::Bytes datagram;
    const auto epoch = static_cast<std::uint8_t>(recording_.welcome.epoch());
    const ConnectionId connection{recording_.welcome.connection_id()};
    proto::append_header({proto::DatagramType::kServerUpdate, epoch, connection, ++sequence_}, datagram);
    proto::ServerUpdateEncoder().append(update, datagram);
    const std::uint64_t before = accepted();
    it_.session().on_datagram(datagram, it_.now());
    if (accepted() == before) return;
    came_ = it_.now();
    kept_back_ = update.sent - update.stepped;
  }

  /// Returns the number of state datagrams that have passed all checks.
  std::uint64_t accepted() {
    const proto::ChannelCounters& counters = it_.session().counters();
    std::uint64_t count = counters.datagrams_received;
    for (std::size_t i = 0; i < static_cast<std::size_t>(proto::DropReason::kCount); ++i) {
      const auto reason = static_cast<proto::DropReason>(i);
      if (reason != proto::DropReason::kOverwritten) count -= counters.received_drops.count(reason);
    }
    return count;
  }

  void wait(int milliseconds) {
    for (; milliseconds > 0 && it_.goes_on(); --milliseconds) tick();
  }

  void tick() {
    it_.tick();
    const bool is_silent = it_.now() - came_ + kept_back_ >= kSilence;
    silent_ticks_ = is_silent ? silent_ticks_ + 1 : 0;
    if (silent_ticks_ > kTicksToZero) check(it_.shown().f.isZero(0) && it_.shown().t.isZero(0));
  }

  fuzz::TimelineReader& in_;
  client::StageSettings settings_;
  const Recording& recording_;
  fuzz::FuzzedClient it_;
  Duration offset_ = std::chrono::hours(1);
  std::uint64_t sequence_ = 0;
  std::uint64_t step_ = 0;
  std::size_t played_ = 0;
  LocalTime came_{};
  Duration kept_back_{0};
  int silent_ticks_ = 0;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::TimelineReader in(std::span(data, size));
  const std::uint8_t stage = in.byte();
  Session session(in, stage);
  while (session.goes_on()) session.act();
  return 0;
}
