// List of used invitations, so that an invitation never admits a second user. It is stored in a file beside the keys,
// and is read at every start, with and without --resume. No clock error can remove an id from the list.
//
//   io thread   use(), release(), revoke() ──ring──▶ writer thread: changes the list, replaces and flushes the file
//               poll()                     ◀──ring── number of the last change that is on disk, or the error
//
// A join has three steps:
//   1. use() adds the id to the list, so no other connection can use the invitation. SessionHub holds the join until
//   step 3.
//   2. The writer thread writes the file with the id to disk.
//   3. The client gets a seat and is notified. If it gets no seat, release() removes the id.
// If the server is killed before step 2 is complete, the invitation remains unused. If it is killed between steps 2
// and 3, the invitation is used although no user was admitted. While the file cannot be written, no user is admitted.
//
// Ids are deleted only from a full list, and only after their tokens have expired. The latest expiry time of a deleted
// id is stored. Tokens that expire at that time or earlier are refused from then on. A clock that is set back therefore
// makes no deleted token valid again.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "common/realtime/ring.hpp"
#include "common/recording/recorder_thread.hpp"
#include "server/session/invitation_file.hpp"

namespace tandem::server {

/// Maximum number of used tokens in the list. A full list takes 7 MB of memory, in two copies, and 2 MB on disk. The
/// largest expected number is 46,080: 64 users who each use a new invitation every hour for 30 days, the longest
/// validity.
inline constexpr std::size_t kMaxUsedTokens = 65'536;
/// The list of used invitations, in memory and in its file.
///
/// Thread  io for all functions except work()
class InvitationLedger {
 public:
  using Id = InvitationId;
  enum class Use : std::uint8_t { kNone, kBeingWritten, kWritten };
  using ReplaceFile = InvitationFile::ReplaceFile;

  /// Reads the file. If it does not exist, tokens issued before begin() are refused.
  /// In      file  if empty, the list is kept in memory only, and each use counts as written (for trials)
  ///         on_news  receives messages for the operator; called in begin() and on the thread of work()
  ///         replace  if empty, replace_file() is used
  /// Fails   std::invalid_argument if the file cannot be read or is damaged; the message names the remedy
  explicit InvitationLedger(std::filesystem::path file = {}, std::function<void(const std::string&)> on_news = {},
                            ReplaceFile replace = {}, std::size_t max_used = kMaxUsedTokens);
  ~InvitationLedger();
  InvitationLedger(const InvitationLedger&) = delete;
  InvitationLedger& operator=(const InvitationLedger&) = delete;

  /// Writes the file once, so that a write error is found at the start of the server. Call it before start().
  /// In      keeps_credentials  if false, all credentials of previous runs become invalid permanently
  /// Fails   std::invalid_argument if the file cannot be written
  void begin(bool keeps_credentials, std::uint64_t now_ms);
  /// Starts the writer thread. Without it, the caller must call work().
  void start();
  /// Writes the pending changes and ends the thread. Repeated calls have no effect.
  void finish();

  /// Returns the last time that a previous run noted with note_time() [ms since 1970]. A running server notes it every
  /// 10 minutes.
  std::uint64_t time_ms() const { return time_ms_; }
  /// Tokens issued before this time are refused [ms since 1970].
  std::uint64_t issued_from_ms() const { return issued_from_ms_; }
  /// Tokens that expire at this time or earlier are refused [ms since 1970].
  std::uint64_t forgotten_to_ms() const { return forgotten_to_ms_; }
  /// Returns the random id that all valid credentials share; empty if the list is kept in memory only.
  const std::string& generation() const { return generation_; }
  /// Returns whether a previous run revoked the credential. Call it before start().
  bool is_revoked(const Id& credential) const;

  Use use_of(const Id& token) const;
  /// Returns whether a use can be added. If the list is full, deletes the tokens that have expired at `now_ms` first.
  bool has_room(std::uint64_t now_ms);
  std::size_t max_used() const { return max_used_; }
  /// Marks a token as used; its state must be kNone. If the write fails, the state becomes kNone again, and problem()
  /// returns the reason.
  void use(const Id& token, std::uint64_t expires_ms);
  /// Removes the use of a token, because its holder got no seat.
  void release(const Id& token);
  /// Revokes a credential, which a checkpoint may still contain.
  void revoke(const Id& credential);
  /// Writes the current time to the file. If the clock shows an earlier time than that at the next start, the clock was
  /// set back.
  void note_time(std::uint64_t now_ms);
  /// Collects the results of the writer thread, and passes changes to the writer. Never blocks.
  void poll();
  /// Error of the last write; empty if it succeeded.
  std::string problem() const;

  /// Writes pending changes, or retries a failed write (InvitationFile::write()).
  /// Thread  writer
  void work(LocalTime now);

 private:
  using Change = InvitationChange;

  struct Outcome {
    std::uint64_t number = 0;  ///< number of the last change in this write
    int error = 0;             ///< errno of the write; 0 if it succeeded
  };
  struct UsedToken {
    std::uint64_t expires_ms = 0;
    /// Number of the kUse change; 0 if the use was read from the file or is kept in memory only.
    std::uint64_t number = 0;
  };

  void post(Change change);
  void settle(const Outcome& outcome);

  /// Accessed by the writer thread while it runs. None: the list is kept in memory only.
  std::optional<InvitationFile> file_;
  std::size_t max_used_;
  std::uint64_t time_ms_ = 0, issued_from_ms_ = 0, forgotten_to_ms_ = 0;
  std::string generation_;
  // Members for the io thread only.
  std::map<Id, UsedToken> used_;
  std::deque<Change> waiting_{};        ///< changes that do not fit into the ring yet
  std::deque<Change> being_written_{};  ///< kUse changes passed to the writer, without a result yet
  /// Numbers of three changes: the last that io has made, the last that io has passed to the writer, and the last that
  /// the writer has completed.
  std::uint64_t posted_ = 0, sent_ = 0, settled_ = 0;
  std::uint64_t none_expires_before_ms_ = 0;
  int error_ = 0;
  // Members for both threads.
  static constexpr std::size_t kInFlight = 256;
  realtime::Ring<Change> changes_{kInFlight};
  realtime::Ring<Outcome> outcomes_{kInFlight};
  std::unique_ptr<recording::RecorderThread> thread_;
};

}  // namespace tandem::server
