#include "devices/device.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace tandem::devices {
namespace {

// Converts an ASCII letter to lower case. Unlike std::tolower() it does not depend on the locale, so that a profile
// file has the same meaning on every machine.
char lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

}  // namespace

bool is_verified(const SourcedLimit& limit) noexcept {
  constexpr std::string_view kUnverified = "unverified";
  std::string_view source = limit.source;
  source.remove_prefix(std::min(source.find_first_not_of(" \t\r\n\v\f"), source.size()));
  if (!std::isfinite(limit.value) || source.empty()) return false;
  return !std::ranges::equal(source.substr(0, kUnverified.size()), kUnverified, {}, lower);
}

std::string_view name_of(DeviceState state) noexcept {
  constexpr std::array<std::string_view, 4> kNames{"opening", "homing", "ready", "lost"};
  return kNames[static_cast<std::size_t>(state)];
}

std::string describe(const DeviceSample& sample) {
  std::string text(name_of(sample.state));
  if (sample.state == DeviceState::kReady && !sample.is_valid) text += ", but gives no usable samples";
  if (!sample.reason.empty()) text.append(": ").append(sample.reason);
  return text;
}

}  // namespace tandem::devices
