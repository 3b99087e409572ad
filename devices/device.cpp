// See device.hpp.
#include "devices/device.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

namespace tandem::devices {
namespace {

// Without the locale's: sources are UTF-8, and what a file says may not depend on where it is read.
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

}  // namespace tandem::devices
