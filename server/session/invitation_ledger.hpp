// List of used invitations, on disk beside the keys. The file is read at every start, with and without --resume. Its
// ids stay regardless of the clock, so a used invitation never admits anybody again.
//
//   io thread   use(), release(), revoke() ──ring──▶ writer thread: changes the list, replaces and flushes the file
//               poll()                     ◀──ring── numbers of the changes that are on disk, or the error
//
// The order of a join:
//   1. use(): the id is in the list, so no other connection can use it; the client waits (SessionHub)
//   2. the file with the id is on disk
//   3. the client gets a seat and is notified; without a seat, release()
// A kill before step 2 leaves the invitation unused. A kill between steps 2 and 3 leaves it used without a user. If the
// file cannot be written, nobody is admitted.
//
// Ids are deleted only when the list is full, and only of expired tokens. From then on, tokens that expire no later are
// refused, so setting the clock back makes none of them valid again.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <system_error>

#include "common/realtime/ring.hpp"
#include "common/recording/recorder_thread.hpp"
#include "tandem/checkpoint.pb.h"

namespace tandem::server {

/// Limit of used tokens in the list. 64 users with a new invitation every hour for 30 days, the longest validity, use
/// 46,080. Memory: two copies, 7 MB; disk: 2 MB.
inline constexpr std::size_t kMaxUsedTokens = 65'536;
/// Limit of revoked credentials; the newest are kept. A checkpoint holds at most 1024 credentials.
inline constexpr int kMaxRevoked = 4096;

/// Thread  io, except work()
class InvitationLedger {
 public:
  using Id = std::array<std::byte, 16>;
  enum class Use : std::uint8_t { kNone, kBeingWritten, kWritten };
  /// Replaces a whole file, which is on disk when the call returns.
  using ReplaceFile = std::function<std::error_code(const std::filesystem::path&, std::span<const std::byte>)>;

  /// Reads the file. Without a file, tokens issued before begin() are refused.
  /// In      file  empty: in memory only, for trials; each use counts as written
  ///         on_news  messages for the operator; called on the thread of work()
  ///         replace  empty: replace_file()
  /// Fails   std::invalid_argument: the file cannot be read or is damaged; the message names the remedy
  explicit InvitationLedger(std::filesystem::path file = {}, std::function<void(const std::string&)> on_news = {},
                            ReplaceFile replace = {}, std::size_t max_used = kMaxUsedTokens);
  ~InvitationLedger();
  InvitationLedger(const InvitationLedger&) = delete;
  InvitationLedger& operator=(const InvitationLedger&) = delete;

  /// Makes the file for a new key, which has no tokens yet; keeps an existing file.
  /// Fails   std::invalid_argument: the file cannot be written
  static void make(const std::filesystem::path& file);

  /// Writes the file once before start(), so that a write error is found at the start.
  /// In      keeps_credentials  false: credentials of previous runs end for good
  /// Fails   std::invalid_argument: the file cannot be written
  void begin(bool keeps_credentials, std::uint64_t now_ms);
  /// Starts the writer thread; without it, the caller must call work().
  void start();
  /// Writes the pending changes and ends the thread. Idempotent.
  void finish();

  /// Newest time noted by previous runs; at most 10 minutes old when the last one ended.
  std::uint64_t time_ms() const { return time_ms_; }
  /// Tokens issued before issued_from_ms() are refused, and those that expire by forgotten_to_ms().
  std::uint64_t issued_from_ms() const { return issued_from_ms_; }
  std::uint64_t forgotten_to_ms() const { return forgotten_to_ms_; }
  /// Generation of the valid credentials; empty: in memory only.
  const std::string& generation() const { return generation_; }
  /// Call before start().
  bool is_revoked(const Id& credential) const;

  Use use_of(const Id& token) const;
  /// Whether a use can be added; false: the list is full of tokens that have not expired at `now_ms`.
  bool has_room(std::uint64_t now_ms);
  std::size_t max_used() const { return max_used_; }
  /// Marks a token that is kNone as used. If the write fails, it becomes kNone again, and problem() gives the reason.
  void use(const Id& token, std::uint64_t expires_ms);
  /// Removes a use whose join got no seat.
  void release(const Id& token);
  /// Revokes a credential that a checkpoint may still hold.
  void revoke(const Id& credential);
  /// Notes the time on disk: a clock behind it at the next start was set back.
  void note_time(std::uint64_t now_ms);
  /// Collects the writer's results. Never waits.
  void poll();
  /// Error of the last write; empty: it succeeded.
  std::string problem() const;

  /// Writes pending changes. After a failure retries with a back-off of 0.5 s to 8 s.
  /// Thread  writer
  void work(LocalTime now);

 private:
  struct Change {
    enum class Kind : std::uint8_t { kUse, kRelease, kRevoke, kForget, kTime };
    Kind kind = Kind::kUse;
    Id id{};
    /// kUse: expiry of the token. kForget: latest expiry of the deleted ones. kTime: the time.
    std::uint64_t unix_ms = 0;
    std::uint64_t number = 0;
  };
  struct Outcome {
    std::uint64_t number = 0;  ///< last change written
    int error = 0;             ///< errno; 0: on disk
  };
  struct UsedToken {
    std::uint64_t expires_ms = 0;
    std::uint64_t number = 0;  ///< number of the change; 0: from a previous run
  };
  void read();
  void post(Change change);
  void settle(const Outcome& outcome);
  void apply(const Change& change);
  std::error_code write();

  std::filesystem::path file_;
  std::function<void(const std::string&)> on_news_;
  ReplaceFile replace_;
  std::size_t max_used_;
  bool is_new_ = false;
  std::uint64_t time_ms_ = 0, issued_from_ms_ = 0, forgotten_to_ms_ = 0;
  std::string generation_;
  // Used by the io thread only.
  std::map<Id, UsedToken> used_;
  std::deque<Change> waiting_{};                       ///< until the ring has space
  std::deque<Change> being_written_{};                 ///< uses
  std::uint64_t posted_ = 0, sent_ = 0, settled_ = 0;  ///< numbers of the last change
  std::uint64_t none_expires_before_ms_ = 0;
  int error_ = 0;
  // Shared by both threads.
  static constexpr std::size_t kInFlight = 256;
  realtime::Ring<Change> changes_{kInFlight};
  realtime::Ring<Outcome> outcomes_{kInFlight};
  // Used by the writer only.
  wire::InvitationLedger list_;
  bool is_failing_ = false;
  LocalTime retry_{};
  Duration back_off_{};
  std::unique_ptr<recording::RecorderThread> thread_;
};

}  // namespace tandem::server
