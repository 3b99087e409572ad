#include "client/net/connector.hpp"

#include <algorithm>
#include <span>
#include <utility>

#include "common/net/host_port.hpp"
#include "common/net/socket_rules.hpp"

namespace tandem::client {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

/// Returns the addresses that are known without a look-up; empty if `host` is a name.
std::vector<net::Address> addresses_without_lookup(const std::string& host, bool is_encrypted) {
  if (!is_encrypted && host == "localhost") return {asio::ip::address_v6::loopback(), asio::ip::address_v4::loopback()};
  if (const auto address = net::numeric(host); address && is_encrypted) return {*address};
  if (is_encrypted) return {};
  return {net::numeric_address("cannot connect to", host, false)};
}

std::string no_answer_text() {
  return "no answer within " + std::to_string(net::RaceSettings{}.attempt_timeout / std::chrono::milliseconds(1)) +
         " ms";
}

net::AttemptFailure failure_of(const error_code& error) {
  if (error == asio::error::connection_refused) return net::AttemptFailure::kRefused;
  if (error == asio::error::timed_out) return net::AttemptFailure::kTimedOut;
  for (const auto unreachable : {asio::error::network_unreachable, asio::error::host_unreachable,
                                 asio::error::address_family_not_supported, asio::error::network_down}) {
    if (error == unreachable) return net::AttemptFailure::kUnreachable;
  }
  return net::AttemptFailure::kOther;
}

std::string text_of(const error_code& error, const net::Address& address) {
  const bool has_no_zone = address.is_v6() && address.to_v6().is_link_local() && address.to_v6().scope_id() == 0;
  const std::string text = net::lower_first(error.message());
  return has_no_zone ? text + " (a link-local address needs an interface of this machine, for example [" +
                           address.to_string() + "%eth0])"
                     : text;
}

}  // namespace

struct Connector::Attempt {
  Attempt(asio::io_context& io, const net::Address& to) : socket(io), address(to) {}

  tcp::socket socket;
  net::Address address;
};

Connector::Connector(asio::io_context& io, const std::string& host, std::uint16_t port, bool is_encrypted,
                     Resolve resolve, const Clock& clock, Accepted accepted, Lost lost)
    : io_(io),
      host_(host),
      port_(port),
      is_name_(false),
      clock_(clock),
      accepted_(std::move(accepted)),
      lost_(std::move(lost)),
      lookup_(io, std::move(resolve),
              [this](const std::vector<net::Address>& addresses, bool is_v6, const std::string& problem) {
                remember(addresses, is_v6);
                if (!is_racing_) return;
                race_.add(addresses, is_v6, problem, clock_.now());
                try_next();
              }),
      known_(addresses_without_lookup(host, is_encrypted)),
      timer_(io) {
  is_name_ = known_.empty();
}

void Connector::start() {
  cancel();
  is_racing_ = true;
  constexpr int kFamilies = 2;
  race_ = net::AddressRace(known_, is_name_ ? kFamilies : 0);
  if (is_name_) lookup_.start(host_);
  try_next();
}

void Connector::cancel() {
  is_racing_ = false;
  timer_.cancel();
  close_all();
}

/// Replaces the known addresses of one family (IPv4 or IPv6). An empty list changes nothing, because the name server
/// that returned it may be faulty.
void Connector::remember(const std::vector<net::Address>& addresses, bool is_v6) {
  if (addresses.empty()) return;
  std::erase_if(known_, [&](const net::Address& known) {
    return known.is_v6() == is_v6 && std::ranges::find(addresses, known) == addresses.end();
  });
  const std::size_t most = std::min(addresses.size(), net::AddressRace::kMaxPerFamily);
  for (const net::Address& address : std::span(addresses).first(most)) {
    if (std::ranges::find(known_, address) == known_.end()) known_.push_back(address);
  }
}

void Connector::set_up() {
  std::erase(known_, accepted_address_);
  known_.insert(known_.begin(), accepted_address_);
  cancel();
}

void Connector::set_up_failed(net::AttemptFailure failure, const std::string& why) {
  if (!is_racing_) return;
  race_.failed(accepted_address_, failure, why);
  try_next();
}

void Connector::try_next() {
  const LocalTime now = clock_.now();
  while (const auto address = race_.expired(now)) {
    close(*address);
    race_.failed(*address, net::AttemptFailure::kTimedOut, no_answer_text());
  }
  while (const auto address = race_.next(now)) try_address(*address);
  if (race_.is_lost()) {
    const std::string why = problem();
    cancel();
    lost_(why);
    return;
  }
  const auto due = race_.due();
  if (!due) return;
  timer_.expires_after(std::max(Duration{0}, *due - now));
  timer_.async_wait([this](const error_code& moved) {
    if (!moved && is_racing_) try_next();
  });
}

void Connector::try_address(const net::Address& address) {
  const auto attempt = std::make_shared<Attempt>(io_, address);
  attempts_.push_back(attempt);
  attempt->socket.async_connect(tcp::endpoint(address, port_),
                                [this, attempt](const error_code& error) { finished(attempt, error); });
}

void Connector::finished(const AttemptPointer& attempt, const error_code& error) {
  // An attempt that is not in the list was cancelled.
  const auto found = std::ranges::find(attempts_, attempt);
  if (found == attempts_.end()) return;
  attempts_.erase(found);
  error_code problem = error;
  // Detects TCP self-connection: while a client tries a local port without a listener, the kernel may assign that port
  // to the client itself.
  if (!problem && attempt->socket.local_endpoint(problem) == tcp::endpoint(attempt->address, port_)) {
    problem = asio::error::connection_refused;
  }
  if (problem) {
    error_code ignored;
    attempt->socket.close(ignored);
    race_.failed(attempt->address, failure_of(problem), text_of(problem, attempt->address));
    return try_next();
  }
  race_.accepted(attempt->address);
  accepted_address_ = attempt->address;
  close_all();
  accepted_(std::move(attempt->socket), attempt->address);
  if (is_racing_) try_next();
}

void Connector::close(const net::Address& address) {
  const auto found = std::ranges::find_if(
      attempts_, [&address](const AttemptPointer& attempt) { return attempt->address == address; });
  if (found == attempts_.end()) return;
  error_code ignored;
  (*found)->socket.close(ignored);
  attempts_.erase(found);
}

void Connector::close_all() {
  while (!attempts_.empty()) close(attempts_.front()->address);
}

std::string Connector::server_name() const {
  return net::text_of(host_, port_);
}

std::string Connector::progress() const {
  return is_racing_ && (is_name_ || known_.size() > 1) ? race_.report() : std::string();
}

std::string Connector::problem() const {
  const bool has_addresses = race_.has_addresses();
  const std::string server = server_name() + ": ";
  const std::string hint =
      has_addresses ? "; is tandem-server running there?" : "; is that the name or address of a server?";
  const auto only = is_name_ ? std::nullopt : race_.only_failure();
  if (!only) return "cannot connect to " + server + race_.report() + hint;
  const std::string why = race_.report().substr(known_.front().to_string().size() + 2);
  if (*only == net::AttemptFailure::kUntrusted) return "cannot connect safely to " + server + why;
  if (*only == net::AttemptFailure::kLost) return "the connection to " + server_name() + " was lost: " + why;
  return "cannot connect to " + server + why + hint;
}

}  // namespace tandem::client
