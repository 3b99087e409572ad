// What one connection, one address and all together may ask of the io thread: every number is here, and said in
// server/README.md. Who goes beyond a limit of his own is ended; who meets one that he shares with others waits.
#pragma once

#include <chrono>
#include <cstddef>

#include "common/base/time.hpp"
#include "common/net/token_bucket.hpp"

namespace tandem::server {

// One connection's own: beyond them it is ended.
/// Control messages; state and requests for assets, which a client sends at its own pace, count kOwnPace.
inline constexpr net::Rate kControlRate{100, 200};
inline constexpr double kOwnPace = 0.05;
/// Client updates that are taken; a client sends 1000 a second.
inline constexpr net::Rate kUpdateRate{4000, 4000};
/// Places that one user points at; beyond it they are refused. Each nudges the hands of the others.
inline constexpr net::Rate kUserPointRate{1, 2};
/// A reader that leaves more than this unread is disconnected (DISCONNECT_SLOW).
inline constexpr std::size_t kMaxQueuedControlBytes = 1024 * 1024;
/// While more than this waits for a reader, news of others wait beside it: of each parameter the newest, of users who is
/// there by then.
inline constexpr std::size_t kMaxQueuedBeforeNews = 16 * 1024;

// One address's: those who share it and have not joined wait, in turn.
/// Control messages of all of them, joined ones included but for what those send at their own pace.
inline constexpr net::Rate kAddressControlRate{1000, 2000};
/// What joining counts there, for it costs others most.
inline constexpr double kJoinPrice = 10;
/// Connections that have not joined; beyond it the oldest of them is ended.
inline constexpr std::size_t kMaxHalfOpen = 16;
/// Who stays no longer than that leaves a line of another kind in the log, where those of a kind are bounded.
inline constexpr Duration kShortStay{std::chrono::seconds(5)};

// A turn of the io thread is about a millisecond: what control, accepting and reading may take of it, so that states go
// out on time. What is more waits for the next turn, here or in the kernel.
inline constexpr net::Rate kTurn{64'000, 64};            ///< control messages of all
inline constexpr net::Rate kConnectionTurn{16'000, 32};  ///< of one connection
/// What a message counts there that is answered with much: joining, an asset's chunk.
inline constexpr double kBigAnswer = 8;
inline constexpr net::Rate kReadTurn{64'000, 64};                ///< reads of TCP, all together
inline constexpr net::Rate kConnectionReadTurn{2000, 2};         ///< of one connection
inline constexpr std::size_t kReadBytes = 4096;                  ///< at one read
inline constexpr net::Rate kAcceptTurn{4000, 8};                 ///< new connections
inline constexpr net::Rate kHandshakeTurn{500, 4};               ///< TLS handshakes answered: a signature each, 0.2 ms
inline constexpr net::Rate kStrangersTurn{64'000, 64};           ///< datagrams to the port that everybody knows
inline constexpr net::Rate kConnectionDatagramTurn{32'000, 32};  ///< datagrams of one user, from where he always sends

}  // namespace tandem::server
