// Decides when to try which address of a host: Happy Eyeballs version 2 (RFC 8305). Contains no sockets.
//
//   answers of DNS look-ups ──▶ add()                  next() ──▶ address to connect to now
//   results of attempts ──────▶ failed(), accepted()    due() ──▶ when to call next() again
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

/// Reason why an attempt to connect to an address failed.
enum class AttemptFailure : std::uint8_t {
  kRefused,      ///< the host answered that no program listens on the port
  kUnreachable,  ///< there is no route, or this machine cannot use the address
  kTimedOut,     ///< the host did not answer in time
  kUntrusted,    ///< a program answered, but it did not prove to be the expected server
  kLost,         ///< the connection was lost before its set-up was complete
  kOther         ///< any other error of the operating system
};

/// Delays of a race; the defaults are those of RFC 8305.
struct RaceSettings {
  /// §3: time to wait for the IPv6 answer of DNS after the IPv4 answer, before IPv4 addresses are tried.
  Duration resolution_delay{std::chrono::milliseconds(50)};
  Duration attempt_delay{std::chrono::milliseconds(250)};  ///< §5: time between the starts of two attempts
  /// Maximum time from the start of an attempt until its connection is set up. Ignored if no other address is left.
  Duration attempt_timeout{std::chrono::seconds(3)};
};

/// Connection attempts to several addresses of one server, of which the first success is used.
///
/// Model   The race makes its attempts one after the other. An attempt starts attempt_delay after the previous one, or
///         at once if the previous one failed.
///         Order: IPv6 comes first, then the families alternate. Within a family, the order of the resolver is used.
///         The first address that accepts wins, and the remaining attempts are cancelled. Their addresses are tried
///         again if the winner turns out not to be the expected server.
/// Source  RFC 8305, sections 3 to 6. Here an address that won an earlier race comes first (§4 permits it).
/// Limits  kMaxPerFamily addresses per family; the race ignores all others
/// Thread  any, one at a time
class AddressRace {
 public:
  static constexpr std::size_t kMaxPerFamily = 8;

  /// In      known    addresses that need no look-up, in order of preference
  ///         lookups  number of outstanding DNS look-ups: 0, or 2 (one for each family)
  explicit AddressRace(std::span<const Address> known = {}, int lookups = 0, RaceSettings settings = {});

  /// Adds the DNS answer for one family. `problem` states why the answer contains no address.
  void add(std::span<const Address> addresses, bool is_v6, const std::string& problem, LocalTime now);
  /// Returns the address to connect to now; empty if no attempt is to start now. Call it repeatedly until it is empty.
  std::optional<Address> next(LocalTime now);
  /// Returns the earliest time at which next() or expired() can return a new result. Empty if their results can change
  /// only after a call of add(), failed() or accepted().
  std::optional<LocalTime> due() const;
  /// Returns the address of an attempt that has timed out. The caller cancels that attempt and calls failed().
  std::optional<Address> expired(LocalTime now) const;
  /// Records that an attempt, or the accepted connection, failed.
  void failed(const Address& address, AttemptFailure failure, const std::string& why);
  /// Declares the address the winner. No further attempt starts; the caller cancels all other attempts.
  void accepted(const Address& address);

  /// Returns whether the race has failed: every address has failed and no look-up is outstanding. If the race began
  /// with known addresses, outstanding look-ups do not count, because an unresponsive name server must not delay
  /// reconnections. A DNS answer that arrives too late for this race is used by the next race.
  bool is_lost() const;
  /// Returns readable text with the result of each tried address and each look-up.
  std::string report() const;
  bool has_addresses() const { return !candidates_.empty(); }
  /// Returns why the only address failed. Empty if there are several addresses, or if the only one did not fail.
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
  int lookups_;                           ///< number of outstanding look-ups
  bool awaits_v6_;                        ///< whether the IPv6 answer of DNS is outstanding
  std::optional<LocalTime> v4_answered_;  ///< time of the IPv4 answer of DNS, set while the IPv6 answer is outstanding
  bool is_v6_next_;                       ///< the next attempt prefers an IPv6 address
  std::optional<Address> last_tried_;     ///< address of the last attempt; empty: no attempt has started
  std::optional<LocalTime> last_start_;   ///< start of the last attempt; empty: the next attempt may start at once
};

}  // namespace tandem::net
