#include "common/net/host_port.hpp"

#include <algorithm>
#include <stdexcept>

#include "common/net/socket_rules.hpp"

namespace tandem::net {
namespace {

/// Returns whether the host contains a forbidden character. "/" is forbidden because it ends the server name in an
/// invitation.
bool has_forbidden(const std::string& host) {
  return host.find_first_of("[]/ \t\r\n") != std::string::npos;
}

bool is_in_brackets(const std::string& host) {
  return host.size() > 2 && host.front() == '[' && host.back() == ']';
}

}  // namespace

HostPort host_port_of(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  const bool has_brackets = text.starts_with('[');
  const bool has_port = colon != std::string::npos && text.find(']', colon) == std::string::npos;
  if (!has_brackets && std::ranges::count(text, ':') > 1) {
    throw std::invalid_argument("'" + text +
                                "' is no address and port; write an IPv6 address in brackets, for example [::1]:47800");
  }
  HostPort result{has_port ? text.substr(0, colon) : text, std::nullopt};
  if (has_brackets) {
    const bool is_address = is_in_brackets(result.host) && numeric(result.host.substr(1, result.host.size() - 2));
    if (!is_address) {
      throw std::invalid_argument("'" + text + "' has no IPv6 address in its brackets; write for example [::1]:47800");
    }
    result.host = result.host.substr(1, result.host.size() - 2);
  }
  if (result.host.empty() || has_forbidden(result.host)) {
    throw std::invalid_argument("'" + text + "' names no address; write for example 127.0.0.1:47800");
  }
  if (!has_port) return result;
  result.port = port_of(text.substr(colon + 1));
  if (!result.port || *result.port == 0) {
    throw std::invalid_argument("'" + text + "' has no port from 1 to 65535; write for example 127.0.0.1:47800");
  }
  return result;
}

std::string host_without_port(const std::string& option, const std::string& text) {
  const bool is_bracketed = is_in_brackets(text);
  const std::string host = is_bracketed ? text.substr(1, text.size() - 2) : text;
  const bool is_v6 = host.find(':') != std::string::npos;
  if (host.empty() || has_forbidden(host) || (is_v6 || is_bracketed) != (numeric(host) && numeric(host)->is_v6())) {
    throw std::invalid_argument(
        option + " '" + text +
        "' is no name or address; write it without a port, for example 192.0.2.1 or 2001:db8::1");
  }
  return host;
}

std::string text_of(const std::string& host, std::uint16_t port) {
  const bool is_v6 = host.find(':') != std::string::npos;
  return (is_v6 ? "[" + host + "]" : host) + ":" + std::to_string(port);
}

std::optional<boost::asio::ip::address> numeric(const std::string& host) {
  boost::system::error_code error;
  const auto address = boost::asio::ip::make_address(host, error);
  return error ? std::nullopt : std::optional(address);
}

}  // namespace tandem::net
