#include "server/docking/pose_site.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <iomanip>
#include <sstream>
#include <utility>

#include "common/docking/atom_contacts.hpp"
#include "common/docking/exact_field.hpp"

namespace tandem::server {
namespace {

/// A molecule is at rest if it moves by less than kStill_angstrom (RMSD) for kRests_s. Its pose is added to the history
/// if it is farther than kElsewhere_angstrom from the current entry. Poses closer than kSame_angstrom count as equal.
constexpr double kRests_s = 0.5, kStill_angstrom = 0.1, kElsewhere_angstrom = 0.5, kSame_angstrom = 0.01;
constexpr std::size_t kMaxTrail = 100;
/// Maximum number of atom pairs evaluated in all steps of one minimisation.
constexpr std::size_t kMaxPairsToMinimise = 300'000'000;
/// Assumed cost of a request that evaluates no energy, in pairs of atoms. It is mostly file access.
constexpr std::uint64_t kPairsOfARequest = 100'000;
constexpr std::uint64_t kProgressEvery_ms = 250;
constexpr const char* kAsInFiles = "as in the files";
constexpr const char* kNoSuchPose = "no pose has that number here";

using Kind = wire::AskPose;

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

/// Copies `count` atoms, beginning with atom `first`. Only the data that the energy needs are copied.
docking::Molecule part_of(const docking::Molecule& molecule, std::size_t first, std::size_t count) {
  const auto copy = [first, count](const auto& from, auto& to) {
    const auto begin = from.begin() + static_cast<std::ptrdiff_t>(first);
    to.assign(begin, begin + static_cast<std::ptrdiff_t>(count));
  };
  docking::Molecule part;
  copy(molecule.positions_angstrom, part.positions_angstrom);
  copy(molecule.sigma_angstrom, part.sigma_angstrom);
  copy(molecule.epsilon_kj_per_mol, part.epsilon_kj_per_mol);
  copy(molecule.charge_e, part.charge_e);
  copy(molecule.mass_u, part.mass_u);
  part.mixes_arithmetically = molecule.mixes_arithmetically;
  return part;
}

bool has_same_numbers(const KeptPoseList& one, const KeptPoseList& other) {
  return one.next_number == other.next_number &&
         std::ranges::equal(one.poses, other.poses, {}, &wire::KeptPose::number, &wire::KeptPose::number);
}

}  // namespace

PoseSite::PoseSite(const Room& of, const std::filesystem::path& folder, std::size_t first, std::size_t second)
    : room(&of),
      room_name_(of.name()),
      first_(body_id_at(first)),
      second_(body_id_at(second)),
      scene_(of.shared_scene()),
      a_(*scene_->world.bodies[first].molecule),
      b_(*scene_->world.bodies[second].molecule),
      centre_a_(scene_->molecule_centres_angstrom[first]),
      centre_b_(scene_->molecule_centres_angstrom[second]),
      moves_first_(of.moves(first_)),
      moves_second_(of.moves(second_)),
      period_(of.period()) {
  if (!folder.empty()) folder_ = folder / kept_pose_folder(of);
  Evaluation evaluation{{}, as_in_files()};
  while (!evaluate_slice(evaluation)) {
  }
  of_files_ = describe(evaluation);
  of_files_.set_name(kAsInFiles);
  if (const auto listed = read_kept_poses(folder_)) list_ = *listed;
  kept = list_.poses;
  kept.insert(kept.begin(), of_files_);
}

PoseSite::~PoseSite() {
  if (lock_ >= 0) ::close(lock_);
}

void PoseSite::on_command(const RoomCommand& command) noexcept {
  placings_ += command.kind == RoomCommand::Kind::kPlace ? 1 : 0;
}

void PoseSite::on_step(const Room& of, ServerTime /*now*/, TickFaults /*faults*/) noexcept {
  // In an empty room, poses are published only after a new kPlace command.
  if (of.is_empty() && placings_ == placings_published_) return;
  placings_published_ = placings_;
  samples_.back() = {of.world().body(first_).X, of.world().body(second_).X, of.steps_done(), placings_};
  samples_.publish();
}

void PoseSite::watch() {
  if (is_refused_.exchange(false)) {
    trail_ = before_placing_;
    X_AB_ = still_ = placed_from_;
    is_placing_ = false;
  }
  if (!samples_.poll()) return;
  const Sample& now = samples_.front();
  // Skips samples from before the pending command, because later requests such as undo start from the new pose.
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

bool PoseSite::has_work() {
  PoseRequest request;
  while (requests.pop(request)) waiting_.push_back(std::move(request));
  return minimising_ || keeping_ || (!is_placing_ && !waiting_.empty());
}

std::uint64_t PoseSite::serve_slice(std::uint64_t unix_ms, std::deque<PoseAnswer>& answers) {
  const bool has_other = keeping_ || (!is_placing_ && !waiting_.empty());
  was_minimising_ = minimising_ && !(has_other && was_minimising_);
  if (was_minimising_) return minimise_slice(unix_ms, answers);
  if (keeping_) return keep_slice(unix_ms, answers);
  PoseRequest request = std::move(waiting_.front());
  waiting_.pop_front();
  return begin(std::move(request), unix_ms, answers);
}

void PoseSite::refuse_all(const std::string& why, std::deque<PoseAnswer>& answers) {
  has_work();  // moves the requests from the ring to waiting_
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
  if (!X_AB_ || !docking::is_evaluable(*X_AB_))
    return refuse(wire::ERROR_NOT_ALLOWED, "the molecules have no pose yet; try again");
  if (kind == Kind::KEEP) {
    if (const std::string problem = keeping_problem(request); !problem.empty())
      return refuse(wire::ERROR_NOT_ALLOWED, problem);
    keeping_ = Evaluation{std::move(request), *X_AB_};
    return keep_slice(unix_ms, answers);
  }
  if (!moves_first_ && !moves_second_) return refuse(wire::ERROR_NOT_ALLOWED, "neither molecule moves in this scene");
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
  before_placing_ = trail_;
  placed_from_ = X_AB_;
  switch (request.message.kind()) {
    case Kind::GO_TO: {
      const wire::KeptPose* const found = find(request.message.number());
      if (found == nullptr) return refusal(request, wire::ERROR_BAD_VALUE, kNoSuchPose);
      return leave_for(*in_first(*found), "to \"" + found->name() + "\"", request);
    }
    case Kind::UNDO:
      if (!trail_.poses.empty() && is_elsewhere()) mark(*X_AB_);
      if (trail_.at == 0) return refusal(request, wire::ERROR_NOT_ALLOWED, "there is nothing to go back to");
      return place(trail_.poses[--trail_.at], "back", request);
    case Kind::REDO:
      if (trail_.at + 1 >= trail_.poses.size() || is_elsewhere())
        return refusal(request, wire::ERROR_NOT_ALLOWED, "there is nothing to go forward to");
      return place(trail_.poses[++trail_.at], "forward again", request);
    default:
      return refusal(request, wire::ERROR_BAD_VALUE, "this server does not support the requested action");
  }
}

PoseAnswer PoseSite::delete_pose(const PoseRequest& request) {
  const std::uint32_t number = request.message.number();
  if (number == 0) return refusal(request, wire::ERROR_BAD_VALUE, "the pose of the files themselves stays");
  if (find(number) == nullptr) return refusal(request, wire::ERROR_BAD_VALUE, kNoSuchPose);
  KeptPoseList left = list_;
  std::erase_if(left.poses, [number](const wire::KeptPose& pose) { return pose.number() == number; });
  if (const std::string problem = write_list(left, nullptr); !problem.empty())
    return refusal(request, wire::ERROR_NOT_ALLOWED, "the pose cannot be deleted: " + problem);
  list_ = std::move(left);
  if (!folder_.empty()) remove_deleted_poses(folder_, list_);
  PoseAnswer answer = answer_to(request);
  answer.message.mutable_pose_deleted()->set_number(number);
  answer.message.mutable_pose_deleted()->set_user(request.user.value);
  return answer;
}

/// Renames a pose. Only the list changes, because the structure files are named by number.
PoseAnswer PoseSite::rename_pose(const PoseRequest& request) {
  const std::uint32_t number = request.message.number();
  if (number == 0) return refusal(request, wire::ERROR_BAD_VALUE, "the pose of the files themselves keeps its name");
  KeptPoseList renamed = list_;
  const auto found = std::ranges::find(renamed.poses, number, &wire::KeptPose::number);
  if (found == renamed.poses.end()) return refusal(request, wire::ERROR_BAD_VALUE, kNoSuchPose);
  found->set_name(request.message.name());
  if (const std::string problem = write_list(renamed, nullptr); !problem.empty())
    return refusal(request, wire::ERROR_NOT_ALLOWED, "the pose cannot be renamed: " + problem);
  PoseAnswer answer = answer_to(request);
  *answer.message.mutable_kept_pose() = *found;
  list_ = std::move(renamed);
  return answer;
}

void PoseSite::begin_minimising(PoseRequest request, std::uint64_t unix_ms, std::deque<PoseAnswer>& answers) {
  const std::size_t pairs = std::max<std::size_t>(1, a_.size() * b_.size());
  if (pairs > kMaxPairsInSlice) {
    answers.push_back(refusal(request, wire::ERROR_NOT_ALLOWED,
                              "these molecules are too large to be minimised: " + std::to_string(a_.size()) + " x " +
                                  std::to_string(b_.size()) + " atoms"));
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
  minimising_.emplace(Minimisation{std::move(request), PoseMinimiser(a_, b_, scene_->world.field_model, *X_AB_), 0,
                                   max_steps, unix_ms});
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
  const std::uint64_t work = kPairsOfARequest + a_.size() * b_.size();
  // The first condition is true if the clock was set back.
  const bool is_due = unix_ms < running.reported_ms || unix_ms - running.reported_ms >= kProgressEvery_ms;
  if (is_due || is_over) answers.push_back(progress(is_over));
  if (is_due) running.reported_ms = unix_ms;
  if (!is_over) return work;
  const Minimisation done = std::move(*std::exchange(minimising_, std::nullopt));
  const std::string energy = text_of(done.minimiser.energy_kj_per_mol()) + " kJ/mol";
  const std::string text = has_more ? "towards the minimum nearby, " + energy + "; minimise again to go on"
                                    : "to the minimum nearby, " + energy;
  before_placing_ = trail_;
  placed_from_ = X_AB_;
  answers.push_back(leave_for(done.minimiser.pose(), text, done.request));
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

/// Returns the reason why the user or the room may not save another pose; empty if they may.
std::string PoseSite::keeping_problem(const PoseRequest& request) const {
  if (list_.poses.size() >= kMaxKeptPoses)
    return "this room has kept " + std::to_string(kMaxKeptPoses) +
           " poses, and keeps no more; delete some that are not needed";
  const auto own = std::ranges::count(list_.poses, request.user_name, &wire::KeptPose::user_name);
  if (static_cast<std::size_t>(own) < kMaxKeptPosesOfUser) return {};
  return "you have kept " + std::to_string(own) + " poses in this room, and a user keeps at most " +
         std::to_string(kMaxKeptPosesOfUser) + "; delete one of yours";
}

std::uint64_t PoseSite::keep_slice(std::uint64_t unix_ms, std::deque<PoseAnswer>& answers) {
  const std::size_t atoms_before = keeping_->atoms_done;
  const bool is_done = evaluate_slice(*keeping_);
  const std::uint64_t work = kPairsOfARequest + (keeping_->atoms_done - atoms_before) * b_.size();
  if (!is_done && *keeping_->request.cancelled == nullptr) return work;
  const Evaluation done = std::move(*std::exchange(keeping_, std::nullopt));
  const char* const why = *done.request.cancelled;
  answers.push_back(why != nullptr ? refusal(done.request, wire::ERROR_NOT_ALLOWED, why) : keep(done, unix_ms));
  return work;
}

PoseAnswer PoseSite::keep(const Evaluation& evaluation, std::uint64_t unix_ms) {
  const PoseRequest& request = evaluation.request;
  wire::KeptPose pose = describe(evaluation);
  pose.set_number(list_.next_number);
  pose.set_name(request.message.name().empty() ? "pose " + std::to_string(pose.number()) : request.message.name());
  pose.set_user_name(request.user_name);
  pose.set_kept_ms(unix_ms);
  KeptPoseList longer = list_;
  longer.poses.push_back(pose);
  ++longer.next_number;
  if (const std::string problem = write_list(longer, &pose); !problem.empty())
    return refusal(request, wire::ERROR_NOT_ALLOWED, "the pose cannot be written: " + problem);
  list_ = std::move(longer);
  if (is_elsewhere()) mark(*X_AB_);
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

PoseAnswer PoseSite::place(const Pose& X_AB, const std::string& text, const PoseRequest& request) {
  PoseAnswer answer = answer_to(request);
  wire::PoseTaken& taken = *answer.message.mutable_pose_taken();
  taken.set_user(request.user.value);
  taken.set_kind(request.message.kind());
  taken.set_text(request.user_name + ": " + text);
  Pose X_SB = X_AB;
  X_SB.p *= scene_->world.metres_per_angstrom;
  answer.placing.emplace();
  answer.placing->kind = RoomCommand::Kind::kPlace;
  answer.placing->body = moves_second_ ? second_ : first_;
  answer.placing->beside = moves_second_ ? first_ : second_;
  answer.placing->X_SB = moves_second_ ? X_SB : X_SB.inverse();
  // Later requests start from this pose.
  X_AB_ = still_ = X_AB;
  is_placing_ = true;
  return answer;
}

/// Moves the molecule to a pose, and adds the current pose to the history for undo.
PoseAnswer PoseSite::leave_for(const Pose& X_AB, const std::string& text, const PoseRequest& request) {
  if (is_elsewhere()) mark(*X_AB_);
  mark(X_AB);
  return place(X_AB, text, request);
}

bool PoseSite::is_elsewhere() const {
  return trail_.poses.empty() || docking::rmsd_angstrom(b_, trail_.poses[trail_.at], *X_AB_) > kElsewhere_angstrom;
}

/// Appends a pose to the history after the current entry, if it differs from it. Deletes the entries for redo.
void PoseSite::mark(const Pose& X_AB) {
  auto& [poses, at] = trail_;
  if (!poses.empty() && docking::rmsd_angstrom(b_, poses[at], X_AB) < kSame_angstrom) return;
  poses.resize(poses.empty() ? 0 : at + 1);
  if (poses.size() == kMaxTrail) poses.erase(poses.begin());
  poses.push_back(X_AB);
  at = poses.size() - 1;
}

/// Evaluates one slice of the energy of a pose. Returns true when the energy is complete.
bool PoseSite::evaluate_slice(Evaluation& evaluation) const {
  const std::size_t fits = std::max<std::size_t>(1, kMaxPairsInSlice / std::max<std::size_t>(1, b_.size()));
  const std::size_t count = std::min(fits, a_.size() - evaluation.atoms_done);
  const docking::FieldModel& model = scene_->world.field_model;
  const docking::FieldResult result =
      count == a_.size() ? docking::exact_field(a_, b_, evaluation.X_AB, model)
                         : docking::exact_field(part_of(a_, evaluation.atoms_done, count), b_, evaluation.X_AB, model);
  evaluation.lj_kj_per_mol += result.lennard_jones_kj_per_mol;
  evaluation.coulomb_kj_per_mol += result.coulomb_kj_per_mol;
  evaluation.atoms_done += count;
  return evaluation.atoms_done == a_.size();
}

wire::KeptPose PoseSite::describe(const Evaluation& evaluation) const {
  const Pose& X_AB = evaluation.X_AB;
  wire::KeptPose pose;
  write(X_AB, *pose.mutable_in_first());
  pose.set_lj_kj_per_mol(evaluation.lj_kj_per_mol);
  pose.set_coulomb_kj_per_mol(evaluation.coulomb_kj_per_mol);
  pose.set_rmsd_angstrom(docking::rmsd_angstrom(b_, as_in_files(), X_AB));
  pose.set_contacts(static_cast<std::uint32_t>(docking::atom_contacts(a_, b_, X_AB).size()));
  pose.set_hydrogen_bonds(static_cast<std::uint32_t>(docking::hydrogen_bonds(a_, b_, X_AB).size()));
  return pose;
}

const wire::KeptPose* PoseSite::find(std::uint32_t number) const {
  if (number == 0) return &of_files_;
  const auto found = std::ranges::find(list_.poses, number, &wire::KeptPose::number);
  return found == list_.poses.end() ? nullptr : &*found;
}

/// Writes the list, and the structure files of `added` unless it is null.
/// Out     empty if the files are written, otherwise the reason for the failure
std::string PoseSite::write_list(const KeptPoseList& list, const wire::KeptPose* added) {
  if (folder_.empty()) return {};
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (lock_ < 0) lock_ = ::open((folder_ / "lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (lock_ < 0) return "the server cannot write into its folder (--keep)";
  if (::flock(lock_, LOCK_EX | LOCK_NB) != 0) return "another server keeps poses in that folder (--keep)";
  const auto listed = read_kept_poses(folder_);
  if (!listed) return (folder_ / "poses.json").string() + " is no list of poses; move it elsewhere";
  if (!is_known_ && !has_same_numbers(*listed, list_))
    return "another server has kept poses in that folder (--keep) since this one read them; start this one again";
  is_known_ = true;
  try {
    if (added != nullptr) save_kept_pose(folder_, *added, room_name_, *scene_, first_, second_);
    write_kept_poses(folder_, list);
  } catch (const std::exception& problem) {
    return problem.what();
  }
  return {};
}

}  // namespace tandem::server
