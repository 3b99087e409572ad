// Rules for the sockets of client and server: permitted addresses, and a limit of unsent bytes in the kernel's buffer.
#pragma once

#include <netinet/tcp.h>

#include <boost/asio/detail/socket_option.hpp>
#include <boost/asio/ip/address.hpp>
#include <cctype>
#include <charconv>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace tandem::net {

/// Limit of unsent bytes in the kernel's TCP buffer. While state waits in the program, newer state can replace it; in
/// the kernel this is impossible. A small limit therefore keeps state over TCP fresh.
using UnsentLimit = boost::asio::detail::socket_option::integer<IPPROTO_TCP, TCP_NOTSENT_LOWAT>;
inline constexpr int kUnsentBytes = 16 * 1024;

/// Socket option that lets several sockets of one system user share a UDP port. Each connected socket then receives
/// only the datagrams of its own peer.
using SharedPort = boost::asio::detail::socket_option::boolean<SOL_SOCKET, SO_REUSEPORT>;

/// Returns a system message in the form for the middle of a sentence: "Connection refused" becomes "connection
/// refused".
inline std::string lower_first(std::string text) {
  if (!text.empty()) text[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(text[0])));
  return text;
}

/// Parses a port number from 0 to 65535 that consists of digits only.
inline std::optional<std::uint16_t> port_of(std::string_view text) {
  std::uint16_t port = 0;
  const char* const end = text.data() + text.size();
  const auto [next, problem] = std::from_chars(text.data(), end, port);
  return problem == std::errc() && next == end ? std::optional(port) : std::nullopt;
}

/// Parses the address in `text`; `purpose` begins the error message, e.g. "cannot listen on". Without encryption only
/// loopback addresses are allowed, because an attacker who modifies the traffic could move the users' hands.
/// Fails   std::invalid_argument: not a numeric address (or localhost), or a non-loopback address without encryption
inline boost::asio::ip::address numeric_address(const std::string& purpose, const std::string& text,
                                                bool is_encrypted) {
  boost::system::error_code error;
  auto address = boost::asio::ip::make_address(text == "localhost" ? "127.0.0.1" : text, error);
  if (error) throw std::invalid_argument(purpose + " \"" + text + "\": not a numeric address; use 127.0.0.1");
  if (!is_encrypted && !address.is_loopback()) {
    throw std::invalid_argument(purpose + " " + text +
                                " with --insecure: without encryption only loopback addresses are allowed; leave out "
                                "--insecure, or use 127.0.0.1");
  }
  return address;
}

}  // namespace tandem::net
