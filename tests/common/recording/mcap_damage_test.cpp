// For any kind and position of damage, a reader must either report the damage or deliver every message.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "common/base/random.hpp"
#include "common/recording/mcap_reader.hpp"
#include "common/recording/mcap_writer.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::recording {
namespace {

/// Topic and content of each message.
using Messages = std::vector<std::pair<std::string, std::string>>;

struct Written {
  Bytes file;
  Messages messages;
  std::vector<std::uint64_t> chunks_at;         ///< file offset of the start of each chunk
  std::uint64_t data_end = 0;                   ///< file offset of the start of the summary
  std::vector<std::size_t> messages_of_chunks;  ///< number of messages up to the end of each chunk
};

Bytes random_bytes(Random& random, std::size_t size) {
  Bytes bytes(size);
  // With few distinct values the bytes are compressible.
  const std::uint32_t kinds = 1 + random.next_u32() % 256;
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random.next_u32() % kinds);
  return bytes;
}

Written random_file(Random& random) {
  std::vector<Channel> channels;
  const std::uint32_t channel_count = 1 + random.next_u32() % 4;
  for (std::uint32_t i = 0; i < channel_count; ++i) {
    channels.push_back({"/topic" + std::to_string(i), "test.Type", random_bytes(random, random.next_u32() % 300)});
  }
  McapWriter writer(channels, "test 1");
  Written written;
  written.file = writer.begin();
  const auto append = [&written](const Bytes& part) {
    written.file.insert(written.file.end(), part.begin(), part.end());
  };
  const std::uint32_t chunk_count = 2 + random.next_u32() % 8;
  std::uint64_t time_ns = 1'700'000'000'000'000'000U;
  for (std::uint32_t chunk = 0; chunk < chunk_count; ++chunk) {
    const std::uint32_t message_count = 1 + random.next_u32() % 20;
    for (std::uint32_t i = 0; i < message_count; ++i) {
      const auto channel = static_cast<std::uint16_t>(random.next_u32() % channel_count);
      const Bytes data = random_bytes(random, random.next_u32() % 400);
      writer.add(channel, time_ns += random.next_u32() % 2'000'000, data);
      written.messages.emplace_back(channels[channel].topic, std::string(data.begin(), data.end()));
    }
    written.chunks_at.push_back(written.file.size());
    written.messages_of_chunks.push_back(written.messages.size());
    append(writer.pop_chunk());
  }
  written.data_end = written.file.size();
  append(writer.finish());
  return written;
}

struct Damage {
  std::string what;
  Bytes file;
  std::uint64_t at = 0;  ///< file offset of the first damaged byte
};

Damage damaged(const Written& written, Random& random) {
  const Bytes& file = written.file;
  const std::size_t at = random.next_u32() % file.size();
  const std::size_t size =
      std::min<std::size_t>(file.size() - at, 1 + random.next_u32() % (1U << random.next_u32() % 12));
  const auto begin = file.begin() + static_cast<std::ptrdiff_t>(at), end = begin + static_cast<std::ptrdiff_t>(size);
  Damage damage{"", file, 0};
  const auto range = [&] { return damage.file.begin() + static_cast<std::ptrdiff_t>(at); };
  switch (random.next_u32() % 8) {
    case 0:
      damage.what = "cut";
      damage.file.assign(file.begin(), begin);
      if (random.next_u32() % 4 > 0) break;
      damage.what = "cut before a chunk";
      damage.file = file;
      damage.file.resize(written.chunks_at[random.next_u32() % written.chunks_at.size()]);
      break;
    case 1:
      damage.what = "zeroed";
      std::fill(range(), range() + static_cast<std::ptrdiff_t>(size), std::uint8_t{0});
      break;
    case 2:
      damage.what = "pages of 512 bytes zeroed";
      std::fill(damage.file.begin() + static_cast<std::ptrdiff_t>(at / 512 * 512),
                damage.file.begin() + static_cast<std::ptrdiff_t>(std::min(file.size(), at / 512 * 512 + 512)),
                std::uint8_t{0});
      break;
    case 3:
      damage.what = "a bit flipped";
      damage.file[at] ^= static_cast<std::uint8_t>(1U << random.next_u32() % 8);
      break;
    case 4:
      damage.what = "overwritten";
      for (std::size_t i = at; i < at + size; ++i) damage.file[i] = static_cast<std::uint8_t>(random.next_u32());
      break;
    case 5:
      damage.what = "taken out";
      damage.file.erase(range(), range() + static_cast<std::ptrdiff_t>(size));
      break;
    case 6:
      damage.what = "written twice";
      damage.file.insert(range(), begin, end);
      break;
    default:
      damage.what = "put elsewhere";
      std::copy(begin, end,
                damage.file.begin() + static_cast<std::ptrdiff_t>(random.next_u32() % (file.size() - size + 1)));
      break;
  }
  damage.what += " at " + std::to_string(at) + ", " + std::to_string(size) + " bytes of " + std::to_string(file.size());
  damage.at = static_cast<std::uint64_t>(
      std::mismatch(file.begin(), file.end(), damage.file.begin(), damage.file.end()).first - file.begin());
  return damage;
}

bool has_same_content(const Messages::value_type& a, const Messages::value_type& b) {
  return a.second == b.second;
}

/// Returns true if `read` is a prefix of `written`; topics are ignored.
bool is_beginning(const Messages& read, const Messages& written) {
  return read.size() <= written.size() && std::equal(read.begin(), read.end(), written.begin(), has_same_content);
}

/// Returns whether `read` consists of whole chunks of `written`, each with its messages in order. Two exceptions are
/// allowed:
/// - A chunk may occur twice, because damage can duplicate it in the file.
/// - The last chunk may be incomplete, because a message with a damaged channel ends the reading.
bool is_of_chunks(const Messages& read, const Written& written) {
  std::vector<int> times(written.chunks_at.size());
  std::size_t at = 0;
  const auto is_next = [&](std::size_t chunk) {
    const std::size_t begin = chunk == 0 ? 0 : written.messages_of_chunks[chunk - 1];
    const std::size_t size = std::min(written.messages_of_chunks[chunk] - begin, read.size() - at);
    const auto first = written.messages.begin() + static_cast<std::ptrdiff_t>(begin);
    if (times[chunk] == 2 || !std::equal(first, first + static_cast<std::ptrdiff_t>(size),
                                         read.begin() + static_cast<std::ptrdiff_t>(at), has_same_content))
      return false;
    ++times[chunk];
    at += size;
    return true;
  };
  while (at < read.size()) {
    std::size_t chunk = 0;
    while (chunk < times.size() && !is_next(chunk)) ++chunk;
    if (chunk == times.size()) return false;
  }
  return true;
}

TEST(McapDamage, AnyDamageIsReportedOrLosesNoMessage) {
  const std::uint64_t seed = test::test_seed(1);
  Random random(seed);
  int whole = 0, cut = 0, damaged_files = 0, behind_a_record = 0;
  for (int i = 0; i < 6'000; ++i) {
    if (HasFailure()) break;
    const Written written = random_file(random);
    const Damage damage = damaged(written, random);
    SCOPED_TRACE("seed " + std::to_string(seed) + ", file " + std::to_string(i) + ": " + damage.what);
    std::istringstream in(std::string(damage.file.begin(), damage.file.end()));
    McapReader reader(in);
    Messages read;
    while (const auto message = reader.next()) {
      read.emplace_back(reader.channel(message->channel)->topic,
                        std::string(message->data.begin(), message->data.end()));
    }
    ASSERT_EQ(reader.messages(), read.size());
    ASSERT_LE(reader.offset(), damage.file.size());
    if (reader.end() == McapReader::End::kWhole) {
      ++whole;
      ASSERT_EQ(read, written.messages) << "messages are missing, or others, in silence";
      ASSERT_EQ(reader.why(), "");
      continue;
    }
    ASSERT_NE(reader.end(), McapReader::End::kNotYet);
    ASSERT_NE(reader.why(), "");
    (reader.end() == McapReader::End::kCut ? cut : damaged_files) += 1;
    behind_a_record += reader.ends_behind_a_record() ? 1 : 0;
    const bool may_repeat = damage.what.starts_with("written twice") || damage.what.starts_with("put elsewhere");
    ASSERT_TRUE(may_repeat ? is_of_chunks(read, written) : is_beginning(read, written.messages)) << reader.why();
    if (damage.at < written.chunks_at.front() || damage.at >= written.data_end) continue;
    // If the data section is damaged, the reader must stop in the damaged chunk, after it has read all earlier chunks.
    const auto behind = std::ranges::upper_bound(written.chunks_at, damage.at);
    const auto chunk = static_cast<std::size_t>(behind - written.chunks_at.begin()) - 1;
    ASSERT_GE(reader.offset(), written.chunks_at[chunk]) << reader.why();
    ASSERT_GE(read.size(), chunk == 0 ? 0 : written.messages_of_chunks[chunk - 1]) << reader.why();
    if (damage.at + 1 < damage.file.size()) continue;
    ASSERT_LE(reader.offset(), damage.at) << reader.why();
  }
  EXPECT_GT(whole, 30);
  EXPECT_GT(cut, 300);
  EXPECT_GT(behind_a_record, 3);
  EXPECT_GT(damaged_files, 1500);
}

TEST(McapDamage, IsNamedWithItsByte) {
  Random random(3);
  const Written written = random_file(random);
  for (const std::uint64_t chunk_at : written.chunks_at) {
    Bytes file = written.file;
    file[chunk_at + 60] ^= 1U;
    std::istringstream in(std::string(file.begin(), file.end()));
    McapReader reader(in);
    while (reader.next()) {
    }
    EXPECT_EQ(reader.end(), McapReader::End::kDamaged);
    EXPECT_EQ(reader.offset(), chunk_at) << reader.why();
  }
}

/// Detects the silent loss of a chunk whose type byte was changed to that of a private record, which readers skip.
TEST(McapDamage, AChunkThatWasMadeAnotherRecordIsNoticed) {
  Random random(4);
  const Written written = random_file(random);
  for (const std::uint64_t chunk_at : written.chunks_at) {
    for (unsigned op = 0; op < 256; ++op) {
      if (op == static_cast<unsigned>(Op::kChunk)) continue;
      Bytes file = written.file;
      file[chunk_at] = static_cast<std::uint8_t>(op);
      for (const std::size_t size : {file.size(), static_cast<std::size_t>(written.data_end)}) {
        std::istringstream in(std::string(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(size)));
        McapReader reader(in);
        while (reader.next()) {
        }
        EXPECT_EQ(reader.end(), McapReader::End::kDamaged)
            << "kind " << op << ", at " << chunk_at << ": " << reader.why();
      }
    }
  }
}

TEST(McapDamage, OfATopicIsNoticedByTheSummary) {
  Random random(5);
  const Written written = random_file(random);
  Bytes file = written.file;
  const std::string topic = "/topic0";
  const auto found = std::search(file.begin(), file.end(), topic.begin(), topic.end());
  ASSERT_NE(found, file.end());
  *(found + 1) = 'x';
  std::istringstream in(std::string(file.begin(), file.end()));
  McapReader reader(in);
  while (reader.next()) {
  }
  EXPECT_EQ(reader.end(), McapReader::End::kDamaged);
}

}  // namespace
}  // namespace tandem::recording
