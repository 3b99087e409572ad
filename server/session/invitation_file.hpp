// File with the used invitations. It is read at the start of a server, and a writer thread writes the changes. The file
// consists of a SHA-256 of the list and the list (checkpoint.proto).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <system_error>

#include "common/base/time.hpp"
#include "tandem/checkpoint.pb.h"

namespace tandem::server {

/// Maximum number of revoked credentials in the list. At the limit, the oldest is deleted. This is safe, because a
/// checkpoint has at most 1024 credentials and therefore none as old as a deleted one.
inline constexpr int kMaxRevoked = 4096;

/// Id of an invitation or of a credential.
using InvitationId = std::array<std::byte, 16>;

std::string text_of_id(const InvitationId& id);
/// Returns none if the text does not have 16 bytes.
std::optional<InvitationId> id_in(const std::string& text);

struct InvitationChange {
  enum class Kind : std::uint8_t { kUse, kRelease, kRevoke, kForget, kTime };
  Kind kind = Kind::kUse;
  InvitationId id{};
  /// kUse: time at which the token expires. kForget: latest expiry among the deleted tokens. kTime: current time. Other
  /// kinds: unused.
  std::uint64_t unix_ms = 0;
  std::uint64_t number = 0;
};

/// The list of used invitations. At first it equals the file. While a write has failed, it also contains the changes
/// that are not on disk yet.
///
/// Thread  the writer thread while it runs; before and after that the io thread
class InvitationFile {
 public:
  /// Replaces a file. The new contents are on disk when the call returns.
  using ReplaceFile = std::function<std::error_code(const std::filesystem::path&, std::span<const std::byte>)>;

  /// Reads the file. If it does not exist, the list is empty and gets a new generation (the random id of all
  /// credentials that are valid together).
  ///
  /// In      file  must not be empty
  ///         on_news  receives messages for the operator
  ///         replace  if empty, replace_file() is used
  /// Fails   std::invalid_argument if the file cannot be read or is damaged; the message names the remedy
  InvitationFile(std::filesystem::path file, std::function<void(const std::string&)> on_news, ReplaceFile replace);

  /// Creates the file for a new server key, for which no tokens exist yet. An existing file is not changed.
  /// Fails   std::invalid_argument if the file cannot be written
  static void make(const std::filesystem::path& file);

  const wire::InvitationLedger& list() const { return list_; }
  /// Writes the list once, so that a write error is found at the start of the server. If the file is new, the list also
  /// records `now_ms`, and tokens issued before that time are refused.
  ///
  /// In      keeps_credentials  true: credentials of earlier runs remain valid. false: a new generation makes them
  ///                            invalid, and the list of revoked credentials is cleared
  /// Fails   std::invalid_argument if the file cannot be written
  void begin(bool keeps_credentials, std::uint64_t now_ms);
  /// Applies the changes and writes the file. If the write fails, the kUse changes are reverted. Without changes, the
  /// file is written only to retry a failed write, with a back-off of 0.5 s to 8 s.
  /// Out     errno of the write; 0 if it succeeded or was not necessary
  int write(std::span<const InvitationChange> changes, LocalTime now);

 private:
  void read();
  void apply(const InvitationChange& change);
  std::error_code replace();

  std::filesystem::path file_;
  std::function<void(const std::string&)> on_news_;
  ReplaceFile replace_;
  bool is_new_ = false;
  wire::InvitationLedger list_;
  bool is_failing_ = false;  ///< whether the last write failed
  LocalTime retry_{};        ///< time of the next attempt
  Duration back_off_{};
};

}  // namespace tandem::server
