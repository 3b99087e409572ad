#include "common/recording/mcap_writer.hpp"

#include <zstd.h>

#include <algorithm>
#include <boost/crc.hpp>
#include <stdexcept>
#include <utility>

#include "common/base/byte_io.hpp"

namespace tandem::recording {
namespace {

/// Compression level of zstd. Measured at this level: one core compresses about 500 MB/s, and recordings of rooms
/// shrink to a third.
constexpr int kCompression = 1;
constexpr std::size_t kRecordHead = 9;  ///< size of a record's type and length [bytes]

void append_text(ByteWriter& out, std::string_view text) {
  out.u32(static_cast<std::uint32_t>(text.size()));
  out.array(std::span(text.data(), text.size()));
}

/// Appends a record. `fill` appends the record's content; then the length of the content is inserted.
template <class Fill>
void append_record(Bytes& out, Op op, const Fill& fill) {
  ByteWriter writer(out);
  writer.number(static_cast<std::uint8_t>(op));
  const std::size_t length_at = out.size();
  writer.number(std::uint64_t{0});
  fill(writer);
  Bytes length;
  ByteWriter(length).number(static_cast<std::uint64_t>(out.size() - length_at - sizeof(std::uint64_t)));
  std::ranges::copy(length, out.begin() + static_cast<std::ptrdiff_t>(length_at));
}

void append_magic(Bytes& out) {
  ByteWriter(out).array(std::span(kMagic.data(), kMagic.size()));
}

Bytes compressed(std::span<const std::uint8_t> bytes) {
  Bytes out(ZSTD_compressBound(bytes.size()));
  const std::size_t size = ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), kCompression);
  if (ZSTD_isError(size) != 0) throw std::runtime_error("a recording's chunk could not be compressed");
  out.resize(size);
  return out;
}

}  // namespace

std::uint32_t crc32(std::span<const std::uint8_t> bytes) {
  boost::crc_32_type crc;
  crc.process_bytes(bytes.data(), bytes.size());
  return crc.checksum();
}

McapWriter::McapWriter(std::vector<Channel> channels, std::string library)
    : channels_(std::move(channels)), library_(std::move(library)) {}

void McapWriter::describe_channels(Bytes& out) const {
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    const Channel& channel = channels_[i];
    append_record(out, Op::kSchema, [&](ByteWriter& content) {
      content.number(static_cast<std::uint16_t>(i + 1));
      append_text(content, channel.type);
      append_text(content, "protobuf");
      content.u32(static_cast<std::uint32_t>(channel.descriptors.size()));
      content.array(std::span(channel.descriptors));
    });
    append_record(out, Op::kChannel, [&](ByteWriter& content) {
      content.number(static_cast<std::uint16_t>(i));
      content.number(static_cast<std::uint16_t>(i + 1));
      append_text(content, channel.topic);
      append_text(content, "protobuf");
      content.u32(0);  // number of metadata bytes
    });
  }
}

Bytes McapWriter::begin() {
  Bytes out;
  append_magic(out);
  append_record(out, Op::kHeader, [this](ByteWriter& content) {
    append_text(content, "");
    append_text(content, library_);
  });
  describe_channels(out);
  file_bytes_ = out.size();
  sequences_.assign(channels_.size(), 0);
  counts_.assign(channels_.size(), 0);
  chunk_indexes_.clear();
  chunks_ = begin_ns_ = end_ns_ = 0;
  return out;
}

void McapWriter::add(std::uint16_t channel, std::uint64_t time_ns, std::span<const std::uint8_t> data) {
  index_[channel].push_back({time_ns, chunk_.size()});
  append_record(chunk_, Op::kMessage, [&](ByteWriter& content) {
    content.number(channel);
    content.number(++sequences_.at(channel));
    content.number(time_ns);
    content.number(time_ns);
    content.array(data);
  });
  ++chunk_messages_;
}

Bytes McapWriter::pop_chunk() {
  Bytes out;
  if (chunk_messages_ == 0) return out;
  last_indexes_ = chunk_indexes_.size();
  last_file_bytes_ = file_bytes_;
  last_begin_ns_ = begin_ns_;
  last_end_ns_ = end_ns_;
  last_counts_ = counts_;
  std::uint64_t first = UINT64_MAX, last = 0;
  for (const auto& [channel, entries] : index_) {
    for (const auto& entry : entries) {
      first = std::min(first, entry[0]);
      last = std::max(last, entry[0]);
    }
    counts_[channel] += entries.size();
  }
  const Bytes packed = compressed(chunk_);
  append_record(out, Op::kChunk, [&](ByteWriter& content) {
    content.number(first);
    content.number(last);
    content.number(static_cast<std::uint64_t>(chunk_.size()));
    content.u32(crc32(chunk_));
    append_text(content, "zstd");
    content.number(static_cast<std::uint64_t>(packed.size()));
    content.array(std::span(packed));
  });
  const std::uint64_t chunk_length = out.size();
  std::map<std::uint16_t, std::uint64_t> index_offsets;
  for (const auto& [channel, entries] : index_) {
    index_offsets[channel] = file_bytes_ + out.size();
    append_record(out, Op::kMessageIndex, [number = channel, &its = entries](ByteWriter& content) {
      content.number(number);
      content.u32(static_cast<std::uint32_t>(its.size() * sizeof(its.front())));
      for (const auto& entry : its) content.array(std::span<const std::uint64_t>(entry));
    });
  }
  append_record(chunk_indexes_, Op::kChunkIndex, [&](ByteWriter& content) {
    content.number(first);
    content.number(last);
    content.number(file_bytes_);
    content.number(chunk_length);
    content.u32(static_cast<std::uint32_t>(index_offsets.size() * (sizeof(std::uint16_t) + sizeof(std::uint64_t))));
    for (const auto& [channel, offset] : index_offsets) {
      content.number(channel);
      content.number(offset);
    }
    content.number(out.size() - chunk_length);
    append_text(content, "zstd");
    content.number(static_cast<std::uint64_t>(packed.size()));
    content.number(static_cast<std::uint64_t>(chunk_.size()));
  });
  begin_ns_ = chunks_ == 0 ? first : std::min(begin_ns_, first);
  end_ns_ = std::max(end_ns_, last);
  ++chunks_;
  file_bytes_ += out.size();
  chunk_.clear();
  index_.clear();
  chunk_messages_ = 0;
  return out;
}

void McapWriter::drop_chunk() {
  chunk_indexes_.resize(last_indexes_);
  file_bytes_ = last_file_bytes_;
  begin_ns_ = last_begin_ns_;
  end_ns_ = last_end_ns_;
  counts_ = last_counts_;
  --chunks_;
}

void McapWriter::add_statistics(Bytes& out) const {
  append_record(out, Op::kStatistics, [this](ByteWriter& content) {
    std::uint64_t messages = 0;
    for (const std::uint64_t count : counts_) messages += count;
    content.number(messages);
    content.number(static_cast<std::uint16_t>(channels_.size()));
    content.u32(static_cast<std::uint32_t>(channels_.size()));
    content.u32(0);  // number of attachments
    content.u32(0);  // number of metadata records
    content.u32(static_cast<std::uint32_t>(chunks_));
    content.number(begin_ns_);
    content.number(end_ns_);
    content.u32(static_cast<std::uint32_t>(counts_.size() * (sizeof(std::uint16_t) + sizeof(std::uint64_t))));
    for (std::size_t i = 0; i < counts_.size(); ++i) {
      content.number(static_cast<std::uint16_t>(i));
      content.number(counts_[i]);
    }
  });
}

Bytes McapWriter::finish() {
  Bytes out;
  append_record(out, Op::kDataEnd, [](ByteWriter& content) { content.u32(0); });  // 0: no checksum of the data section
  const std::size_t summary_at = out.size();
  describe_channels(out);
  add_statistics(out);
  out.insert(out.end(), chunk_indexes_.begin(), chunk_indexes_.end());
  std::uint32_t sum = 0;
  append_record(out, Op::kFooter, [&](ByteWriter& content) {
    content.number(file_bytes_ + summary_at);
    content.number(std::uint64_t{0});  // 0: no offsets into the summary
    // The checksum covers the summary and this record up to the checksum itself, including the length of the record.
    // append_record() writes that length only later, so it is inserted into the copy from which the sum is computed.
    Bytes summed(out.begin() + static_cast<std::ptrdiff_t>(summary_at), out.end());
    constexpr std::uint64_t kLength = 2 * sizeof(std::uint64_t) + sizeof(std::uint32_t);
    Bytes length;
    ByteWriter(length).number(kLength);
    std::ranges::copy(length, summed.end() - static_cast<std::ptrdiff_t>(3 * sizeof(std::uint64_t)));
    sum = crc32(summed);
    content.u32(sum);
  });
  append_magic(out);
  return out;
}

}  // namespace tandem::recording
