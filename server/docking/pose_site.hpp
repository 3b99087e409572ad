// Kept poses, rest poses and open requests of one room with two molecules.
//
//   room thread: on_command(), on_step() ──mailbox──▶ keeper's thread: watch(), serve_slice()
//   io: requests ──ring──▶                                  └─▶ answers (PoseKeeper delivers them to io)
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
#include "server/docking/kept_pose_files.hpp"
#include "server/room/room.hpp"

namespace tandem::server {

// Limits of a user's pose requests (WIRE.md); for rates see session/limits.hpp.
inline constexpr std::size_t kMaxKeptPosesOfUser = 50;
inline constexpr std::size_t kMaxPoseRequestsOfUser = 4, kMaxPoseRequestsOfRoom = 32;

/// Pairs of atoms evaluated in one slice, which bounds the wait of other rooms.
inline constexpr std::size_t kMaxPairsInSlice = 10'000'000;
/// Larger scenes have no kept poses, because each pose is evaluated over all pairs in double precision.
inline constexpr std::size_t kMaxPairsToKeep = 300'000'000;

struct PoseRequest {
  std::uint64_t id = 0;  ///< unique in the keeper
  UserId user;
  std::string user_name;
  std::uint32_t number = 0;  ///< request number on the wire
  wire::AskPose message;
  /// Literal with the reason for dropping the request, set by io; null: it is still to be served.
  std::shared_ptr<std::atomic<const char*>> cancelled;
};

class PoseSite;

struct PoseAnswer {
  PoseSite* site = nullptr;
  std::uint64_t id = 0;  ///< id of the answered request; 0: progress of a running one
  UserId user;
  wire::ServerControl message;
  std::optional<RoomCommand> placing;
};

class PoseSite final : public RoomWatcher {
 public:
  /// In      folder  root for the poses of all rooms; empty: nothing is written
  ///         first, second  indices of the bodies with the molecules
  PoseSite(const Room& of, const std::filesystem::path& folder, std::size_t first, std::size_t second);
  ~PoseSite() override;
  PoseSite(const PoseSite&) = delete;
  PoseSite& operator=(const PoseSite&) = delete;

  // Room thread:
  void on_command(const RoomCommand& command) noexcept override;
  void on_input(std::size_t /*seat*/, const proto::ClientUpdate& /*input*/) noexcept override {}
  void on_step(const Room& of, ServerTime now, TickFaults faults) noexcept override;

  // Keeper's thread:
  /// Reads the newest poses of the molecules.
  void watch();
  /// Whether a request can be served. False while a placing is pending, because later requests refer to the pose after
  /// it. A minimisation continues meanwhile.
  bool has_work();
  /// Serves one slice of a request. Appends its answer when it is finished, or progress. Requires has_work().
  ///
  /// Model   A minimisation and other requests take turns. A request that moves the molecules ends the minimisation
  /// Out     work in pairs of atoms: at most about kMaxPairsInSlice
  std::uint64_t serve_slice(std::uint64_t unix_ms, std::deque<PoseAnswer>& answers);
  /// Refuses each open request with the reason `why`.
  void refuse_all(const std::string& why, std::deque<PoseAnswer>& answers);

  // io thread:
  const Room* const room;
  std::vector<PoseRequest> unanswered;  ///< copies of the pushed requests, until their answers are delivered
  std::vector<wire::KeptPose> kept;     ///< number 0 and the users' poses, as known to io
  realtime::Ring<PoseRequest> requests{2 * kMaxPoseRequestsOfRoom};
  /// Reports that the room did not accept the last placing.
  void refuse_placing() { is_refused_ = true; }

 private:
  /// Poses of both bodies after a step, and the number of placings the room had received before.
  struct Sample {
    Pose X_WA, X_WB;
    Step step;
    std::uint64_t placings = 0;
  };
  /// Visited poses and the current one, for undo and redo.
  struct Trail {
    std::vector<Pose> poses;
    std::size_t at = 0;
  };
  /// Energy of a pose that is to be kept, summed over atoms of the first molecule.
  struct Evaluation {
    PoseRequest request;  ///< empty for the pose of the files
    Pose X_AB;
    std::size_t atoms_done = 0;
    double lj_kj_per_mol = 0, coulomb_kj_per_mol = 0;
  };
  struct Minimisation {
    PoseRequest request;
    PoseMinimiser minimiser;
    std::size_t steps = 0, max_steps = 0;
    std::uint64_t reported_ms = 0;  ///< time of the last progress
  };

  std::uint64_t begin(PoseRequest request, std::uint64_t unix_ms, std::deque<PoseAnswer>& answers);
  PoseAnswer navigate(const PoseRequest& request);
  PoseAnswer delete_pose(const PoseRequest& request);
  PoseAnswer rename_pose(const PoseRequest& request);
  void begin_minimising(PoseRequest request, std::uint64_t unix_ms, std::deque<PoseAnswer>& answers);
  std::uint64_t minimise_slice(std::uint64_t unix_ms, std::deque<PoseAnswer>& answers);
  void end_minimising(const std::string& why, std::deque<PoseAnswer>& answers);
  PoseAnswer progress(bool is_over);
  std::string keeping_problem(const PoseRequest& request) const;
  std::uint64_t keep_slice(std::uint64_t unix_ms, std::deque<PoseAnswer>& answers);
  PoseAnswer keep(const Evaluation& evaluation, std::uint64_t unix_ms);

  PoseAnswer answer_to(const PoseRequest& request);
  PoseAnswer refusal(const PoseRequest& request, wire::ErrorCode code, const std::string& text);
  PoseAnswer place(const Pose& X_AB, const std::string& text, const PoseRequest& request);
  PoseAnswer leave_for(const Pose& X_AB, const std::string& text, const PoseRequest& request);

  Pose as_in_files() const { return {centre_b_ - centre_a_, Quat::Identity()}; }
  bool is_elsewhere() const;
  void mark(const Pose& X_AB);
  bool evaluate_slice(Evaluation& evaluation) const;
  wire::KeptPose describe(const Evaluation& evaluation) const;
  const wire::KeptPose* find(std::uint32_t number) const;
  std::string write_list(const KeptPoseList& list, const wire::KeptPose* added);

  const std::string room_name_;
  const BodyId first_, second_;
  const std::shared_ptr<const LoadedScene> scene_;
  const docking::Molecule& a_;
  const docking::Molecule& b_;
  const Vec3 centre_a_, centre_b_;
  const bool moves_first_, moves_second_;
  const Duration period_;
  std::filesystem::path folder_;

  std::uint64_t placings_ = 0, placings_published_ = 0;  ///< used by the room's thread only
  realtime::Mailbox<Sample> samples_;
  std::atomic<bool> is_refused_{false};

  // Used by the keeper's thread only.
  int lock_ = -1;
  bool is_known_ = false;  ///< the file has the list below; the lock ensures that it stays so
  bool is_placing_ = false;
  std::uint64_t placed_ = 0;  ///< placings in the newest sample
  wire::KeptPose of_files_;
  KeptPoseList list_;
  std::deque<PoseRequest> waiting_;
  std::optional<Evaluation> keeping_;
  std::optional<Minimisation> minimising_;
  bool was_minimising_ = false;  ///< whether the last slice was of the minimisation
  std::optional<Pose> placed_from_;
  std::optional<Pose> X_AB_;   ///< newest [Å]
  std::optional<Pose> still_;  ///< pose since which it has moved less than kStill_angstrom
  Step still_since_{};
  Trail trail_, before_placing_;
};

}  // namespace tandem::server
