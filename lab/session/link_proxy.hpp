// The project's simulated link for unmodified programs: a proxy at the clients' address that forwards to the server,
// with the same port number for TCP and UDP.
//
//   client ══ TCP ══▶ [reliable link up] ══▶ server        each user's datagrams leave by their own socket, as behind a
//   client ◀══ UDP ══ [link down] ◀══════════ server       NAT: move() replaces these, cut() blocks all traffic,
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
  std::string listen = "127.0.0.2";  ///< address for the clients
  std::string server = "127.0.0.1";
  std::uint16_t port = 47800;  ///< port of proxy and server: the server announces its own UDP port
  net::LinkParameters link;    ///< each direction; its rate limit applies to all users together
  std::uint64_t seed = 1;
  std::string capture;  ///< file that receives all bytes of both directions; empty: none
};

/// Thread  one
class LinkProxy {
 public:
  /// Fails   std::exception: an invalid address, or a port in use
  explicit LinkProxy(const LinkProxySettings& settings);
  ~LinkProxy();

  /// Receives waiting traffic and forwards packets that are due. Call about every 0.5 ms.
  void step(LocalTime now);
  /// Blocks or unblocks traffic: while blocked, datagrams are lost and streams wait.
  void cut(bool is_cut);
  /// Sends datagrams to the server from new ports, as after a change of the NAT's mapping.
  void move();
  /// Ends all streams at once at both ends (TCP reset), as a restarted NAT does; new streams are accepted.
  void reset();
  /// Numbers of open streams and of known client datagram addresses; an address is dropped after a silent minute.
  std::size_t streams() const;
  std::size_t flows() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::lab
