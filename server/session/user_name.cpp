#include "server/session/user_name.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "common/net/text.hpp"

namespace tandem::server {
namespace {

constexpr std::size_t kMaxNameBytes = 64;

bool is_between(std::uint32_t code, std::uint32_t first, std::uint32_t last) {
  return code >= first && code <= last;
}

/// Returns whether the code point is a space of any width.
bool is_space(std::uint32_t code) {
  return code == ' ' || code == 0xA0 || code == 0x1680 || is_between(code, 0x2000, 0x200A) || code == 0x202F ||
         code == 0x205F || code == 0x3000;
}

/// Returns whether the code point has no visible glyph. Names that differ only in such code points look equal.
bool is_invisible(std::uint32_t code) {
  return code == 0xAD || code == 0x34F || code == 0x61C || code == 0x115F || code == 0x1160 ||
         is_between(code, 0x17B4, 0x17B5) || is_between(code, 0x180B, 0x180F) || is_between(code, 0x200B, 0x200D) ||
         is_between(code, 0x2060, 0x206F) || code == 0x2800 || code == 0x3164 || is_between(code, 0xFE00, 0xFE0F) ||
         code == 0xFEFF || code == 0xFFA0 || is_between(code, 0xFFF0, 0xFFFB) || is_between(code, 0x1BCA0, 0x1BCA3) ||
         is_between(code, 0x1D173, 0x1D17A) || is_between(code, 0xE0000, 0xE0FFF);
}

/// Returns the longest prefix of `name` that has at most `most_bytes` and ends with a complete character.
std::string first_characters(std::string_view name, std::size_t most_bytes) {
  std::string_view rest = name;
  std::size_t size = 0;
  while (!rest.empty() && net::pop_code_point(rest) && name.size() - rest.size() <= most_bytes) {
    size = name.size() - rest.size();
  }
  return std::string(name.substr(0, size));
}

}  // namespace

bool is_acceptable_user_name(std::string_view name) {
  if (name.empty() || name.size() > kMaxNameBytes) return false;
  bool was_space = true;  // true, so that a leading space is refused
  while (!name.empty()) {
    const auto code = net::pop_code_point(name);
    if (!code || !net::is_harmless(*code) || is_invisible(*code)) return false;
    // Other spaces than U+0020 look like U+0020, so two different names could look equal.
    if (is_space(*code) && (was_space || *code != ' ')) return false;
    was_space = is_space(*code);
  }
  return !was_space;
}

std::string name_beside(const std::string& name, const std::vector<std::string>& taken) {
  std::string result = name;
  for (int number = 2; std::ranges::find(taken, result) != taken.end(); ++number) {
    const std::string suffix = " (" + std::to_string(number) + ")";
    result = first_characters(name, kMaxNameBytes - suffix.size()) + suffix;
  }
  return result;
}

std::string quoted(const std::string& text) {
  return is_acceptable_user_name(text) ? "\"" + text + "\"" : std::string("(unprintable)");
}

}  // namespace tandem::server
