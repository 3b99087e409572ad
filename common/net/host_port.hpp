// Parses the address of a host: "HOST", "HOST:PORT", "[IPv6]" or "[IPv6]:PORT" (RFC 3986, section 3.2.2).
#pragma once

#include <boost/asio/ip/address.hpp>
#include <cstdint>
#include <optional>
#include <string>

namespace tandem::net {

/// A host and, if the text contains one, its port.
struct HostPort {
  std::string host;  ///< a name or an address, without brackets; an IPv6 address may have a zone ("fe80::1%eth0")
  std::optional<std::uint16_t> port;
};

/// Parses a host with an optional port.
/// Fails   std::invalid_argument: the host is empty, the text after the colon is no port from 1 to 65535, or the text
///         is an IPv6 address without brackets, whose last group could be mistaken for a port
HostPort host_port_of(const std::string& text);

/// Returns the host given to a command-line option that takes no port; brackets around an IPv6 address are removed.
/// Fails   std::invalid_argument: the message names `option`, the value, the error and the remedy
std::string host_without_port(const std::string& option, const std::string& text);

/// Returns "HOST:PORT", with brackets around an IPv6 address.
std::string text_of(const std::string& host, std::uint16_t port);

/// Returns the numeric address in `host`; nothing if `host` is a name.
std::optional<boost::asio::ip::address> numeric(const std::string& host);

}  // namespace tandem::net
