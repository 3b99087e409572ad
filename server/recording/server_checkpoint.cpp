#include "server/recording/server_checkpoint.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <span>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "common/base/folders.hpp"

namespace tandem::server {
namespace {

constexpr const char* kFileName = "checkpoint.pb";
/// Period of writes, and maximum back-off after failed writes.
constexpr Duration kCheckpointEvery = std::chrono::milliseconds(500), kMaxBackOff = std::chrono::seconds(8);
/// Period in which a room publishes its state.
constexpr double kCheckpointEvery_s = 0.1;
/// Period in which the checkpoint thread checks for changes.
constexpr Duration kCheckpointPeriod = std::chrono::milliseconds(20);
/// Maximum size of the file: sufficient for 64 rooms with eight soft bodies each, and a full AdmissionState.
constexpr std::uintmax_t kMaxFileBytes = 64U << 20U;

}  // namespace

/// Copies the state of a room on the room thread, and publishes it for the checkpoint thread.
class ServerCheckpoint::Watch final : public RoomWatcher {
 public:
  explicit Watch(const Room& room)
      : name(room.name()),
        scene(room.shared_scene()),
        states(with_all_nodes(*scene)),
        every_(static_cast<std::uint64_t>(std::max(1.0, std::round(kCheckpointEvery_s / to_seconds(room.period()))))) {}

  void on_command(const RoomCommand& /*command*/) noexcept override {}
  void on_input(std::size_t /*seat*/, const proto::ClientUpdate& /*input*/) noexcept override {}
  void on_step(const Room& room, ServerTime /*now*/, TickFaults /*faults*/) noexcept override {
    // A room that becomes idle makes no further steps, so its last state is published regardless of the period.
    if (room.steps_done().value % every_ != 0 && !room.is_idle()) return;
    room.describe(states.back());
    states.publish();
  }

  // Copies of the room's data, because the room may be destroyed before this object.
  const std::string name;
  const std::shared_ptr<const LoadedScene> scene;
  realtime::Mailbox<RoomState> states;

 private:
  /// Returns a state with space for all nodes of the soft bodies, so that the room thread can fill it in without
  /// allocation.
  static RoomState with_all_nodes(const LoadedScene& scene) {
    RoomState state;
    for (const SoftModel& body : scene.soft_bodies) {
      state.soft_nodes_W.insert(state.soft_nodes_W.end(), body.nodes_W.begin(), body.nodes_W.end());
    }
    return state;
  }

  std::uint64_t every_;
};

ServerCheckpoint::ServerCheckpoint(const std::filesystem::path& folder, const std::vector<std::unique_ptr<Room>>& rooms,
                                   std::string audience, std::function<std::uint64_t()> unix_ms,
                                   std::function<void(const std::string&)> on_news)
    : file_(folder / kFileName),
      audience_(std::move(audience)),
      unix_ms_(std::move(unix_ms)),
      on_news_(std::move(on_news)),
      restored_(rooms.size()) {
  for (const auto& room : rooms) rooms_.push_back(room.get());
  remove_unfinished(file_);
  read();
  for (Room* const room : rooms_) {
    watches_.push_back(std::make_unique<Watch>(*room));
    room->watch(*watches_.back());
    *newest_.add_rooms() = checkpoint_of(*room);
  }
  newest_.set_audience(audience_);
  *newest_.mutable_admission() = admission_;
}

void ServerCheckpoint::start() {
  thread_ = std::make_unique<recording::RecorderThread>(kCheckpointPeriod, [this] { work(SteadyClock().now()); });
}

ServerCheckpoint::~ServerCheckpoint() {
  try {
    finish();
  } catch (const std::exception& error) {
    on_news_(file_.string() + " cannot be written: " + error.what() + "; a restart would go on from an older one");
  }
}

void ServerCheckpoint::read() {
  std::error_code error;
  if (!std::filesystem::exists(file_, error)) return;
  wire::ServerCheckpoint before;
  std::ifstream in(file_, std::ios::binary);
  const bool is_read =
      std::filesystem::file_size(file_, error) <= kMaxFileBytes && !error && before.ParseFromIstream(&in);
  if (!is_read) return on_news_(file_.string() + " cannot be read: everything begins anew");
  resume(before);
}

void ServerCheckpoint::resume(const wire::ServerCheckpoint& before) {
  const std::uint64_t now_ms = unix_ms_();
  const double age_s = 1e-3 * static_cast<double>(now_ms - std::min(now_ms, before.written_ms()));
  if (before.audience() == audience_) admission_ = before.admission();
  for (wire::ResumeCredential& credential : *admission_.mutable_credentials()) {
    if (credential.lost_ms() == 0) credential.set_lost_ms(before.written_ms());
  }
  for (std::size_t i = 0; i < rooms_.size(); ++i) {
    const double reset_after_s = rooms_[i]->scene().world.limits.reset_after_s;
    const double limit_s = std::max(reset_after_s, to_seconds(kResumeWithin));
    const auto found = std::ranges::find(before.rooms(), rooms_[i]->name(), &wire::RoomCheckpoint::room);
    if (found == before.rooms().end()) continue;
    if (reset_after_s > 0 && age_s > limit_s) {
      on_news_("room " + rooms_[i]->name() + " starts from its scene: its state is " +
               std::to_string(std::llround(age_s)) + " s old, and a state is kept for " +
               std::to_string(std::llround(limit_s)) + " s");
      continue;
    }
    const auto state = state_of(*found, rooms_[i]->scene());
    if (!state || (state->bodies.empty() && state->tools.empty() && state->soft_nodes_W.empty())) continue;
    rooms_[i]->resume(*state);
    restored_[i] = *found;
    on_news_("room " + rooms_[i]->name() + " continues from its state of " +
             std::to_string(static_cast<int>(1e3 * age_s)) + " ms ago");
  }
}

void ServerCheckpoint::note(const wire::AdmissionState& admission) {
  admissions_.back() = admission.SerializeAsString();
  admissions_.publish();
}

void ServerCheckpoint::work(LocalTime now) {
  const bool has_news = admissions_.poll();
  if (has_news) newest_.mutable_admission()->ParseFromString(admissions_.front());
  if (next_ && now < *next_ && !(has_news && back_off_ == Duration{0})) return;
  bool is_due = has_news || back_off_ > Duration{0};
  for (std::size_t i = 0; i < watches_.size(); ++i) {
    if (!watches_[i]->states.poll()) continue;
    is_due = true;
    *newest_.mutable_rooms(static_cast<int>(i)) =
        checkpoint_of(watches_[i]->name, *watches_[i]->scene, watches_[i]->states.front());
  }
  next_ = now + kCheckpointEvery;
  if (is_due) write(now);
}

void ServerCheckpoint::write(LocalTime now) {
  newest_.set_written_ms(unix_ms_());
  const std::string bytes = newest_.SerializeAsString();
  const std::error_code error = replace_file(file_, {std::as_bytes(std::span(bytes))}, 0600);
  (error ? failures_ : writes_).fetch_add(1, std::memory_order_relaxed);
  const bool was_failing = back_off_ > Duration{0};
  back_off_ = error ? std::clamp(2 * back_off_, kCheckpointEvery, kMaxBackOff) : Duration{0};
  if (error) next_ = now + back_off_;
  if (error && !was_failing) {
    on_news_(file_.string() + " cannot be written: " + error.message() +
             "; a restart would go on from an older one. Free space, or make the folder writable: it is tried again");
  }
  if (!error && was_failing) on_news_(file_.string() + " is written again");
}

void ServerCheckpoint::finish() {
  if (is_finished_) return;
  is_finished_ = true;
  thread_.reset();
  if (admissions_.poll()) newest_.mutable_admission()->ParseFromString(admissions_.front());
  for (std::size_t i = 0; i < rooms_.size(); ++i) {
    *newest_.mutable_rooms(static_cast<int>(i)) = checkpoint_of(*rooms_[i]);
  }
  write(SteadyClock().now());
}

}  // namespace tandem::server
