#include "proto/datagram.hpp"

#include <array>
#include <boost/endian/conversion.hpp>
#include <cassert>

namespace tandem::proto {
namespace {

constexpr std::size_t kConnectionOffset = 1;
constexpr std::size_t kSequenceOffset = 9;

constexpr unsigned kVersionShift = 5;
constexpr unsigned kTypeShift = 3;
constexpr unsigned kTypeMask = 0b11;
constexpr unsigned kEpochMask = kMaxEpoch;

std::uint64_t load_u64(std::span<const std::byte> datagram, std::size_t offset) {
  return boost::endian::load_big_u64(reinterpret_cast<const unsigned char*>(datagram.data() + offset));
}

}  // namespace

void append_header(const DatagramHeader& header, Bytes& out) {
  assert(header.epoch <= kMaxEpoch);
  std::array<unsigned char, kDatagramHeaderBytes> bytes{};  // the tag is zero here; DatagramSeal overwrites it
  bytes[0] =
      static_cast<unsigned char>((kProtocolVersion << kVersionShift) |
                                 (static_cast<unsigned>(header.type) << kTypeShift) | (header.epoch & kEpochMask));
  boost::endian::store_big_u64(bytes.data() + kConnectionOffset, header.connection.value);
  boost::endian::store_big_u64(bytes.data() + kSequenceOffset, header.sequence);
  const auto as_bytes = std::as_bytes(std::span(bytes));
  out.insert(out.end(), as_bytes.begin(), as_bytes.end());
}

DropReason parse_header(std::span<const std::byte> datagram, DatagramHeader& out) {
  if (datagram.size() < kDatagramHeaderBytes) return DropReason::kTooShort;
  if (datagram.size() > kMaxDatagramBytes) return DropReason::kTooLong;
  const auto first = std::to_integer<unsigned>(datagram[0]);
  if (first >> kVersionShift != kProtocolVersion) return DropReason::kVersion;
  out.type = static_cast<DatagramType>((first >> kTypeShift) & kTypeMask);
  out.epoch = static_cast<std::uint8_t>(first & kEpochMask);
  out.connection.value = load_u64(datagram, kConnectionOffset);
  out.sequence = load_u64(datagram, kSequenceOffset);
  if (!out.connection.is_valid()) return DropReason::kUnknownConnection;
  if (out.sequence == 0) return DropReason::kMalformed;
  return DropReason::kNone;
}

}  // namespace tandem::proto
