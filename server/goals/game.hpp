// The game of a room. It determines which level is played, which goals are reached, the score and the time. The room
// calls it once in each step, after the step of the world.
//
//   World ──states──▶ conditions ──▶ goals ──▶ level ──▶ score, events ──▶ io thread: GameStatus, GameNews
//     ▲                                          │
//     └── bodies of the level, gravity, coupling ┘
#pragma once

#include <array>
#include <boost/container/static_vector.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "common/base/ids.hpp"
#include "common/physics/world.hpp"
#include "common/realtime/mailbox.hpp"
#include "common/realtime/ring.hpp"
#include "proto/state.hpp"
#include "server/goals/game_plan.hpp"
#include "server/goals/signals.hpp"
#include "server/goals/silhouette_fit.hpp"

namespace tandem::server {

enum class GamePhase : std::uint8_t { kWaiting, kPlaying, kWon, kLost };
enum class GoalStatus : std::uint8_t { kWaiting, kOpen, kReached, kFailed };

/// Progress of a goal. Times are numbers of steps in which the clock of the game ran.
struct GoalProgress {
  GoalStatus status = GoalStatus::kWaiting;
  std::uint8_t satisfied = 0;    ///< number of conditions that hold
  std::uint64_t steps = 0;       ///< steps since the goal was opened
  std::uint64_t held_steps = 0;  ///< consecutive steps in which enough conditions have held
};

/// State that a game needs to continue and that is sent to users.
struct GameStatus {
  GamePhase phase = GamePhase::kWaiting;
  std::uint8_t level = 0;
  double score = 0;        ///< score of the earlier levels
  double level_score = 0;  ///< score of this attempt at the level
  std::uint64_t steps = 0;
  std::uint64_t level_steps = 0;
  boost::container::static_vector<GoalProgress, kMaxGoalsPerLevel> goals;  ///< of the level
  bool is_weightless = false;                                              ///< a user has switched gravity off
  std::uint64_t absent = 0;                                                ///< bit i: body i does not exist
  std::uint64_t events_hash = 0;                                           ///< hash of all events so far
  SignalStatuses signals;                                                  ///< parallel to the signals of the plan
  bool has_called = false;                                                 ///< the call of this game was made
  Step step;                                                               ///< last step of the room
  std::uint32_t entries = 0;  ///< number of levels that were entered; not part of checkpoints

  double total() const noexcept { return score + level_score; }
};

struct GameEvent {
  enum class Kind : std::uint8_t {
    kStarted,
    kGoalReached,
    kGoalFailed,
    kLevelStarted,
    kLevelReached,
    kLevelFailed,
    kWon,
    kLost,
    kLevelChosen,
    kCalled
  };
  Kind kind = Kind::kStarted;
  std::uint8_t level = 0;
  std::uint8_t goal = 0;
  double score = 0;
  Step step = {};
  bool by_time = false;   ///< true: a time limit caused the event
  std::uint8_t row = 0;   ///< kLevelChosen: index of the row of the decision table
  bool by_state = false;  ///< true: the limit of the time in a state of a signal caused the event
};

/// Value of a signal, as received.
struct SignalValue {
  double value = 0;
  double confidence = 0;
  std::uint32_t age_steps = 0;  ///< age of the value since its measurement [steps]
};

/// Evaluates the game of one room.
///
/// Determinism  the same states and commands give the same status and events in each step. Nothing depends on wall
///              time.
/// Bodies       a body may appear or disappear with a level. A movable body disappears when no hand touches it. All other
///              changes wait until no hand is near the body's place in the scene. No force jumps as a result.
/// Signals      a signal ages with each step, also while the clock of the game stands. In a room without users, steps
///              may be skipped, so the room discards all signals. A checkpoint contains the times spent in the states
///              of signals, but not their values, so the values are stale after a restart.
/// Thread       room: no allocation, lock or wait. The io thread reads status_mailbox() and next_event().
/// Cost         evaluates only the conditions of open goals, and at most one placement of a silhouette per step
class Game {
 public:
  /// In      scene  has a game; must outlive this
  Game(const LoadedScene& scene, GamePlan plan);

  /// Starts the game from its beginning, and removes the bodies that the first level lacks.
  /// In      hands  as for step()
  void restart(physics::World& world, std::uint32_t hands) noexcept;
  /// Continues from a stored status. Returns false, without effect, if the status does not fit this game.
  bool resume(const GameStatus& status, physics::World& world) noexcept;
  /// Starts a level; a number without a level is ignored. If the game has ended, its score and its time start at zero
  /// again.
  /// In      hands  as for step()
  void start_level(std::size_t level, physics::World& world, std::uint32_t hands) noexcept;
  /// Switches gravity off or on, in this level and the later ones.
  void set_weightless(bool is_weightless, physics::World& world) noexcept;
  /// Sets the newest value of a signal. A signal that does not exist, and a value that is not finite, are ignored.
  void set_signal(std::size_t signal, const SignalValue& value) noexcept;
  /// Discards the values of all signals.
  void forget_signals() noexcept;
  /// Begins a step of the room, before its commands: the events of the last step are discarded.
  void begin_step(Step step) noexcept;
  /// Evaluates the step of the last begin_step(), after the world's step.
  /// In      hands  bit i: tool i has a user
  void step(physics::World& world, std::uint32_t hands) noexcept;

  const GameStatus& status() const noexcept { return status_; }
  bool is_absent(BodyId body) const noexcept { return (status_.absent >> (body.value - 1) & 1U) != 0; }
  /// Events since the last begin_step().
  std::span<const GameEvent> events() const noexcept { return events_; }
  const GamePlan& plan() const noexcept { return plan_; }

  /// Status for users: published when it changes, and ten times a second while the clock runs.
  realtime::Mailbox<GameStatus>& status_mailbox() noexcept { return published_; }
  bool next_event(GameEvent& event) { return news_.pop(event); }
  /// Returns the number of events that were lost because 256 events waited for next_event().
  /// Thread  room
  std::uint64_t events_lost() const noexcept { return events_lost_; }

 private:
  const PlannedLevel& level() const noexcept { return plan_.levels[status_.level]; }
  void enter(std::size_t level, physics::World& world, std::uint32_t hands) noexcept;
  void apply_level(physics::World& world) noexcept;
  void read_absent(const physics::World& world) noexcept;
  void return_bodies(physics::World& world, std::uint32_t hands) const noexcept;
  void exchange_bodies(physics::World& world, std::uint32_t hands) noexcept;
  bool is_near_hand(const physics::World& world, std::uint32_t hands, std::size_t body) const noexcept;
  void read_bodies(const physics::World& world, std::uint32_t hands) noexcept;
  bool holds(const PlannedCondition& condition) const noexcept;
  void evaluate(std::size_t goal) noexcept;
  void advance_fits() noexcept;
  void interrupt_conditions() noexcept;
  void reach(std::size_t goal) noexcept;
  void end_level(physics::World& world, std::uint32_t hands) noexcept;
  void end_round(bool is_reached, physics::World& world, std::uint32_t hands) noexcept;
  void enter_within_limits(std::size_t level, physics::World& world, std::uint32_t hands) noexcept;
  void check_limits() noexcept;
  void finish(GameEvent::Kind kind, GameEvent event) noexcept;
  void emit(GameEvent::Kind kind, GameEvent event = {}) noexcept;
  void publish() noexcept;

  const LoadedScene& scene_;
  GamePlan plan_;
  std::uint64_t min_round_steps_ = 0;  ///< shortest time of a level with a decision table
  /// Bit i: body i may return to its start; false for a body that a tool holds at the start.
  std::uint64_t returnable_ = 0;
  GameStatus status_;
  GameStatus shown_;                 ///< last published status
  std::vector<SilhouetteFit> fits_;  ///< one for each silhouette of the plan
  std::array<RigidState, proto::kMaxBodies> states_;
  std::array<std::uint8_t, proto::kMaxBodies> holders_{};
  std::array<double, proto::kMaxUsers> tool_radius_m_{};
  boost::container::static_vector<GameEvent, 4 * kMaxGoalsPerLevel> events_;
  realtime::Mailbox<GameStatus> published_;
  realtime::Ring<GameEvent> news_{256};
  std::uint64_t events_lost_ = 0;
};

/// Returns whether two statuses are equal, apart from their times.
bool is_same_but_time(const GameStatus& a, const GameStatus& b) noexcept;

/// Returns a hash of the data of a status that checkpoints contain, for recordings.
std::uint32_t hash_of(const GameStatus& status) noexcept;

}  // namespace tandem::server
