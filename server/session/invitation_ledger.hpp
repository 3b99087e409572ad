// Which invitations were used, on disk beside the keys. The file is read at every start, with --resume and without, and an id stays
// in it whatever the clock does: no used invitation lets in again.
//
//   io thread      use(), release(), revoke() ──ring──▶ writer thread: changes the list, replaces the file as a whole and flushes it
//                  poll()                     ◀──ring── numbers of the changes that are on the disk, or the error
//
// The order of a join:
//   1. use(): the id is in the list, and no other connection can use it; the client waits (SessionHub)
//   2. the file with the id is on the disk
//   3. the client has its seat and is told so; release() where it gets none
// A kill before 2 leaves an invitation that nobody has used; a kill between 2 and 3 one that is used up without a user. A file that
// cannot be written lets nobody in.
//
// An id is deleted only when the list is full, of tokens that have expired. Tokens that expire no later are refused from then on, so
// that a clock which is set back makes none of them valid again.
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

/// Used tokens in the list: 64 users, each with a new invitation every hour, around the clock for the 30 days that one can be valid
/// make 46,080. In memory twice, 7 MB; on disk 2 MB.
inline constexpr std::size_t kMaxUsedTokens = 65'536;
/// Credentials that were revoked, of which the newest are kept: a checkpoint holds 1024 credentials at most.
inline constexpr int kMaxRevoked = 4096;

/// Thread  io, but for work()
class InvitationLedger {
 public:
  using Id = std::array<std::byte, 16>;
  enum class Use : std::uint8_t { kNone, kBeingWritten, kWritten };
  /// Replaces a file as a whole; it is on the disk when this returns.
  using ReplaceFile = std::function<std::error_code(const std::filesystem::path&, std::span<const std::byte>)>;

  /// Reads the file. Where there is none, tokens that were issued before begin() are refused.
  /// In      file  empty: in memory alone, for trials; each use counts as written
  ///         on_news  for people; called on the thread of work()
  ///         replace  empty: replace_file()
  /// Fails   std::invalid_argument: it cannot be read or is damaged; the message names the remedy
  explicit InvitationLedger(std::filesystem::path file = {}, std::function<void(const std::string&)> on_news = {},
                            ReplaceFile replace = {}, std::size_t max_used = kMaxUsedTokens);
  ~InvitationLedger();
  InvitationLedger(const InvitationLedger&) = delete;
  InvitationLedger& operator=(const InvitationLedger&) = delete;

  /// Makes the file for a key that has just been made, of which there are no tokens yet; leaves one that exists.
  /// Fails   std::invalid_argument: it cannot be written
  static void make(const std::filesystem::path& file);

  /// Writes the file, so that one that cannot be written is found at the start. Before start().
  /// In      keeps_credentials  false: those of the runs before end, also for later runs
  /// Fails   std::invalid_argument: it cannot be written
  void begin(bool keeps_credentials, std::uint64_t now_ms);
  /// Starts the writer thread; without it work() is the caller's to call.
  void start();
  /// Writes what has not been written yet, and ends the thread. Idempotent.
  void finish();

  /// The newest time that the runs before have noted; at most 10 minutes old when the last one ended.
  std::uint64_t time_ms() const { return time_ms_; }
  /// Tokens that were issued before are refused; those that expire then or before, too.
  std::uint64_t issued_from_ms() const { return issued_from_ms_; }
  std::uint64_t forgotten_to_ms() const { return forgotten_to_ms_; }
  /// Of the credentials that are valid; empty: in memory alone.
  const std::string& generation() const { return generation_; }
  /// Before start().
  bool is_revoked(const Id& credential) const;

  Use use_of(const Id& token) const;
  /// False: the list is full of tokens that have not expired at `now_ms`.
  bool has_room(std::uint64_t now_ms);
  std::size_t max_used() const { return max_used_; }
  /// Of a token that is kNone. Where it cannot be written it becomes kNone again, and problem() says why.
  void use(const Id& token, std::uint64_t expires_ms);
  /// Nobody was let in by it.
  void release(const Id& token);
  /// A credential that a checkpoint may still hold.
  void revoke(const Id& credential);
  /// Has the time written: a clock that is behind it at the next start was set back.
  void note_time(std::uint64_t now_ms);
  /// Takes over what the writer has done. Never waits.
  void poll();
  /// Of the last write; empty: it has worked.
  std::string problem() const;

  /// Writes what has changed, or what could not be written before; from 0.5 s to 8 s after a failure.
  /// Thread  the writer's
  void work(LocalTime now);

 private:
  struct Change {
    enum class Kind : std::uint8_t { kUse, kRelease, kRevoke, kForget, kTime };
    Kind kind = Kind::kUse;
    Id id{};
    std::uint64_t unix_ms =
        0;  ///< of kUse, when the token expires; of kForget, the last of those that are deleted; of kTime
    std::uint64_t number = 0;
  };
  struct Outcome {
    std::uint64_t number = 0;  ///< of the last change
    int error = 0;             ///< errno; 0: it is on the disk
  };
  struct UsedToken {
    std::uint64_t expires_ms = 0;
    std::uint64_t number = 0;  ///< of the change; 0: of a run before
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
  // The io thread's.
  std::map<Id, UsedToken> used_;
  std::deque<Change> waiting_{};                       ///< for space in the ring
  std::deque<Change> being_written_{};                 ///< uses
  std::uint64_t posted_ = 0, sent_ = 0, settled_ = 0;  ///< numbers of the last change
  std::uint64_t none_expires_before_ms_ = 0;
  int error_ = 0;
  // Between both.
  static constexpr std::size_t kInFlight = 256;
  realtime::Ring<Change> changes_{kInFlight};
  realtime::Ring<Outcome> outcomes_{kInFlight};
  // The writer's.
  wire::InvitationLedger list_;
  bool is_failing_ = false;
  LocalTime retry_{};
  Duration back_off_{};
  std::unique_ptr<recording::RecorderThread> thread_;
};

}  // namespace tandem::server
