#include "lab/session/udp_echo.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <cstring>
#include <thread>
#include <utility>
#include <vector>

#include "common/realtime/realtime.hpp"

namespace tandem::lab {
namespace {

namespace asio = boost::asio;
using asio::ip::udp;
using boost::system::error_code;

constexpr std::size_t kDatagramBytes = 220;
/// Time that the thread needs to set up its memory and priority, with a large margin. Datagrams sent earlier are not
/// counted.
constexpr Duration kEchoSettling = std::chrono::milliseconds(200);
/// Relative difference between the sending rate and a room's rate. Without it, all datagrams of a run would arrive at
/// the same phase of the room's period. The result would then depend on whether the processor is busy at this phase.
constexpr double kDrift = 1e-3;
using Datagram = std::array<std::byte, kDatagramBytes>;

/// A separate thread that sends each datagram back to its sender.
class Echo {
 public:
  /// Starts the thread.
  /// In      from  datagrams sent before this time are not counted
  Echo(int priority, LocalTime from) : from_(from), socket_(io_, udp::endpoint(asio::ip::address_v4::loopback(), 0)) {
    timeval receive_timeout{.tv_sec = 0, .tv_usec = 10'000};
    setsockopt(socket_.native_handle(), SOL_SOCKET, SO_RCVTIMEO, &receive_timeout, sizeof receive_timeout);
    thread_ = std::thread([this, priority] { run(priority); });
  }
  ~Echo() { stop(); }
  Echo(const Echo&) = delete;
  Echo& operator=(const Echo&) = delete;

  udp::endpoint address() const { return socket_.local_endpoint(); }
  std::pair<Histogram, Duration> stop() {
    is_stopping_ = true;
    if (thread_.joinable()) thread_.join();
    return {latency_, cpu_};
  }

 private:
  void run(int priority) {
    realtime::request_realtime(priority);
    const SteadyClock clock;
    Datagram datagram;
    const auto cpu = [] { return realtime::cpu_time(pthread_self()); };
    for (; !is_stopping_; cpu_ = cpu()) {
      sockaddr_in from{};
      socklen_t from_size = sizeof from;
      auto* const address = reinterpret_cast<sockaddr*>(&from);
      if (::recvfrom(socket_.native_handle(), datagram.data(), datagram.size(), 0, address, &from_size) < 0) continue;
      LocalTime sent;
      std::memcpy(&sent, datagram.data(), sizeof sent);
      if (sent >= from_) latency_.record(clock.now() - sent);
      ::sendto(socket_.native_handle(), datagram.data(), datagram.size(), 0, address, from_size);
    }
  }

  LocalTime from_;
  asio::io_context io_;
  udp::socket socket_;
  std::atomic<bool> is_stopping_{false};
  Histogram latency_;
  Duration cpu_{0};
  std::thread thread_;
};

}  // namespace

std::pair<Histogram, Duration> udp_echo_latency(std::size_t users, double rate_hz, Duration duration, int priority) {
  const Duration cpu_before = realtime::cpu_time(pthread_self());
  const SteadyClock clock;
  const LocalTime begin = clock.now(), counted_from = begin + std::min(kEchoSettling, duration / 4);
  Echo echo(priority, counted_from);
  asio::io_context io;
  std::vector<udp::socket> sockets;
  for (std::size_t i = 0; i < users; ++i) {
    sockets.emplace_back(io, udp::endpoint(asio::ip::address_v4::loopback(), 0));
    sockets.back().connect(echo.address());
    sockets.back().non_blocking(true);
  }
  realtime::PeriodicTimer timer(from_seconds((1 + kDrift) / rate_hz), begin);
  Datagram datagram{};
  error_code error;
  while (timer.wait() < begin + duration) {
    for (udp::socket& socket : sockets) {
      Datagram answer;
      while (socket.receive(asio::buffer(answer), 0, error) > 0) continue;
      const LocalTime now = clock.now();
      std::memcpy(datagram.data(), &now, sizeof now);
      socket.send(asio::buffer(datagram), 0, error);
    }
  }
  const auto [latency, cpu] = echo.stop();
  return {latency, cpu + realtime::cpu_time(pthread_self()) - cpu_before};
}

}  // namespace tandem::lab
