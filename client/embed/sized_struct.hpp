// Reads and writes structs of the C interface. The first field of each struct is its size. So program and library may
// have different versions of the struct.
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

/// Limits of struct_size [bytes]. The minimum is the size field and one more field of 4 bytes. The maximum is larger
/// than any later version of a struct will be.
inline constexpr std::uint32_t kMinStructSize = 8, kMaxStructSize = 65536;
/// struct_size must be a multiple of this number. All versions of a struct have such a size and no padding, so a valid
/// size never ends within a field.
inline constexpr std::uint32_t kStructAlignment = 8;

/// Returns the struct_size that the calling program has set.
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

/// Reads a struct of settings from the program. Fields that the program's version of the struct does not have are zero.
/// Fails   StatusError: see size_of(); or the program has set a field that this version of the library does not have
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

/// Writes a result to element `index` of the program's array, whose elements have `size` bytes. Fields that only this
/// version of the library has are omitted. Fields that only the program's version has are set to zero. The field
/// struct_size is not changed.
template <class Struct>
void write_struct(Struct result, Struct* to, std::uint32_t size, std::size_t index = 0) {
  result.struct_size = size;
  auto* const bytes = reinterpret_cast<unsigned char*>(to) + index * size;
  const std::size_t known = std::min<std::size_t>(size, sizeof result);
  std::memcpy(bytes, &result, known);
  std::memset(bytes + known, 0, size - known);
}

/// Maximum length of a text from the program [bytes], far below that of a control message (proto::kMaxControlBytes).
inline constexpr std::size_t kMaxTextBytes = 8192;

/// Returns the text of an argument or of a setting, after a check.
/// Fails   StatusError: the text is too long, or is not valid UTF-8, which messages require
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

/// Copies a text and a final 0 into a buffer of at least one byte. A text that does not fit is cut at the start of a
/// UTF-8 character.
inline void cut_text(std::string_view text, std::span<char> to) {
  std::size_t length = std::min(text.size(), to.size() - 1);
  while (length > 0 && length < text.size() && (static_cast<unsigned char>(text[length]) & 0xc0U) == 0x80U) --length;
  std::copy_n(text.data(), length, to.data());
  to[length] = '\0';
}

}  // namespace tandem::client::embed
