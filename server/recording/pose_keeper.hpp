// Poses of two molecules that the users of a room keep, go back to, and find again: in lists, and as structure files.
//
//   room threads ──mailbox each──▶ keeper's thread: one slice of work after the other, for the room that had least (fair_turns.hpp)
//   io ──ring a room: requests──▶    │                  energies, files, where the molecules rested (pose_site.hpp)
//      ◀──ring: answers, and where the room is to place the second molecule──┘
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/recording/pose_site.hpp"
#include "server/room/server_rooms.hpp"

namespace tandem::server {

/// For rooms whose scenes have exactly two molecules, of kMaxPairsToKeep pairs of atoms at most; for others it does nothing.
///
/// Model   The second molecule is put elsewhere, or where it is static the first. Kept in `folder` (kept_pose_files.hpp),
///         where a later server of the same room and scene reads them again. Undo goes back to where the second molecule last
///         rested, for kRests_s and farther than kElsewhere_angstrom from before, or was before it was sent elsewhere; redo
///         goes forward again, until it is moved on. Each request that was taken gets one answer, at the latest by
///         refuse_unanswered()
class PoseKeeper final : public RoomService {
 public:
  /// In      folder  empty: nothing is written
  ///         rooms   that do not step yet
  ///         unix_ms  milliseconds since 1970
  PoseKeeper(std::filesystem::path folder, const std::vector<std::unique_ptr<Room>>& rooms,
             std::function<std::uint64_t()> unix_ms);
  ~PoseKeeper() override;
  PoseKeeper(const PoseKeeper&) = delete;
  PoseKeeper& operator=(const PoseKeeper&) = delete;

  /// Calls work() on a thread of its own from now on.
  void start();
  /// Serves all requests that can be served.
  void work();
  /// Part of that: one slice. False: nothing can be served now.
  bool work_slice();
  /// Requests that are still open are dropped, not served: begin_stop() and deliver() refuse them before.
  void finish() override;

  // io
  bool has_molecules(const Room& room) const;
  /// The file's own pose, and those that users kept, by their numbers.
  const std::vector<wire::KeptPose>& kept(const Room& room) const;
  /// Takes a request, of any kind but CANCEL.
  /// Out     empty; else why it is refused, for people
  std::string ask(const Room& room, UserId user, const std::string& user_name, std::uint32_t request,
                  const wire::AskPose& asked);
  /// Ends minimisations of the room that were asked for and are not over: of that user, or without one of all.
  /// In      why  a literal, which answers those requests
  /// Out     false: there are none
  bool cancel(const Room& room, std::optional<UserId> user, const char* why);
  /// The user has left: the requests are dropped that are to bring the molecules elsewhere.
  void forget(const Room& room, UserId user);
  /// From now on all that is open is refused, within a slice of work.
  void begin_stop();
  /// Requests without an answer.
  std::size_t unanswered() const;
  /// Gives each of them up: deliver() brings no answer to them any more.
  void refuse_unanswered(const std::function<void(const Room& room, UserId user, std::uint32_t request)>& on_refused);
  /// Answers: a kept_pose, a pose_deleted, a pose_taken and a pose_progress are for all users of the room, an error for the user
  /// who asked, all but pose_progress with that request's number. `placing`, where the molecules are to be put elsewhere, lacks
  /// the seat; until the room was sent it, or on_answer() returned false because it cannot be, nothing more is answered of that
  /// room.
  void deliver(const std::function<bool(const Room& room, UserId user, const wire::ServerControl& answer,
                                        const RoomCommand* placing)>& on_answer);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::server
