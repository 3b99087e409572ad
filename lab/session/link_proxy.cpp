#include "lab/session/link_proxy.hpp"

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ip/udp.hpp>
#include <fstream>
#include <map>
#include <span>
#include <vector>

namespace tandem::lab {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using asio::ip::udp;
using boost::system::error_code;
using net::SimulatedLink;

constexpr std::size_t kBytesAtOnce = 16 * 1024;
constexpr int kDatagramsAtOnce = 256;
/// Time without datagrams after which a client address is removed. In this case the client has ended or has changed its
/// address.
constexpr Duration kForgetAfter = std::chrono::minutes(1);

/// One direction of a TCP stream.
struct Pipe {
  Pipe(const net::LinkParameters& parameters, std::uint64_t seed, std::uint64_t stream)
      : link(SimulatedLink::reliable(parameters, seed, stream)) {}

  /// Returns whether the sender has closed the stream and all its bytes have been forwarded.
  bool is_done() const { return has_ended && unsent.empty() && !link.next_due(); }

  SimulatedLink link;
  std::vector<std::byte> unsent;
  bool has_ended = false;
};

struct Stream {
  Stream(tcp::socket from_client, tcp::socket to_server, const LinkProxySettings& settings, std::uint64_t number)
      : client(std::move(from_client)),
        server(std::move(to_server)),
        up(settings.link, settings.seed, number),
        down(settings.link, settings.seed, number + 1) {}

  tcp::socket client;
  tcp::socket server;
  Pipe up;
  Pipe down;
};

struct Flow {
  Flow(asio::io_context& io, const LinkProxySettings& settings, std::uint64_t number)
      : server(io), up(settings.link, settings.seed, number), down(settings.link, settings.seed, number + 1) {}

  udp::socket server;
  SimulatedLink up;
  SimulatedLink down;
  LocalTime last_received{};  ///< time of the last datagram from the client
};

/// Closes the socket by a TCP reset instead of an orderly shutdown.
void reset_socket(tcp::socket& socket) {
  error_code error;
  socket.set_option(tcp::socket::linger(true, 0), error);
  socket.close(error);
}

}  // namespace

struct LinkProxy::Impl {
  explicit Impl(const LinkProxySettings& given)
      : settings(given),
        to(asio::ip::make_address(settings.server), settings.port),
        acceptor(io, {asio::ip::make_address(settings.listen), settings.port}),
        clients(io, udp::endpoint(acceptor.local_endpoint().address(), settings.port)) {
    acceptor.non_blocking(true);
    clients.non_blocking(true);
    if (!settings.capture.empty()) capture.open(settings.capture, std::ios::binary | std::ios::trunc);
  }

  void accept();
  void carry(Stream& stream, LocalTime now);
  void receive(tcp::socket& from, Pipe& pipe, LocalTime now);
  void forward(Pipe& pipe, tcp::socket& to_socket, LocalTime now);
  void connect(Flow& flow) const;
  void receive_from_clients(LocalTime now);
  void carry(Flow& flow, const udp::endpoint& client, LocalTime now);
  void note(std::span<const std::byte> bytes) {
    if (capture.is_open())
      capture.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }

  LinkProxySettings settings;
  asio::io_context io;
  tcp::endpoint to;
  tcp::acceptor acceptor;
  udp::socket clients;
  std::vector<std::unique_ptr<Stream>> streams;
  std::map<udp::endpoint, std::unique_ptr<Flow>> flows;
  std::uint64_t links = 0;
  // Two links without data. They model the rate limit of the line in each direction, which all streams and datagrams of
  // all clients share.
  SimulatedLink line_up{settings.link, settings.seed, 0};
  SimulatedLink line_down{settings.link, settings.seed, 0};
  bool is_cut = false;
  std::ofstream capture;
};

void LinkProxy::Impl::accept() {
  error_code error;
  tcp::socket client = acceptor.accept(io, error);
  if (error) return;
  tcp::socket server(io);
  server.connect(to, error);
  if (error) return;  // no connection to the server: returning also closes the client's connection
  for (tcp::socket* socket : {&client, &server}) {
    socket->non_blocking(true);
    socket->set_option(tcp::no_delay(true));
  }
  streams.push_back(std::make_unique<Stream>(std::move(client), std::move(server), settings, links));
  streams.back()->up.link.share_line(line_up);
  streams.back()->down.link.share_line(line_down);
  links += 2;
}

void LinkProxy::Impl::receive(tcp::socket& from, Pipe& pipe, LocalTime now) {
  std::array<std::byte, kBytesAtOnce> bytes;
  error_code error;
  const std::size_t size = from.read_some(asio::buffer(bytes), error);
  note(std::span(bytes).first(size));
  if (size > 0) pipe.link.send(now, std::span(bytes).first(size));
  pipe.has_ended = pipe.has_ended || (error && error != asio::error::would_block);
}

void LinkProxy::Impl::forward(Pipe& pipe, tcp::socket& to_socket, LocalTime now) {
  while (const auto chunk = pipe.link.receive(now)) pipe.unsent.insert(pipe.unsent.end(), chunk->begin(), chunk->end());
  error_code error;
  const std::size_t sent = pipe.unsent.empty() ? 0 : to_socket.write_some(asio::buffer(pipe.unsent), error);
  pipe.unsent.erase(pipe.unsent.begin(), pipe.unsent.begin() + static_cast<std::ptrdiff_t>(sent));
  if (error && error != asio::error::would_block) pipe.unsent.clear();  // the receiver has closed its end
  if (pipe.is_done()) to_socket.shutdown(tcp::socket::shutdown_send, error);
}

void LinkProxy::Impl::carry(Stream& stream, LocalTime now) {
  receive(stream.client, stream.up, now);
  receive(stream.server, stream.down, now);
  forward(stream.up, stream.server, now);
  forward(stream.down, stream.client, now);
}

void LinkProxy::Impl::connect(Flow& flow) const {
  flow.server = udp::socket(flow.server.get_executor());
  flow.server.open(to.address().is_v6() ? udp::v6() : udp::v4());
  flow.server.non_blocking(true);
  flow.server.connect(udp::endpoint(to.address(), to.port()));
}

void LinkProxy::Impl::receive_from_clients(LocalTime now) {
  std::array<std::byte, 2048> bytes;
  udp::endpoint from;
  error_code error;
  for (int i = 0; i < kDatagramsAtOnce; ++i) {
    const std::size_t size = clients.receive_from(asio::buffer(bytes), from, 0, error);
    if (error == asio::error::would_block) return;
    auto& flow = flows[from];
    if (flow == nullptr) {
      flow = std::make_unique<Flow>(io, settings, links);
      flow->up.share_line(line_up);
      flow->down.share_line(line_down);
      links += 2;
      connect(*flow);
    }
    if (!error && !is_cut) flow->up.send(now, std::span(bytes).first(size));
    flow->last_received = now;
    note(std::span(bytes).first(size));
  }
}

void LinkProxy::Impl::carry(Flow& flow, const udp::endpoint& client, LocalTime now) {
  std::array<std::byte, 2048> bytes;
  error_code error;
  for (int i = 0; i < kDatagramsAtOnce; ++i) {
    const std::size_t size = flow.server.receive(asio::buffer(bytes), 0, error);
    if (error) break;
    if (!is_cut) flow.down.send(now, std::span(bytes).first(size));
    note(std::span(bytes).first(size));
  }
  while (const auto packet = flow.up.receive(now)) {
    if (!is_cut) flow.server.send(asio::buffer(*packet), 0, error);
  }
  while (const auto packet = flow.down.receive(now)) {
    if (!is_cut) clients.send_to(asio::buffer(*packet), client, 0, error);
  }
}

LinkProxy::LinkProxy(const LinkProxySettings& settings) : impl_(std::make_unique<Impl>(settings)) {}

LinkProxy::~LinkProxy() = default;

void LinkProxy::step(LocalTime now) {
  impl_->receive_from_clients(now);
  for (const auto& [client, flow] : impl_->flows) impl_->carry(*flow, client, now);
  std::erase_if(impl_->flows, [now](const auto& known) { return now - known.second->last_received > kForgetAfter; });
  if (impl_->is_cut) return;
  impl_->accept();
  for (const auto& stream : impl_->streams) impl_->carry(*stream, now);
  std::erase_if(impl_->streams, [](const auto& stream) { return stream->up.is_done() && stream->down.is_done(); });
}

void LinkProxy::cut(bool is_cut) {
  impl_->is_cut = is_cut;
}

void LinkProxy::move() {
  for (const auto& [client, flow] : impl_->flows) impl_->connect(*flow);
}

void LinkProxy::reset() {
  for (const auto& stream : impl_->streams) {
    reset_socket(stream->client);
    reset_socket(stream->server);
  }
  impl_->streams.clear();
}

std::size_t LinkProxy::streams() const {
  return impl_->streams.size();
}

std::size_t LinkProxy::flows() const {
  return impl_->flows.size();
}

}  // namespace tandem::lab
