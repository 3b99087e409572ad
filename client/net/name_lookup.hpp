// Looks up the addresses of a host without blocking the io thread: a name server that does not answer holds up
// getaddrinfo() for 5 s and more.
#pragma once

#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/net/address_race.hpp"

namespace tandem::client {

/// The addresses of one family; blocks. `problem` is set where there is none.
using Resolve = std::function<std::vector<net::Address>(const std::string& host, bool is_v6, std::string& problem)>;
/// The system's resolver.
std::vector<net::Address> resolve_by_system(const std::string& host, bool is_v6, std::string& problem);

/// Each family is looked up by a thread of its own, so that the answer for one family does not wait for the other
/// (RFC 8305, section 3). The threads are detached: neither a lost connection nor the end of the program waits for a name
/// server. Of each family at most one look-up is outstanding, however often the client reconnects.
///
/// Thread  the one that runs the io_context
class NameLookup {
 public:
  using Answer =
      std::function<void(const std::vector<net::Address>& addresses, bool is_v6, const std::string& problem)>;

  /// In      io       outlives this; `answer` is called there
  ///         resolve  called by the look-up threads
  NameLookup(boost::asio::io_context& io, Resolve resolve, Answer answer);
  /// No answer is delivered any more.
  ~NameLookup();
  NameLookup(const NameLookup&) = delete;
  NameLookup& operator=(const NameLookup&) = delete;

  /// Starts the look-ups that are not outstanding. One answer of each family follows.
  void start(const std::string& host);

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace tandem::client
