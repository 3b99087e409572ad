// Saved poses, rest poses and open requests of one room with two molecules.
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
#include "server/docking/kept_pose_files.hpp"
#include "server/room/room.hpp"

namespace tandem::server {

// Limits on saved poses and unanswered pose requests (WIRE.md). For limits on their rate, see session/limits.hpp.
inline constexpr std::size_t kMaxKeptPosesOfUser = 50;
inline constexpr std::size_t kMaxPoseRequestsOfUser = 4, kMaxPoseRequestsOfRoom = 32;

/// Maximum number of atom pairs evaluated in one slice of work. It limits the time for which other rooms wait.
inline constexpr std::size_t kMaxPairsInSlice = 10'000'000;
/// Maximum number of atom pairs of a scene with saved poses. The energy of each saved pose is summed over all pairs in
/// double precision, which would take too long for larger scenes.
inline constexpr std::size_t kMaxPairsToKeep = 300'000'000;

struct PoseRequest {
  std::uint64_t id = 0;  ///< unique within a PoseKeeper
  UserId user;
  std::string user_name;
  std::uint32_t number = 0;  ///< request number on the wire
  wire::AskPose message;
  /// String literal with the reason for the cancellation, set by the io thread; null if the request is not cancelled.
  std::shared_ptr<std::atomic<const char*>> cancelled;
};

class PoseSite;

struct PoseAnswer {
  PoseSite* site = nullptr;
  std::uint64_t id = 0;  ///< id of the answered request; 0 for a progress report of a minimisation
  UserId user;
  wire::ServerControl message;
  std::optional<RoomCommand> placing;  ///< command to the room that moves a molecule, without the seat
};

class PoseSite final : public RoomWatcher {
 public:
  /// In      folder  root folder of the saved poses of all rooms; if empty, no file is written
  ///         first, second  indices of the bodies that represent the molecules
  PoseSite(const Room& of, const std::filesystem::path& folder, std::size_t first, std::size_t second);
  ~PoseSite() override;
  PoseSite(const PoseSite&) = delete;
  PoseSite& operator=(const PoseSite&) = delete;

  // Called on the room thread:
  void on_command(const RoomCommand& command) noexcept override;
  void on_input(std::size_t /*seat*/, const proto::ClientUpdate& /*input*/) noexcept override {}
  void on_step(const Room& of, ServerTime now, TickFaults faults) noexcept override;

  // Called on the pose thread:
  /// Reads the newest poses of the molecules, and detects rest poses.
  void watch();
  /// Returns whether there is work for serve_slice(). While a command that moves a molecule is pending, no new request
  /// is begun, because it refers to the pose after that command. Begun requests continue meanwhile.
  bool has_work();
  /// Does one slice of work on a request. Appends the answer when the request is completed, and progress reports of a
  /// minimisation. Requires has_work().
  ///
  /// Model   Slices of a minimisation alternate with slices of other requests. A request that moves the molecules ends
  ///         the minimisation.
  /// Out     work done, in pairs of atoms; at most about kMaxPairsInSlice
  std::uint64_t serve_slice(std::uint64_t unix_ms, std::deque<PoseAnswer>& answers);
  /// Refuses every open request with the text `why`.
  void refuse_all(const std::string& why, std::deque<PoseAnswer>& answers);

  // Used by the io thread:
  const Room* const room;
  std::vector<PoseRequest> unanswered;  ///< copies of the requests whose answers have not been delivered yet
  std::vector<wire::KeptPose> kept;     ///< pose number 0 and the saved poses, according to the delivered answers
  realtime::Ring<PoseRequest> requests{2 * kMaxPoseRequestsOfRoom};
  /// Reports that the last command that moves a molecule was not passed to the room.
  void refuse_placing() { is_refused_ = true; }

 private:
  /// Poses of both bodies after a step, and the number of kPlace commands that the room had executed until then.
  struct Sample {
    Pose X_WA, X_WB;
    Step step;
    std::uint64_t placings = 0;
  };
  /// History of poses for undo and redo; `at` is the index of the current one.
  struct Trail {
    std::vector<Pose> poses;
    std::size_t at = 0;
  };
  /// State of the energy evaluation of a pose that is to be saved. It is summed over the atoms of the first molecule.
  struct Evaluation {
    PoseRequest request;  ///< empty for the pose in the structure files
    Pose X_AB;
    std::size_t atoms_done = 0;
    double lj_kj_per_mol = 0, coulomb_kj_per_mol = 0;
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

  /// Number of executed kPlace commands, now and at the last publication; used by the room thread only.
  std::uint64_t placings_ = 0, placings_published_ = 0;
  realtime::Mailbox<Sample> samples_;
  std::atomic<bool> is_refused_{false};

  // Used by the pose thread only.
  int lock_ = -1;  ///< descriptor of the lock file; -1 if it is not open
  /// Whether poses.json was found to list the poses of list_. From then on, the held lock prevents other servers from
  /// changing the file.
  bool is_known_ = false;
  bool is_placing_ = false;   ///< whether a command that moves a molecule is pending
  std::uint64_t placed_ = 0;  ///< Sample::placings of the last accepted sample
  wire::KeptPose of_files_;
  KeptPoseList list_;
  std::deque<PoseRequest> waiting_;
  std::optional<Evaluation> keeping_;
  std::optional<Minimisation> minimising_;
  bool was_minimising_ = false;  ///< whether the last slice belonged to the minimisation
  std::optional<Pose> placed_from_;
  std::optional<Pose> X_AB_;   ///< newest pose of the second molecule in the frame of the first [Å]
  std::optional<Pose> still_;  ///< since still_since_ the molecule has moved by less than kStill_angstrom from it
  Step still_since_{};
  Trail trail_, before_placing_;
};

}  // namespace tandem::server
