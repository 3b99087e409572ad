// A port of this machine's own that answers GET, for programs that watch over a server.
//
//   accept ▶ at most 16 at once, the oldest goes ▶ head within 2 s and 4 KiB ▶ one answer ▶ closed
//
// Whoever can reach it may be hostile: what one connection does ends only itself.
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
/// From the connection to its whole head, and from there until the answer is taken.
inline constexpr Duration kHttpWithin = std::chrono::seconds(2);

struct HttpAnswer {
  unsigned status = 200;
  std::string text;
  std::string_view type = "text/plain; charset=utf-8";
};

/// Thread  one of its own, of normal priority
class HttpPort {
 public:
  /// By path, without a query; nothing: there is none. Called on the port's thread.
  using Answer = std::function<std::optional<HttpAnswer>(const std::string& path)>;

  /// Opens the port and answers from then on.
  /// In      option   what people gave the address by, e.g. "--metrics"
  ///         address  [ADDRESS:]PORT of this machine's own; port 0: any
  /// Fails   std::invalid_argument: not that; std::runtime_error: the port is in use
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
