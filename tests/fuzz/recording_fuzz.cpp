// Reads arbitrary bytes as a recording. The reader must terminate, and every message must belong to a channel of the
// file. The messages must give a complete recording when they are written again.
#include <cstdint>
#include <sstream>

#include "common/recording/mcap_reader.hpp"
#include "common/recording/mcap_writer.hpp"
#include "tests/fuzz/check.hpp"

using tandem::fuzz::check;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tandem::recording;
  constexpr std::size_t kMaxMessages = 1000;
  std::istringstream in(std::string(reinterpret_cast<const char*>(data), size));
  McapReader reader(in);
  McapWriter writer({{"/again", "Again", {}}}, "fuzz");
  Bytes file = writer.begin();
  std::size_t messages = 0;
  while (const auto message = reader.next()) {
    check(reader.channel(message->channel) != nullptr);
    if (++messages > kMaxMessages) return 0;
    writer.add(0, message->log_ns, message->data);
  }
  check(reader.end() != McapReader::End::kNotYet);
  for (const Bytes& part : {writer.pop_chunk(), writer.finish()}) file.insert(file.end(), part.begin(), part.end());
  std::istringstream written(std::string(file.begin(), file.end()));
  McapReader again(written);
  std::size_t read = 0;
  while (again.next()) ++read;
  check(read == messages && again.end() == McapReader::End::kWhole);
  return 0;
}
