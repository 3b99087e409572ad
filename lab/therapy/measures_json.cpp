#include "lab/therapy/measures_json.hpp"

#include <array>
#include <cmath>
#include <vector>

#include "common/base/json_fields.hpp"

namespace tandem::lab {
namespace {

namespace json = boost::json;

constexpr std::uint64_t kFormat = 1;
constexpr double kMaxLength_m = 1e9, kMaxNumber = 1e13;
constexpr std::uint64_t kMaxCount = 1'000'000'000;
constexpr std::size_t kMovementNumbers = 5;
const std::vector<std::string_view> kKinds{"session", "level", "goal"};
const std::vector<std::string_view> kOutcomes{"none", "reached", "failed", "open"};

/// Name of a number in the JSON of a part, and the member that has its value.
struct Number {
  const char* name;
  double PartMeasures::*member;
};
constexpr std::array kNumbers{Number{"begin_s", &PartMeasures::begin_s},
                              Number{"time_s", &PartMeasures::time_s},
                              Number{"moving_s", &PartMeasures::moving_s},
                              Number{"path_m", &PartMeasures::path_m},
                              Number{"score", &PartMeasures::score},
                              Number{"force_mean_n", &PartMeasures::force_mean_n},
                              Number{"force_peak_n", &PartMeasures::force_peak_n},
                              Number{"smoothness", &PartMeasures::smoothness},
                              Number{"smoothness_low", &PartMeasures::smoothness_low},
                              Number{"smoothness_high", &PartMeasures::smoothness_high}};
struct Count {
  const char* name;
  std::uint64_t PartMeasures::*member;
};
constexpr std::array kCounts{Count{"movements", &PartMeasures::movements}, Count{"grasps", &PartMeasures::grasps},
                             Count{"objects", &PartMeasures::objects}};

json::array array_of(const Vec3& a) {
  return {a.x(), a.y(), a.z()};
}

json::object to_json(const MotionRange& range) {
  return {{"low_m", array_of(range.low_m)}, {"high_m", array_of(range.high_m)}, {"start_m", array_of(range.start_m)}};
}

json::object to_json(const PartMeasures& part) {
  json::object out{{"kind", text_of(part.kind)}, {"outcome", text_of(part.outcome)}, {"name", part.name}};
  for (const Number& number : kNumbers) {
    if (std::isfinite(part.*number.member)) out[number.name] = part.*number.member;
  }
  for (const Count& count : kCounts) out[count.name] = part.*count.member;
  if (part.range) out["range"] = to_json(*part.range);
  return out;
}

MotionRange range_from(JsonFields fields) {
  MotionRange range;
  for (const auto& [name, member] : {std::pair{"low_m", &MotionRange::low_m}, std::pair{"high_m", &MotionRange::high_m},
                                     std::pair{"start_m", &MotionRange::start_m}}) {
    if (!fields.has(name)) fields.fail(name, "it must be three numbers [x, y, z]");
    range.*member = fields.vector(name, Vec3::Zero(), kMaxLength_m);
  }
  fields.finish();
  return range;
}

PartMeasures part_from(JsonFields& fields) {
  PartMeasures part;
  part.kind = static_cast<PartKind>(fields.choice("kind", 0, kKinds));
  part.outcome = static_cast<PartOutcome>(fields.choice("outcome", 0, kOutcomes));
  part.name = fields.text("name", "");
  for (const Number& number : kNumbers) {
    part.*number.member = fields.number(number.name, PartMeasures::kUnknown, -kMaxNumber, kMaxNumber);
  }
  for (const Count& count : kCounts) part.*count.member = fields.whole_number(count.name, 0, kMaxCount);
  if (fields.has("range")) part.range = range_from(fields.object("range"));
  fields.finish();
  return part;
}

/// Converts a movement to an array of numbers. Names are omitted, so that thousands of movements give a small file. The
/// last number is the smoothness; it is omitted if it is unknown.
json::array to_json(const Movement& movement) {
  json::array out{movement.begin_s, movement.duration_s, movement.path_m, movement.peak_speed_m_per_s};
  if (std::isfinite(movement.smoothness)) out.emplace_back(movement.smoothness);
  return out;
}

Movement movement_from(JsonFields& fields) {
  const std::vector<double> n = fields.numbers("numbers", -kMaxNumber, kMaxNumber);
  if (n.size() != kMovementNumbers && n.size() != kMovementNumbers - 1) {
    fields.fail("numbers", "it must be begin, duration, path, peak speed and smoothness");
  }
  return {n[0], n[1], n[2], n[3], n.size() == kMovementNumbers ? n[4] : PartMeasures::kUnknown};
}

}  // namespace

json::object to_json(const SessionMeasures& session) {
  json::object out{{"format", kFormat},
                   {"recording", std::to_string(session.recording)},
                   {"begun_utc", session.begun_utc},
                   {"scene", session.scene},
                   {"is_cut", session.is_cut}};
  if (session.calibration) out["calibration"] = to_json(*session.calibration);
  json::array parts, movements;
  for (const PartMeasures& part : session.parts) parts.push_back(to_json(part));
  for (const Movement& movement : session.movements) {
    movements.push_back(json::object{{"numbers", to_json(movement)}});
  }
  out["parts"] = std::move(parts);
  out["movements"] = std::move(movements);
  return out;
}

SessionMeasures session_from_json(const json::value& value, const std::string& origin) {
  JsonFields fields(value, origin);
  if (fields.whole_number("format", 0, kMaxCount) != kFormat) {
    fields.fail("format", "it must be 1; add the recording again with this version");
  }
  SessionMeasures session;
  const std::string recording = fields.required_text("recording");
  constexpr std::size_t kMaxDigits = 20;
  if (recording.size() > kMaxDigits || recording.find_first_not_of("0123456789") != std::string::npos) {
    fields.fail("recording", "it must be a whole number in quotes");
  }
  for (const char digit : recording)
    session.recording = session.recording * 10 + static_cast<std::uint64_t>(digit - '0');
  session.begun_utc = fields.required_text("begun_utc");
  session.scene = fields.text("scene", "");
  session.is_cut = fields.boolean("is_cut", false);
  if (fields.has("calibration")) session.calibration = range_from(fields.object("calibration"));
  for (JsonFields& part : fields.objects("parts", 1, kMaxParts + 2)) session.parts.push_back(part_from(part));
  for (JsonFields& movement : fields.objects("movements", 0, kMaxMovements)) {
    session.movements.push_back(movement_from(movement));
  }
  fields.finish();
  return session;
}

}  // namespace tandem::lab
