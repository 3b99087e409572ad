// Connects to a server. Several addresses of the server may be tried; the first one that accepts is used
// (common/net/address_race.hpp).
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

/// Connects to a host. Once a host was reached, its addresses are stored. A later start() looks up the host again and
/// meanwhile tries the stored addresses, the last successful one first. So a reconnection need not wait for a slow name
/// server.
///
/// Thread  the thread that runs the io_context
class Connector {
 public:
  using Accepted = std::function<void(boost::asio::ip::tcp::socket socket, const net::Address& address)>;
  using Lost = std::function<void(const std::string& why)>;

  /// In      host          a numeric address; also "localhost" without encryption, or any name with encryption
  ///         is_encrypted  if false, only loopback addresses are allowed
  ///         accepted      receives a TCP connection that the caller must set up; called again after set_up_failed() or
  ///                       a slow set-up
  ///         lost          called when all addresses of the host have failed
  /// Fails   std::invalid_argument: not a numeric address, or an address that requires encryption
  Connector(boost::asio::io_context& io, const std::string& host, std::uint16_t port, bool is_encrypted,
            Resolve resolve, const Clock& clock, Accepted accepted, Lost lost);

  void start();
  /// Must be called when the accepted connection has been set up. Attempts to connect to other addresses are then
  /// ended.
  void set_up();
  /// Rejects the accepted connection, so that the remaining addresses are tried.
  void set_up_failed(net::AttemptFailure failure, const std::string& why);
  void cancel();

  /// Returns the name of the server as shown to users, e.g. "rig.example:47800".
  std::string server_name() const;
  /// Returns the results of the attempts so far, as shown to users. Empty if no attempts run, or for a numeric address.
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
