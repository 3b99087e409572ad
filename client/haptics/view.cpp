#include "client/haptics/view.hpp"

#include <algorithm>

#include "client/model/local_model.hpp"

namespace tandem::client {
namespace {

/// Time without a received state of a user after which this user counts as having left and is not drawn.
constexpr Duration kUserKept = std::chrono::seconds(1);

/// Replaces the entry with the same id, or appends it if there is capacity. Returns the index of the entry, or the
/// number of entries if there is no capacity.
template <class States, class State>
std::size_t keep(States& states, const State& received) noexcept {
  const auto known = std::ranges::find(states, received.id, &State::id);
  const auto index = static_cast<std::size_t>(known - states.begin());
  if (known != states.end()) {
    *known = received;
  } else if (states.size() < states.capacity()) {
    states.push_back(received);
  }
  return index;
}

}  // namespace

void ViewFeed::reset() noexcept {
  next_.received_bodies.clear();
  next_.users.clear();
  user_states_at_.clear();
}

// An update need not contain every body and user. For a missing one, the last state is kept.
void ViewFeed::receive(const proto::ServerUpdate& update) noexcept {
  for (const proto::BodyState& body : update.bodies) keep(next_.received_bodies, body);
  for (const proto::OtherUserState& user : update.users) {
    const std::size_t index = keep(next_.users, user);
    user_states_at_.resize(next_.users.size());
    if (index < user_states_at_.size()) user_states_at_[index] = update.stepped;
  }
  forget_users(update.stepped);
}

void ViewFeed::forget_users(ServerTime now) noexcept {
  for (std::size_t i = next_.users.size(); i-- > 0;) {
    if (now - user_states_at_[i] <= kUserKept) continue;
    next_.users.erase(next_.users.begin() + static_cast<std::ptrdiff_t>(i));
    user_states_at_.erase(user_states_at_.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

void ViewFeed::write(const TickRecord& record, const WorkspaceMapping& workspace, const ReceivedUpdate* newest,
                     const LocalModel* model) noexcept {
  View& view = mailbox_.back();
  view = next_;
  view.record = record;
  view.workspace = workspace;
  view.has_state = newest != nullptr;
  if (newest != nullptr) view.newest = *newest;
  view.bodies = view.received_bodies;
  view.loop_delay = Duration{0};
  view.residual_on_hand_W = Wrench{};
  view.contacts_W.clear();
  if (model != nullptr && model->has_started()) {
    view.loop_delay = model->loop_delay();
    view.residual_on_hand_W = model->newest_residual();
    for (proto::BodyState& body : view.bodies) body.state = model->body(body.id);
    view.contacts_W.resize(view.contacts_W.capacity());
    view.contacts_W.resize(model->contact_points_W({view.contacts_W.data(), view.contacts_W.size()}));
    for (proto::OtherUserState& user : view.users) user.tool = model->partner_tool(user.id, user.tool);
  }
  mailbox_.publish();
}

const View* ViewFeed::newest() noexcept {
  has_view_ = mailbox_.poll() || has_view_;
  return has_view_ ? &mailbox_.front() : nullptr;
}

}  // namespace tandem::client
