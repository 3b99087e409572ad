#include "common/net/text.hpp"

namespace tandem::net {

std::optional<std::uint32_t> pop_code_point(std::string_view& text) {
  const auto lead = static_cast<unsigned char>(text.front());
  const std::size_t length = lead < 0x80          ? 1
                             : lead >> 5U == 0x6  ? 2
                             : lead >> 4U == 0xE  ? 3
                             : lead >> 3U == 0x1E ? 4
                                                  : 0;
  if (length == 0 || text.size() < length) return std::nullopt;
  std::uint32_t code = length == 1 ? lead : lead & (0x7FU >> length);
  for (std::size_t i = 1; i < length; ++i) {
    const auto next = static_cast<unsigned char>(text[i]);
    if (next >> 6U != 0x2) return std::nullopt;
    code = (code << 6U) | (next & 0x3FU);
  }
  constexpr std::uint32_t kMinOfLength[] = {0, 0, 0x80, 0x800, 0x10000};
  if (code < kMinOfLength[length] || code > 0x10FFFF || (code >= 0xD800 && code <= 0xDFFF)) return std::nullopt;
  text.remove_prefix(length);
  return code;
}

bool is_harmless(std::uint32_t code) {
  const bool is_control = code < 0x20 || (code >= 0x7F && code <= 0x9F);
  const bool breaks_line = code == 0x2028 || code == 0x2029;
  const bool turns_text =
      code == 0x200E || code == 0x200F || (code >= 0x202A && code <= 0x202E) || (code >= 0x2066 && code <= 0x2069);
  return !is_control && !breaks_line && !turns_text;
}

std::string printable(std::string_view text, std::size_t most_bytes) {
  std::string result;
  while (!text.empty()) {
    const std::string_view before = text;
    const auto code = pop_code_point(text);
    if (!code) text.remove_prefix(1);
    const std::string_view taken = code && is_harmless(*code) ? before.substr(0, before.size() - text.size()) : "?";
    if (result.size() + taken.size() > most_bytes) break;
    result += taken;
  }
  return result;
}

}  // namespace tandem::net
