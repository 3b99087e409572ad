// Connects to a server at the first of its addresses that answers (common/net/address_race.hpp).
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client/net/name_lookup.hpp"
#include "common/base/time.hpp"
#include "common/net/address_race.hpp"

namespace tandem::client {

/// Remembers the addresses of a host that was once reached. A later start() tries them during the new look-up, the last
/// winner first, so that a name server that does not answer delays no reconnection.
///
/// Thread  the one that runs the io_context
class Connector {
 public:
  using Accepted = std::function<void(boost::asio::ip::tcp::socket socket, const net::Address& address)>;
  using Lost = std::function<void(const std::string& why)>;

  /// In      host          a numeric address; "localhost", this machine, if not encrypted; otherwise a name
  ///         is_encrypted  false: only loopback addresses
  ///         accepted      receives a connection to set up; another one after set_up_failed() or a slow set-up
  ///         lost          called when no address of the host is left
  /// Fails   std::invalid_argument: not a numeric address, or one that needs encryption
  Connector(boost::asio::io_context& io, const std::string& host, std::uint16_t port, bool is_encrypted,
            Resolve resolve, const Clock& clock, Accepted accepted, Lost lost);

  void start();
  /// Ends the race: the accepted connection is set up.
  void set_up();
  /// Rejects the accepted connection: the other addresses are tried.
  void set_up_failed(net::AttemptFailure failure, const std::string& why);
  void cancel();

  /// Server as shown to users: "rig.example:47800".
  std::string server_name() const;
  /// Results of the race so far, as shown to users; empty: no race, or a numeric address.
  std::string progress() const;

 private:
  struct Attempt;
  using AttemptPointer = std::shared_ptr<Attempt>;

  void remember(const std::vector<net::Address>& addresses, bool is_v6);
  void try_next();
  void try_address(const net::Address& address);
  void finished(const AttemptPointer& attempt, const boost::system::error_code& error);
  void close(const net::Address& address);
  void close_all();
  std::string problem() const;

  boost::asio::io_context& io_;
  std::string host_;
  std::uint16_t port_;
  bool is_name_;
  const Clock& clock_;
  Accepted accepted_;
  Lost lost_;
  NameLookup lookup_;
  std::vector<net::Address> known_;
  net::AddressRace race_;
  bool is_racing_ = false;
  net::Address accepted_address_;
  std::vector<AttemptPointer> attempts_;
  boost::asio::steady_timer timer_;
};

}  // namespace tandem::client
