// Simulates the project's link for unmodified programs: a proxy to which clients connect and which forwards to the
// server. TCP and UDP have the same port number.
//
//   client ══ TCP ══▶ [reliable link up] ══▶ server        each user's datagrams leave by their own socket, as behind a
//   client ◀══ UDP ══ [link down] ◀══════════ server       NAT: move() opens new sockets, cut() blocks all traffic,
//                                                          reset() ends the streams
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "common/base/time.hpp"
#include "common/net/link.hpp"

namespace tandem::lab {

struct LinkProxySettings {
  std::string listen = "127.0.0.2";  ///< address to which the clients connect
  std::string server = "127.0.0.1";
  /// port of both proxy and server; they must be equal, because the server announces its own UDP port
  std::uint16_t port = 47800;
  net::LinkParameters link;  ///< link in each direction; its rate limit applies to all users together
  std::uint64_t seed = 1;
  std::string capture;  ///< file to which all bytes of both directions are written; empty: none
};

/// The proxy with its sockets.
/// Thread  one thread calls all functions
class LinkProxy {
 public:
  /// Opens the sockets.
  /// Fails   std::exception: an address is invalid, or a port is in use
  explicit LinkProxy(const LinkProxySettings& settings);
  ~LinkProxy();

  /// Receives the datagrams and bytes at the sockets, and forwards the packets that are due. Must be called about every
  /// 0.5 ms.
  void step(LocalTime now);
  /// Blocks all traffic, or forwards it again. While traffic is blocked, datagrams are lost and streams wait.
  void cut(bool is_cut);
  /// Sends later datagrams to the server from new ports, as after a change of a NAT's mapping.
  void move();
  /// Terminates all streams at once at both ends (TCP reset), as a restarted NAT does. New streams are accepted.
  void reset();
  /// Return the number of open streams (first function), and the number of client addresses that sent datagrams (second
  /// function). An address is removed after a minute without datagrams.
  std::size_t streams() const;
  std::size_t flows() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::lab
