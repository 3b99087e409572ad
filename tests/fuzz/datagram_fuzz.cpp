// Any bytes as a datagram, read by either side; what is read must survive being written and read again.
#include <cstdint>
#include <cstdlib>
#include <span>

#include "proto/state_codec.hpp"

namespace {

using tandem::Bytes;
using tandem::DropReason;

void check(bool is_good) {
  if (!is_good) std::abort();
}

void read_as_client_update(std::span<const std::byte> payload) {
  tandem::ClientUpdate update;
  if (tandem::parse_client_update(payload, update) != DropReason::kNone) return;
  Bytes again;
  tandem::append_client_update(update, again);
  check(tandem::parse_client_update(again, update) == DropReason::kNone);
}

void read_as_server_update(std::span<const std::byte> payload) {
  tandem::ServerUpdate update;
  if (tandem::parse_server_update(payload, update) != DropReason::kNone) return;
  Bytes again;
  tandem::ServerUpdateEncoder().append(update, again);
  check(again.size() <= tandem::kMaxPayloadBytes);
  check(tandem::parse_server_update(again, update) == DropReason::kNone);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::byte> datagram = std::as_bytes(std::span(data, size));
  tandem::DatagramHeader header;
  if (tandem::parse_header(datagram, header) != DropReason::kNone) return 0;
  read_as_client_update(tandem::payload_of(datagram));
  read_as_server_update(tandem::payload_of(datagram));
  return 0;
}
