// Saved poses of two molecules. On request of a user, the relative pose of the molecules is saved, or the molecules are
// moved back to a saved or earlier pose. Saved poses are stored as a list and as structure files.
//
//   room threads ──poses (one mailbox each)─────────────────────────────▶ pose thread
//   io thread    ──requests (one ring per room)─────────────────────────▶ pose thread
//   io thread    ◀──answers, commands that move a molecule (one ring)──── pose thread
//
// The pose thread computes energies, writes files and detects rest poses of the molecules (pose_site.hpp). It does a
// slice of work for each room in turn (fair_turns.hpp).
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/docking/pose_site.hpp"
#include "server/room/server_rooms.hpp"

namespace tandem::server {

/// Serves rooms whose scenes have exactly two molecules, with at most kMaxPairsToKeep pairs of atoms. Ignores other
/// rooms.
///
/// Model   1. Requests move the second molecule, or the first if the second is static.
///         2. Poses are saved in `folder` (kept_pose_files.hpp). The next server with the same room and scene reads
///            them.
///         3. A pose of the molecule enters the history for undo as a rest pose under two conditions: the molecule
///            stays there for kRests_s, and the pose is farther than kElsewhere_angstrom from the previous rest pose
///            (pose_trail.hpp).
///         4. Undo returns to the previous rest pose, or to the pose before the last move by a request. Redo reverses
///            undo, until a user moves the molecule by hand.
///         5. Each accepted request gets one answer, at the latest in refuse_unanswered().
class PoseKeeper final : public RoomService {
 public:
  /// In      folder  root folder of the saved poses; if empty, no file is written
  ///         rooms   must not step before the constructor returns
  ///         unix_ms  returns the current time [ms since 1970]
  PoseKeeper(std::filesystem::path folder, const std::vector<std::unique_ptr<Room>>& rooms,
             std::function<std::uint64_t()> unix_ms);
  ~PoseKeeper() override;
  PoseKeeper(const PoseKeeper&) = delete;
  PoseKeeper& operator=(const PoseKeeper&) = delete;

  /// Starts the pose thread, which calls work() periodically. If the thread is not started, the caller must call
  /// work().
  void start();
  /// Does slices of work on all pending requests until nothing more can be done.
  void work();
  /// Does one slice of work. Returns false if there is none to do now.
  bool work_slice();
  /// Ends the thread and discards unanswered requests. To answer them first, call begin_stop() and then deliver().
  void finish() override;

  // The following functions are called on the io thread.
  bool has_molecules(const Room& room) const;
  /// Saved poses, sorted by number. Number 0 is the pose in the structure files from which the scene was loaded.
  const std::vector<wire::KeptPose>& kept(const Room& room) const;
  /// Queues a request of any kind except CANCEL, which is handled by cancel().
  /// Out     empty if the request is accepted, otherwise the reason for the refusal, as text for users
  std::string submit(const Room& room, UserId user, const std::string& user_name, std::uint32_t request,
                     const wire::AskPose& message);
  /// Cancels minimisations that are queued or running.
  /// In      user  user of the room who has requested them; none: those of all users
  ///         why  reason, as a string literal; it is the text of the refusals
  /// Out     false if there is no such minimisation
  bool cancel(const Room& room, std::optional<UserId> user, const char* why);
  /// Cancels all requests of a user who has left the room, except those that change the list of poses.
  void forget(const Room& room, UserId user);
  /// Refuses all unanswered and all later requests. A slice of work that has begun is completed first.
  void begin_stop();
  /// Number of requests without an answer.
  std::size_t unanswered() const;
  /// Calls on_refused() for each unanswered request and removes the request. A later deliver() discards answers to
  /// these requests. Changes that these requests have made to the list of poses remain, and kept() includes them.
  void refuse_unanswered(const std::function<void(const Room& room, UserId user, std::uint32_t request)>& on_refused);
  /// Calls on_answer() for each available answer. An error goes to the user who made the request, any other answer to
  /// all users of the room. All answers except pose_progress contain the number of their request.
  ///
  /// In      on_answer  sends an answer. If `placing` is not null, the answer contains a command that moves a molecule.
  ///                    on_answer then also sets the seat of the command and posts it to the room, or returns false if
  ///                    that fails. The room's next request begins only after the command has been executed or has
  ///                    failed.
  void deliver(const std::function<bool(const Room& room, UserId user, const wire::ServerControl& answer,
                                        const RoomCommand* placing)>& on_answer);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::server
