// What a window draws, handed from the haptic thread to it: one newest-wins mailbox, so that a window that stalls costs
// the hand nothing.
//
//   haptic thread  take() each new state, write() every kViewEvery ticks ──▶ mailbox ──▶ window thread  newest()
#pragma once

#include <array>
#include <boost/container/static_vector.hpp>
#include <cstdint>

#include "client/haptics/mailboxes.hpp"
#include "client/haptics/tick_record.hpp"
#include "common/realtime/mailbox.hpp"

namespace tandem::client {

class LocalModel;

/// One haptic tick as a window draws it.
struct View {
  TickRecord record;           ///< handle, both tools, forces, faults
  WorkspaceMapping workspace;  ///< of the scene of record.scene_generation
  bool has_state = false;      ///< what follows is known
  ReceivedUpdate newest;       ///< of the server; its bodies and users may be thinned
  Duration loop_delay{0};      ///< from an input to its effect, as the local model measured it; 0: not known
  Wrench residual_on_hand_W;   ///< the server's wrench beyond the local model's for the same input, newest known
  /// As the server told of them last.
  boost::container::static_vector<proto::BodyState, proto::kMaxBodies> told_bodies;
  /// As they are felt: the local model's where there is one, else as told.
  boost::container::static_vector<proto::BodyState, proto::kMaxBodies> bodies;
  /// Where the local model's tool, or what it holds, touches; spread over them where there are more.
  boost::container::static_vector<Vec3, 48> contacts_W;
  /// Other users, with the tools that are felt.
  boost::container::static_vector<proto::OtherUserState, proto::kMaxUsers> users;
};

/// Ticks from one view to the next: 250 Hz, more than any window draws.
inline constexpr std::uint64_t kViewEvery = 4;

class ViewFeed {
 public:
  /// A new scene: what was told before is forgotten.
  void reset() noexcept;
  /// Thread  haptic: no allocation
  void take(const proto::ServerUpdate& update) noexcept;
  /// In      newest, model  null: none
  /// Thread  haptic: no allocation
  void write(const TickRecord& record, const WorkspaceMapping& workspace, const ReceivedUpdate* newest,
             const LocalModel* model) noexcept;

  /// Null before the first. Valid until the next call.
  /// Thread  window
  const View* newest() noexcept;

 private:
  void forget_users(ServerTime now) noexcept;

  View next_;
  boost::container::static_vector<ServerTime, proto::kMaxUsers> users_told_at_;  ///< as next_.users
  realtime::Mailbox<View> mailbox_;
  bool has_view_ = false;  ///< of the window
};

}  // namespace tandem::client
