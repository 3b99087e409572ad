#include "client/haptics/scene_inbox.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "client/haptics/scene_coupling.hpp"

namespace tandem::client {
namespace {

bool is_positive(double value) {
  return std::isfinite(value) && value > 0;
}

bool can_render(const HapticScene& scene) {
  if (!SceneCoupling::is_usable(scene)) return false;
  const WorkspaceMapping& map = scene.workspace;
  return is_finite(map.X_WD) && std::abs(map.X_WD.q.norm() - 1) < 1e-3 && is_positive(map.position_scale) &&
         is_positive(map.force_scale);
}

}  // namespace

SceneInbox::SceneInbox(ClientMailboxes& mailboxes, const haptics::CouplingParameters& device_bounds) noexcept
    : mailboxes_(mailboxes), device_bounds_(device_bounds) {}

// Reads the mailboxes: first the states, then the scene. In the opposite order, a last state of the previous connection
// could arrive between the two reads and be mistaken for a state of the new scene.
SceneNews SceneInbox::poll() noexcept {
  const bool has_arrived = mailboxes_.inbox.poll();
  has_state_ = has_state_ || has_arrived;
  const SceneNews news = mailboxes_.scene.poll() ? take_scene(mailboxes_.scene.front()) : SceneNews{};
  has_new_state_ = has_arrived && has_state_;
  return news;
}

SceneNews SceneInbox::take_scene(const HapticScene& scene) noexcept {
  SceneNews news;
  news.is_entered = scene.generation != scene_.generation;
  news.is_changed = !news.is_entered;
  news.is_place_shown = news.is_changed && scene.places_shown != scene_.places_shown;
  scene_ = scene;
  if (scene_.tool < scene_.coupling_bounds.size()) {
    scene_.coupling_bounds[scene_.tool] = haptics::coupling_bounds_in_world(device_bounds_, scene_.workspace);
  }
  is_usable_ = scene.generation != 0 && can_render(scene);
  if (news.is_entered) has_state_ = false;
  return news;
}

// Returns the age of the newest state: time since its reception plus the age that it had when the server sent it. If
// the world has halted, the server repeats its last state. Because of the second term, such a state still becomes
// stale.
Duration SceneInbox::state_age(LocalTime now) const noexcept {
  constexpr Duration kLongest = std::chrono::hours(1);
  if (!has_state_) return Duration{-1};
  const ReceivedUpdate& newest = mailboxes_.inbox.front();
  const Duration kept_back = newest.update.sent - newest.update.stepped;
  return std::max(Duration{0}, now - newest.received) + std::clamp(kept_back, Duration{0}, kLongest);
}

}  // namespace tandem::client
