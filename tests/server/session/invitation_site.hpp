// Test support: a state folder with a sequence of servers that use it, and a model that predicts which invitations are
// valid.
#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "proto/join_token.hpp"
#include "tests/support/hub_bench.hpp"

namespace tandem::server {

using namespace std::chrono_literals;

inline std::int64_t milliseconds(Duration duration) {
  return duration / 1ms;
}

struct Invitation {
  proto::Bytes token;
  std::int64_t issued_ms = 0, expires_ms = 0;
  bool is_operator = false;
};

/// Predicts from the events so far whether an invitation is valid, without using the server's code.
struct Model {
  /// Invitations that have admitted a user, or whose use was on disk when the server was killed.
  std::set<std::size_t> used;
  // Bounds of the clock offset (wall clock minus true time) that the server may assume. Both bounds are equal if the
  // clock has not been set for 10 s.
  std::int64_t low_ms = 0, high_ms = 0;
  std::int64_t noted_ms = 0;  ///< upper bound of the clock offset when the ledger noted the time in its file
  std::int64_t wall_ms = 0;   ///< current offset of the wall clock
  std::int64_t set_at_ms = 0;

  void set_clock(std::int64_t offset_ms, std::int64_t now_ms) {
    wall_ms = offset_ms;
    set_at_ms = now_ms;
  }
  void start(std::int64_t now_ms) {
    low_ms = std::min(low_ms, wall_ms);
    high_ms = std::max({high_ms, wall_ms, noted_ms});
    set_at_ms = now_ms;
  }
  void pass_to(std::int64_t now_ms, bool is_disk_full) {
    if (now_ms - set_at_ms < milliseconds(kClockHold)) return;
    low_ms = high_ms = wall_ms;
    noted_ms = is_disk_full ? std::max(noted_ms, wall_ms) : wall_ms;
  }
  bool must_enter(std::size_t number, const Invitation& invitation, std::int64_t now_ms) const {
    return !used.contains(number) && invitation.issued_ms <= now_ms + low_ms + 60'000 &&
           now_ms + high_ms < invitation.expires_ms;
  }
  bool must_not_enter(std::size_t number, const Invitation& invitation, std::int64_t now_ms) const {
    return used.contains(number) || invitation.issued_ms > now_ms + high_ms + 60'000 ||
           now_ms + low_ms >= invitation.expires_ms;
  }
};

/// A user who was admitted, connected or not.
struct Guest {
  std::string credential;
  std::int64_t joined_ms = 0, lost_ms = 0;  ///< lost_ms is 0 while the user is connected
  bool is_ended = false;  ///< true if the user was kicked, or if a server has since been started without --resume
};

/// A state folder and the servers that use it, one after the other. A server has one room.
class Site {
 public:
  explicit Site(std::uint64_t seed) : random_(seed) {
    char folder[] = "/tmp/tandem-invitations-XXXXXX";
    folder_ = ::mkdtemp(folder);
    InvitationFile::make(file());
    set_clock(0);
    start(false);
  }
  ~Site() {
    bench.reset();
    ledger.reset();
    std::filesystem::remove_all(folder_);
  }

  std::filesystem::path file() const { return folder_ / "invitations.pb"; }
  std::int64_t wall_ms() const { return now_ms + model.wall_ms; }

  void start(bool resumes) {
    boot_ms_ = now_ms - 1000 - static_cast<std::int64_t>(random_.next_u32() % 1'000'000);
    const auto replace = [this](const std::filesystem::path& to, std::span<const std::byte> bytes) {
      if (is_disk_full) return std::make_error_code(std::errc::no_space_on_device);
      std::ofstream(to, std::ios::binary).write(reinterpret_cast<const char*>(bytes.data()), std::ssize(bytes));
      ++writes;
      return std::error_code();
    };
    ledger = std::make_unique<InvitationLedger>(
        file(), [](const std::string&) {}, replace);
    HubSettings settings;
    settings.admission = AdmissionSettings{.audience = server_key_.id(),
                                           .issuers = {issuer_.public_key()},
                                           .unix_ms = [this] { return static_cast<std::uint64_t>(wall_ms()); },
                                           .ledger = ledger.get(),
                                           .resumed = resumes ? kept_ : wire::AdmissionState{}};
    bench = std::make_unique<test::HubBench>(settings);
    bench->transport.is_encrypted = true;
    bench->hub->on_admission = [this](const wire::AdmissionState& state) { kept_in_memory_ = state; };
    const bool was_full = std::exchange(is_disk_full, false);  // a server with a full disk would refuse to start
    ledger->begin(resumes, static_cast<std::uint64_t>(wall_ms()));
    is_disk_full = was_full;
    keeps_checkpoints_ = resumes;
    for (Guest& guest : guests) {
      if (guest.lost_ms == 0) guest.lost_ms = now_ms;
      guest.is_ended = guest.is_ended || !resumes;
    }
    model.start(now_ms);
    poll();
  }
  /// Ends the server as kill -9 would: data that is not on disk yet is lost.
  void kill() {
    bench.reset();
    ledger.reset();
  }
  void set_clock(std::int64_t offset_ms) {
    now_ms += 200;
    model.set_clock(offset_ms, now_ms);
    if (bench) poll();
  }
  void pass(Duration duration) {
    // Users who are silent for the duration time out. The server reads the clock before and after the duration.
    now_ms += milliseconds(duration);
    for (Guest& guest : guests) {
      if (duration >= 1500ms && guest.lost_ms == 0) guest.lost_ms = now_ms;
    }
    poll();
    // The first poll may change the state, for example by ending users. The second poll handles these changes.
    now_ms += 200;
    poll();
    write();
    model.pass_to(now_ms, is_disk_full);
  }
  void poll() {
    bench->now = LocalTime(std::chrono::milliseconds(now_ms - boot_ms_));
    bench->hub->poll(VirtualClock(bench->now));
    if (!keeps_checkpoints_) return;
    kept_ = kept_in_memory_;
    // Writes the checkpoint. For users who are connected, it contains the present time as the time of their loss, which
    // is used after a restart.
    for (auto& credential : *kept_.mutable_credentials()) {
      if (credential.lost_ms() == 0) credential.set_lost_ms(static_cast<std::uint64_t>(wall_ms()));
    }
  }
  /// Advances the time far enough that rate limits (limits.hpp) do not delay the next join.
  void breathe() {
    now_ms += 50;
    poll();
  }
  void write() {
    ledger->work(bench->now);
    poll();
  }

  Invitation issue(Duration life, wire::Role role = wire::ROLE_OBSERVER) {
    wire::TokenClaims claims;
    claims.set_audience(server_key_.id().data(), 32);
    claims.set_role(role);
    claims.set_issued_ms(static_cast<std::uint64_t>(wall_ms()));
    claims.set_expires_ms(claims.issued_ms() + static_cast<std::uint64_t>(milliseconds(life)));
    return {proto::sign_token(claims, issuer_), wall_ms(), wall_ms() + milliseconds(life), role == wire::ROLE_OPERATOR};
  }
  test::BenchClient join_with(const Invitation& invitation) {
    test::BenchClient client = bench->connect();
    bench->greet(client);
    wire::ClientControl join = test::HubBench::join_message("ada", wire::ROLE_UNSPECIFIED);
    join.mutable_join()->set_token(invitation.token.data(), invitation.token.size());
    const secure::PublicKey key = client_key_.public_key();
    join.mutable_join()->set_resume_key(key.data(), key.size());
    bench->send(client, join);
    return client;
  }
  test::BenchClient resume_with(const std::string& credential) {
    test::BenchClient client = bench->connect();
    bench->greet(client);
    wire::ClientControl join = test::HubBench::join_message("ada", wire::ROLE_UNSPECIFIED);
    const auto exported = test::RecordingTransport::export_of(client.handle, secure::kResumeExport);
    const secure::Signature signature = client_key_.sign(exported.secret.bytes());
    join.mutable_join()->mutable_resume()->set_credential(credential);
    join.mutable_join()->mutable_resume()->set_signature(signature.data(), signature.size());
    bench->send(client, join);
    return client;
  }
  /// Reads the messages to the client, and returns whether it was admitted. `text` receives the text of an error.
  bool is_in(test::BenchClient& client, std::string* text = nullptr) {
    for (const wire::ServerControl& message : bench->drain(client)) {
      if (text != nullptr && message.has_error()) *text = message.error().text();
      if (message.has_joined()) client.joined = message.joined();
    }
    return client.joined.user() != 0;
  }
  bool has_place() const { return bench->hub->users_in(0)[1] < 1; }  // the room has one seat for an observer
  void leave_all() {
    for (auto& client : here) bench->hub->on_disconnected(client.handle, bench->now);
    here.clear();
    for (Guest& guest : guests) {
      if (guest.lost_ms == 0) guest.lost_ms = now_ms;
    }
    poll();
  }

  std::int64_t now_ms = 1'700'000'000'000;  ///< true time [ms since 1970]
  Model model;
  bool is_disk_full = false;
  int writes = 0;
  std::unique_ptr<InvitationLedger> ledger;
  std::unique_ptr<test::HubBench> bench;
  std::vector<Guest> guests;
  std::vector<test::BenchClient> here;

 private:
  Random random_;
  std::filesystem::path folder_;
  std::int64_t boot_ms_ = 0;
  bool keeps_checkpoints_ = false;
  wire::AdmissionState kept_, kept_in_memory_;
  const secure::KeyPair server_key_ = secure::KeyPair::make(secure::KeyPair::Kind::kP256);
  const secure::KeyPair issuer_ = secure::KeyPair::make(secure::KeyPair::Kind::kEd25519);
  const secure::KeyPair client_key_ = secure::KeyPair::make(secure::KeyPair::Kind::kEd25519);
};

}  // namespace tandem::server
