#include "client/session/pose_book.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/spatial.hpp"
#include "common/net/text.hpp"

namespace tandem::client {

using net::printable;

void PoseBook::clear() {
  kept_.reset();
  progress_.reset();
  own_progress_.Clear();
}

std::string PoseBook::receive(const wire::KeptPose& pose) {
  auto poses =
      kept_ ? std::make_shared<std::vector<wire::KeptPose>>(*kept_) : std::make_shared<std::vector<wire::KeptPose>>();
  const auto& numbers = pose.in_first();
  const bool is_pose =
      numbers.size() == 7 && std::abs(Quat(numbers[3], numbers[4], numbers[5], numbers[6]).norm() - 1) < 1e-6;
  if (!is_pose) return {};
  const auto known = std::ranges::find(*poses, pose.number(), &wire::KeptPose::number);
  if (known != poses->end()) {
    if (pose.number() == 0) return {};
    known->set_name(printable(pose.name()));
    kept_ = std::move(poses);
    return {};
  }
  const bool is_next = poses->empty() ? pose.number() == 0 : pose.number() > poses->back().number();
  if (!is_next || poses->size() == kMaxPoses) return {};
  wire::KeptPose& added = poses->emplace_back(pose);
  added.set_name(printable(pose.name()));
  added.set_user_name(printable(pose.user_name()));
  kept_ = poses;
  return pose.is_news() ? added.user_name() + " kept \"" + added.name() + "\"" : std::string();
}

std::string PoseBook::receive(const wire::PoseDeleted& deleted) {
  if (!kept_ || deleted.number() == 0) return {};
  auto poses = std::make_shared<std::vector<wire::KeptPose>>(*kept_);
  const auto found = std::ranges::find(*poses, deleted.number(), &wire::KeptPose::number);
  if (found == poses->end()) return {};
  const std::string name = found->name();
  poses->erase(found);
  kept_ = std::move(poses);
  return "\"" + name + "\" was deleted";
}

void PoseBook::receive(const wire::PoseProgress& progress, std::uint32_t own_user) {
  const bool is_sound = progress.max_steps() > 0 && std::isfinite(progress.energy_kj_per_mol());
  if (is_sound && progress.user() == own_user) own_progress_ = progress;
  if (progress.is_over() || !is_sound) return progress_.reset();
  progress_ = progress;
}

void PoseBook::await(std::uint32_t request, std::uint32_t tag) {
  tags_.insert_or_assign(request, tag);
}

/// Returns the event for the pose request that `message` answers. A message of a type that cannot answer a pose request
/// is ignored, even if its request number is that of a pose request.
std::optional<event::PoseAnswered> PoseBook::answer(const wire::ServerControl& message) {
  const bool is_answer = message.has_kept_pose() || message.has_pose_taken() || message.has_pose_deleted() ||
                         message.has_pose_progress() || message.has_error();
  const auto found = is_answer ? tags_.find(message.request()) : tags_.end();
  if (found == tags_.end()) return std::nullopt;
  const std::uint32_t tag = found->second;
  tags_.erase(found);
  return event::PoseAnswered{tag, message, own_progress_};
}

std::vector<event::PoseAnswered> PoseBook::refuse_all(const std::string& why) {
  wire::ServerControl answer;
  answer.mutable_error()->set_code(wire::ERROR_NOT_ALLOWED);
  answer.mutable_error()->set_text("not in a room: " + printable(why));
  std::vector<event::PoseAnswered> events;
  for (const auto& [request, tag] : std::exchange(tags_, {})) events.push_back({tag, answer, own_progress_});
  return events;
}

}  // namespace tandem::client
