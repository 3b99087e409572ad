// Last stage before a device. All commands pass through this class, so the limits are checked for every device.
#include "devices/device_writer.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

namespace tandem::devices {
namespace {

// Largest software limits that are permitted for a device whose maximum is unverified. They are our choice, far below
// the maximum of every listed device.
constexpr double kUnverifiedForce_n = 2.0;
constexpr double kUnverifiedTorque_n_m = 0.1;

void fail(const DeviceSpec& spec, const char* field, double value, const std::string& remedy) {
  throw std::invalid_argument("device '" + spec.name + "': " + field + " is " + std::to_string(value) + "; " + remedy);
}

void check_positive(const DeviceSpec& spec, const char* field, double value) {
  if (!std::isfinite(value) || value <= 0) fail(spec, field, value, "it must be a finite number above 0");
}

void check_limit(const DeviceSpec& spec, const char* field, double limit, const SourcedLimit& maximum,
                 double unverified_maximum) {
  if (!std::isfinite(limit) || limit < 0) fail(spec, field, limit, "it must be a finite number, 0 or more");
  const bool verified = is_verified(maximum);
  const double largest = verified ? maximum.value : unverified_maximum;
  if (limit <= largest) return;
  fail(spec, field, limit,
       "it must be at most " + std::to_string(largest) +
           (verified ? " (" + maximum.source + ")" : " while the device's maximum is unverified"));
}

/// Checks the numbers of axes: three translational axes or none are permitted, and up to three rotational axes.
void check_axes(const DeviceSpec& spec) {
  const auto check = [&spec](const char* field, int axes, int least) {
    if (axes < least || axes > 3) fail(spec, field, axes, "it must be " + std::to_string(least) + " to 3");
  };
  check("sensed_translations", spec.sensed_translations, 3);
  check("sensed_rotations", spec.sensed_rotations, 0);
  if (spec.has_force()) check("actuated_translations", spec.actuated_translations, 3);
  check("actuated_rotations", spec.actuated_rotations, 0);
}

}  // namespace

void check_device_spec(const DeviceSpec& spec) {
  check_axes(spec);
  check_limit(spec, "force_limit_n", spec.force_limit_n, spec.force_maximum_n, kUnverifiedForce_n);
  if (spec.has_torque()) {
    check_limit(spec, "torque_limit_n_m", spec.torque_limit_n_m, spec.torque_maximum_n_m, kUnverifiedTorque_n_m);
  }
  check_positive(spec, "reach_m", spec.reach_m);
  check_positive(spec, "speed_limit_m_per_s", spec.speed_limit_m_per_s);
  check_positive(spec, "slew_limit_n_per_s", spec.slew_limit_n_per_s);
  check_positive(spec, "slew_limit_n_m_per_s", spec.slew_limit_n_m_per_s);
}

DeviceWriter::DeviceWriter(Device& device) : device_(device) {
  const DeviceSpec& spec = device.spec();
  check_device_spec(spec);
  force_limit_n_ = spec.has_force() ? spec.force_limit_n : 0.0;
  torque_limit_n_m_ = spec.has_torque() ? spec.torque_limit_n_m : 0.0;
}

bool DeviceWriter::write(LocalTime now, const Wrench& wrench_on_hand_D) noexcept {
  const bool is_good = is_finite(wrench_on_hand_D);
  const Wrench wanted = is_good ? wrench_on_hand_D : Wrench{};
  const Wrench command{clamped_to_length(wanted.f, force_limit_n_), clamped_to_length(wanted.t, torque_limit_n_m_)};
  // A device without force or torque always displays zero there; this does not count as clamping.
  was_clamped_ =
      !is_good || (force_limit_n_ > 0 && command.f != wanted.f) || (torque_limit_n_m_ > 0 && command.t != wanted.t);
  if (device_.has_released_force()) {
    device_.write(now, Wrench{});
    written_ = {};
    return false;
  }
  if (!device_.write(now, command)) return false;
  written_ = command;
  return true;
}

}  // namespace tandem::devices
