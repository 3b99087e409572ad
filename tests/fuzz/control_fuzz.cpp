// Reads arbitrary bytes as a control stream of the client or the server. The stream arrives in pieces whose size
// depends on the size of the input, so that framing is tested too.
#include <algorithm>
#include <cstdint>
#include <span>

#include "proto/control_framing.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::size_t piece = 1 + size % 61;
  std::span<const std::byte> stream = std::as_bytes(std::span(data, size));
  tandem::proto::FrameReader reader;
  tandem::wire::ClientControl from_client;
  tandem::wire::ServerControl from_server;
  while (!stream.empty()) {
    const auto fed = stream.first(std::min(piece, stream.size()));
    stream = stream.subspan(fed.size());
    if (!reader.feed(fed)) break;
    while (const auto payload = reader.next()) {
      tandem::proto::parse_control(*payload, from_client);
      tandem::proto::parse_control(*payload, from_server);
    }
  }
  return 0;
}
