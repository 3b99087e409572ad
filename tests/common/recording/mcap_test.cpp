// Written messages must be readable, even from a truncated file, and reading must stop at damage.
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "common/recording/mcap_reader.hpp"
#include "common/recording/mcap_writer.hpp"

namespace tandem::recording {
namespace {

Bytes bytes_of(const std::string& text) {
  return {text.begin(), text.end()};
}

McapWriter two_channels() {
  return McapWriter({{"/a", "test.A", bytes_of("descriptors of a")}, {"/b", "test.B", bytes_of("of b")}}, "test 1");
}

void append(Bytes& file, const Bytes& part) {
  file.insert(file.end(), part.begin(), part.end());
}

/// Returns a file with three chunks of ten messages each. `ends` receives the file offset of the end of each chunk.
Bytes whole_file(std::vector<std::size_t>* ends = nullptr) {
  McapWriter writer = two_channels();
  Bytes file = writer.begin();
  for (std::uint64_t i = 0; i < 30; ++i) {
    writer.add(static_cast<std::uint16_t>(i % 2), 1000 + i, bytes_of("message " + std::to_string(i)));
    if (i % 10 != 9) continue;
    append(file, writer.pop_chunk());
    if (ends != nullptr) ends->push_back(file.size());
  }
  append(file, writer.finish());
  return file;
}

struct Reading {
  std::vector<std::string> messages;
  McapReader::End end = McapReader::End::kNotYet;
  std::string why;
};

Reading read(const Bytes& file) {
  std::istringstream in(std::string(file.begin(), file.end()));
  McapReader reader(in);
  Reading reading;
  while (const auto message = reader.next()) {
    reading.messages.push_back(reader.channel(message->channel)->topic + " " + std::to_string(message->log_ns) + " " +
                               std::string(message->data.begin(), message->data.end()));
  }
  reading.end = reader.end();
  reading.why = reader.why();
  return reading;
}

TEST(Mcap, ReadsTheMessagesThatItWrote) {
  const Reading reading = read(whole_file());
  ASSERT_EQ(reading.messages.size(), 30U);
  EXPECT_EQ(reading.messages[0], "/a 1000 message 0");
  EXPECT_EQ(reading.messages[29], "/b 1029 message 29");
  EXPECT_EQ(reading.end, McapReader::End::kWhole) << reading.why;
}

TEST(Mcap, AChannelHasTheNameAndDescriptorsOfItsMessages) {
  const Bytes file = whole_file();
  std::istringstream in(std::string(file.begin(), file.end()));
  McapReader reader(in);
  const auto message = reader.next();
  ASSERT_TRUE(message);
  const Channel* const channel = reader.channel(message->channel);
  ASSERT_NE(channel, nullptr);
  EXPECT_EQ(channel->type, "test.A");
  EXPECT_EQ(channel->descriptors, bytes_of("descriptors of a"));
  EXPECT_EQ(reader.channel(7), nullptr);
}

TEST(Mcap, ATruncatedFileIsReadToItsLastWholeChunk) {
  std::vector<std::size_t> ends;
  const Bytes file = whole_file(&ends);
  const Reading all = read(file);
  for (std::size_t size = 0; size < file.size(); ++size) {
    const Reading reading = read(Bytes(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(size)));
    std::size_t whole_chunks = 0;
    for (const std::size_t end : ends) whole_chunks += size >= end ? 1 : 0;
    // A chunk is readable even if the indexes that follow it are missing.
    ASSERT_GE(reading.messages.size(), 10 * whole_chunks) << "of " << size << " bytes";
    ASSERT_LE(reading.messages.size(), 10 * (whole_chunks + 1));
    ASSERT_TRUE(std::equal(reading.messages.begin(), reading.messages.end(), all.messages.begin()));
    ASSERT_EQ(reading.messages.size() % 10, 0U) << "a chunk counts as a whole";
    const bool has_footer = size + kMagic.size() >= file.size();
    ASSERT_EQ(reading.end, has_footer ? McapReader::End::kWhole : McapReader::End::kCut) << reading.why;
  }
}

TEST(Mcap, AChangedByteGivesNoMessageThatWasNotWritten) {
  const Bytes file = whole_file();
  const Reading all = read(file);
  std::size_t refused = 0;
  for (std::size_t at = 0; at < file.size(); ++at) {
    Bytes damaged = file;
    damaged[at] ^= 0x55U;
    const Reading reading = read(damaged);
    if (reading.end == McapReader::End::kDamaged) ++refused;
    for (const std::string& message : reading.messages) {
      // Only the content is compared, because the checksum of a chunk does not cover the topic.
      const std::string content = message.substr(message.find(' '));
      ASSERT_TRUE(std::ranges::any_of(all.messages, [&](const auto& good) { return good.ends_with(content); }))
          << "byte " << at << ": " << message;
    }
  }
  EXPECT_GT(refused, 100U);
}

TEST(Mcap, LengthsBeyondTheFileTakeNoMemory) {
  Bytes file(kMagic.begin(), kMagic.end());
  file.push_back(static_cast<std::uint8_t>(Op::kChunk));
  for (int i = 0; i < 8; ++i) file.push_back(i == 7 ? 0x7f : 0xff);
  const Reading reading = read(file);
  EXPECT_EQ(reading.end, McapReader::End::kDamaged);
  EXPECT_NE(reading.why.find("64 MiB"), std::string::npos) << reading.why;
}

TEST(Mcap, AChunkThatWasDroppedIsNotInTheIndex) {
  McapWriter writer = two_channels();
  Bytes file = writer.begin();
  writer.add(0, 1, bytes_of("kept"));
  append(file, writer.pop_chunk());
  writer.add(0, 2, bytes_of("lost"));
  writer.pop_chunk();
  writer.drop_chunk();
  writer.add(0, 3, bytes_of("kept too"));
  const std::uint64_t at = file.size();
  const Bytes chunk = writer.pop_chunk();
  append(file, chunk);
  const Bytes end = writer.finish();
  append(file, end);
  const Reading reading = read(file);
  EXPECT_EQ(reading.messages, (std::vector<std::string>{"/a 1 kept", "/a 3 kept too"}));
  // The ChunkIndex contains the file offset of the chunk.
  Bytes place(8);
  for (std::size_t i = 0; i < 8; ++i) place[i] = static_cast<std::uint8_t>(at >> (8 * i));
  EXPECT_NE(std::search(end.begin(), end.end(), place.begin(), place.end()), end.end());
}

}  // namespace
}  // namespace tandem::recording
