#include "server/metrics/http_port.hpp"

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http.hpp>
#include <deque>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <utility>

#include "common/net/socket_rules.hpp"
#include "common/realtime/realtime.hpp"

namespace tandem::server {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;
using boost::system::error_code;

/// Maximum number of request bytes that are read and discarded after the answer. If unread bytes remained, closing
/// would send a TCP reset, and the peer might lose the answer.
constexpr std::size_t kMaxLeftOverBytes = std::size_t{64} << 10U;
constexpr Duration kListenAgain = std::chrono::milliseconds(100);

tcp::endpoint loopback_endpoint(const std::string& option, const std::string& text) {
  const std::size_t colon = text.rfind(':');
  const bool has_host = colon != std::string::npos;
  std::string host = has_host ? text.substr(0, colon) : "127.0.0.1";
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  if (host == "localhost") host = "127.0.0.1";
  const std::string digits = has_host ? text.substr(colon + 1) : text;
  const auto port = net::port_of(digits);
  error_code error;
  const asio::ip::address address = asio::ip::make_address(host, error);
  if (error || !port) {
    throw std::invalid_argument(option + " \"" + text +
                                "\": not a port, or a numeric address and a port; use 9464 or " + "127.0.0.1:9464");
  }
  if (!address.is_loopback()) {
    throw std::invalid_argument(option + " " + text + ": requests there need no authentication, so only addresses " +
                                "of this machine's own are allowed; use 127.0.0.1:" + digits +
                                ", and a proxy that asks for a password if other machines are to read it");
  }
  return {address, *port};
}

bool is_of_http(const error_code& error) {
  return error.category() == http::make_error_code(http::error::bad_method).category() &&
         error != http::error::end_of_stream && error != http::error::partial_message;
}

struct HttpConnection {
  explicit HttpConnection(tcp::socket socket) : stream(std::move(socket)), buffer(2 * kMaxHttpHeadBytes) {
    parser.header_limit(kMaxHttpHeadBytes);
    parser.body_limit(0);
  }

  beast::tcp_stream stream;
  beast::flat_buffer buffer;
  http::request_parser<http::empty_body> parser;
  http::response<http::string_body> response;
  std::array<char, 4096> left_over{};
  std::size_t left_over_bytes = 0;
};
using ConnectionPointer = std::shared_ptr<HttpConnection>;

}  // namespace

struct HttpPort::Impl {
  Impl(const std::string& option, const tcp::endpoint& endpoint, Answer its_answer);

  void accept();
  void welcome(tcp::socket socket);
  void serve(const ConnectionPointer& connection, const error_code& error);
  void respond(const ConnectionPointer& connection, HttpAnswer answer);
  void drain(const ConnectionPointer& connection);
  void end(const ConnectionPointer& connection);
  HttpAnswer answer_to(const http::request<http::empty_body>& request) const;

  Answer answer;
  asio::io_context io{1};
  tcp::acceptor acceptor{io};
  tcp::endpoint opened;
  asio::steady_timer accept_again{io};
  std::deque<ConnectionPointer> connections;  ///< ordered by the time of connecting
  std::thread thread;
};

HttpPort::Impl::Impl(const std::string& option, const tcp::endpoint& endpoint, Answer its_answer)
    : answer(std::move(its_answer)) {
  error_code error;
  acceptor.open(endpoint.protocol());
  acceptor.set_option(tcp::acceptor::reuse_address(true));
  acceptor.bind(endpoint, error);
  if (!error) acceptor.listen(tcp::acceptor::max_listen_connections, error);
  if (!error) {
    opened = acceptor.local_endpoint();
    return;
  }
  std::ostringstream text;
  text << "cannot listen on " << endpoint << ": " << net::lower_first(error.message())
       << "; stop the program that has this port, or choose another with " << option << " (0: any)";
  throw std::runtime_error(text.str());
}

void HttpPort::Impl::accept() {
  acceptor.async_accept([this](const error_code& error, tcp::socket socket) {
    if (error == asio::error::operation_aborted) return;
    if (!error) {
      welcome(std::move(socket));
      return accept();
    }
    // Accepting has failed. The usual cause is that no file descriptor is free.
    accept_again.expires_after(kListenAgain);
    accept_again.async_wait([this](const error_code& stopped) {
      if (!stopped) accept();
    });
  });
}

void HttpPort::Impl::welcome(tcp::socket socket) {
  // Limits the open connections by closing the oldest one. A well-behaved peer has been served before sixteen further
  //        peers connect.
  if (connections.size() >= kMaxHttpConnections) end(ConnectionPointer(connections.front()));
  const auto connection = std::make_shared<HttpConnection>(std::move(socket));
  connections.push_back(connection);
  connection->stream.expires_after(kHttpWithin);
  http::async_read_header(connection->stream, connection->buffer, connection->parser,
                          [this, connection](const error_code& error, std::size_t) { serve(connection, error); });
}

void HttpPort::Impl::serve(const ConnectionPointer& connection, const error_code& error) {
  if (!error) return respond(connection, answer_to(connection->parser.get()));
  if (!is_of_http(error)) return end(connection);
  respond(connection, {400, "this is no request that is answered here: " + error.message() + "\n"});
}

HttpAnswer HttpPort::Impl::answer_to(const http::request<http::empty_body>& request) const {
  if (request.method() != http::verb::get) return {405, "only GET is answered here\n"};
  const std::string target(request.target());
  const auto found = answer(target.substr(0, target.find('?')));
  return found ? *found : HttpAnswer{404, "there is no such page\n"};
}

void HttpPort::Impl::respond(const ConnectionPointer& connection, HttpAnswer of) {
  auto& response = connection->response;
  response.version(11);
  response.result(of.status);
  response.set(http::field::content_type, beast::string_view(of.type.data(), of.type.size()));
  response.set(http::field::cache_control, "no-store");
  if (of.status == 405) response.set(http::field::allow, "GET");
  response.keep_alive(false);
  response.body() = std::move(of.text);
  response.prepare_payload();
  connection->stream.expires_after(kHttpWithin);
  http::async_write(connection->stream, response, [this, connection](const error_code& error, std::size_t) {
    error_code ignored;
    if (error) return end(connection);
    connection->stream.socket().shutdown(tcp::socket::shutdown_send, ignored);
    drain(connection);
  });
}

/// Reads and discards the remaining bytes until the peer closes the connection, within the time limit of the answer.
void HttpPort::Impl::drain(const ConnectionPointer& connection) {
  connection->stream.async_read_some(asio::buffer(connection->left_over),
                                     [this, connection](const error_code& error, std::size_t size) {
                                       connection->left_over_bytes += size;
                                       const bool is_over = connection->left_over_bytes > kMaxLeftOverBytes;
                                       error || is_over ? end(connection) : drain(connection);
                                     });
}

void HttpPort::Impl::end(const ConnectionPointer& connection) {
  connection->stream.close();
  std::erase(connections, connection);
}

HttpPort::HttpPort(const std::string& option, const std::string& address, Answer answer)
    : impl_(std::make_unique<Impl>(option, loopback_endpoint(option, address), std::move(answer))) {
  impl_->accept();
  impl_->thread = std::thread([impl = impl_.get()] {
    realtime::drop_realtime();
    impl->io.run();
  });
}

HttpPort::~HttpPort() {
  impl_->io.stop();
  impl_->thread.join();
}

std::string HttpPort::address() const {
  std::ostringstream text;
  text << impl_->opened;
  return text.str();
}

}  // namespace tandem::server
