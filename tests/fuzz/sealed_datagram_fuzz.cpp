// Reads arbitrary bytes as a sealed datagram at either end of a connection with known keys. The seeds have valid seals.
// A datagram that was accepted once must be refused as a duplicate.
#include <cstdint>
#include <span>

#include "proto/datagram_channel.hpp"
#include "proto/state_codec.hpp"
#include "tests/fuzz/check.hpp"
#include "tests/fuzz/secure_seeds.hpp"

namespace {

using namespace tandem;
using fuzz::check;
using proto::DropReason;

proto::DatagramChannel channel_that_sends(proto::DatagramType type, proto::ChannelCounters& counters) {
  return {{.sends = type, .connection = fuzz::kConnection, .max_rate_hz = 1000, .secret = fuzz::fixed_secret()},
          counters};
}

template <class Update, class Read>
void receive(proto::DatagramType sends, proto::DatagramType expected, std::span<const std::byte> datagram,
             const Read& read) {
  proto::ChannelCounters counters;
  proto::DatagramChannel channel = channel_that_sends(sends, counters);
  proto::DatagramHeader header;
  if (proto::read_header(datagram, expected, header) != DropReason::kNone || !channel.is_for(header)) return;
  std::uint64_t number = 0;
  Update update;
  const auto receive_once = [&] {
    return header.type == expected ? channel.receive(header, datagram, LocalTime{}, update, read)
                                   : channel.receive_path(header, datagram, number);
  };
  if (receive_once() == DropReason::kNone) check(receive_once() == DropReason::kDuplicate);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using Type = proto::DatagramType;
  const std::span<const std::byte> datagram = std::as_bytes(std::span(data, size));
  receive<proto::ClientUpdate>(Type::kServerUpdate, Type::kClientUpdate, datagram, proto::parse_client_update);
  receive<proto::ServerUpdate>(
      Type::kClientUpdate, Type::kServerUpdate, datagram,
      [](auto payload, proto::ServerUpdate& out) { return proto::parse_server_update(payload, out); });
  return 0;
}
