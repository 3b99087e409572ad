// Saved poses, rest poses and unanswered requests of one room with two molecules.
//
//   room thread: on_command(), on_step() ──mailbox──▶ pose thread: watch(), serve_slice()
//   io thread: requests ──ring──▶                           └─▶ answers (PoseKeeper passes them to the io thread)
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/realtime/mailbox.hpp"
#include "common/realtime/ring.hpp"
#include "server/assets/pose_minimiser.hpp"
#include "server/docking/kept_poses.hpp"
#include "server/docking/molecule_pair.hpp"
#include "server/docking/pose_trail.hpp"
#include "server/room/room.hpp"

namespace tandem::server {

// Limits on unanswered pose requests (WIRE.md). For limits on their rate, see session/limits.hpp.
inline constexpr std::size_t kMaxPoseRequestsOfUser = 4, kMaxPoseRequestsOfRoom = 32;

/// Maximum number of atom pairs of a scene whose poses can be saved. The energy of a saved pose is summed over all
/// pairs in double precision, which would take too long for more pairs.
inline constexpr std::size_t kMaxPairsToKeep = 300'000'000;

struct PoseRequest {
  std::uint64_t id = 0;  ///< unique within a PoseKeeper
  UserId user;
  std::string user_name;
  std::uint32_t number = 0;  ///< request number on the wire
  wire::AskPose message;
  /// Reason for the cancellation, a string literal set by the io thread; null if the request is not cancelled.
  std::shared_ptr<std::atomic<const char*>> cancelled;
};

class PoseSite;

struct PoseAnswer {
  PoseSite* site = nullptr;
  std::uint64_t id = 0;  ///< id of the answered request; 0 for a progress report of a minimisation
  UserId user;
  wire::ServerControl message;
  std::optional<RoomCommand> placing;  ///< command that moves a molecule; the receiver fills in RoomCommand::seat
};

class PoseSite final : public RoomWatcher {
 public:
  /// In      folder  root folder of the saved poses of all rooms; if empty, no file is written
  ///         first, second  indices of the bodies that represent the molecules
  PoseSite(const Room& of, const std::filesystem::path& folder, std::size_t first, std::size_t second);
  PoseSite(const PoseSite&) = delete;
  PoseSite& operator=(const PoseSite&) = delete;

  // Functions for the room thread.
  void on_command(const RoomCommand& command) noexcept override;
  void on_input(std::size_t /*seat*/, const proto::ClientUpdate& /*input*/) noexcept override {}
  void on_step(const Room& of, ServerTime now, TickFaults faults) noexcept override;

  // Functions for the pose thread.
  /// Reads the newest poses of the molecules, and detects rest poses.
  void watch();
  /// Returns whether there is work for serve_slice(). A command that moves a molecule may be pending. A new request
  /// refers to the pose after that command, and so waits for it. A request that has begun continues meanwhile.
  bool has_work();
  /// Does one slice of work on a request; requires has_work(). When the request is completed, its answer is appended to
  /// `answers`; for a minimisation, progress reports are appended as well.
  ///
  /// Model   Slices of a minimisation alternate with slices of other requests. A request that moves the molecules ends
  ///         the minimisation.
  /// Out     work done, in pairs of atoms; at most about kMaxPairsInSlice
  std::uint64_t serve_slice(std::uint64_t unix_ms, std::deque<PoseAnswer>& answers);
  /// Refuses every open request with the text `why`.
  void refuse_all(const std::string& why, std::deque<PoseAnswer>& answers);

  // Members for the io thread.
  const Room* const room;
  std::vector<PoseRequest> unanswered;  ///< copies of the requests whose answers have not been delivered
  /// Pose number 0 and the saved poses, up to date with the answers delivered so far.
  std::vector<wire::KeptPose> kept;
  realtime::Ring<PoseRequest> requests{2 * kMaxPoseRequestsOfRoom};
  /// Reports that the last command that moves a molecule was not posted to the room, so that the pose thread does not
  /// wait for it.
  void refuse_placing() { is_refused_ = true; }

 private:
  /// Poses of both bodies after a step, and the number of kPlace commands that the room had executed until that step.
  struct Sample {
    Pose X_WA, X_WB;
    Step step;
    std::uint64_t placings = 0;
  };
  /// Evaluation of the energy of a pose that is to be saved.
  struct Keeping {
    PoseRequest request;
    PoseEnergy energy;
  };
  struct Minimisation {
    PoseRequest request;
    PoseMinimiser minimiser;
    std::size_t steps = 0, max_steps = 0;
    std::uint64_t reported_ms = 0;  ///< time of the last progress report [ms since 1970]
  };

  std::uint64_t begin(PoseRequest request, std::uint64_t unix_ms, std::deque<PoseAnswer>& answers);
  PoseAnswer navigate(const PoseRequest& request);
  PoseAnswer delete_pose(const PoseRequest& request);
  PoseAnswer rename_pose(const PoseRequest& request);
  void begin_minimising(PoseRequest request, std::uint64_t unix_ms, std::deque<PoseAnswer>& answers);
  std::uint64_t minimise_slice(std::uint64_t unix_ms, std::deque<PoseAnswer>& answers);
  void end_minimising(const std::string& why, std::deque<PoseAnswer>& answers);
  PoseAnswer progress(bool is_over);
  std::uint64_t keep_slice(std::uint64_t unix_ms, std::deque<PoseAnswer>& answers);
  PoseAnswer keep(const Keeping& keeping, std::uint64_t unix_ms);

  PoseAnswer answer_to(const PoseRequest& request);
  PoseAnswer refusal(const PoseRequest& request, wire::ErrorCode code, const std::string& text);
  PoseAnswer place(const Pose& X_AB, const std::string& text, const PoseRequest& request);

  const MoleculePair pair_;

  /// Number of executed kPlace commands, now and at the last publication. For the room thread only.
  std::uint64_t placings_ = 0, placings_published_ = 0;
  realtime::Mailbox<Sample> samples_;
  std::atomic<bool> is_refused_{false};

  // Members for the pose thread only.
  KeptPoses kept_poses_;
  PoseTrail trail_;
  std::deque<PoseRequest> waiting_;
  std::optional<Keeping> keeping_;
  std::optional<Minimisation> minimising_;
  bool was_minimising_ = false;  ///< whether the last slice of work belonged to the minimisation
};

}  // namespace tandem::server
