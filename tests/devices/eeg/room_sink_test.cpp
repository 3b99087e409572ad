// Tests RoomSink, which sends the signal of a model to a room: refusals by the room, and a permanent end of the
// session.
#include "devices/eeg/app/room_sink.hpp"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <mutex>
#include <stdexcept>
#include <thread>

#include "proto/control_framing.hpp"

namespace tandem::eeg {
namespace {

using ::testing::HasSubstr;

/// A server of one connection: it admits the source, and sends more messages when the test asks for them.
class OneRoomServer {
 public:
  explicit OneRoomServer(const std::string& signal) : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* const any = reinterpret_cast<sockaddr*>(&address);
    if (::bind(socket_, any, size) != 0 || ::listen(socket_, 1) != 0 || ::getsockname(socket_, any, &size) != 0) {
      throw std::runtime_error("no socket on loopback");
    }
    port = ntohs(address.sin_port);
    thread_ = std::thread([this, signal] {
      connection_ = ::accept(socket_, nullptr, nullptr);
      wire::ServerControl welcome, joined;
      welcome.mutable_welcome()->set_protocol_version(proto::kProtocolVersion);
      welcome.mutable_welcome()->set_connection_id(5);
      send(welcome);
      joined.mutable_joined()->set_user(1);
      joined.mutable_joined()->add_signals(signal);
      send(joined);
    });
  }
  ~OneRoomServer() {
    if (thread_.joinable()) thread_.join();
    ::close(connection_);
    ::close(socket_);
  }
  void end_for_good() {
    thread_.join();
    wire::ServerControl goodbye;
    goodbye.mutable_goodbye()->set_reason(wire::DISCONNECT_RESUMED);
    goodbye.mutable_goodbye()->set_text("the token is used elsewhere");
    send(goodbye);
  }
  client::SignalConnectionSettings settings() {
    client::SignalConnectionSettings settings;
    settings.port = port;
    settings.on_log = [this](const std::string& line) {
      const std::lock_guard lock(mutex);
      log.push_back(line);
    };
    return settings;
  }

  std::uint16_t port = 0;
  std::mutex mutex;
  std::vector<std::string> log;

 private:
  void send(const wire::ServerControl& message) const {
    proto::Bytes frame;
    proto::append_frame(message, frame);
    EXPECT_EQ(::send(connection_, frame.data(), frame.size(), MSG_NOSIGNAL), static_cast<ssize_t>(frame.size()));
  }

  int socket_ = -1;
  int connection_ = -1;
  std::thread thread_;
};

struct CountingSink final : SignalSink {
  void send(const SignalReport& /*report*/) override { ++count; }
  int count = 0;
};

SignalReport report() {
  SignalReport out;
  out.name = "valence";
  out.value = 0.5;
  out.confidence = 0.9;
  return out;
}

TEST(RoomSink, TheFinalLossOfTheRoomIsLoggedAndEndsTheStream) {
  OneRoomServer server("valence");
  CountingSink next;
  RoomSink sink(next, server.settings());
  sink.send(report());
  EXPECT_EQ(next.count, 1);
  server.end_for_good();
  std::string error;
  for (int i = 0; i < 2000 && error.empty(); ++i) {
    try {
      sink.send(report());
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    } catch (const std::runtime_error& lost) {
      error = lost.what();
    }
  }
  EXPECT_THAT(error, HasSubstr("the room was lost: the server ended the connection: the token is used elsewhere"));
  EXPECT_THROW(sink.finish(), std::runtime_error);
  const std::lock_guard lock(server.mutex);
  ASSERT_FALSE(server.log.empty());
  EXPECT_THAT(server.log.back(), HasSubstr("the token is used elsewhere; no more values are sent"));
}

TEST(RoomSink, AValueWithoutConfirmationIsAnError) {
  OneRoomServer server("valence");
  CountingSink next;
  RoomSink sink(next, server.settings());
  sink.send(report());
  try {
    sink.finish();
    FAIL() << "the server has sent no pong";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("the room has not confirmed the last value"));
  }
}

TEST(RoomSink, ARoomWithoutTheSignalIsASetUpError) {
  OneRoomServer server("pulse");
  CountingSink next;
  try {
    RoomSink sink(next, server.settings());
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), HasSubstr("no signal 'valence'; add it to game.signals"));
  }
}

}  // namespace
}  // namespace tandem::eeg
