// Passes arbitrary bytes as the messages of a server to a complete client with its local model and a device.
#include <cstdint>

#include "tests/fuzz/fuzzed_client.hpp"
#include "tests/fuzz/server_script.hpp"

namespace {

using namespace tandem;

class Victim {
 public:
  Victim() : it_({.name = "local-model"}) {}

  void suffer(const fuzz::ScriptedAct& next) {
    it_.connect();
    switch (next.act) {
      case fuzz::ServerAct::kMessage:
        send_control(next.bytes);
        break;
      case fuzz::ServerAct::kStream:
        it_.session().on_control_bytes(next.bytes, it_.now());
        break;
      case fuzz::ServerAct::kDatagram:
        it_.session().on_datagram(next.bytes, it_.now());
        break;
      case fuzz::ServerAct::kState:
        send_state(next.bytes);
        break;
      case fuzz::ServerAct::kHangUp:
        it_.session().on_disconnected(it_.now(), "the server hung up");
        break;
      default:
        for (std::size_t i = 1; i < next.bytes.size(); ++i) it_.tick();
    }
    it_.tick();
  }

 private:
  void send_control(std::span<const std::byte> payload) {
    wire::ServerControl message;
    if (proto::parse_control(payload, message) && message.has_welcome()) welcome_ = message.welcome();
    it_.deliver(payload);
  }

  void send_state(std::span<const std::byte> payload) {
    proto::Bytes datagram;
    const auto epoch = static_cast<std::uint8_t>(welcome_.epoch());
    proto::append_header(
        {proto::DatagramType::kServerUpdate, epoch, ConnectionId{welcome_.connection_id()}, ++sequence_}, datagram);
    datagram.insert(datagram.end(), payload.begin(), payload.end());
    it_.session().on_datagram(datagram, it_.now());
  }

  fuzz::FuzzedClient it_;
  wire::Welcome welcome_;
  std::uint64_t sequence_ = 0;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Victim victim;
  std::span<const std::byte> script = std::as_bytes(std::span(data, size));
  while (!script.empty()) victim.suffer(fuzz::next_act(script));
  return 0;
}
