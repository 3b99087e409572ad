// Tests the proxy with real sockets on loopback. The time is an argument, so no real time passes.
#include "lab/session/link_proxy.hpp"

#include <gtest/gtest.h>

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ip/udp.hpp>
#include <chrono>
#include <thread>

namespace tandem::lab {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using asio::ip::udp;
using boost::system::error_code;

constexpr int kMostSteps = 5000;  // maximum number of steps of 1 ms; reached only if no data arrives

class LinkProxyTest : public ::testing::Test {
 protected:
  explicit LinkProxyTest(const net::LinkParameters& link = {}) {
    LinkProxySettings settings;
    settings.port = acceptor_.local_endpoint().port();
    settings.link = link;
    datagrams_ = udp::socket(io_, udp::endpoint(asio::ip::make_address("127.0.0.1"), settings.port));
    datagrams_.non_blocking(true);
    acceptor_.non_blocking(true);
    proxy_ = std::make_unique<LinkProxy>(settings);
    proxy_address_ = {asio::ip::make_address(settings.listen), settings.port};
  }

  void step(Duration time = std::chrono::milliseconds(1)) {
    now_ += time;
    proxy_->step(now_);
    std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
  template <class Condition>
  bool step_until(Condition is_so) {
    for (int i = 0; i < kMostSteps; ++i) {
      if (is_so()) return true;
      step();
    }
    return false;
  }
  /// Opens a stream through the proxy. Returns the client's socket and the server's socket.
  std::pair<tcp::socket, tcp::socket> connected() {
    tcp::socket client(io_), server(io_);
    client.connect(proxy_address_);
    client.non_blocking(true);
    error_code error;
    const bool has_arrived = step_until([&] {
      acceptor_.accept(server, error);
      return !error;
    });
    EXPECT_TRUE(has_arrived);
    server.non_blocking(true);
    return {std::move(client), std::move(server)};
  }
  /// Returns the error code of the last read from a socket.
  error_code end_of(tcp::socket& socket) {
    error_code error;
    std::array<char, 16> bytes{};
    step_until([&] {
      socket.read_some(asio::buffer(bytes), error);
      return error && error != asio::error::would_block;
    });
    return error;
  }
  std::size_t datagrams_at_the_server() {
    std::size_t number = 0;
    error_code error;
    std::array<char, 16> bytes{};
    while (datagrams_.receive(asio::buffer(bytes), 0, error) > 0 && !error) ++number;
    return number;
  }
  udp::socket sender() {
    udp::socket client(io_, udp::endpoint(asio::ip::make_address("127.0.0.1"), 0));
    client.connect(udp::endpoint(proxy_address_.address(), proxy_address_.port()));
    return client;
  }

  asio::io_context io_;
  tcp::acceptor acceptor_{io_, {asio::ip::make_address("127.0.0.1"), 0}};
  udp::socket datagrams_{io_};
  std::unique_ptr<LinkProxy> proxy_;
  tcp::endpoint proxy_address_;
  LocalTime now_{};
};

TEST_F(LinkProxyTest, ResetEndsBothEndsAtOnceAndLetsNewStreamsCome) {
  auto [client, server] = connected();
  EXPECT_EQ(proxy_->streams(), 1U);
  proxy_->reset();
  EXPECT_EQ(end_of(client), asio::error::connection_reset);
  EXPECT_EQ(end_of(server), asio::error::connection_reset);
  EXPECT_EQ(proxy_->streams(), 0U);

  auto [client_again, server_again] = connected();
  client_again.send(asio::buffer("x", 1));
  std::array<char, 1> byte{};
  error_code error;
  EXPECT_TRUE(step_until([&, &from = server_again] { return from.read_some(asio::buffer(byte), error) == 1; }));
}

TEST_F(LinkProxyTest, AnAddressThatIsSilentForAMinuteIsForgotten) {
  udp::socket quiet = sender(), busy = sender();
  quiet.send(asio::buffer("x", 1));
  busy.send(asio::buffer("x", 1));
  ASSERT_TRUE(step_until([&] { return proxy_->flows() == 2; }));
  for (int i = 0; i < 5; ++i) {
    busy.send(asio::buffer("x", 1));
    step(std::chrono::seconds(15));
  }
  EXPECT_EQ(proxy_->flows(), 1U);
}

net::LinkParameters slow() {
  net::LinkParameters link;
  link.delay = std::chrono::milliseconds(200);
  return link;
}

class SlowLink : public LinkProxyTest {
 protected:
  SlowLink() : LinkProxyTest(slow()) {}
};

TEST_F(SlowLink, DeliversTheLastBytesOfBothEndsThoughBothHaveEnded) {
  auto [client, server] = connected();
  for (tcp::socket* const socket : {&client, &server}) {
    socket->send(asio::buffer("last", 4));
    socket->shutdown(tcp::socket::shutdown_send);
  }
  for (tcp::socket* const socket : {&client, &server}) {
    std::array<char, 16> bytes{};
    std::size_t number = 0;
    error_code error;
    step_until([&] {
      number += socket->read_some(asio::buffer(bytes), error);
      return error && error != asio::error::would_block;
    });
    EXPECT_EQ(number, 4U);
    EXPECT_EQ(error, asio::error::eof);
  }
  EXPECT_TRUE(step_until([&] { return proxy_->streams() == 0; }));
}

net::LinkParameters doubling() {
  net::LinkParameters link;
  link.delay = std::chrono::milliseconds(5);
  link.duplication = 1;
  return link;
}

class DoublingLink : public LinkProxyTest {
 protected:
  DoublingLink() : LinkProxyTest(doubling()) {}
};

TEST_F(DoublingLink, DeliversEachDatagramTwice) {
  udp::socket client = sender();
  for (int i = 0; i < 10; ++i) client.send(asio::buffer("x", 1));
  std::size_t number = 0;
  EXPECT_TRUE(step_until([&] { return (number += datagrams_at_the_server()) >= 20; }));
  for (int i = 0; i < 100; ++i) step();
  EXPECT_EQ(number + datagrams_at_the_server(), 20U);
}

}  // namespace
}  // namespace tandem::lab
