#include "server/docking/pose_keeper.hpp"

#include <algorithm>
#include <atomic>
#include <deque>
#include <optional>
#include <utility>

#include "common/realtime/ring.hpp"
#include "common/recording/recorder_thread.hpp"
#include "server/docking/fair_turns.hpp"

namespace tandem::server {
namespace {

constexpr Duration kServeEvery = std::chrono::milliseconds(20);
constexpr std::size_t kMaxAnswers = 64;
constexpr const char* kStopping = "the server is stopping; try again when it has restarted";
constexpr const char* kLeft = "the requesting user has left";

using Kind = wire::AskPose;

/// Returns whether a request changes the list of poses. Such a request is executed even if its user has left.
bool changes_list(Kind::Kind kind) {
  return kind == Kind::KEEP || kind == Kind::DELETE || kind == Kind::RENAME;
}

std::string unanswered_problem(const std::vector<PoseRequest>& unanswered, UserId user) {
  const auto own = static_cast<std::size_t>(std::ranges::count(unanswered, user, &PoseRequest::user));
  if (own >= kMaxPoseRequestsOfUser)
    return std::to_string(own) +
           " of your requests wait for their answers, which is the limit; try again after one of them";
  if (unanswered.size() >= kMaxPoseRequestsOfRoom)
    return std::to_string(unanswered.size()) +
           " requests of this room wait for their answers, which is the limit; try again";
  return {};
}

}  // namespace

struct PoseKeeper::Impl {
  std::vector<std::unique_ptr<PoseSite>> sites;
  std::function<std::uint64_t()> unix_ms;
  std::atomic<bool> is_stopping{false}, has_finished{false};
  realtime::Ring<PoseAnswer> answers{kMaxAnswers};
  // Members for the pose thread only.
  FairTurns turns{0};
  std::deque<PoseAnswer> unsent;
  // Members for the io thread only.
  std::uint64_t last_id = 0;
  // The thread is the last member, so that it is joined before the members that it uses are destroyed.
  std::unique_ptr<recording::RecorderThread> thread;

  PoseSite* find(const Room& room) const {
    const auto found = std::ranges::find_if(sites, [&room](const auto& site) { return site->room == &room; });
    return found == sites.end() ? nullptr : found->get();
  }

  /// Moves the answers to the ring. Returns false if the ring is full and answers remain.
  bool send_answers() {
    while (!unsent.empty() && answers.push(unsent.front())) unsent.pop_front();
    return unsent.empty();
  }
};

PoseKeeper::PoseKeeper(std::filesystem::path folder, const std::vector<std::unique_ptr<Room>>& rooms,
                       std::function<std::uint64_t()> unix_ms)
    : impl_(std::make_unique<Impl>()) {
  impl_->unix_ms = std::move(unix_ms);
  for (const auto& room : rooms) {
    std::vector<std::size_t> molecules;
    const auto& bodies = room->scene().world.bodies;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      if (bodies[i].molecule != nullptr) molecules.push_back(i);
    }
    if (molecules.size() != 2) continue;
    if (bodies[molecules[0]].molecule->size() * bodies[molecules[1]].molecule->size() > kMaxPairsToKeep) continue;
    impl_->sites.push_back(std::make_unique<PoseSite>(*room, folder, molecules[0], molecules[1]));
    room->watch(*impl_->sites.back());
  }
  impl_->turns = FairTurns(impl_->sites.size());
}

PoseKeeper::~PoseKeeper() {
  finish();
}

void PoseKeeper::start() {
  if (!impl_->sites.empty())
    impl_->thread = std::make_unique<recording::RecorderThread>(kServeEvery, [this] { work(); });
}

void PoseKeeper::finish() {
  impl_->has_finished = true;
  impl_->thread.reset();
}

void PoseKeeper::work() {
  while (work_slice()) {
  }
}

bool PoseKeeper::work_slice() {
  Impl& impl = *impl_;
  if (impl.has_finished) return false;
  for (const auto& site : impl.sites) {
    site->watch();
    if (impl.is_stopping) site->refuse_all(kStopping, impl.unsent);
  }
  if (!impl.send_answers()) return false;
  const auto next = impl.turns.next([&impl](std::size_t i) { return impl.sites[i]->has_work(); });
  if (!next) return false;
  impl.turns.charge(*next, impl.sites[*next]->serve_slice(impl.unix_ms(), impl.unsent));
  impl.send_answers();
  return true;
}

bool PoseKeeper::has_molecules(const Room& room) const {
  return impl_->find(room) != nullptr;
}

const std::vector<wire::KeptPose>& PoseKeeper::kept(const Room& room) const {
  static const std::vector<wire::KeptPose> kNone;
  const PoseSite* const site = impl_->find(room);
  return site == nullptr ? kNone : site->kept;
}

std::string PoseKeeper::submit(const Room& room, UserId user, const std::string& user_name, std::uint32_t request,
                               const wire::AskPose& message) {
  PoseSite* const site = impl_->find(room);
  if (site == nullptr) return "this room has no two molecules";
  if (impl_->is_stopping) return kStopping;
  if (std::string problem = unanswered_problem(site->unanswered, user); !problem.empty()) return problem;
  const PoseRequest submitted{++impl_->last_id, user,    user_name,
                              request,          message, std::make_shared<std::atomic<const char*>>(nullptr)};
  if (!site->requests.push(submitted)) return "the room is busy; try again";
  site->unanswered.push_back(submitted);
  return {};
}

bool PoseKeeper::cancel(const Room& room, std::optional<UserId> user, const char* why) {
  PoseSite* const site = impl_->find(room);
  bool is_any = false;
  if (site == nullptr) return is_any;
  for (const PoseRequest& request : site->unanswered) {
    if (request.message.kind() != Kind::MINIMISE || (user && request.user != *user)) continue;
    if (*request.cancelled != nullptr) continue;
    *request.cancelled = why;
    is_any = true;
  }
  return is_any;
}

void PoseKeeper::forget(const Room& room, UserId user) {
  PoseSite* const site = impl_->find(room);
  if (site == nullptr) return;
  for (const PoseRequest& request : site->unanswered) {
    if (request.user == user && !changes_list(request.message.kind())) *request.cancelled = kLeft;
  }
}

void PoseKeeper::begin_stop() {
  impl_->is_stopping = true;
  for (const auto& site : impl_->sites) {
    for (const PoseRequest& request : site->unanswered) *request.cancelled = kStopping;
  }
}

std::size_t PoseKeeper::unanswered() const {
  std::size_t count = 0;
  for (const auto& site : impl_->sites) count += site->unanswered.size();
  return count;
}

void PoseKeeper::refuse_unanswered(const std::function<void(const Room&, UserId, std::uint32_t)>& on_refused) {
  begin_stop();
  for (const auto& site : impl_->sites) {
    for (const PoseRequest& request : std::exchange(site->unanswered, {}))
      on_refused(*site->room, request.user, request.number);
  }
}

void PoseKeeper::deliver(
    const std::function<bool(const Room&, UserId, const wire::ServerControl&, const RoomCommand*)>& on_answer) {
  PoseAnswer answer;
  while (impl_->answers.pop(answer)) {
    PoseSite& site = *answer.site;
    const wire::ServerControl& message = answer.message;
    const std::uint32_t number =
        message.has_kept_pose() ? message.kept_pose().number() : message.pose_deleted().number();
    const auto known = std::ranges::find(site.kept, number, &wire::KeptPose::number);
    if (message.has_pose_deleted() && known != site.kept.end()) site.kept.erase(known);
    if (message.has_kept_pose()) {
      wire::KeptPose& pose = known != site.kept.end() ? *known : site.kept.emplace_back();
      pose = message.kept_pose();
      pose.clear_is_news();
    }
    const auto request = std::ranges::find(site.unanswered, answer.id, &PoseRequest::id);
    const bool is_open = request != site.unanswered.end();
    if (answer.id != 0 && !is_open) {
      // refuse_unanswered() has answered this request already.
      if (answer.placing) site.refuse_placing();
      continue;
    }
    const char* const why = is_open ? request->cancelled->load() : nullptr;
    if (is_open) site.unanswered.erase(request);
    // If the request was cancelled while its answer was in the ring, the answer is replaced by a refusal, and no
    // molecule moves.
    const bool is_cancelled = answer.placing && why != nullptr;
    if (is_cancelled) {
      answer.message.mutable_error()->set_code(wire::ERROR_NOT_ALLOWED);
      answer.message.mutable_error()->set_text(why);
    }
    const bool has_placing = answer.placing && !is_cancelled;
    const bool is_done = on_answer(*site.room, answer.user, answer.message, has_placing ? &*answer.placing : nullptr);
    if (is_cancelled || (has_placing && !is_done)) site.refuse_placing();
  }
}

}  // namespace tandem::server
