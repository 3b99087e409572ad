#include "lab/therapy/session_measures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <stdexcept>

#include "lab/report/format.hpp"
#include "lab/report/utc.hpp"
#include "lab/therapy/recorded_hand.hpp"

namespace tandem::lab {
namespace {

/// Adds the forces and the held bodies of the tool in the interval part.begin_s ≤ t < end_s to `part`.
void add_tool(const std::vector<ToolSample>& samples, double end_s, PartMeasures& part) {
  std::set<std::uint32_t> objects;
  double sum_n = 0, peak_n = 0;
  std::uint64_t count = 0;
  std::uint32_t held = 0;
  for (const ToolSample& sample : samples) {
    const bool is_inside = sample.at_s >= part.begin_s && sample.at_s < end_s;
    if (is_inside) {
      sum_n += sample.force_n;
      peak_n = std::max(peak_n, sample.force_n);
      ++count;
      if (sample.held_body != 0) objects.insert(sample.held_body);
      if (sample.held_body != 0 && sample.held_body != held) ++part.grasps;
    }
    held = sample.held_body;
  }
  part.objects = objects.size();
  if (count == 0) return;
  part.force_mean_n = sum_n / static_cast<double>(count);
  part.force_peak_n = peak_n;
}

void add_motion(const HandMotion& motion, const std::vector<Movement>& movements, double end_s, PartMeasures& part) {
  const auto index = [](double at_s) {
    return static_cast<std::size_t>(std::max(0.0, std::ceil(at_s * kMotionRate_hz)));
  };
  const std::size_t first = index(part.begin_s), last = index(end_s);
  part.path_m = path_length_m(motion, first, last);
  part.range = range_of(motion, first, last);
  std::vector<double> smoothness;
  for (const Movement& movement : movements) {
    if (movement.begin_s < part.begin_s || movement.begin_s >= end_s) continue;
    ++part.movements;
    part.moving_s += movement.duration_s;
    smoothness.push_back(movement.smoothness);
  }
  part.smoothness = quantile(smoothness, 0.5);
  part.smoothness_low = quantile(smoothness, 0.25);
  part.smoothness_high = quantile(smoothness, 0.75);
}

PartMeasures measure(const RecordedHand& hand, const std::vector<Movement>& movements, const GamePart& part) {
  const double end_s = std::min(part.end_s, hand.motion.duration_s());
  PartMeasures measures{.kind = part.kind,
                        .outcome = part.outcome,
                        .name = part.name,
                        .begin_s = std::max(0.0, part.begin_s),
                        .score = part.score};
  measures.time_s = std::max(0.0, end_s - measures.begin_s);
  add_motion(hand.motion, movements, end_s, measures);
  add_tool(hand.tool_samples, end_s, measures);
  return measures;
}

MotionRange calibration_of(const HandMotion& motion, double seconds, const std::filesystem::path& file) {
  const auto last = static_cast<std::size_t>(std::clamp(seconds, 0.0, kMaxSession_s) * kMotionRate_hz);
  const auto range = range_of(motion, 0, last);
  if (range) return *range;
  throw std::invalid_argument(file.string() +
                              ": the calibration has less than 1 s of the hand's motion; record the hand while it "
                              "reaches as far as it can in each direction");
}

}  // namespace

std::string text_of(PartKind kind) {
  constexpr std::array<const char*, 3> kTexts{"session", "level", "goal"};
  return kTexts.at(static_cast<std::size_t>(kind));
}

std::string text_of(PartOutcome outcome) {
  constexpr std::array<const char*, 4> kTexts{"none", "reached", "failed", "open"};
  return kTexts.at(static_cast<std::size_t>(outcome));
}

std::size_t SessionMeasures::count(PartKind kind, PartOutcome outcome) const {
  return static_cast<std::size_t>(std::ranges::count_if(
      parts, [=](const PartMeasures& part) { return part.kind == kind && part.outcome == outcome; }));
}

SessionMeasures measure_session(const std::filesystem::path& file, const std::string& user,
                                std::optional<double> calibration_s) {
  const RecordedHand hand = read_hand(file, user);
  std::vector<Movement> movements = movements_of(hand.motion);
  SessionMeasures session{.recording = hand.recording,
                          .begun_utc = utc_text(hand.joined_ns),
                          .scene = hand.scene,
                          .is_cut = hand.is_damaged,
                          .parts = {},
                          .movements = {}};
  session.parts.push_back(measure(
      hand, movements, {PartKind::kSession, hand.game_outcome, "session", 0, hand.motion.duration_s(), hand.score}));
  if (calibration_s) session.calibration = calibration_of(hand.motion, *calibration_s, file);
  for (const GamePart& part : hand.game_parts) {
    if (part.end_s <= 0 || part.begin_s >= hand.motion.duration_s()) continue;  // the user was absent
    session.parts.push_back(measure(hand, movements, part));
  }
  movements.resize(std::min(movements.size(), kMaxMovements));
  session.movements = std::move(movements);
  return session;
}

MotionRange measure_calibration(const std::filesystem::path& file, const std::string& user) {
  const HandMotion motion = read_hand(file, user).motion;
  return calibration_of(motion, motion.duration_s(), file);
}

}  // namespace tandem::lab
