// Reads arbitrary bytes as a datagram of the client or the server. Every accepted update must be readable again after
// it is written, and must fit into a datagram.
#include <cstdint>
#include <span>

#include "proto/state_codec.hpp"
#include "tests/fuzz/check.hpp"

namespace {

using tandem::fuzz::check;
using tandem::proto::Bytes;
using tandem::proto::DropReason;

void read_as_client_update(std::span<const std::byte> payload) {
  tandem::proto::ClientUpdate update;
  if (tandem::proto::parse_client_update(payload, update) != DropReason::kNone) return;
  Bytes again;
  tandem::proto::append_client_update(update, again);
  check(tandem::proto::parse_client_update(again, update) == DropReason::kNone);
}

void read_as_server_update(std::span<const std::byte> payload) {
  tandem::proto::ServerUpdate update;
  if (tandem::proto::parse_server_update(payload, update) != DropReason::kNone) return;
  Bytes again;
  tandem::proto::ServerUpdateEncoder().append(update, again);
  check(again.size() <= tandem::proto::kMaxPayloadBytes);
  check(tandem::proto::parse_server_update(again, update) == DropReason::kNone);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::byte> datagram = std::as_bytes(std::span(data, size));
  tandem::proto::DatagramHeader header;
  if (tandem::proto::parse_header(datagram, header) != DropReason::kNone) return 0;
  read_as_client_update(tandem::proto::payload_of(datagram));
  read_as_server_update(tandem::proto::payload_of(datagram));
  return 0;
}
