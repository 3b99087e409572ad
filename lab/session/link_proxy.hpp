// A proxy that simulates a network link between unmodified clients and an unmodified server. Clients connect to the
// proxy, which forwards their traffic to the server. TCP and UDP use the same port number.
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
  /// Blocks all traffic (`is_cut` true) or ends the blocking (false). While traffic is blocked, datagrams are lost, and
  /// the bytes of streams are delayed until the blocking ends.
  void cut(bool is_cut);
  /// Simulates a change of a NAT's mapping: all later datagrams are sent to the server from new ports.
  void move();
  /// Terminates all streams at once at both ends (TCP reset), as a restarted NAT does. New streams are accepted.
  void reset();
  /// streams() returns the number of open streams. flows() returns the number of client addresses from which datagrams
  /// were received in the last minute.
  std::size_t streams() const;
  std::size_t flows() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::lab
