// Calls of functions of tandem.h, encoded as bytes. They are the input of embed_fuzz.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace tandem::fuzz {

/// A function, or a group of functions with the same arguments.
enum class Call : std::uint8_t {
  kOpenDevice,
  kFeed,
  kForce,
  kCloseDevice,
  kOpenClient,
  kJoin,
  kWaitJoined,
  kStart,
  kStop,
  kCloseClient,
  kSession,
  kSnapshot,
  kBodies,
  kUsers,
  kTicks,
  kEvent,
  kWaitEvent,
  kDescriptor,
  kGrab,
  kPoint,
  kParameter,
  kTexts,
  kNumbers,
  kPose,
  kConstants,
  kCount
};

/// Reads the arguments of calls from the front of the input. After the end of the input all values are zero.
class CallReader {
 public:
  explicit CallReader(std::span<const std::uint8_t> script) : script_(script) {}

  bool is_at_end() const { return script_.empty(); }

  /// Reads the bytes of a number, so that all NaN and infinities occur.
  template <class Number>
  Number number() {
    static_assert(std::is_arithmetic_v<Number>);
    Number read{};
    const std::size_t size = std::min(sizeof read, script_.size());
    if (size > 0) std::memcpy(&read, script_.data(), size);
    script_ = script_.subspan(size);
    return read;
  }
  std::uint8_t byte() { return number<std::uint8_t>(); }

  /// Reads a text of less than 255 bytes, which may contain any byte except 0. Returns null for the length 255. The text
  /// is kept as long as this object.
  const char* text() {
    const std::size_t length = byte();
    if (length == 255) return nullptr;
    const std::size_t size = std::min(length, script_.size());
    texts_.push_back(
        std::make_unique<std::string>(script_.begin(), script_.begin() + static_cast<std::ptrdiff_t>(size)));
    script_ = script_.subspan(size);
    return texts_.back()->c_str();
  }

 private:
  std::span<const std::uint8_t> script_;
  std::vector<std::unique_ptr<std::string>> texts_;
};

}  // namespace tandem::fuzz
