// Limits on the load of the io thread by one connection, one address and all together (server/OPERATING.md).
// A connection that exceeds its own limit is ended; at a shared limit it waits.
#pragma once

#include <chrono>
#include <cstddef>

#include "common/base/time.hpp"
#include "common/net/token_bucket.hpp"

namespace tandem::server {

// Limits of one connection; beyond them it is ended.
/// Control messages. State and requests for assets, which a client sends at its own pace, cost kOwnPace.
inline constexpr net::Rate kControlRate{100, 200};
inline constexpr double kOwnPace = 0.05;
/// Accepted client updates; a client sends 1000 a second.
inline constexpr net::Rate kUpdateRate{4000, 4000};
/// Unread control bytes above which a connection is ended (DISCONNECT_SLOW).
inline constexpr std::size_t kMaxQueuedControlBytes = 1024 * 1024;
/// Queued bytes above which news are held back. Held news are merged: the newest value of each parameter, and the users
/// present at the time of sending.
inline constexpr std::size_t kMaxQueuedBeforeNews = 16 * 1024;

// Limits of the requests of one user, and of all users of a room; beyond them a request is refused.
/// Pointing; each nudges the hands of the others.
inline constexpr net::Rate kUserPointRate{1, 2}, kPointRate{4, 8};
/// Requests for poses of molecules.
inline constexpr net::Rate kUserPoseRate{4, 8}, kPoseRate{16, 32};

// Limits of one address. Its connections that have not joined wait in turn.
/// Control messages of all its connections, except those that joined users send at their own pace.
inline constexpr net::Rate kAddressControlRate{1000, 2000};
/// Cost of a join there; it is high because joins burden others most.
inline constexpr double kJoinPrice = 10;
/// Connections that have not joined; beyond this number the oldest is ended.
inline constexpr std::size_t kMaxHalfOpen = 16;
/// Stays up to this length are logged as another kind, because the log limits the lines of each kind.
inline constexpr Duration kShortStay{std::chrono::seconds(5)};

// Budget of control, accepting and reading in one turn of the io thread (about a millisecond), so that states go out on
// time. The rest waits for the next turn, here or in the kernel.
inline constexpr net::Rate kTurn{64'000, 64};            ///< control messages of all connections
inline constexpr net::Rate kConnectionTurn{16'000, 32};  ///< control messages of one connection
/// Cost there of a message with a large answer: a join or an asset's chunk.
inline constexpr double kBigAnswer = 8;
inline constexpr net::Rate kReadTurn{64'000, 64};         ///< TCP reads of all connections
inline constexpr net::Rate kConnectionReadTurn{2000, 2};  ///< TCP reads of one connection
inline constexpr std::size_t kReadBytes = 4096;           ///< per read
inline constexpr net::Rate kAcceptTurn{4000, 8};          ///< new connections
inline constexpr net::Rate kHandshakeTurn{500, 4};        ///< answered TLS handshakes: one signature each, 0.2 ms
inline constexpr net::Rate kStrangersTurn{64'000, 64};    ///< datagrams to the public port
inline constexpr net::Rate kConnectionDatagramTurn{32'000, 32};  ///< datagrams of one user from the usual address

}  // namespace tandem::server
