#include "proto/control_framing.hpp"

#include <google/protobuf/message.h>
#include <google/protobuf/stubs/logging.h>

#include <algorithm>
#include <boost/endian/conversion.hpp>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace tandem::proto {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

/// Returns whether all numbers in one field, including its sub-messages, are finite.
bool is_finite_field(const Message& message, const FieldDescriptor& field);

/// Returns whether all numbers of a message are finite. Every field is visited through Protobuf reflection, because a
/// list of all fields of a scene, kept by hand, would become incomplete. The cost is acceptable for a few control
/// messages per second. The recursion limit of the Protobuf parser bounds the depth.
bool is_finite_message(const Message& message) {
  std::vector<const FieldDescriptor*> present;
  message.GetReflection()->ListFields(message, &present);
  return std::ranges::all_of(present, [&](const FieldDescriptor* f) { return is_finite_field(message, *f); });
}

bool is_finite_repeated(const Message& message, const FieldDescriptor& field) {
  const Reflection& reflection = *message.GetReflection();
  const bool is_double = field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE;
  const bool is_message = field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE;
  if (!is_double && !is_message) return true;
  for (int i = 0; i < reflection.FieldSize(message, &field); ++i) {
    if (is_double && !std::isfinite(reflection.GetRepeatedDouble(message, &field, i))) return false;
    if (is_message && !is_finite_message(reflection.GetRepeatedMessage(message, &field, i))) return false;
  }
  return true;
}

bool is_finite_field(const Message& message, const FieldDescriptor& field) {
  if (field.is_repeated()) return is_finite_repeated(message, field);
  const Reflection& reflection = *message.GetReflection();
  if (field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE) return std::isfinite(reflection.GetDouble(message, &field));
  if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
    return is_finite_message(reflection.GetMessage(message, &field));
  }
  return true;
}

bool is_within_limits(const wire::Welcome& welcome) {
  return welcome.connection_id() != 0 && welcome.epoch() <= kMaxEpoch &&
         welcome.datagram_port() <= std::numeric_limits<std::uint16_t>::max();
}

bool is_within_limits(const wire::AssetChunk& chunk) {
  return chunk.sha256().size() == kAssetHashBytes && chunk.data().size() <= kAssetChunkBytes &&
         chunk.offset() <= chunk.total_bytes() && chunk.data().size() <= chunk.total_bytes() - chunk.offset();
}

bool parse_bounded(std::span<const std::byte> payload, Message& out) {
  if (payload.size() > kMaxControlBytes) return false;
  // Protobuf logs an error for each string that is not valid UTF-8. Without the silencer, a peer could fill the log.
  const google::protobuf::LogSilencer silencer;
  return out.ParseFromArray(payload.data(), static_cast<int>(payload.size())) && is_finite_message(out);
}

}  // namespace

void append_frame(const google::protobuf::MessageLite& message, Bytes& out) {
  const std::size_t size = message.ByteSizeLong();
  if (size > kMaxControlBytes) {
    throw std::length_error("control message " + message.GetTypeName() + " has " + std::to_string(size) +
                            " bytes; at most " + std::to_string(kMaxControlBytes) + " go into a frame");
  }
  const std::size_t start = out.size();
  out.resize(start + kFrameLengthBytes + size);
  auto* const to = reinterpret_cast<unsigned char*>(out.data() + start);
  boost::endian::store_big_u32(to, static_cast<std::uint32_t>(size));
  message.SerializeWithCachedSizesToArray(to + kFrameLengthBytes);
}

std::size_t FrameReader::payload_size_at(std::size_t frame) const {
  return boost::endian::load_big_u32(reinterpret_cast<const unsigned char*>(buffer_.data() + frame));
}

void FrameReader::drop_taken_bytes() {
  // The remaining bytes are moved to the front only if the dropped part is at least as long. Each byte is therefore
  // moved O(1) times on average.
  if (read_ < buffer_.size() - read_) return;
  buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(read_));
  frame_ -= read_;
  read_ = 0;
}

bool FrameReader::feed(std::span<const std::byte> bytes) {
  if (is_broken_) return false;
  drop_taken_bytes();
  while (!bytes.empty()) {
    const std::size_t have = buffer_.size() - frame_;
    const std::size_t need = have < kFrameLengthBytes ? kFrameLengthBytes : kFrameLengthBytes + payload_size_at(frame_);
    const std::span<const std::byte> taken = bytes.first(std::min(bytes.size(), need - have));
    buffer_.insert(buffer_.end(), taken.begin(), taken.end());
    bytes = bytes.subspan(taken.size());
    if (buffer_.size() - frame_ < kFrameLengthBytes) continue;
    const std::size_t payload_size = payload_size_at(frame_);
    if (payload_size > max_payload_bytes_) {
      is_broken_ = true;
      return false;
    }
    if (buffer_.size() - frame_ == kFrameLengthBytes + payload_size) frame_ = buffer_.size();
  }
  return true;
}

std::optional<std::span<const std::byte>> FrameReader::next() {
  if (!has_next()) return std::nullopt;
  const std::size_t payload_size = payload_size_at(read_);
  const std::span<const std::byte> payload(buffer_.data() + read_ + kFrameLengthBytes, payload_size);
  read_ += kFrameLengthBytes + payload_size;
  return payload;
}

bool parse_control(std::span<const std::byte> payload, wire::ClientControl& out) {
  return parse_bounded(payload, out) && out.message_case() != wire::ClientControl::MESSAGE_NOT_SET;
}

bool parse_control(std::span<const std::byte> payload, wire::ServerControl& out) {
  if (!parse_bounded(payload, out)) return false;
  switch (out.message_case()) {
    case wire::ServerControl::MESSAGE_NOT_SET:
      return false;
    case wire::ServerControl::kWelcome:
      return is_within_limits(out.welcome());
    case wire::ServerControl::kAssetChunk:
      return is_within_limits(out.asset_chunk());
    default:
      return true;
  }
}

}  // namespace tandem::proto
