#include "devices/sim/hand_path.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/base/buttons.hpp"
#include "common/base/json_fields.hpp"

namespace tandem::devices {
namespace {

constexpr double kMaxPath_s = 86400;
constexpr double kFarthest_m = 10;
constexpr std::size_t kMaxPoints = 10000;
constexpr std::size_t kMaxComponents = 64;
// Maximum frequency of a multisine: the limit up to which a hand can follow. It is far below the sampling rate of 1
// kHz.
constexpr double kMaxFrequency_hz = 50;
constexpr double kMaxAmplitude_m = 1;

/// Position and speed of a minimum-jerk movement of unit length at the relative time u = t/T. T is the duration of the
/// movement, so u is 0..1.
///
/// Model   s = 10u³ − 15u⁴ + 6u⁵
/// Source  Flash, Hogan, "The coordination of arm movements: an experimentally confirmed mathematical model", J.
///         Neuroscience 5 (1985), solution for point-to-point movements
struct UnitMove {
  double position;
  double speed;
};
UnitMove minimum_jerk(double u) {
  const double u2 = u * u;
  return {u2 * u * (10 + u * (-15 + 6 * u)), 30 * u2 * (1 + u * (-2 + u))};
}

bool is_rotation(const Quat& q) {
  return is_finite(q) && std::abs(q.norm() - 1.0) < 1e-6;
}

Quat quaternion_of_xyz_degrees(const Vec3& degrees) {
  const Vec3 a = degrees * (std::numbers::pi / 180);
  return (Eigen::AngleAxisd(a.z(), Vec3::UnitZ()) * Eigen::AngleAxisd(a.y(), Vec3::UnitY()) *
          Eigen::AngleAxisd(a.x(), Vec3::UnitX()))
      .normalized();
}

std::uint32_t buttons_of(JsonFields& point, std::uint32_t otherwise) {
  if (!point.has("buttons")) return otherwise;
  std::uint32_t bits = 0;
  for (const std::string& name : point.texts("buttons")) {
    if (name != "grab" && name != "clutch") point.fail("buttons", "it must be a list of \"grab\" and \"clutch\"");
    bits |= name == "grab" ? kButtonGrab : kButtonClutch;
  }
  return bits;
}

WayPoint way_point_of(JsonFields& point, const WayPoint& before, bool is_first) {
  WayPoint result = before;
  const double earliest_s = is_first ? 0 : to_seconds(before.at);
  result.at = from_seconds(point.required_number("t_s", earliest_s, kMaxPath_s));
  if (!is_first && result.at <= before.at) point.fail("t_s", "it must be later than the point before");
  result.X_DH.p = point.vector("position_m", before.X_DH.p, kFarthest_m);
  if (point.has("rotation_xyz_deg")) {
    result.X_DH.q = quaternion_of_xyz_degrees(point.vector("rotation_xyz_deg", Vec3::Zero(), 360));
  }
  result.buttons = buttons_of(point, before.buttons);
  result.is_relaxed = point.boolean("relaxed", before.is_relaxed);
  result.phase = point.text("phase", "");
  point.finish();
  return result;
}

SineComponent component_of(JsonFields& component) {
  SineComponent result;
  const Vec3 axis = component.vector("axis", Vec3::UnitX(), 1);
  if (axis.norm() < 1e-3) component.fail("axis", "it must have a direction");
  result.axis = axis.normalized();
  result.frequency_hz = component.required_number("frequency_hz", 0, kMaxFrequency_hz);
  result.amplitude_m = component.required_number("amplitude_m", 0, kMaxAmplitude_m);
  result.phase_rad = component.number("phase_rad", 0, -1000, 1000);
  component.finish();
  return result;
}

Multisine multisine_of(JsonFields fields) {
  Multisine result;
  result.from = from_seconds(fields.required_number("from_s", 0, kMaxPath_s));
  result.to = from_seconds(fields.required_number("to_s", 0, kMaxPath_s));
  result.fade = from_seconds(fields.number("fade_s", 0.5, 0, kMaxPath_s));
  if (result.to <= result.from) fields.fail("to_s", "it must be later than from_s");
  if (2 * result.fade > result.to - result.from) fields.fail("fade_s", "it must be at most half of to_s - from_s");
  for (JsonFields& component : fields.objects("components", 1, kMaxComponents)) {
    result.components.push_back(component_of(component));
  }
  fields.finish();
  return result;
}

bool is_unit(const Vec3& axis) {
  return is_finite(axis) && std::abs(axis.norm() - 1) < 1e-9;
}

void check_multisine(const Multisine& multisine) {
  const bool has_room = multisine.fade >= Duration(0) && multisine.from >= Duration(0) &&
                        multisine.to > multisine.from && 2 * multisine.fade <= multisine.to - multisine.from;
  if (!has_room)
    throw std::invalid_argument("hand path: multisine.to must be later than from, with room for two fades");
  for (const SineComponent& component : multisine.components) {
    const bool is_good = is_unit(component.axis) && std::isfinite(component.frequency_hz) &&
                         std::isfinite(component.amplitude_m) && std::isfinite(component.phase_rad);
    if (!is_good) throw std::invalid_argument("hand path: multisine.components must be finite with unit axes");
  }
}

/// Displacement and velocity of a multisine.
struct Sway {
  Vec3 p = Vec3::Zero();
  Vec3 v = Vec3::Zero();
};

Sway sway_of(const std::vector<SineComponent>& components, double t_s) {
  Sway sway;
  for (const SineComponent& each : components) {
    const double omega = 2 * std::numbers::pi * each.frequency_hz;
    const double angle = omega * t_s + each.phase_rad;
    sway.p += each.amplitude_m * std::sin(angle) * each.axis;
    sway.v += each.amplitude_m * omega * std::cos(angle) * each.axis;
  }
  return sway;
}

/// Returns the envelope w of the multisine, and its time derivative [1/s] as the speed. w rises from 0 to 1 during the
/// first fade, and falls from 1 to 0 during the last.
UnitMove envelope_of(const Multisine& multisine, Duration time) {
  const Duration inside = std::min(time - multisine.from, multisine.to - time);
  if (inside >= multisine.fade) return {1, 0};
  const double fade_s = to_seconds(multisine.fade);
  const UnitMove rising = minimum_jerk(to_seconds(inside) / fade_s);
  const bool is_ending = multisine.to - time < time - multisine.from;
  return {rising.position, (is_ending ? -1 : 1) * rising.speed / fade_s};
}

// The multisine is p = w s, with the envelope w and the sum of sines s. By the product rule, its speed is v = w s' + w'
// s.
Sway sway_at(const Multisine& multisine, Duration time) {
  if (multisine.components.empty() || time <= multisine.from || time >= multisine.to) return {};
  const Sway full = sway_of(multisine.components, to_seconds(time - multisine.from));
  const UnitMove envelope = envelope_of(multisine, time);
  return {envelope.position * full.p, envelope.position * full.v + envelope.speed * full.p};
}

}  // namespace

HandPath::HandPath(std::vector<WayPoint> points, Multisine multisine)
    : points_(std::move(points)), multisine_(std::move(multisine)) {
  if (!multisine_.components.empty()) check_multisine(multisine_);
  if (points_.empty()) throw std::invalid_argument("hand path: has no way point; it needs at least one");
  int phase = -1;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const WayPoint& point = points_[i];
    const std::string name = "hand path: points[" + std::to_string(i) + "]";
    if (!is_finite(point.X_DH.p) || !is_rotation(point.X_DH.q)) {
      throw std::invalid_argument(name + ".X_DH is not a pose; it must be finite with a unit quaternion");
    }
    if (i > 0 && point.at <= points_[i - 1].at) {
      throw std::invalid_argument(name + ".at is " + std::to_string(to_seconds(point.at)) +
                                  " s; it must be later than the point before");
    }
    if (!point.phase.empty()) {
      const auto known = std::find(phases_.begin(), phases_.end(), point.phase);
      phase = static_cast<int>(known - phases_.begin());
      if (known == phases_.end()) phases_.push_back(point.phase);
    }
    phase_of_point_.push_back(phase);
  }
}

std::size_t HandPath::segment_of(Duration time) const noexcept {
  const auto after = std::upper_bound(points_.begin(), points_.end(), time,
                                      [](Duration t, const WayPoint& point) { return t < point.at; });
  return after == points_.begin() ? 0 : static_cast<std::size_t>(after - points_.begin()) - 1;
}

Duration HandPath::length() const {
  const Duration last = points_.back().at;
  return multisine_.components.empty() ? last : std::max(last, multisine_.to);
}

HandPath HandPath::shifted(Duration later) const {
  std::vector<WayPoint> points = points_;
  for (WayPoint& point : points) point.at += later;
  Multisine multisine = multisine_;
  multisine.from += later;
  multisine.to += later;
  return HandPath(std::move(points), std::move(multisine));
}

HandPath HandPath::paced(double factor) const {
  const auto at_pace = [factor](Duration time) { return from_seconds(to_seconds(time) / factor); };
  std::vector<WayPoint> points = points_;
  for (WayPoint& point : points) point.at = at_pace(point.at);
  Multisine multisine = multisine_;
  multisine.from = at_pace(multisine.from);
  multisine.to = at_pace(multisine.to);
  multisine.fade = at_pace(multisine.fade);
  for (SineComponent& component : multisine.components) component.frequency_hz *= factor;
  return HandPath(std::move(points), std::move(multisine));
}

Pose HandPath::pose_at(Duration time) const noexcept {
  Pose X = way_pose_at(time);
  X.p += sway_at(multisine_, time).p;
  return X;
}

Twist HandPath::twist_at(Duration time) const noexcept {
  Twist V = way_twist_at(time);
  V.v += sway_at(multisine_, time).v;
  return V;
}

Pose HandPath::way_pose_at(Duration time) const noexcept {
  const std::size_t i = segment_of(time);
  const WayPoint& from = points_[i];
  if (time <= from.at || i + 1 == points_.size()) return from.X_DH;
  const WayPoint& to = points_[i + 1];
  const double s = minimum_jerk(to_seconds(time - from.at) / to_seconds(to.at - from.at)).position;
  const Vec3 turn = rotation_vector(from.X_DH.q.conjugate() * to.X_DH.q);
  return {from.X_DH.p + s * (to.X_DH.p - from.X_DH.p), (from.X_DH.q * quaternion_of(s * turn)).normalized()};
}

Twist HandPath::way_twist_at(Duration time) const noexcept {
  const std::size_t i = segment_of(time);
  const WayPoint& from = points_[i];
  if (time <= from.at || i + 1 == points_.size()) return {};
  const WayPoint& to = points_[i + 1];
  const double length_s = to_seconds(to.at - from.at);
  const double speed_per_s = minimum_jerk(to_seconds(time - from.at) / length_s).speed / length_s;
  const Vec3 turn = rotation_vector(from.X_DH.q.conjugate() * to.X_DH.q);
  return {speed_per_s * (to.X_DH.p - from.X_DH.p), speed_per_s * (from.X_DH.q * turn)};
}

std::uint32_t HandPath::buttons_at(Duration time) const noexcept {
  return time < points_.front().at ? 0 : points_[segment_of(time)].buttons;
}

bool HandPath::is_relaxed_at(Duration time) const noexcept {
  return time >= points_.front().at && points_[segment_of(time)].is_relaxed;
}

int HandPath::phase_at(Duration time) const noexcept {
  return time < points_.front().at ? -1 : phase_of_point_[segment_of(time)];
}

HandPath parse_hand_path(std::string_view json, std::string_view origin) {
  const std::string name(origin);
  JsonFields file(parse_json(json, name), name);
  std::vector<WayPoint> points;
  for (JsonFields& point : file.objects("points", 1, kMaxPoints)) {
    const WayPoint before = points.empty() ? WayPoint{} : points.back();
    points.push_back(way_point_of(point, before, points.empty()));
  }
  Multisine multisine;
  if (file.has("multisine")) multisine = multisine_of(file.object("multisine"));
  file.finish();
  return HandPath(std::move(points), std::move(multisine));
}

HandPath load_hand_path(const std::filesystem::path& file) {
  return parse_hand_path(read_text_file(file), file.string());
}

HandPath find_hand_path(std::string_view name) {
  const bool is_file = name.ends_with(".json") || name.find('/') != std::string_view::npos;
  return is_file ? load_hand_path(name) : named_hand_path(name);
}

}  // namespace tandem::devices
