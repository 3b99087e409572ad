// Reads and writes asset files. Numbers are little-endian on every machine. Input bytes are untrusted, so the reader
// never accesses memory outside its input.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace tandem {

template <typename T>
concept WireNumber = std::is_arithmetic_v<T> && !std::is_same_v<T, bool>;

/// Appends numbers to a byte vector.
class ByteWriter {
 public:
  explicit ByteWriter(std::vector<std::uint8_t>& bytes) : bytes_(bytes) {}

  template <WireNumber T>
  void number(T value) {
    array(std::span<const T>(&value, 1));
  }
  void u32(std::uint32_t value) { number(value); }
  void f32(float value) { number(value); }
  void f64(double value) { number(value); }

  /// Appends the elements of an array without a count.
  template <WireNumber T>
  void array(std::span<const T> values) {
    if (values.empty()) return;
    const std::size_t start = bytes_.size();
    bytes_.resize(start + values.size_bytes());
    std::memcpy(bytes_.data() + start, values.data(), values.size_bytes());
    if constexpr (std::endian::native == std::endian::big) {
      for (std::size_t i = start; i < bytes_.size(); i += sizeof(T)) reverse(bytes_.data() + i, sizeof(T));
    }
  }

  static void reverse(std::uint8_t* first, std::size_t count) {
    for (std::size_t i = 0; i < count / 2; ++i) std::swap(first[i], first[count - 1 - i]);
  }

 private:
  std::vector<std::uint8_t>& bytes_;
};

/// Reads numbers from the front of a byte span. A read past the end returns zeros and makes ok() return false. Callers
/// must check ok() after the last read, and before they use a value as a size or an index.
class ByteReader {
 public:
  /// In      bytes  bytes to read; each read removes its bytes from the front of this span, which the caller owns
  explicit ByteReader(std::span<const std::uint8_t>& bytes) : bytes_(bytes) {}

  bool ok() const { return is_ok_; }
  void fail() { is_ok_ = false; }

  template <WireNumber T>
  T number() {
    T value{};
    array(std::span<T>(&value, 1));
    return value;
  }
  std::uint32_t u32() { return number<std::uint32_t>(); }
  float f32() { return number<float>(); }
  double f64() { return number<double>(); }

  /// Reads the number of elements of a following array; each element needs at least `bytes_each` bytes. If fewer bytes
  /// remain than the array needs, returns 0 and makes ok() return false. A malicious number therefore cannot cause an
  /// allocation much larger than the received bytes.
  std::uint32_t count(std::size_t bytes_each) {
    const std::uint32_t value = u32();
    if (value <= bytes_.size() / bytes_each) return value;
    fail();
    return 0;
  }

  /// Fills `values` with the next numbers, or with zeros if too few bytes remain.
  template <WireNumber T>
  void array(std::span<T> values) {
    if (values.empty()) return;
    if (!is_ok_ || bytes_.size() < values.size_bytes()) {
      fail();
      std::memset(values.data(), 0, values.size_bytes());
      return;
    }
    std::memcpy(values.data(), bytes_.data(), values.size_bytes());
    bytes_ = bytes_.subspan(values.size_bytes());
    if constexpr (std::endian::native == std::endian::big) {
      auto* raw = reinterpret_cast<std::uint8_t*>(values.data());
      for (std::size_t i = 0; i < values.size_bytes(); i += sizeof(T)) ByteWriter::reverse(raw + i, sizeof(T));
    }
  }

 private:
  std::span<const std::uint8_t>& bytes_;
  bool is_ok_ = true;
};

/// Checksum that detects a truncated or accidentally altered file, computed at memory speed. It does not detect
/// deliberate manipulation; the readers therefore also check the range of each value.
inline std::uint64_t checksum_of(std::span<const std::uint8_t> bytes) {
  // 2^64 / golden ratio: an odd multiplier that mixes the bits well
  constexpr std::uint64_t kOdd = 0x9E3779B97F4A7C15U;
  std::uint64_t sum = bytes.size();
  ByteReader reader(bytes);
  while (bytes.size() >= sizeof(std::uint64_t)) sum = (std::rotl(sum, 29) ^ reader.number<std::uint64_t>()) * kOdd;
  while (!bytes.empty()) sum = (std::rotl(sum, 29) ^ reader.number<std::uint8_t>()) * kOdd;
  return sum ^ sum >> 32U;
}

/// Returns the header of an asset: the codes of its kind and version.
inline std::vector<std::uint8_t> begin_asset(std::uint32_t kind, std::uint32_t version) {
  std::vector<std::uint8_t> bytes;
  ByteWriter(bytes).array(std::span<const std::uint32_t>(std::array{kind, version}));
  return bytes;
}

/// Ends an asset: appends the checksum of all bytes so far.
inline void end_asset(std::vector<std::uint8_t>& bytes) {
  ByteWriter(bytes).number(checksum_of(bytes));
}

/// Returns the bytes of an asset between its header and its checksum. Returns nothing if the checksum, the kind or the
/// version is wrong.
inline std::optional<std::span<const std::uint8_t>> asset_content(std::span<const std::uint8_t> bytes,
                                                                  std::uint32_t kind, std::uint32_t version) {
  constexpr std::size_t kChecksumBytes = sizeof(std::uint64_t);
  if (bytes.size() < kChecksumBytes) return std::nullopt;
  auto content = bytes.first(bytes.size() - kChecksumBytes), ending = bytes.last(kChecksumBytes);
  if (ByteReader(ending).number<std::uint64_t>() != checksum_of(content)) return std::nullopt;
  ByteReader reader(content);
  if (reader.u32() != kind || reader.u32() != version) return std::nullopt;
  return content;
}

/// Conversions between std::uint8_t, the type of ByteReader and ByteWriter, and std::byte, the type of files and
/// messages.
inline std::span<const std::uint8_t> octets_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
}
inline std::vector<std::byte> bytes_of(std::span<const std::uint8_t> octets) {
  const auto bytes = std::as_bytes(octets);
  return {bytes.begin(), bytes.end()};
}

}  // namespace tandem
