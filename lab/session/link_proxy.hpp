// The project's simulated link between programs that know nothing of it: it listens where clients connect, and goes on to
// the server, TCP and UDP of one port number.
//
//   client ══ TCP ══▶ [reliable link up] ══▶ server        a user's datagrams leave by a socket of their own, as behind a
//   client ◀══ UDP ══ [link down] ◀══════════ server       NAT: move() gives each another one, cut() lets nothing through,
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
  std::string listen = "127.0.0.2";  ///< clients connect there
  std::string server = "127.0.0.1";
  std::uint16_t port = 47800;  ///< of both: the server names its UDP port itself
  net::LinkParameters link;    ///< each way; its rate limit is of all users together
  std::uint64_t seed = 1;
  std::string capture;  ///< file of all bytes that go through, each way; empty: none
};

/// Thread  one
class LinkProxy {
 public:
  /// Fails   std::exception: an address that is none, or a port in use
  explicit LinkProxy(const LinkProxySettings& settings);
  ~LinkProxy();

  /// Takes what has come, and hands on what is due. About each half millisecond.
  void step(LocalTime now);
  /// From now on nothing passes: datagrams are lost, streams wait.
  void cut(bool is_cut);
  /// Datagrams to the server come from another port from now on.
  void move();
  /// Ends all streams at once for both ends (TCP reset), as a NAT does that was started anew; new ones may come.
  void reset();
  /// Streams and clients' datagram addresses that are known at the moment; one that is silent for a minute is forgotten.
  std::size_t streams() const;
  std::size_t flows() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::lab
