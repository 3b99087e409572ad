// Loopback HTTP port that answers GET, for programs that monitor a server.
//
//   accept ▶ at most 16 at once, the oldest is closed ▶ head within 2 s and 4 KiB ▶ one answer ▶ closed
//
// A peer may be hostile: the actions of a connection end only that connection.
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
/// Time limit from the connection to its whole head, and from there to the end of the answer.
inline constexpr Duration kHttpWithin = std::chrono::seconds(2);

struct HttpAnswer {
  unsigned status = 200;
  std::string text;
  std::string_view type = "text/plain; charset=utf-8";
};

/// Thread  one of its own, of normal priority
class HttpPort {
 public:
  /// Answer for a path without a query; nothing: there is no such page. Called on the port's thread.
  using Answer = std::function<std::optional<HttpAnswer>(const std::string& path)>;

  /// Opens the port and answers from then on.
  /// In      option   name of the option with the address, e.g. "--metrics"
  ///         address  [ADDRESS:]PORT of this machine's own; port 0: any
  /// Fails   std::invalid_argument: not such an address; std::runtime_error: the port is in use
  HttpPort(const std::string& option, const std::string& address, Answer answer);
  ~HttpPort();
  HttpPort(const HttpPort&) = delete;
  HttpPort& operator=(const HttpPort&) = delete;

  /// "127.0.0.1:9464"
  std::string address() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::server
