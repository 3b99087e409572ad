#include "server/docking/pose_site.hpp"

#include <algorithm>
#include <iomanip>
#include <sstream>
#include <utility>

#include "common/docking/exact_field.hpp"

namespace tandem::server {
namespace {

/// Maximum number of atom pairs that one minimisation evaluates in all its steps together.
constexpr std::size_t kMaxPairsToMinimise = 300'000'000;
/// Assumed cost of a request that evaluates no energy but accesses files, in the unit of work (atom pairs).
constexpr std::uint64_t kPairsOfARequest = 100'000;
constexpr std::uint64_t kProgressEvery_ms = 250;
constexpr const char* kAsInFiles = "as in the files";
constexpr const char* kNoSuchPose = "no pose has that number here";

using Kind = wire::AskPose;

std::string text_of(double value) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(2) << value;
  return text.str();
}

/// Returns the relative pose that the molecules have in their structure files, in the form of a saved pose.
wire::KeptPose pose_of_files(const MoleculePair& pair) {
  PoseEnergy energy{pair.as_in_files()};
  while (!pair.evaluate_slice(energy)) {
  }
  wire::KeptPose pose = pair.describe(energy);
  pose.set_name(kAsInFiles);
  return pose;
}

}  // namespace

PoseSite::PoseSite(const Room& of, const std::filesystem::path& folder, std::size_t first, std::size_t second)
    : room(&of),
      pair_(of, first, second),
      kept_poses_(of.name(), folder.empty() ? folder : folder / kept_pose_folder(of), pose_of_files(pair_), pair_),
      trail_(pair_.b(), of.period()) {
  kept = kept_poses_.all();
  kept.insert(kept.begin(), kept_poses_.of_files());
}

void PoseSite::on_command(const RoomCommand& command) noexcept {
  placings_ += command.kind == RoomCommand::Kind::kPlace ? 1 : 0;
}

void PoseSite::on_step(const Room& of, ServerTime /*now*/, TickFaults /*faults*/) noexcept {
  // In an empty room, the molecules can move only by a kPlace command, so a pose is published only after a new one.
  if (of.is_empty() && placings_ == placings_published_) return;
  placings_published_ = placings_;
  samples_.back() = {of.world().body(pair_.first()).X, of.world().body(pair_.second()).X, of.steps_done(), placings_};
  samples_.publish();
}

void PoseSite::watch() {
  if (is_refused_.exchange(false)) trail_.cancel_move();
  if (!samples_.poll()) return;
  const Sample& now = samples_.front();
  trail_.observe(pair_.relative(now.X_WA, now.X_WB), now.step, now.placings);
}

bool PoseSite::has_work() {
  PoseRequest request;
  while (requests.pop(request)) waiting_.push_back(std::move(request));
  return minimising_ || keeping_ || (!trail_.is_moving() && !waiting_.empty());
}

std::uint64_t PoseSite::serve_slice(std::uint64_t unix_ms, std::deque<PoseAnswer>& answers) {
  const bool has_other = keeping_ || (!trail_.is_moving() && !waiting_.empty());
  was_minimising_ = minimising_ && !(has_other && was_minimising_);
  if (was_minimising_) return minimise_slice(unix_ms, answers);
  if (keeping_) return keep_slice(unix_ms, answers);
  PoseRequest request = std::move(waiting_.front());
  waiting_.pop_front();
  return begin(std::move(request), unix_ms, answers);
}

void PoseSite::refuse_all(const std::string& why, std::deque<PoseAnswer>& answers) {
  has_work();  // called for its side effect: it moves the requests from the ring to waiting_
  if (minimising_) end_minimising(why, answers);
  if (keeping_) waiting_.push_front(std::exchange(keeping_, std::nullopt)->request);
  for (const PoseRequest& request : waiting_) answers.push_back(refusal(request, wire::ERROR_NOT_ALLOWED, why));
  waiting_.clear();
}

std::uint64_t PoseSite::begin(PoseRequest request, std::uint64_t unix_ms, std::deque<PoseAnswer>& answers) {
  const auto refuse = [&](wire::ErrorCode code, const std::string& text) {
    answers.push_back(refusal(request, code, text));
    return kPairsOfARequest;
  };
  if (const char* const why = *request.cancelled) return refuse(wire::ERROR_NOT_ALLOWED, why);
  const Kind::Kind kind = request.message.kind();
  if (kind == Kind::DELETE || kind == Kind::RENAME) {
    answers.push_back(kind == Kind::DELETE ? delete_pose(request) : rename_pose(request));
    return kPairsOfARequest;
  }
  if (!trail_.newest() || !docking::is_evaluable(*trail_.newest()))
    return refuse(wire::ERROR_NOT_ALLOWED, "the molecules have no pose yet; try again");
  if (kind == Kind::KEEP) {
    if (const std::string problem = kept_poses_.problem_of_adding(request.user_name); !problem.empty())
      return refuse(wire::ERROR_NOT_ALLOWED, problem);
    keeping_ = Keeping{std::move(request), {*trail_.newest()}};
    return keep_slice(unix_ms, answers);
  }
  if (!pair_.moves()) return refuse(wire::ERROR_NOT_ALLOWED, "neither molecule moves in this scene");
  if (kind == Kind::MINIMISE) {
    begin_minimising(std::move(request), unix_ms, answers);
    return kPairsOfARequest;
  }
  PoseAnswer answer = navigate(request);
  if (answer.placing && minimising_)
    end_minimising(request.user_name + " has moved the molecules in the meantime; minimise again from there", answers);
  answers.push_back(std::move(answer));
  return kPairsOfARequest;
}

/// Handles undo, redo and jumps to a saved pose.
PoseAnswer PoseSite::navigate(const PoseRequest& request) {
  switch (request.message.kind()) {
    case Kind::GO_TO: {
      const wire::KeptPose* const found = kept_poses_.find(request.message.number());
      if (found == nullptr) return refusal(request, wire::ERROR_BAD_VALUE, kNoSuchPose);
      const Pose X_AB = *in_first(*found);
      trail_.move_to(X_AB);
      return place(X_AB, "to \"" + found->name() + "\"", request);
    }
    case Kind::UNDO:
      if (const auto X_AB = trail_.undo()) return place(*X_AB, "back", request);
      return refusal(request, wire::ERROR_NOT_ALLOWED, "there is nothing to go back to");
    case Kind::REDO:
      if (const auto X_AB = trail_.redo()) return place(*X_AB, "forward again", request);
      return refusal(request, wire::ERROR_NOT_ALLOWED, "there is nothing to go forward to");
    default:
      return refusal(request, wire::ERROR_BAD_VALUE, "this server does not support the requested action");
  }
}

PoseAnswer PoseSite::delete_pose(const PoseRequest& request) {
  const std::uint32_t number = request.message.number();
  if (number == 0) return refusal(request, wire::ERROR_BAD_VALUE, "the pose of the files themselves stays");
  if (kept_poses_.find(number) == nullptr) return refusal(request, wire::ERROR_BAD_VALUE, kNoSuchPose);
  if (const std::string problem = kept_poses_.remove(number); !problem.empty())
    return refusal(request, wire::ERROR_NOT_ALLOWED, "the pose cannot be deleted: " + problem);
  PoseAnswer answer = answer_to(request);
  answer.message.mutable_pose_deleted()->set_number(number);
  answer.message.mutable_pose_deleted()->set_user(request.user.value);
  return answer;
}

PoseAnswer PoseSite::rename_pose(const PoseRequest& request) {
  const std::uint32_t number = request.message.number();
  if (number == 0) return refusal(request, wire::ERROR_BAD_VALUE, "the pose of the files themselves keeps its name");
  if (kept_poses_.find(number) == nullptr) return refusal(request, wire::ERROR_BAD_VALUE, kNoSuchPose);
  if (const std::string problem = kept_poses_.rename(number, request.message.name()); !problem.empty())
    return refusal(request, wire::ERROR_NOT_ALLOWED, "the pose cannot be renamed: " + problem);
  PoseAnswer answer = answer_to(request);
  *answer.message.mutable_kept_pose() = *kept_poses_.find(number);
  return answer;
}

void PoseSite::begin_minimising(PoseRequest request, std::uint64_t unix_ms, std::deque<PoseAnswer>& answers) {
  const std::size_t pairs = std::max<std::size_t>(1, pair_.atom_pairs());
  if (pairs > kMaxPairsInSlice) {
    answers.push_back(refusal(request, wire::ERROR_NOT_ALLOWED,
                              "these molecules are too large to be minimised: " + std::to_string(pair_.a().size()) +
                                  " x " + std::to_string(pair_.b().size()) + " atoms"));
    return;
  }
  if (minimising_) {
    const std::string& name = minimising_->request.user_name;
    answers.push_back(refusal(request, wire::ERROR_NOT_ALLOWED,
                              "a minimisation of " + name + " is under way; wait for its end, or let " + name +
                                  " or the operator cancel it"));
    return;
  }
  const std::size_t max_steps =
      std::min<std::size_t>(PoseMinimiser::kMaxSteps + 1, std::max<std::size_t>(2, kMaxPairsToMinimise / pairs));
  PoseMinimiser minimiser(pair_.a(), pair_.b(), pair_.scene().world.field_model, *trail_.newest());
  minimising_.emplace(Minimisation{std::move(request), std::move(minimiser), 0, max_steps, unix_ms});
  answers.push_back(progress(false));
}

std::uint64_t PoseSite::minimise_slice(std::uint64_t unix_ms, std::deque<PoseAnswer>& answers) {
  Minimisation& running = *minimising_;
  if (const char* const why = *running.request.cancelled) {
    end_minimising(why, answers);
    return kPairsOfARequest;
  }
  const bool has_more = running.minimiser.step();
  const bool is_over = !has_more || ++running.steps >= running.max_steps;
  const std::uint64_t work = kPairsOfARequest + pair_.atom_pairs();
  // If the clock was set back, the first condition holds, so that progress is still reported.
  const bool is_due = unix_ms < running.reported_ms || unix_ms - running.reported_ms >= kProgressEvery_ms;
  if (is_due || is_over) answers.push_back(progress(is_over));
  if (is_due) running.reported_ms = unix_ms;
  if (!is_over) return work;
  const Minimisation done = std::move(*std::exchange(minimising_, std::nullopt));
  const std::string energy = text_of(done.minimiser.energy_kj_per_mol()) + " kJ/mol";
  const std::string text = has_more ? "towards the minimum nearby, " + energy + "; minimise again to go on"
                                    : "to the minimum nearby, " + energy;
  trail_.move_to(done.minimiser.pose());
  answers.push_back(place(done.minimiser.pose(), text, done.request));
  return work;
}

void PoseSite::end_minimising(const std::string& why, std::deque<PoseAnswer>& answers) {
  answers.push_back(progress(true));
  answers.push_back(refusal(minimising_->request, wire::ERROR_NOT_ALLOWED, why));
  minimising_.reset();
}

PoseAnswer PoseSite::progress(bool is_over) {
  PoseAnswer news{this, 0, minimising_->request.user, {}, std::nullopt};
  wire::PoseProgress& progress = *news.message.mutable_pose_progress();
  progress.set_user(minimising_->request.user.value);
  progress.set_steps(static_cast<std::uint32_t>(minimising_->steps));
  progress.set_max_steps(static_cast<std::uint32_t>(minimising_->max_steps));
  progress.set_energy_kj_per_mol(minimising_->minimiser.energy_kj_per_mol());
  progress.set_is_over(is_over);
  return news;
}

std::uint64_t PoseSite::keep_slice(std::uint64_t unix_ms, std::deque<PoseAnswer>& answers) {
  const std::size_t atoms_before = keeping_->energy.atoms_done;
  const bool is_done = pair_.evaluate_slice(keeping_->energy);
  const std::uint64_t work = kPairsOfARequest + (keeping_->energy.atoms_done - atoms_before) * pair_.b().size();
  if (!is_done && *keeping_->request.cancelled == nullptr) return work;
  const Keeping done = std::move(*std::exchange(keeping_, std::nullopt));
  const char* const why = *done.request.cancelled;
  answers.push_back(why != nullptr ? refusal(done.request, wire::ERROR_NOT_ALLOWED, why) : keep(done, unix_ms));
  return work;
}

PoseAnswer PoseSite::keep(const Keeping& keeping, std::uint64_t unix_ms) {
  const PoseRequest& request = keeping.request;
  wire::KeptPose pose = pair_.describe(keeping.energy);
  pose.set_number(kept_poses_.next_number());
  pose.set_name(request.message.name().empty() ? "pose " + std::to_string(pose.number()) : request.message.name());
  pose.set_user_name(request.user_name);
  pose.set_kept_ms(unix_ms);
  if (const std::string problem = kept_poses_.add(pose); !problem.empty())
    return refusal(request, wire::ERROR_NOT_ALLOWED, "the pose cannot be written: " + problem);
  trail_.mark_newest();
  PoseAnswer answer = answer_to(request);
  *answer.message.mutable_kept_pose() = pose;
  answer.message.mutable_kept_pose()->set_is_news(true);
  return answer;
}

PoseAnswer PoseSite::answer_to(const PoseRequest& request) {
  PoseAnswer answer{this, request.id, request.user, {}, std::nullopt};
  answer.message.set_request(request.number);
  return answer;
}

PoseAnswer PoseSite::refusal(const PoseRequest& request, wire::ErrorCode code, const std::string& text) {
  PoseAnswer answer = answer_to(request);
  answer.message.mutable_error()->set_code(code);
  answer.message.mutable_error()->set_text(text);
  return answer;
}

/// Returns the answer to a request that moves a molecule to the target of the trail.
PoseAnswer PoseSite::place(const Pose& X_AB, const std::string& text, const PoseRequest& request) {
  PoseAnswer answer = answer_to(request);
  wire::PoseTaken& taken = *answer.message.mutable_pose_taken();
  taken.set_user(request.user.value);
  taken.set_kind(request.message.kind());
  taken.set_text(request.user_name + ": " + text);
  answer.placing = pair_.placing(X_AB);
  return answer;
}

}  // namespace tandem::server
