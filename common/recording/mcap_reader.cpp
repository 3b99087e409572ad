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

std::span<const std::uint8_t> read_bytes(ByteReader& reader, std::span<const std::uint8_t>& rest, std::uint64_t size) {
  if (!reader.ok() || size > rest.size()) {
    reader.fail();
    return {};
  }
  const auto taken = rest.first(static_cast<std::size_t>(size));
  rest = rest.subspan(static_cast<std::size_t>(size));
  return taken;
}

std::string read_text(ByteReader& reader, std::span<const std::uint8_t>& rest) {
  const auto bytes = read_bytes(reader, rest, reader.u32());
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

/// Reads exactly `size` bytes. Memory is allocated only as the bytes arrive, so that a false length in the file cannot
/// cause a large allocation.
bool McapReader::read_exactly(std::size_t size, Bytes& out) {
  out.clear();
  while (out.size() < size) {
    const std::size_t had = out.size();
    out.resize(had + std::min(size - had, kReadAtOnce));
    in_.read(reinterpret_cast<char*>(out.data() + had), static_cast<std::streamsize>(out.size() - had));
    position_ += static_cast<std::uint64_t>(in_.gcount());
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

/// Reads the next record into op_ and content_.
bool McapReader::read_record() {
  record_at_ = position_;
  if (!read_exactly(sizeof(std::uint8_t) + sizeof(std::uint64_t), head_)) {
    const bool is_behind_a_record = position_ == record_at_;
    stop(End::kCut, is_behind_a_record ? "the file ends without its end: its program was stopped, or it was cut"
                                       : "the file ends within a record: it was cut");
    return false;
  }
  std::span<const std::uint8_t> rest(head_);
  ByteReader reader(rest);
  op_ = static_cast<Op>(reader.number<std::uint8_t>());
  const auto length = reader.number<std::uint64_t>();
  if (length > kMaxRecordBytes) {
    stop(End::kDamaged, "a record states a length of " + std::to_string(length) + " bytes, more than 64 MiB");
    return false;
  }
  if (read_exactly(static_cast<std::size_t>(length), content_)) return true;
  stop(End::kCut, "the file ends within a record: it was cut");
  return false;
}

bool McapReader::read_schema(std::span<const std::uint8_t> rest) {
  ByteReader reader(rest);
  const auto id = reader.number<std::uint16_t>();
  Channel schema;
  schema.type = read_text(reader, rest);
  read_text(reader, rest);  // skips the encoding, because the decoder determines it from the type
  const auto data = read_bytes(reader, rest, reader.u32());
  schema.descriptors.assign(data.begin(), data.end());
  if (!reader.ok() || !rest.empty() || id == 0 || schemas_.size() >= kMaxChannels) return false;
  schemas_.insert_or_assign(id, std::move(schema));
  return true;
}

bool McapReader::read_channel(std::span<const std::uint8_t> rest) {
  ByteReader reader(rest);
  const auto id = reader.number<std::uint16_t>();
  const auto schema = schemas_.find(reader.number<std::uint16_t>());
  Channel channel = schema == schemas_.end() ? Channel{} : schema->second;
  channel.topic = read_text(reader, rest);
  read_text(reader, rest);                 // skips the encoding of the messages
  read_bytes(reader, rest, reader.u32());  // skips the channel's metadata
  if (!reader.ok() || !rest.empty() || channels_.size() >= kMaxChannels) return false;
  // The summary repeats each channel and has a checksum. If the summary gives a different topic for a channel, the
  // channel record before it was altered, and messages were assigned to a wrong channel.
  const Channel* const before = is_in_summary_ ? this->channel(id) : nullptr;
  if (before != nullptr && before->topic != channel.topic) return false;
  channels_.insert_or_assign(id, std::move(channel));
  return true;
}

std::string McapReader::damage_of_chunk(std::span<const std::uint8_t> rest) {
  ByteReader reader(rest);
  reader.number<std::uint64_t>();
  reader.number<std::uint64_t>();
  const auto size = reader.number<std::uint64_t>();
  const std::uint32_t sum = reader.u32();
  const std::string compression = read_text(reader, rest);
  const auto packed = read_bytes(reader, rest, reader.number<std::uint64_t>());
  if (!reader.ok() || !rest.empty()) return "a chunk does not fit the length of its record";
  if (size > kMaxRecordBytes) {
    return "a chunk states a length of " + std::to_string(size) + " bytes unpacked, more than 64 MiB";
  }
  if (compression.empty()) {
    chunk_.assign(packed.begin(), packed.end());
  } else if (compression != "zstd") {
    return "a chunk is not packed by zstd";
  } else if (ZSTD_getFrameContentSize(packed.data(), packed.size()) != size) {
    return "a chunk cannot be unpacked";
  } else {
    chunk_.resize(static_cast<std::size_t>(size));
    if (ZSTD_decompress(chunk_.data(), chunk_.size(), packed.data(), packed.size()) != size) {
      return "a chunk cannot be unpacked";
    }
  }
  if (chunk_.size() != size || sum != crc32(chunk_)) return "the sum of a chunk is wrong";
  rest_ = chunk_;
  ++chunks_;
  return {};
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
  ++messages_;
  return message;
}

/// Processes a schema or channel record; ignores all other records.
bool McapReader::read_data_record(Op op, std::span<const std::uint8_t> content) {
  if (op == Op::kSchema) return read_schema(content);
  if (op == Op::kChannel) return read_channel(content);
  return true;
}

std::optional<Message> McapReader::next_in_chunk() {
  while (!rest_.empty() && end_ == End::kNotYet) {
    ByteReader reader(rest_);
    const auto op = static_cast<Op>(reader.number<std::uint8_t>());
    const auto content = read_bytes(reader, rest_, reader.number<std::uint64_t>());
    if (!reader.ok() || (op != Op::kMessage && op != Op::kSchema && op != Op::kChannel))
      return stop(End::kDamaged, "a chunk does not hold the records that it states");
    if (op == Op::kMessage) return message_of(content);
    if (!read_data_record(op, content)) return stop(End::kDamaged, "a chunk has a damaged schema or channel");
  }
  return std::nullopt;
}

/// Returns a description of the damage of the header record, or an empty text. The length of the header must be
/// checked, because a wrong length would hide the records that follow the header.
std::string McapReader::damage_of_header() const {
  std::span<const std::uint8_t> rest(content_);
  ByteReader reader(rest);
  read_text(reader, rest);  // skips the name of the profile
  read_text(reader, rest);  // skips the name of the library
  return reader.ok() && rest.empty() && channels_.empty() ? "" : "the header is damaged";
}

/// Returns a description of the damage of a MessageIndex record, or an empty text. The record must follow its chunk. If
/// it does not, the type byte of the chunk was altered, so that the chunk was skipped as an unknown record.
std::string McapReader::damage_of_index() const {
  if (!follows_chunk_) return "an index follows no chunk: a chunk before it is damaged";
  std::span<const std::uint8_t> rest(content_);
  ByteReader reader(rest);
  const auto id = reader.number<std::uint16_t>();
  read_bytes(reader, rest, reader.u32());
  return reader.ok() && rest.empty() && channel(id) != nullptr ? "" : "the index of a chunk is damaged";
}

/// Returns whether `sum` is the correct checksum of the summary. The checksum also covers the fields of the Footer that
/// precede it.
bool McapReader::is_sum_of_summary_right(std::uint32_t sum) const {
  Bytes summed = summary_;
  summed.insert(summed.end(), head_.begin(), head_.end());
  summed.insert(summed.end(), content_.begin(), content_.end() - sizeof(sum));
  return sum == crc32(summed);
}

/// Compares the numbers of messages and chunks that were read with those that the writer stored in the file.
std::string McapReader::damage_of_footer() {
  std::span<const std::uint8_t> rest(content_);
  ByteReader reader(rest);
  reader.number<std::uint64_t>();
  reader.number<std::uint64_t>();
  const std::uint32_t sum = reader.u32();
  if (!reader.ok() || !rest.empty() || !is_in_summary_) return "the end of the file is not where it belongs";
  if (!is_sum_of_summary_right(sum)) return "the sum of the summary is wrong";
  if (!counts_) return "the summary has no count of messages";
  std::span<const std::uint8_t> counted(*counts_);
  ByteReader statistics(counted);
  const auto messages = statistics.number<std::uint64_t>();
  statistics.number<std::uint16_t>();
  for (int i = 0; i < 3; ++i) statistics.u32();  // skips the numbers of channels, attachments and metadata records
  const std::uint32_t chunks = statistics.u32();
  if (!statistics.ok()) return "the summary's count of messages is damaged";
  if (messages == messages_ && chunks == chunks_) return {};
  return std::to_string(messages) + " messages in " + std::to_string(chunks) + " chunks were written, but " +
         std::to_string(messages_) + " in " + std::to_string(chunks_) + " were read";
}

std::string McapReader::damage_of_record() {
  switch (op_) {
    case Op::kHeader:
      return damage_of_header();
    case Op::kChunk:
      return is_in_summary_ ? "a chunk follows the end of the data" : damage_of_chunk(content_);
    case Op::kMessageIndex:
      return damage_of_index();
    case Op::kSchema:
    case Op::kChannel:
      return read_data_record(op_, content_) ? "" : "a schema or channel is damaged";
    case Op::kMessage:
      return "a message is outside of a chunk, where no sum protects it";
    case Op::kDataEnd:
      return std::exchange(is_in_summary_, true) || content_.size() != sizeof(std::uint32_t)
                 ? "the end of the data is damaged"
                 : "";
    case Op::kStatistics:
      counts_ = content_;
      return "";
    default:
      // Type 0 is no MCAP record; it occurs where pages of a file were zeroed. Types from 0x80 on are private records
      // of other programs, which are skipped.
      const bool is_known = op_ >= Op::kHeader && op_ <= Op::kDataEnd;
      return is_known || static_cast<std::uint8_t>(op_) >= 0x80 ? "" : "there is no record where one should begin";
  }
}

std::optional<Message> McapReader::next() {
  if (!is_open_ && !open()) return std::nullopt;
  while (end_ == End::kNotYet) {
    if (!rest_.empty()) {
      if (auto message = next_in_chunk()) return message;
      continue;
    }
    const bool was_in_summary = is_in_summary_;
    if (!read_record()) return std::nullopt;
    if (op_ == Op::kFooter) {
      std::string damage = damage_of_footer();
      const End end = damage.empty() ? End::kWhole : End::kDamaged;
      return stop(end, std::move(damage));
    }
    if (std::string damage = damage_of_record(); !damage.empty()) return stop(End::kDamaged, std::move(damage));
    follows_chunk_ = op_ == Op::kChunk || op_ == Op::kMessageIndex;
    if (!was_in_summary) continue;
    if (summary_.size() + content_.size() > kMaxRecordBytes) {
      return stop(End::kDamaged, "the summary has more than 64 MiB");
    }
    summary_.insert(summary_.end(), head_.begin(), head_.end());
    summary_.insert(summary_.end(), content_.begin(), content_.end());
  }
  return std::nullopt;
}

}  // namespace tandem::recording
