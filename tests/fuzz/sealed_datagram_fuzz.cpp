// Passes arbitrary bytes as datagrams to both ends of an encrypted connection with known keys. Each input is used
// twice:
//
// * unchanged, as a stranger without keys would send it;
// * sealed by this target, as a hostile peer with valid keys would send it. Headers and contents then pass the seal and
//   reach the later checks.
//
// An accepted datagram that arrives again must be refused as a duplicate.
#include <cstdint>
#include <optional>
#include <span>

#include "proto/datagram_channel.hpp"
#include "proto/datagram_seal.hpp"
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

/// Returns a datagram with a valid seal, as the peer would send it. It has the type, the sequence number and the
/// content of `input`.
/// In      state  datagram type of the peer's states: kClientUpdate or kServerUpdate
/// Out     empty if `input` has no valid header of type `state` or of the peer's path message (an address check)
std::optional<proto::Bytes> sealed_by_peer(proto::DatagramType state, std::span<const std::byte> input) {
  proto::DatagramHeader header;
  if (proto::read_header(input, state, header) != DropReason::kNone) return std::nullopt;
  proto::Bytes datagram;
  proto::append_header({header.type, 0, fuzz::kConnection, header.sequence}, datagram);
  const auto content = input.subspan(proto::kDatagramHeaderBytes);
  datagram.insert(datagram.end(), content.begin(), content.end());
  proto::DatagramSeal seal(fuzz::fixed_secret(), proto::DatagramSeal::Use::kSeal,
                           state == proto::DatagramType::kClientUpdate, 0);
  seal.seal(header.sequence, datagram);
  return datagram;
}

void receive_at_server(std::span<const std::byte> datagram) {
  using Type = proto::DatagramType;
  receive<proto::ClientUpdate>(Type::kServerUpdate, Type::kClientUpdate, datagram, proto::parse_client_update);
}

void receive_at_client(std::span<const std::byte> datagram) {
  using Type = proto::DatagramType;
  receive<proto::ServerUpdate>(
      Type::kClientUpdate, Type::kServerUpdate, datagram,
      [](auto payload, proto::ServerUpdate& out) { return proto::parse_server_update(payload, out); });
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using Type = proto::DatagramType;
  const std::span<const std::byte> datagram = std::as_bytes(std::span(data, size));
  receive_at_server(datagram);
  receive_at_client(datagram);
  if (const auto sealed = sealed_by_peer(Type::kClientUpdate, datagram)) receive_at_server(*sealed);
  if (const auto sealed = sealed_by_peer(Type::kServerUpdate, datagram)) receive_at_client(*sealed);
  return 0;
}
