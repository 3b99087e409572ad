// Reads arbitrary bytes at either end of a connection with known keys: once as a sealed datagram, as a stranger would
// send it, and once sealed by the target itself, as a hostile peer with valid keys would send it. In the second case
// mutated headers and contents reach the checks behind the seal. A datagram that was accepted once must be refused as a
// duplicate.
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

/// Makes a datagram with a valid seal from the type, the sequence and the content of the input.
/// In      state  type of state that the peer sends
/// Out     empty if the input has no valid header of this state or of the corresponding path message
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
