#include "lab/therapy/recorded_hand.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>

#include "lab/report/format.hpp"
#include "proto/recording/exact_state.hpp"
#include "proto/recording/recorded_files.hpp"
#include "proto/recording/schema.hpp"
#include "tandem/recording.pb.h"

namespace tandem::lab {
namespace {

constexpr std::size_t kMaxToolSamples = 2'000'000;
constexpr std::size_t kMaxNameWidth = 64;
constexpr std::size_t kMaxUsersListed = 16;
/// Largest accepted deviation of a sample's converted time stamp from its time of arrival. A larger deviation means
/// that the client's clock was set. In this case the offset of the clock is measured again.
constexpr double kMaxClockStep_s = 0.5;
constexpr double kMaxForce_n = 1e6;
constexpr double kMaxScore = 1e12;

std::string clean(const std::string& name) {
  return shortened(printable(name), kMaxNameWidth);
}

double seconds_between(std::uint64_t from_ns, std::uint64_t to_ns) {
  const bool is_later = to_ns >= from_ns;
  const double magnitude = static_cast<double>(is_later ? to_ns - from_ns : from_ns - to_ns) * 1e-9;
  return is_later ? magnitude : -magnitude;
}

/// Converts the time stamps of a client's samples to the time of the recording. Time stamps are preferred to times of
/// arrival, because they contain no network jitter. The offset between the two clocks is measured at the first sample.
/// A sample without a usable time stamp gets its time of arrival.
class SampleTime {
 public:
  double at_s(double arrival_s, std::uint64_t sent_ns) {
    const double sent_s = static_cast<double>(sent_ns) * 1e-9;
    const double mapped_s = sent_s + offset_s_;
    if (has_offset_ && sent_ns > sent_ns_ && std::abs(mapped_s - arrival_s) <= kMaxClockStep_s) {
      sent_ns_ = sent_ns;
      return mapped_s;
    }
    has_offset_ = sent_ns != 0;
    sent_ns_ = sent_ns;
    offset_s_ = arrival_s - sent_s;
    return arrival_s;
  }

 private:
  bool has_offset_ = false;
  std::uint64_t sent_ns_ = 0;
  double offset_s_ = 0;
};

/// Collects the levels and goals of a game from its recorded events.
class GameLog {
 public:
  /// In      room  must outlive this object; it may be filled after the construction
  explicit GameLog(const wire::RecordedRoom& room) : room_(room) {}

  void add(const wire::GameEvent& event, std::uint64_t at_ns) {
    using Event = wire::GameEvent;
    has_game_ = true;
    const double before = score_;
    set_score(event.score());
    switch (event.kind()) {
      case Event::LEVEL_STARTED:
        close_level(PartOutcome::kOpen, at_ns);
        open_level(event.level(), at_ns);
        break;
      case Event::GOAL_REACHED:
      case Event::GOAL_FAILED:
        if (!level_) open_level(event.level(), at_ns);
        append({PartKind::kGoal, event.kind() == Event::GOAL_REACHED ? PartOutcome::kReached : PartOutcome::kFailed,
                goal_name(event), goal_begin_ns_, at_ns, score_ - before});
        if (is_in_order(event.level())) goal_begin_ns_ = at_ns;
        break;
      case Event::LEVEL_REACHED:
        close_level(PartOutcome::kReached, at_ns);
        break;
      case Event::LEVEL_FAILED:
        close_level(PartOutcome::kFailed, at_ns);
        break;
      case Event::WON:
        outcome_ = PartOutcome::kReached;
        break;
      case Event::LOST:
        close_level(PartOutcome::kFailed, at_ns);
        outcome_ = PartOutcome::kFailed;
        break;
      case Event::STARTED:
        outcome_ = PartOutcome::kOpen;
        break;
      default:  // event kind of a later version of the format
        break;
    }
  }

  /// Adds the saved state of a game with which a recording may begin. If the room has resumed a game, a level is
  /// already running before the first recorded event.
  void add(const wire::GameCheckpoint& game, std::uint64_t at_ns) {
    has_game_ = true;
    if (level_ || !parts_.empty() || game.phase() != wire::GameState::PLAYING) return;
    set_score(game.score() + game.level_score());
    open_level(game.level(), at_ns);
  }

  /// Ends the log and moves its levels and goals to `out`, sorted by their start.
  void finish(std::uint64_t end_ns, std::uint64_t joined_ns, RecordedHand& out) {
    close_level(PartOutcome::kOpen, end_ns);
    if (!has_game_) return;
    out.game_outcome = outcome_ == PartOutcome::kNone ? PartOutcome::kOpen : outcome_;
    out.score = score_;
    for (const Part& part : parts_) {
      out.game_parts.push_back({part.kind, part.outcome, part.name, seconds_between(joined_ns, part.begin_ns),
                                seconds_between(joined_ns, part.end_ns), part.score});
    }
    std::ranges::stable_sort(out.game_parts, [](const GamePart& a, const GamePart& b) {
      return std::tie(a.begin_s, a.kind) < std::tie(b.begin_s, b.kind);
    });
  }
  bool is_too_long() const { return parts_.size() > kMaxParts; }

 private:
  struct Part {
    PartKind kind;
    PartOutcome outcome;
    std::string name;
    std::uint64_t begin_ns, end_ns;
    double score;
  };

  void set_score(double score) {
    if (std::isfinite(score) && std::abs(score) <= kMaxScore) score_ = score;
  }
  void append(Part part) {
    if (!is_too_long()) parts_.push_back(std::move(part));
  }
  void open_level(std::uint32_t level, std::uint64_t at_ns) {
    level_ = {PartKind::kLevel, PartOutcome::kOpen, level_name(level), at_ns, at_ns, score_};
    goal_begin_ns_ = at_ns;
    outcome_ = PartOutcome::kOpen;  // a level that starts after the end of a game begins a new game
  }
  void close_level(PartOutcome outcome, std::uint64_t at_ns) {
    if (!level_) return;
    level_->outcome = outcome;
    level_->end_ns = at_ns;
    level_->score = score_ - level_->score;
    append(*level_);
    level_.reset();
  }
  /// Returns the description of a level; null if the scene does not contain the level.
  const wire::Level* find_level(std::uint32_t level) const {
    const auto& levels = room_.scene().game().levels();
    return level < static_cast<std::uint32_t>(levels.size()) ? &levels[static_cast<int>(level)] : nullptr;
  }
  bool is_in_order(std::uint32_t level) const {
    const wire::Level* const found = find_level(level);
    return found != nullptr && found->in_order();
  }
  std::string level_name(std::uint32_t level) const {
    const wire::Level* const found = find_level(level);
    return found != nullptr ? clean(found->name()) : "level " + std::to_string(level + std::uint64_t{1});
  }
  std::string goal_name(const wire::GameEvent& event) const {
    const wire::Level* const level = find_level(event.level());
    const bool is_known = level != nullptr && event.goal() < static_cast<std::uint32_t>(level->goals_size());
    return is_known ? clean(level->goals(static_cast<int>(event.goal())).name())
                    : "goal " + std::to_string(event.goal() + std::uint64_t{1});
  }

  const wire::RecordedRoom& room_;
  std::vector<Part> parts_;
  /// current level, if any; until the level ends, its `score` holds the total score at the start of the level
  std::optional<Part> level_;
  std::uint64_t goal_begin_ns_ = 0;
  double score_ = 0;
  PartOutcome outcome_ = PartOutcome::kNone;
  bool has_game_ = false;
};

class HandReader {
 public:
  HandReader(const std::filesystem::path& file, const std::string& user)
      : file_(file.string()), user_(user), is_named_(!user.empty()) {}

  bool receive(const std::string& topic, const recording::Message& message) {
    if (topic == "/room" && !has_room_) {
      parse(message, room_);
      has_room_ = true;
    }
    if (!has_room_) return false;
    if (topic == "/step") read_step(message);
    if (topic == "/states") read_states(message);
    return true;
  }

  RecordedHand finish(bool is_damaged) {
    if (!has_room_) {
      throw std::invalid_argument(file_ + " is no recording of a room; name one of tandem-server --record");
    }
    require_user();
    if (sampler_.is_empty()) {
      throw std::invalid_argument(file_ + ": inputs of the user " + clean(user_) +
                                  " have no valid position of the hand; record a session with a device");
    }
    hand_.motion = sampler_.motion();
    hand_.recording = room_.recording();
    hand_.joined_ns = *joined_ns_;
    hand_.scene = clean(room_.scene().name());
    hand_.is_damaged = is_damaged;
    game_.finish(last_ns_, *joined_ns_, hand_);
    return std::move(hand_);
  }

 private:
  void read_step(const recording::Message& message) {
    parse(message, step_);
    last_ns_ = std::max(last_ns_, message.log_ns);
    for (const wire::RecordedCommand& command : step_.commands()) read_command(command, message.log_ns);
    for (const wire::RecordedInput& input : step_.inputs()) read_input(input, message.log_ns);
    for (const wire::GameEvent& event : step_.game_events()) game_.add(event, message.log_ns);
    if (game_.is_too_long()) {
      throw std::invalid_argument(file_ + ": game_events have more than " + std::to_string(kMaxParts) +
                                  " levels and goals; record sessions in files of their own");
    }
  }

  void read_command(const wire::RecordedCommand& command, std::uint64_t at_ns) {
    if (command.kind() == wire::RecordedCommand::LEAVE && seat_ == command.seat()) seat_.reset();
    if (command.kind() != wire::RecordedCommand::JOIN || command.role() == wire::ROLE_OBSERVER) return;
    if (names_.size() < kMaxUsersListed) names_.insert(clean(command.user_name()));
    if (user_.empty() && !joined_ns_) user_ = command.user_name();
    if (command.user_name() != user_) return;
    seat_ = command.seat();
    user_id_ = command.user();
    time_ = {};
    if (!joined_ns_) joined_ns_ = at_ns;
  }

  void read_input(const wire::RecordedInput& input, std::uint64_t at_ns) {
    if (!seat_ || input.seat() != *seat_ || !input.update().handle_valid()) return;
    const double arrival_s = seconds_between(*joined_ns_, at_ns);
    if (arrival_s > kMaxSession_s) {
      throw std::invalid_argument(file_ + ": the session of " + clean(user_) + " lasts more than " +
                                  format_significant(kMaxSession_s / 3600, 2) +
                                  " h; record sessions in files of their own");
    }
    const double at_s = std::max(0.0, time_.at_s(arrival_s, input.update().sent_local_ns()));
    sampler_.add(at_s, proto::read_exact(input.update().handle()).X.p);
  }

  void read_states(const recording::Message& message) {
    parse(message, states_);
    if (states_.has_game()) game_.add(states_.game(), message.log_ns);
    if (!seat_) return;
    for (const wire::RecordedTool& tool : states_.tools()) {
      if (tool.user() != user_id_) continue;
      const wire::WrenchOnHand& wrench = tool.wrench_on_hand();
      const double force_n = Vec3(wrench.fx_n(), wrench.fy_n(), wrench.fz_n()).norm();
      if (!std::isfinite(force_n) || force_n > kMaxForce_n) continue;
      if (hand_.tool_samples.size() == kMaxToolSamples) {
        throw std::invalid_argument(file_ + ": /states has more than " + std::to_string(kMaxToolSamples) +
                                    " states of the user; record sessions in files of their own");
      }
      hand_.tool_samples.push_back({seconds_between(*joined_ns_, message.log_ns), force_n, tool.held_body()});
    }
  }

  void require_user() const {
    if (names_.empty()) {
      throw std::invalid_argument(file_ + ": no user with a tool joined the room; record a session with a device");
    }
    if (!is_named_ && names_.size() > 1) {
      throw std::invalid_argument(file_ + " has the user" + user_list() + "; name one of them by --user");
    }
    if (joined_ns_) return;
    throw std::invalid_argument("--user " + clean(user_) + ": " + file_ + " has the user" + user_list() +
                                "; name one of them");
  }
  std::string user_list() const {
    std::string text = names_.size() == 1 ? " " : "s ";
    for (const std::string& name : names_) text += (name == *names_.begin() ? "" : ", ") + name;
    return text;
  }

  void parse(const recording::Message& message, google::protobuf::Message& out) const {
    if (proto::parse_recorded(message, out)) return;
    throw std::invalid_argument(file_ + ": a message " + out.GetTypeName() +
                                " cannot be read; the file is damaged: copy it again from where it was recorded");
  }

  std::string file_;
  std::string user_;
  bool is_named_;
  bool has_room_ = false;
  wire::RecordedRoom room_;
  wire::RecordedStep step_;
  wire::RecordedStates states_;
  std::set<std::string> names_;  ///< names of the users with a tool
  /// number of the measured user's place in the room (seat); none while the user is absent
  std::optional<std::uint32_t> seat_;
  std::uint32_t user_id_ = 0;
  std::optional<std::uint64_t> joined_ns_;  ///< time of the user's first join
  std::uint64_t last_ns_ = 0;
  SampleTime time_;
  MotionSampler sampler_;
  GameLog game_{room_};
  RecordedHand hand_;
};

}  // namespace

RecordedHand read_hand(const std::filesystem::path& file, const std::string& user) {
  HandReader reader(file, user);
  const proto::RecordingEnd end = proto::read_recording(
      file, [&reader](const std::string& topic, const auto& message) { return reader.receive(topic, message); });
  return reader.finish(end.is_damaged);
}

}  // namespace tandem::lab
