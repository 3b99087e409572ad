// Looks up the addresses of a host without blocking the io thread. getaddrinfo() would block it for 5 s or more if the
// name server does not answer.
#pragma once

#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/net/address_race.hpp"

namespace tandem::client {

/// Returns the addresses of a host in one family. May block. If there are none, sets `problem` to the reason.
using Resolve = std::function<std::vector<net::Address>(const std::string& host, bool is_v6, std::string& problem)>;
/// Calls the resolver of the system.
std::vector<net::Address> resolve_by_system(const std::string& host, bool is_v6, std::string& problem);

/// Looks up the addresses of a host, for IPv4 and IPv6 in separate threads. So neither answer waits for the other (RFC
/// 8305, section 3). The threads are detached, so neither a lost connection nor the end of the program waits for a name
/// server. For each family, at most one look-up is outstanding, even if the client reconnects often.
///
/// Thread  the thread that runs the io_context
class NameLookup {
 public:
  using Answer =
      std::function<void(const std::vector<net::Address>& addresses, bool is_v6, const std::string& problem)>;

  /// In      io       must outlive this object; `answer` is called on the thread that runs `io`
  ///         resolve  called by the look-up threads
  NameLookup(boost::asio::io_context& io, Resolve resolve, Answer answer);
  /// After destruction no answer is delivered.
  ~NameLookup();
  NameLookup(const NameLookup&) = delete;
  NameLookup& operator=(const NameLookup&) = delete;

  /// Starts a look-up for each family without an outstanding one. Each look-up calls `answer` once.
  void start(const std::string& host);

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace tandem::client
