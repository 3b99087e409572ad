// Limits on the load of the io thread per connection, per address and in total (server/OPERATING.md). A connection that
// exceeds its own limit is closed. If a limit shared with others is reached, the connection waits.
#pragma once

#include <chrono>
#include <cstddef>

#include "common/base/time.hpp"
#include "common/net/token_bucket.hpp"

namespace tandem::server {

// Limits of one connection. If it exceeds one of them, it is closed.
/// Rate of control messages. Each costs 1, except state datagrams and requests for assets, which cost kOwnPace, because
/// a client program sends them automatically.
inline constexpr net::Rate kControlRate{100, 200};
inline constexpr double kOwnPace = 0.05;
/// Rate of accepted client updates. A client sends 1000 per second.
inline constexpr net::Rate kUpdateRate{4000, 4000};
/// Maximum number of queued control bytes that the client has not read. Beyond it, the connection is closed
/// (DISCONNECT_SLOW).
inline constexpr std::size_t kMaxQueuedControlBytes = 1024 * 1024;
/// Number of queued bytes above which notifications are held back. Meanwhile, only the newest value of each parameter
/// is stored, and a user who joins and leaves again is not reported.
inline constexpr std::size_t kMaxQueuedBeforeNews = 16 * 1024;

// Limits on the requests of one user, and of all users of a room together. Requests beyond them are refused.
/// Rate of pointing requests. They are rare because each gives a short force to the hands of all users.
inline constexpr net::Rate kUserPointRate{1, 2}, kPointRate{4, 8};
/// Rate of values of signals.
inline constexpr net::Rate kSourceSignalRate{50, 100}, kSignalRate{200, 400};
/// Rate of requests for poses of molecules.
inline constexpr net::Rate kUserPoseRate{4, 8}, kPoseRate{16, 32};

// Limits of one address, shared by all connections from it. If the rate is exceeded, its connections that have not
// joined wait.
/// Rate of control messages of all its connections. State datagrams and requests for assets of joined users are not
/// counted.
inline constexpr net::Rate kAddressControlRate{1000, 2000};
/// Cost of a join in kAddressControlRate. It is high, because a join causes the most work for others.
inline constexpr double kJoinPrice = 10;
/// Maximum number of connections that have not joined. If it is exceeded, the oldest of them is closed.
inline constexpr std::size_t kMaxHalfOpen = 16;
/// A user who leaves earlier than this after joining is logged as another kind of event. The log limits the lines of
/// each kind, so many short visits do not suppress the lines of other users.
inline constexpr Duration kShortStay{std::chrono::seconds(5)};

// Budgets of one cycle of the io thread (about a millisecond) for control messages, new connections and reads. They
// ensure that states are sent on time. Excess work waits for the next cycle, in the hub or in the kernel.
inline constexpr net::Rate kTurn{64'000, 64};            ///< control messages of all connections
inline constexpr net::Rate kConnectionTurn{16'000, 32};  ///< control messages of one connection
/// Cost of a message with a large answer (a join or a chunk of an asset) in kTurn and kConnectionTurn.
inline constexpr double kBigAnswer = 8;
inline constexpr net::Rate kReadTurn{64'000, 64};         ///< TCP reads of all connections
inline constexpr net::Rate kConnectionReadTurn{2000, 2};  ///< TCP reads of one connection
inline constexpr std::size_t kReadBytes = 4096;           ///< maximum number of bytes per read
inline constexpr net::Rate kAcceptTurn{4000, 8};          ///< new connections
inline constexpr net::Rate kHandshakeTurn{500, 4};        ///< answered TLS handshakes; each needs a signature, 0.2 ms
inline constexpr net::Rate kStrangersTurn{64'000, 64};    ///< datagrams to the public port
inline constexpr net::Rate kConnectionDatagramTurn{32'000, 32};  ///< datagrams of one user from the known address

}  // namespace tandem::server
