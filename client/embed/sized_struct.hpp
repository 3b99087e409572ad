// Structs of a C interface whose first field is their size, so that program and library may have different versions.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>

#include "client/embed/status_error.hpp"
#include "common/net/text.hpp"

namespace tandem::client::embed {

/// Limits of struct_size. The lower one is that of a struct with one number, the upper one is above any later version.
inline constexpr std::uint32_t kMinStructSize = 8, kMaxStructSize = 65536;
/// Divisor of struct_size: no version of a struct has padding, so each size ends after a whole field.
inline constexpr std::uint32_t kStructAlignment = 8;

/// Returns the struct_size that the caller has set.
/// Fails   StatusError: a null pointer, or a size outside the limits
template <class Struct>
std::uint32_t size_of(const Struct* given, const char* name) {
  if (given == nullptr) throw StatusError(TANDEM_BAD_ARGUMENT, std::string(name) + " is a null pointer");
  std::uint32_t size = 0;
  std::memcpy(&size, given, sizeof size);
  if (size >= kMinStructSize && size <= kMaxStructSize && size % kStructAlignment == 0) return size;
  throw StatusError(TANDEM_BAD_ARGUMENT, std::string(name) + ".struct_size is " + std::to_string(size) +
                                             "; set it to sizeof(" + name + ") before the call");
}

/// Reads a struct of settings. Fields that the caller's version lacks are zero.
/// Fails   StatusError: see size_of(); or a field that this version lacks is not zero
template <class Struct>
Struct read_struct(const Struct* given, const char* name) {
  const std::uint32_t size = size_of(given, name);
  Struct known{};
  std::memcpy(&known, given, std::min<std::size_t>(size, sizeof known));
  const auto* const bytes = reinterpret_cast<const unsigned char*>(given);
  if (size > sizeof known && std::any_of(bytes + sizeof known, bytes + size, [](unsigned char c) { return c != 0; })) {
    throw StatusError(TANDEM_BAD_ARGUMENT, std::string(name) +
                                               " has a setting that this version of libtandem does not " +
                                               "support; install the version for which the program was built");
  }
  return known;
}

/// Writes the caller's part of a result to element `index` of an array, whose elements have `size` bytes. Fields that
/// this version lacks are zero. struct_size is kept.
template <class Struct>
void write_struct(Struct result, Struct* to, std::uint32_t size, std::size_t index = 0) {
  result.struct_size = size;
  auto* const bytes = reinterpret_cast<unsigned char*>(to) + index * size;
  const std::size_t known = std::min<std::size_t>(size, sizeof result);
  std::memcpy(bytes, &result, known);
  std::memset(bytes + known, 0, size - known);
}

/// Limit of a text of the program [bytes], far below that of a control message (proto::kMaxControlBytes).
inline constexpr std::size_t kMaxTextBytes = 8192;

/// Returns the text of an argument or of a setting.
/// Fails   StatusError: the text is too long, or not valid UTF-8, which no message can contain
inline std::string checked_text(const char* text, const char* name) {
  if (std::strlen(text) > kMaxTextBytes) {
    throw StatusError(TANDEM_BAD_ARGUMENT,
                      std::string(name) + " is longer than " + std::to_string(kMaxTextBytes) + " bytes; shorten it");
  }
  for (std::string_view rest = text; !rest.empty();) {
    if (!net::pop_code_point(rest)) {
      throw StatusError(TANDEM_BAD_ARGUMENT, std::string(name) + " is not valid UTF-8");
    }
  }
  return text;
}

/// Copies text and a 0 into a buffer of at least one byte. Longer text is cut between characters of UTF-8.
inline void cut_text(std::string_view text, std::span<char> to) {
  std::size_t length = std::min(text.size(), to.size() - 1);
  while (length > 0 && length < text.size() && (static_cast<unsigned char>(text[length]) & 0xc0U) == 0x80U) --length;
  std::copy_n(text.data(), length, to.data());
  to[length] = '\0';
}

}  // namespace tandem::client::embed
