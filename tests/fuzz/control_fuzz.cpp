// Treats arbitrary bytes as a control stream that the client or the server reads. The size of the input selects the
// size of the pieces in which the stream arrives, so that framing is also tested.
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
