#include "common/recording/mcap_reader.hpp"

#include <zstd.h>

#include <algorithm>
#include <utility>

#include "common/base/byte_io.hpp"

namespace tandem::recording {
namespace {

constexpr std::size_t kMaxRecordBytes = std::size_t{64} << 20U;
constexpr std::size_t kMaxChannels = 1024;
constexpr std::size_t kReadAtOnce = std::size_t{1} << 20U;

std::span<const std::uint8_t> take_bytes(ByteReader& reader, std::span<const std::uint8_t>& rest, std::uint64_t size) {
  if (!reader.ok() || size > rest.size()) {
    reader.fail();
    return {};
  }
  const auto taken = rest.first(static_cast<std::size_t>(size));
  rest = rest.subspan(static_cast<std::size_t>(size));
  return taken;
}

std::string take_text(ByteReader& reader, std::span<const std::uint8_t>& rest) {
  const auto bytes = take_bytes(reader, rest, reader.u32());
  return {bytes.begin(), bytes.end()};
}

}  // namespace

McapReader::McapReader(std::istream& in) : in_(in) {}

const Channel* McapReader::channel(std::uint16_t id) const {
  const auto found = channels_.find(id);
  return found == channels_.end() ? nullptr : &found->second;
}

std::optional<Message> McapReader::stop(End end, std::string why) {
  end_ = end;
  why_ = std::move(why);
  return std::nullopt;
}

/// Takes memory as the bytes come, not as a length says.
bool McapReader::read_exactly(std::size_t size, Bytes& out) {
  out.clear();
  while (out.size() < size) {
    const std::size_t had = out.size();
    out.resize(had + std::min(size - had, kReadAtOnce));
    in_.read(reinterpret_cast<char*>(out.data() + had), static_cast<std::streamsize>(out.size() - had));
    if (static_cast<std::size_t>(in_.gcount()) != out.size() - had) return false;
  }
  return true;
}

bool McapReader::open() {
  Bytes magic;
  is_open_ = true;
  if (!read_exactly(kMagic.size(), magic)) {
    stop(End::kCut, "the file ends before it begins");
  } else if (!std::ranges::equal(magic, kMagic,
                                 [](std::uint8_t a, char b) { return a == static_cast<std::uint8_t>(b); })) {
    stop(End::kDamaged, "this is no MCAP file");
  }
  return end_ == End::kNotYet;
}

/// Into op_ and content_.
bool McapReader::read_record() {
  Bytes head;
  if (!read_exactly(sizeof(std::uint8_t) + sizeof(std::uint64_t), head)) {
    stop(End::kCut, "the file ends without its end: its program was stopped");
    return false;
  }
  std::span<const std::uint8_t> rest(head);
  ByteReader reader(rest);
  op_ = static_cast<Op>(reader.number<std::uint8_t>());
  const auto length = reader.number<std::uint64_t>();
  if (length > kMaxRecordBytes) {
    stop(End::kDamaged, "a record says that it has " + std::to_string(length) + " bytes, more than 64 MiB");
    return false;
  }
  if (read_exactly(static_cast<std::size_t>(length), content_)) return true;
  stop(End::kCut, "the file ends within a record: its program was stopped");
  return false;
}

bool McapReader::take_schema(std::span<const std::uint8_t> rest) {
  ByteReader reader(rest);
  const auto id = reader.number<std::uint16_t>();
  Channel schema;
  schema.type = take_text(reader, rest);
  take_text(reader, rest);  // the encoding: who decodes knows the type
  const auto data = take_bytes(reader, rest, reader.u32());
  schema.descriptors.assign(data.begin(), data.end());
  if (!reader.ok() || id == 0 || schemas_.size() >= kMaxChannels) return false;
  schemas_.insert_or_assign(id, std::move(schema));
  return true;
}

bool McapReader::take_channel(std::span<const std::uint8_t> rest) {
  ByteReader reader(rest);
  const auto id = reader.number<std::uint16_t>();
  const auto schema = schemas_.find(reader.number<std::uint16_t>());
  Channel channel = schema == schemas_.end() ? Channel{} : schema->second;
  channel.topic = take_text(reader, rest);
  if (!reader.ok() || channels_.size() >= kMaxChannels) return false;
  channels_.insert_or_assign(id, std::move(channel));
  return true;
}

bool McapReader::open_chunk(std::span<const std::uint8_t> rest) {
  ByteReader reader(rest);
  reader.number<std::uint64_t>();
  reader.number<std::uint64_t>();
  const auto size = reader.number<std::uint64_t>();
  const std::uint32_t sum = reader.u32();
  const std::string compression = take_text(reader, rest);
  const auto packed = take_bytes(reader, rest, reader.number<std::uint64_t>());
  if (!reader.ok() || size > kMaxRecordBytes) return false;
  if (compression.empty()) {
    chunk_.assign(packed.begin(), packed.end());
  } else if (compression == "zstd" && ZSTD_getFrameContentSize(packed.data(), packed.size()) == size) {
    chunk_.resize(static_cast<std::size_t>(size));
    if (ZSTD_decompress(chunk_.data(), chunk_.size(), packed.data(), packed.size()) != size) return false;
  } else {
    return false;
  }
  rest_ = chunk_;
  return chunk_.size() == size && (sum == 0 || sum == crc32(chunk_));
}

std::optional<Message> McapReader::message_of(std::span<const std::uint8_t> content) {
  ByteReader reader(content);
  Message message;
  message.channel = reader.number<std::uint16_t>();
  message.sequence = reader.u32();
  message.log_ns = reader.number<std::uint64_t>();
  message.publish_ns = reader.number<std::uint64_t>();
  message.data = content;
  if (!reader.ok() || channel(message.channel) == nullptr) return stop(End::kDamaged, "a message fits no channel");
  return message;
}

/// All but messages and what ends a file.
bool McapReader::take_record(Op op, std::span<const std::uint8_t> content) {
  if (op == Op::kSchema) return take_schema(content);
  if (op == Op::kChannel) return take_channel(content);
  return true;
}

std::optional<Message> McapReader::next_in_chunk() {
  while (!rest_.empty() && end_ == End::kNotYet) {
    ByteReader reader(rest_);
    const auto op = static_cast<Op>(reader.number<std::uint8_t>());
    const auto content = take_bytes(reader, rest_, reader.number<std::uint64_t>());
    if (!reader.ok()) return stop(End::kDamaged, "a chunk does not hold what it says");
    if (op == Op::kMessage) return message_of(content);
    if (!take_record(op, content)) return stop(End::kDamaged, "a chunk has a damaged schema or channel");
  }
  return std::nullopt;
}

std::optional<Message> McapReader::next() {
  if (!is_open_ && !open()) return std::nullopt;
  while (end_ == End::kNotYet) {
    if (!rest_.empty()) {
      if (auto message = next_in_chunk()) return message;
      continue;
    }
    if (!read_record()) return std::nullopt;
    if (op_ == Op::kMessage) return message_of(content_);
    if (op_ == Op::kFooter) return stop(End::kWhole, "");
    const bool is_good = op_ == Op::kChunk ? open_chunk(content_) : take_record(op_, content_);
    if (!is_good) return stop(End::kDamaged, "a record is damaged");
  }
  return std::nullopt;
}

}  // namespace tandem::recording
