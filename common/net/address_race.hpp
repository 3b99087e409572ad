// Selects which address of a host to try at which time: Happy Eyeballs version 2 (RFC 8305), without sockets.
//
//   answers of look-ups ──▶ add()        next() ──▶ address to connect to now
//   results of attempts ──▶ failed(), accepted()    due() ──▶ when to call next() again
#pragma once

#include <boost/asio/ip/address.hpp>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/time.hpp"

namespace tandem::net {

using Address = boost::asio::ip::address;

/// Why an attempt to connect to an address failed.
enum class AttemptFailure : std::uint8_t {
  kRefused,      ///< the host answered that no program listens on the port
  kUnreachable,  ///< no route, or an address that this machine cannot use
  kTimedOut,     ///< no answer
  kUntrusted,    ///< a program answered that is not the expected server
  kLost,         ///< the connection ended before it was set up
  kOther         ///< any other error of the system
};

/// Delays of a race; the defaults are those of RFC 8305.
struct RaceSettings {
  Duration resolution_delay{std::chrono::milliseconds(50)};  ///< §3: IPv4 addresses wait for the IPv6 answer
  Duration attempt_delay{std::chrono::milliseconds(250)};    ///< §5: between the starts of two attempts
  /// From the start of an attempt until its connection is set up; ignored while no other address is left.
  Duration attempt_timeout{std::chrono::seconds(3)};
};

/// The race of one connection.
///
/// Model   One attempt starts at a time. The next one starts attempt_delay after the last one, or at once when the last
///         one failed. The next address is of the other family than the last attempt, IPv6 first; within a family the
///         order is that of the resolver. The first address to accept wins. The others are cancelled and stay
///         available: they are tried when the winner turns out not to be the expected server.
/// Source  RFC 8305, sections 3 to 6. Here an address that won an earlier race comes first (§4 permits it).
/// Limits  kMaxPerFamily addresses of each family; further ones are ignored
/// Thread  any, one at a time
class AddressRace {
 public:
  static constexpr std::size_t kMaxPerFamily = 8;

  /// In      known    addresses that need no look-up, the preferred one first
  ///         lookups  answers that are outstanding: 0, or 2 (one for each family)
  explicit AddressRace(std::span<const Address> known = {}, int lookups = 0, RaceSettings settings = {});

  /// Adds the answer to a look-up of one family. `problem` states why it has no address.
  void add(std::span<const Address> addresses, bool is_v6, const std::string& problem, LocalTime now);
  /// The address to connect to now; call it until it is empty.
  std::optional<Address> next(LocalTime now);
  /// Time at which next() or expired() can return a new result; empty: only after add(), failed() or accepted().
  std::optional<LocalTime> due() const;
  /// An attempt that has timed out: the caller cancels it and reports it as failed().
  std::optional<Address> expired(LocalTime now) const;
  /// Ends the attempt, or the accepted connection.
  void failed(const Address& address, AttemptFailure failure, const std::string& why);
  /// Marks the winner. No further attempt starts; the caller cancels all others.
  void accepted(const Address& address);

  /// Every address has failed, and no look-up is outstanding. A race that began with known addresses does not wait for
  /// look-ups: a name server that hangs must not slow down reconnections. Its late answer serves the next race.
  bool is_lost() const;
  /// Readable result of each tried address and of the look-ups.
  std::string report() const;
  bool has_addresses() const { return !candidates_.empty(); }
  /// Reason why the only address failed; empty: there are several, or it did not fail.
  std::optional<AttemptFailure> only_failure() const;

 private:
  enum class State : std::uint8_t { kWaiting, kTrying, kAccepted, kFailed };
  struct Candidate {
    Address address;
    State state = State::kWaiting;
    LocalTime started{};
    AttemptFailure failure = AttemptFailure::kOther;
    std::string why{};
  };

  void append(const Address& address);
  Candidate* find(const Address& address);
  Candidate* first_waiting();
  bool has(State state) const;
  std::optional<LocalTime> next_start() const;
  std::optional<LocalTime> expiry(const Candidate& candidate) const;

  RaceSettings settings_;
  std::vector<Candidate> candidates_;
  bool has_known_;
  std::vector<std::string> lookup_problems_;
  int lookups_;                           ///< number outstanding
  bool awaits_v6_;                        ///< the IPv6 answer is outstanding
  std::optional<LocalTime> v4_answered_;  ///< time of the IPv4 answer, while the IPv6 answer is outstanding
  bool is_v6_next_;                       ///< family that the next attempt prefers
  std::optional<Address> last_tried_;     ///< empty: no attempt has started
  std::optional<LocalTime> last_start_;   ///< empty: the next attempt may start at once
};

}  // namespace tandem::net
