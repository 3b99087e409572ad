// Keeps poses of two molecules for the users of a room, as lists and as structure files, and brings the molecules back
// to them.
//
//   room threads ──mailbox each──▶ keeper's thread: slices of work, next for the room served least (fair_turns.hpp)
//   io ──ring per room: requests─▶   │                energies, files, rest poses of the molecules (pose_site.hpp)
//      ◀──ring: answers, and placings of the second molecule─┘
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

/// Serves rooms whose scenes have exactly two molecules with at most kMaxPairsToKeep pairs of atoms; ignores others.
///
/// Model   The second molecule is moved, or the first if the second is static. Poses are kept in `folder`
///         (kept_pose_files.hpp), where a later server of the same room and scene reads them again. Undo returns to the
///         last rest pose or to the pose before a jump. A rest pose is held for kRests_s, farther than
///         kElsewhere_angstrom from the one before. Redo goes forward again until the molecule is moved. Each accepted
///         request gets one answer, at the latest by refuse_unanswered()
class PoseKeeper final : public RoomService {
 public:
  /// In      folder  empty: nothing is written
  ///         rooms   not stepping yet
  ///         unix_ms  milliseconds since 1970
  PoseKeeper(std::filesystem::path folder, const std::vector<std::unique_ptr<Room>>& rooms,
             std::function<std::uint64_t()> unix_ms);
  ~PoseKeeper() override;
  PoseKeeper(const PoseKeeper&) = delete;
  PoseKeeper& operator=(const PoseKeeper&) = delete;

  /// Calls work() on a thread of its own from now on.
  void start();
  /// Serves all pending requests.
  void work();
  /// Serves one slice. Returns false when nothing can be served now.
  bool work_slice();
  /// Drops open requests without serving them; begin_stop() and deliver() refuse them before.
  void finish() override;

  // io
  bool has_molecules(const Room& room) const;
  /// The pose of the files and the poses kept by users, by number.
  const std::vector<wire::KeptPose>& kept(const Room& room) const;
  /// Accepts a request of any kind except CANCEL.
  /// Out     empty, or the reason for the refusal as text for users
  std::string submit(const Room& room, UserId user, const std::string& user_name, std::uint32_t request,
                     const wire::AskPose& message);
  /// Cancels pending and running minimisations of the room, of one user or of all.
  /// In      why  literal that answers those requests
  /// Out     false: there is none
  bool cancel(const Room& room, std::optional<UserId> user, const char* why);
  /// Drops a departed user's requests that would move the molecules.
  void forget(const Room& room, UserId user);
  /// From now on refuses all open requests, within a slice of work.
  void begin_stop();
  /// Number of requests without an answer.
  std::size_t unanswered() const;
  /// Drops all unanswered requests: deliver() brings no answer to them any more.
  void refuse_unanswered(const std::function<void(const Room& room, UserId user, std::uint32_t request)>& on_refused);
  /// Delivers the answers. kept_pose, pose_deleted, pose_taken and pose_progress go to all users of the room, an error
  /// to the user of the request. All but pose_progress carry that request's number. `placing`, for answers that move
  /// molecules, lacks the seat. A room gets no further answers until the placing is done or on_answer() has returned
  /// false.
  void deliver(const std::function<bool(const Room& room, UserId user, const wire::ServerControl& answer,
                                        const RoomCommand* placing)>& on_answer);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::server
