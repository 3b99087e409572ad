// Loopback HTTP port that answers GET, for programs that monitor a server.
//
//   1. The port accepts a connection. At most 16 are open; a further connection closes the oldest one.
//   2. It reads the request head, within 2 s and at most 4 KiB.
//   3. It sends one response within 2 s.
//   4. It closes the connection.
//
// A peer may be hostile. An error in a connection affects only that connection.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/time.hpp"

namespace tandem::server {

inline constexpr std::size_t kMaxHttpConnections = 16;
inline constexpr std::size_t kMaxHttpHeadBytes = 4096;
/// Time limit of each of two phases: reading the request head, from the acceptance of the connection; and sending the
/// answer.
inline constexpr Duration kHttpWithin = std::chrono::seconds(2);

struct HttpAnswer {
  unsigned status = 200;
  std::string text;
  std::string_view type = "text/plain; charset=utf-8";
};

/// A loopback port that answers GET requests.
///
/// Thread  a separate thread of normal priority
class HttpPort {
 public:
  /// Returns the answer for a path without its query; nothing if there is no such page. Called on the port's thread.
  using Answer = std::function<std::optional<HttpAnswer>(const std::string& path)>;

  /// Opens the port and starts answering.
  /// In      option   name of the option with the address, e.g. "--metrics"
  ///         address  [ADDRESS:]PORT with a local address; port 0: any free one
  /// Fails   std::invalid_argument: the address is invalid or not local; std::runtime_error: the port is in use
  HttpPort(const std::string& option, const std::string& address, Answer answer);
  ~HttpPort();
  HttpPort(const HttpPort&) = delete;
  HttpPort& operator=(const HttpPort&) = delete;

  /// Address and port in the form "127.0.0.1:9464".
  std::string address() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::server
