// Limits on the load of the io thread, per connection, per address and in total (server/OPERATING.md). A connection
// that exceeds its own limit is closed. At a limit that is shared with other connections, a connection is delayed.
#pragma once

#include <chrono>
#include <cstddef>

#include "common/base/time.hpp"
#include "common/net/token_bucket.hpp"

namespace tandem::server {

// Limits of one connection, which is closed when it exceeds one of them.
/// Rate of control messages. A message usually costs 1 token of the bucket. State datagrams over TCP and requests for
/// assets cost only kOwnPace tokens, because the client program sends many of them automatically.
inline constexpr net::Rate kControlRate{100, 200};
inline constexpr double kOwnPace = 0.05;
/// Rate of accepted client updates. A client sends 1000 per second.
inline constexpr net::Rate kUpdateRate{4000, 4000};
/// Maximum number of queued control bytes that the client has not read. Beyond it, the connection is closed
/// (DISCONNECT_SLOW).
inline constexpr std::size_t kMaxQueuedControlBytes = 1024 * 1024;
/// Number of queued control bytes above which notifications are held back. While they are held back, a newer value of a
/// parameter replaces the older one, and a user who joins and leaves again is not reported.
inline constexpr std::size_t kMaxQueuedBeforeNews = 16 * 1024;

// Limits on the requests of one user, and of all users of a room together. Requests beyond them are refused.
/// Rate of pointing requests. It is low because each request applies a short force to the hands of all users.
inline constexpr net::Rate kUserPointRate{1, 2}, kPointRate{4, 8};
/// Rate of signal values: from one source, and from all sources of a room.
inline constexpr net::Rate kSourceSignalRate{50, 100}, kSignalRate{200, 400};
/// Rate of requests for saved poses of molecules.
inline constexpr net::Rate kUserPoseRate{4, 8}, kPoseRate{16, 32};

// Limits of one address, shared by all connections from it. At the limit of the rate, those connections are delayed
//        that have not joined.
/// Rate of the control messages of all connections of an address. State datagrams and requests for assets of joined
/// users are not counted.
inline constexpr net::Rate kAddressControlRate{1000, 2000};
/// Cost of a join in kAddressControlRate, in tokens. It is high, because a join causes more work than other messages.
inline constexpr double kJoinPrice = 10;
/// Maximum number of connections of an address that have not joined. Beyond it, the oldest of them is closed.
inline constexpr std::size_t kMaxHalfOpen = 16;
/// Stays in a room that are shorter than this are logged as a separate kind of event. The log limits the number of
/// lines of each kind, so many short stays do not suppress the lines about longer stays.
inline constexpr Duration kShortStay{std::chrono::seconds(5)};

// Budgets of one cycle of the io thread (about a millisecond) for control messages, new connections and reads. They
// bound the delay of states. Excess work remains in the hub or in the kernel until the next cycle.
inline constexpr net::Rate kTurn{64'000, 64};            ///< control messages of all connections
inline constexpr net::Rate kConnectionTurn{16'000, 32};  ///< control messages of one connection
/// Cost of a message with a large answer (a join or a chunk of an asset) in kTurn and kConnectionTurn.
inline constexpr double kBigAnswer = 8;
inline constexpr net::Rate kReadTurn{64'000, 64};                ///< TCP reads of all connections
inline constexpr net::Rate kConnectionReadTurn{2000, 2};         ///< TCP reads of one connection
inline constexpr std::size_t kReadBytes = 4096;                  ///< maximum number of bytes per read
inline constexpr net::Rate kAcceptTurn{4000, 8};                 ///< new connections
inline constexpr net::Rate kHandshakeTurn{500, 4};               ///< TLS handshakes; the signature of each takes 0.2 ms
inline constexpr net::Rate kStrangersTurn{64'000, 64};           ///< datagrams to the public port
inline constexpr net::Rate kConnectionDatagramTurn{32'000, 32};  ///< datagrams from the known address of one user

}  // namespace tandem::server
