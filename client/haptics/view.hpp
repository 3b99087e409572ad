// Data for a window. The haptic thread sends them through a mailbox that keeps only the newest value, so a stalled
// window does not delay the haptic loop.
//
//   haptic thread  receive() each new state, write() every kViewEvery ticks ──▶ mailbox ──▶ window thread  newest()
#pragma once

#include <array>
#include <boost/container/static_vector.hpp>
#include <cstdint>

#include "client/exchange/mailboxes.hpp"
#include "client/haptics/tick_record.hpp"
#include "common/realtime/mailbox.hpp"

namespace tandem::client {

class LocalModel;

/// Data of one haptic tick for a window.
struct View {
  TickRecord record;           ///< record of the tick: handle, both tools, forces and faults
  WorkspaceMapping workspace;  ///< mapping of the scene with the generation record.scene_generation
  bool has_state = false;      ///< true: a server state was received, so the fields below are valid
  ReceivedUpdate newest;       ///< newest server state; it may omit bodies and users
  /// Measured delay of the local model from an input to its effect in a server state; 0 if not known
  Duration loop_delay{0};
  Wrench residual_on_hand_W;  ///< residual: the server's wrench minus the local model's for the same input
  /// Last received state of each body.
  boost::container::static_vector<proto::BodyState, proto::kMaxBodies> received_bodies;
  /// Bodies to display. Their states are those of the local model if there is one, otherwise the last received states.
  boost::container::static_vector<proto::BodyState, proto::kMaxBodies> bodies;
  /// Contact points of the local model's tool, or of the body that the tool holds. If there are more points than
  /// capacity, a spatially distributed subset of them.
  boost::container::static_vector<Vec3, 48> contacts_W;
  /// Other users, with the poses of their tools to display.
  boost::container::static_vector<proto::OtherUserState, proto::kMaxUsers> users;
};

/// Number of ticks between two views. The resulting 250 Hz is more than any window draws.
inline constexpr std::uint64_t kViewEvery = 4;

class ViewFeed {
 public:
  /// Starts a new scene: discards the received states.
  void reset() noexcept;
  /// Thread  haptic: no allocation
  void receive(const proto::ServerUpdate& update) noexcept;
  /// In      newest  newest server state; null if none was received
  ///         model   local model; null if there is none
  /// Thread  haptic: no allocation
  void write(const TickRecord& record, const WorkspaceMapping& workspace, const ReceivedUpdate* newest,
             const LocalModel* model) noexcept;

  /// Returns the newest view; null before the first. Valid until the next call.
  /// Thread  window
  const View* newest() noexcept;

 private:
  void forget_users(ServerTime now) noexcept;

  View next_;
  boost::container::static_vector<ServerTime, proto::kMaxUsers>
      user_states_at_;  ///< time of the last state of each element of next_.users
  realtime::Mailbox<View> mailbox_;
  bool has_view_ = false;  ///< true: a view was received; used by the window thread only
};

}  // namespace tandem::client
