// Passes arbitrary bytes as the messages of a server to a source of signals, and as a line of text to its reader.
#include <algorithm>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "client/signals/signal_line.hpp"
#include "client/signals/signal_session.hpp"
#include "proto/signals.hpp"
#include "tests/fuzz/check.hpp"
#include "tests/fuzz/server_script.hpp"
#include "tests/support/session_bench.hpp"

namespace {

using namespace tandem;

bool is_printable(const std::string& text) {
  return std::ranges::all_of(text, [](char c) { return static_cast<unsigned char>(c) >= ' ' && c != 127; });
}

class Victim {
 public:
  Victim() : source_({}, transport_) {
    source_.on_log = [](const std::string& line) { fuzz::check(is_printable(line)); };
    source_.start(now_);
  }

  void suffer(const fuzz::ScriptedAct& next) {
    if (source_.status().state == client::SessionState::kConnecting) source_.on_connected(now_);
    proto::Bytes frame;
    switch (next.act) {
      case fuzz::ServerAct::kMessage:
        for (const int shift : {24, 16, 8, 0}) frame.push_back(static_cast<std::byte>(next.bytes.size() >> shift));
        frame.insert(frame.end(), next.bytes.begin(), next.bytes.end());
        source_.on_control_bytes(frame, now_);
        break;
      case fuzz::ServerAct::kStream:
        source_.on_control_bytes(next.bytes, now_);
        break;
      case fuzz::ServerAct::kDatagram:
      case fuzz::ServerAct::kState:
        source_.on_datagram(next.bytes, now_);
        break;
      case fuzz::ServerAct::kHangUp:
        source_.on_disconnected(now_, "the server hung up");
        break;
      default:
        now_ += std::chrono::milliseconds(static_cast<int>(next.bytes.size()));
    }
    source_.set({"s" + std::to_string(++number_ % 100), 0.5, 1, now_});
    source_.poll(now_);
    fuzz::check(source_.names().size() <= client::SignalSession::kMaxNames);
    fuzz::check(std::ranges::all_of(source_.names(), is_printable) && is_printable(source_.status().why));
    fuzz::check(source_.waiting() <= client::SignalSession::kMaxNames);
    fuzz::check(source_.unconfirmed() <= client::SignalSession::kMaxNames);
    transport_.messages.clear();
  }

 private:
  test::RecordingClientTransport transport_;
  LocalTime now_{std::chrono::seconds(10)};
  client::SignalSession source_;
  std::uint64_t number_ = 0;
};

void read_line(const std::string& text) {
  try {
    const client::SignalLine line = client::parse_signal_line(text);
    fuzz::check(client::problem_of(line.signal).empty() && proto::is_signal_age(to_seconds(line.age)));
  } catch (const std::invalid_argument& error) {
    fuzz::check(is_printable(error.what()));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  read_line(std::string(data, data + size));
  Victim victim;
  std::span<const std::byte> script = std::as_bytes(std::span(data, size));
  while (!script.empty()) victim.suffer(fuzz::next_act(script));
  return 0;
}
