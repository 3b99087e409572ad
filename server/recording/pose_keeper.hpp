// Poses of two molecules that the users of a room keep, go back to, and find again: in lists, and as structure files.
//
//   room thread ──mailbox──▶ keeper thread: energies, contacts, files; where the molecules rested
//   io ──ring: what users ask──▶    │
//      ◀──ring: what they are told, and where the room is to put the second molecule──┘
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "server/recording/kept_pose_files.hpp"
#include "server/room/room.hpp"
#include "tandem/control.pb.h"

namespace tandem::server {

/// Of rooms whose scenes have exactly two molecules, of 300 million pairs of atoms at most; of others it does nothing.
///
/// Model   The second molecule is put elsewhere, or where it is static the first. Kept in `folder` (kept_pose_files.hpp),
///         where a later server of the same room and scene reads them again. Undo goes back to where the second molecule last
///         rested, for kRests_s and farther than kElsewhere_angstrom from before, or was before it was sent elsewhere; redo
///         goes forward again, until it is moved on
class PoseKeeper {
 public:
  /// In      folder  empty: nothing is written
  ///         rooms   that do not step yet, and are there as long as they step
  ///         unix_ms  milliseconds since 1970
  PoseKeeper(std::filesystem::path folder, const std::vector<std::unique_ptr<Room>>& rooms,
             std::function<std::uint64_t()> unix_ms);
  /// Waits for the thread.
  ~PoseKeeper();
  PoseKeeper(const PoseKeeper&) = delete;
  PoseKeeper& operator=(const PoseKeeper&) = delete;

  /// Calls work() on a thread of its own from now on.
  void start();
  /// Serves what was asked.
  void work();

  // io
  bool has_molecules(const Room& room) const;
  /// The file's own pose, and those that users kept.
  const std::vector<wire::KeptPose>& kept(const Room& room) const;
  /// False: too much waits.
  bool ask(const Room& room, UserId user, const std::string& user_name, std::uint32_t request,
           const wire::AskPose& asked);
  /// What has become of it: a kept_pose and a pose_taken are for all users of the room, an error for who asked, all with
  /// his request; `placing`, where the molecules are to be put elsewhere, lacks the seat, and until the room was told it, or
  /// on_answer() returned false because it cannot be, nothing more is answered of that room.
  void deliver(const std::function<bool(const Room& room, UserId user, const wire::ServerControl& answer,
                                        const RoomCommand* placing)>& on_answer);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::server
