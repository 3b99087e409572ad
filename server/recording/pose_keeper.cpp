#include "server/recording/pose_keeper.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <deque>
#include <iomanip>
#include <optional>
#include <span>
#include <sstream>
#include <utility>

#include "common/docking/atom_contacts.hpp"
#include "common/docking/exact_field.hpp"
#include "common/realtime/mailbox.hpp"
#include "common/realtime/ring.hpp"
#include "common/recording/recorder_thread.hpp"
#include "server/assets/molecular_scale.hpp"
#include "server/recording/kept_pose_files.hpp"

namespace tandem::server {
namespace {

constexpr Duration kServeEvery = std::chrono::milliseconds(20);
constexpr std::size_t kMaxWaiting = 64;
constexpr double kRests_s = 0.5, kStill_angstrom = 0.1, kElsewhere_angstrom = 0.5;
constexpr std::size_t kMaxTrail = 100;
/// Some seconds of the thread that serves all rooms, and what a request may take of it.
constexpr std::size_t kMaxPairsAtOnce = 300'000'000, kMaxPairsToMinimise = 10'000'000;
constexpr const char* kAsInFiles = "as in the files";

using Kind = wire::AskPose;

/// Two bodies, the step after which they were there, and how often the room was told to place them before.
struct Sample {
  Pose X_WA, X_WB;
  Step step;
  std::uint64_t placings = 0;
};

/// Poses that can be gone back to, and which of them is now's; those behind it can be gone forward to.
struct Trail {
  std::vector<Pose> poses;
  std::size_t at = 0;
};

struct Request {
  UserId user;
  std::string user_name;
  std::uint32_t number = 0;
  wire::AskPose asked;
};

class Site;

struct Answer {
  Site* site = nullptr;
  UserId user;
  wire::ServerControl message;
  std::optional<RoomCommand> placing;
};

void write(const Pose& X, google::protobuf::RepeatedField<double>& out) {
  out.Clear();
  for (const double number : X.p) out.Add(number);
  for (const double number : {X.q.w(), X.q.x(), X.q.y(), X.q.z()}) out.Add(number);
}

std::string text_of(double value) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(2) << value;
  return text.str();
}

/// A room with two molecules.
class Site final : public RoomWatcher {
 public:
  Site(const Room& of, const std::filesystem::path& folder, std::size_t first, std::size_t second,
       const std::atomic<bool>& is_stopping)
      : room(&of),
        is_stopping_(is_stopping),
        first_(body_id_at(first)),
        second_(body_id_at(second)),
        scene_(of.shared_scene()),
        a_(*scene_->world.bodies[first].molecule),
        b_(*scene_->world.bodies[second].molecule),
        centre_a_(scene_->molecule_centres_angstrom[first]),
        centre_b_(scene_->molecule_centres_angstrom[second]),
        period_(of.period()) {
    if (!folder.empty()) {
      folder_ = folder / kept_pose_folder(of);
    }
    kept_.push_back(described(as_in_files()));
    kept_.front().set_name(kAsInFiles);
    if (const auto listed = read_kept_poses(folder_)) kept_.insert(kept_.end(), listed->begin(), listed->end());
    kept_for_io = kept_;
  }
  ~Site() override {
    if (lock_ >= 0) ::close(lock_);
  }
  Site(const Site&) = delete;
  Site& operator=(const Site&) = delete;

  void on_command(const RoomCommand& command) noexcept override {
    placings_ += command.kind == RoomCommand::Kind::kPlace ? 1 : 0;
  }
  void on_input(std::size_t /*seat*/, const proto::ClientUpdate& /*input*/) noexcept override {}
  void on_step(const Room& of, ServerTime /*now*/, TickFaults /*faults*/) noexcept override {
    // Of a room that everybody has left, only that it was told.
    if (of.is_empty() && placings_ == placings_told_) return;
    placings_told_ = placings_;
    samples_.back() = {of.world().body(first_).X, of.world().body(second_).X, of.steps_done(), placings_};
    samples_.publish();
  }

  /// Looks where the molecules are.
  void watch() {
    if (is_refused_.exchange(false)) {
      trail_ = before_placing_;
      X_AB_ = still_ = placed_from_;
      is_placing_ = false;
    }
    if (!samples_.poll()) return;
    const Sample& now = samples_.front();
    // Where they were before they are placed is not where they went from there.
    if (is_placing_ && now.placings <= placed_) return;
    is_placing_ = false;
    placed_ = now.placings;
    X_AB_ = now.X_WA.inverse() * now.X_WB;
    X_AB_->p /= scene_->world.metres_per_angstrom;
    if (!still_ || docking::rmsd_angstrom(b_, *still_, *X_AB_) > kStill_angstrom) {
      still_ = X_AB_;
      still_since_ = now.step;
    }
    const double rested_s = to_seconds(period_) * static_cast<double>(now.step.value - still_since_.value);
    if (rested_s >= kRests_s && is_elsewhere()) mark(*X_AB_);
  }

  /// The next request, unless the room has not yet placed what the last one sent elsewhere.
  std::optional<Answer> serve_next(std::uint64_t unix_ms) {
    Request request;
    if (is_placing_ || !requests.pop(request)) return std::nullopt;
    before_placing_ = trail_;
    placed_from_ = X_AB_;
    Answer answer = serve(request, unix_ms);
    is_placing_ = answer.placing.has_value();
    return answer;
  }

  const Room* room;
  realtime::Ring<Request> requests{kMaxWaiting};
  std::vector<wire::KeptPose> kept_for_io;  ///< io's own
  /// io: the room could not be told what the last answer wanted placed.
  void refuse_placing() { is_refused_ = true; }

 private:
  Answer serve(const Request& request, std::uint64_t unix_ms) {
    Answer answer{this, request.user, {}, std::nullopt};
    answer.message.set_request(request.number);
    if (!X_AB_ || !docking::is_evaluable(*X_AB_))
      return refused(answer, wire::ERROR_NOT_ALLOWED, "the molecules are nowhere yet; try again");
    if (request.asked.kind() == Kind::KEEP) return keep(request, unix_ms, answer);
    if (!room->moves(first_) && !room->moves(second_))
      return refused(answer, wire::ERROR_NOT_ALLOWED, "neither molecule moves in this scene");
    switch (request.asked.kind()) {
      case Kind::GO_TO: {
        const auto found = std::ranges::find(kept_, request.asked.number(), &wire::KeptPose::number);
        if (found == kept_.end()) return refused(answer, wire::ERROR_BAD_VALUE, "no pose has that number here");
        return leave_for(*in_first(*found), "to " + found->name(), request, answer);
      }
      case Kind::UNDO:
        return undo(request, answer);
      case Kind::REDO:
        if (trail_.at + 1 >= trail_.poses.size() || is_elsewhere())
          return refused(answer, wire::ERROR_NOT_ALLOWED, "there is nothing to go forward to");
        return place(trail_.poses[++trail_.at], "forward again", request, answer);
      case Kind::MINIMISE:
        return minimise(request, answer);
      default:
        return refused(answer, wire::ERROR_BAD_VALUE, "this server does not know what is asked of the pose");
    }
  }

  Pose as_in_files() const { return {centre_b_ - centre_a_, Quat::Identity()}; }

  bool is_elsewhere() const {
    return trail_.poses.empty() || docking::rmsd_angstrom(b_, trail_.poses[trail_.at], *X_AB_) > kElsewhere_angstrom;
  }

  /// Behind where the trail is now, if it is not the same; what was ahead is gone.
  void mark(const Pose& X_AB) {
    constexpr double kSame_angstrom = 0.01;
    auto& [poses, at] = trail_;
    if (!poses.empty() && docking::rmsd_angstrom(b_, poses[at], X_AB) < kSame_angstrom) return;
    poses.resize(poses.empty() ? 0 : at + 1);
    if (poses.size() == kMaxTrail) poses.erase(poses.begin());
    poses.push_back(X_AB);
    at = poses.size() - 1;
  }

  static Answer& refused(Answer& answer, wire::ErrorCode code, const std::string& text) {
    answer.message.mutable_error()->set_code(code);
    answer.message.mutable_error()->set_text(text);
    return answer;
  }

  Answer& place(const Pose& X_AB, const std::string& text, const Request& request, Answer& answer) {
    wire::PoseTaken& taken = *answer.message.mutable_pose_taken();
    taken.set_user(request.user.value);
    taken.set_kind(request.asked.kind());
    taken.set_text(request.user_name + ": " + text);
    Pose X_SB = X_AB;
    X_SB.p *= scene_->world.metres_per_angstrom;
    const bool moves_second = room->moves(second_);
    answer.placing.emplace();
    answer.placing->kind = RoomCommand::Kind::kPlace;
    answer.placing->body = moves_second ? second_ : first_;
    answer.placing->beside = moves_second ? first_ : second_;
    answer.placing->X_SB = moves_second ? X_SB : X_SB.inverse();
    // What was asked meanwhile starts from there.
    X_AB_ = still_ = X_AB;
    return answer;
  }

  /// Where it is now can be come back to.
  Answer& leave_for(const Pose& X_AB, const std::string& text, const Request& request, Answer& answer) {
    if (is_elsewhere()) mark(*X_AB_);
    mark(X_AB);
    return place(X_AB, text, request, answer);
  }

  Answer& undo(const Request& request, Answer& answer) {
    if (!trail_.poses.empty() && is_elsewhere()) mark(*X_AB_);
    if (trail_.at == 0) return refused(answer, wire::ERROR_NOT_ALLOWED, "there is nothing to go back to");
    return place(trail_.poses[--trail_.at], "back", request, answer);
  }

  Answer& minimise(const Request& request, Answer& answer) {
    if (a_.size() * b_.size() > kMaxPairsToMinimise) {
      return refused(answer, wire::ERROR_NOT_ALLOWED,
                     "these molecules are too large to be minimised: " + std::to_string(a_.size()) + " x " +
                         std::to_string(b_.size()) + " atoms");
    }
    std::size_t left = kMaxPairsAtOnce / (a_.size() * b_.size());
    const auto [X_AB, energy] = minimum_near(a_, b_, scene_->world.field_model, *X_AB_,
                                             [&] { return !is_stopping_ && left > 0 && left-- > 0; });
    const std::string found = text_of(energy * docking::kKilojoulesPerKilocalorie) + " kJ/mol";
    const std::string how = left > 0 ? "to the minimum nearby, " + found
                                     : "towards the minimum nearby, " + found + "; minimise again to go on";
    return leave_for(X_AB, how, request, answer);
  }

  wire::KeptPose described(const Pose& X_AB) const {
    const docking::FieldResult result = docking::exact_field(a_, b_, X_AB, scene_->world.field_model);
    wire::KeptPose pose;
    write(X_AB, *pose.mutable_in_first());
    pose.set_lj_kj_per_mol(result.lennard_jones_kj_per_mol);
    pose.set_coulomb_kj_per_mol(result.coulomb_kj_per_mol);
    pose.set_rmsd_angstrom(docking::rmsd_angstrom(b_, as_in_files(), X_AB));
    pose.set_contacts(static_cast<std::uint32_t>(docking::atom_contacts(a_, b_, X_AB).size()));
    pose.set_hydrogen_bonds(static_cast<std::uint32_t>(docking::hydrogen_bonds(a_, b_, X_AB).size()));
    return pose;
  }

  Answer& keep(const Request& request, std::uint64_t unix_ms, Answer& answer) {
    if (kept_.size() > kMaxKeptPoses) {
      return refused(answer, wire::ERROR_NOT_ALLOWED,
                     "this room has kept " + std::to_string(kMaxKeptPoses) + " poses, and keeps no more");
    }
    wire::KeptPose pose = described(*X_AB_);
    pose.set_number(static_cast<std::uint32_t>(kept_.size()));
    pose.set_name(request.asked.name().empty() ? "pose " + std::to_string(pose.number()) : request.asked.name());
    pose.set_user_name(request.user_name);
    pose.set_kept_ms(unix_ms);
    kept_.push_back(pose);
    if (const std::string problem = write_down(pose); !problem.empty()) {
      kept_.pop_back();
      return refused(answer, wire::ERROR_NOT_ALLOWED, "the pose cannot be written: " + problem);
    }
    if (is_elsewhere()) mark(*X_AB_);
    *answer.message.mutable_kept_pose() = pose;
    answer.message.mutable_kept_pose()->set_is_news(true);
    return answer;
  }

  /// Empty, or what stands in the way.
  std::string write_down(const wire::KeptPose& pose) {
    if (folder_.empty()) return {};
    std::error_code error;
    std::filesystem::create_directories(folder_, error);
    if (lock_ < 0) lock_ = ::open((folder_ / "lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (lock_ < 0) return "the server cannot write into its folder (--keep)";
    if (::flock(lock_, LOCK_EX | LOCK_NB) != 0) return "another server keeps poses in that folder (--keep)";
    const auto listed = read_kept_poses(folder_);
    if (!listed) return (folder_ / "poses.json").string() + " is no list of poses; move it elsewhere";
    if (!is_known_ && listed->size() != static_cast<std::size_t>(pose.number() - 1))
      return "another server has kept poses in that folder (--keep) since this one read them; start this one again";
    is_known_ = true;
    try {
      save_kept_pose(folder_, pose, *room, first_, second_);
      write_kept_poses(folder_, std::span(kept_).subspan(1));
    } catch (const std::exception& problem) {
      return problem.what();
    }
    return {};
  }

  const std::atomic<bool>& is_stopping_;
  BodyId first_, second_;
  std::shared_ptr<const LoadedScene> scene_;
  const docking::Molecule& a_;
  const docking::Molecule& b_;
  Vec3 centre_a_, centre_b_;
  Duration period_;
  std::filesystem::path folder_;
  int lock_ = -1;
  bool is_known_ = false;  ///< that what stands in the folder is what is kept; with the lock it stays so
  std::uint64_t placings_ = 0, placings_told_ = 0;  ///< the room's own
  realtime::Mailbox<Sample> samples_;
  std::atomic<bool> is_refused_{false};
  bool is_placing_ = false;
  std::uint64_t placed_ = 0;  ///< by the newest sample
  std::vector<wire::KeptPose> kept_;
  std::optional<Pose> placed_from_;
  std::optional<Pose> X_AB_;   ///< newest [Å]
  std::optional<Pose> still_;  ///< since then it has moved less than kStill_angstrom
  Step still_since_{};
  Trail trail_, before_placing_;
};

}  // namespace

struct PoseKeeper::Impl {
  std::atomic<bool> is_stopping{false};
  std::vector<std::unique_ptr<Site>> sites;
  realtime::Ring<Answer> answers{kMaxWaiting};
  std::deque<Answer> unsaid;
  std::function<std::uint64_t()> unix_ms;
  std::unique_ptr<recording::RecorderThread> thread;

  Site* find(const Room& room) const {
    const auto found = std::ranges::find_if(sites, [&room](const auto& site) { return site->room == &room; });
    return found == sites.end() ? nullptr : found->get();
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
    // Each pose is evaluated in double, all pairs of it.
    if (bodies[molecules[0]].molecule->size() * bodies[molecules[1]].molecule->size() > kMaxPairsAtOnce) continue;
    impl_->sites.push_back(std::make_unique<Site>(*room, folder, molecules[0], molecules[1], impl_->is_stopping));
    room->watch(*impl_->sites.back());
  }
}

PoseKeeper::~PoseKeeper() {
  impl_->is_stopping = true;
}

void PoseKeeper::start() {
  if (!impl_->sites.empty())
    impl_->thread = std::make_unique<recording::RecorderThread>(kServeEvery, [this] { work(); });
}

void PoseKeeper::work() {
  for (const auto& site : impl_->sites) {
    site->watch();
    while (impl_->unsaid.empty()) {
      std::optional<Answer> answer = site->serve_next(impl_->unix_ms());
      if (!answer) break;
      impl_->unsaid.push_back(std::move(*answer));
    }
  }
  while (!impl_->unsaid.empty() && impl_->answers.push(impl_->unsaid.front())) impl_->unsaid.pop_front();
}

bool PoseKeeper::has_molecules(const Room& room) const {
  return impl_->find(room) != nullptr;
}

const std::vector<wire::KeptPose>& PoseKeeper::kept(const Room& room) const {
  static const std::vector<wire::KeptPose> kNone;
  const Site* const site = impl_->find(room);
  return site == nullptr ? kNone : site->kept_for_io;
}

bool PoseKeeper::ask(const Room& room, UserId user, const std::string& user_name, std::uint32_t request,
                     const wire::AskPose& asked) {
  Site* const site = impl_->find(room);
  return site != nullptr && site->requests.push({user, user_name, request, asked});
}

void PoseKeeper::deliver(
    const std::function<bool(const Room&, UserId, const wire::ServerControl&, const RoomCommand*)>& on_answer) {
  Answer answer;
  while (impl_->answers.pop(answer)) {
    Site& site = *answer.site;
    if (answer.message.has_kept_pose()) {
      site.kept_for_io.push_back(answer.message.kept_pose());
      site.kept_for_io.back().clear_is_news();
    }
    const bool is_done =
        on_answer(*site.room, answer.user, answer.message, answer.placing ? &*answer.placing : nullptr);
    if (answer.placing && !is_done) site.refuse_placing();
  }
}

}  // namespace tandem::server
