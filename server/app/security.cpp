#include "server/app/security.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <stdexcept>

#include "common/base/units.hpp"
#include "common/secure/certificate.hpp"
#include "server/session/unix_time.hpp"

namespace tandem::server {
namespace {

std::string text_in(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  if (text.empty()) throw std::invalid_argument("--cert: " + file.string() + " cannot be read; give a PEM file");
  return text;
}

std::filesystem::path from_environment(const char* name, const char* below) {
  const char* const value = std::getenv(name);
  return value == nullptr || *value == '\0' ? std::filesystem::path() : std::filesystem::path(value) / below;
}

wire::Role role_named(const std::string& name) {
  if (name == "observer") return wire::ROLE_OBSERVER;
  if (name == "signal") return wire::ROLE_SIGNAL;
  return name == "operator" ? wire::ROLE_OPERATOR : wire::ROLE_MANIPULATOR;
}

}  // namespace

std::filesystem::path default_state_folder() {
  auto folder = from_environment("TANDEM_STATE", "");
  if (folder.empty()) folder = from_environment("XDG_STATE_HOME", "tandem");
  if (folder.empty()) folder = from_environment("HOME", ".local/state/tandem");
  return folder;
}

ServerKeys open_keys(const SecurityOptions& options) {
  if (options.state.empty()) throw std::invalid_argument("--state: give a folder for the server's keys");
  if (options.certificate.empty() != options.key.empty()) {
    throw std::invalid_argument("--cert and --key belong together; give both, or none");
  }
  using Kind = secure::KeyPair::Kind;
  const bool has_own = options.key.empty();
  const bool is_new = has_own && !std::filesystem::exists(options.state / "server-key.pem");
  const auto identity = has_own ? secure::KeyPair::load_or_make(options.state / "server-key.pem", Kind::kP256)
                                : secure::KeyPair::load(options.key);
  if (is_new) InvitationFile::make(ledger_file(options.state));
  const std::string pem = has_own ? secure::self_signed_certificate(identity) : text_in(options.certificate);
  return {identity, secure::KeyPair::load_or_make(options.state / "token-key.pem", Kind::kEd25519), pem};
}

std::filesystem::path ledger_file(const std::filesystem::path& state) {
  return state / "invitations.pb";
}

std::shared_ptr<void> lock_state(const std::filesystem::path& state) {
  if (state.empty()) throw std::invalid_argument("--state: give a folder for the server's data");
  const std::filesystem::path file = state / "lock";
  std::error_code error;
  if (std::filesystem::create_directories(state, error)) ::chmod(state.c_str(), S_IRWXU);
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (descriptor < 0) throw std::invalid_argument("--state: " + file.string() + " cannot be written");
  const std::shared_ptr<void> lock(nullptr, [descriptor](void*) { ::close(descriptor); });
  if (::flock(descriptor, LOCK_EX | LOCK_NB) == 0) return lock;
  throw std::invalid_argument("--state: another server has " + state.string() + "; give each a folder of its own");
}

std::shared_ptr<const secure::TlsContext> tls_of(const ServerKeys& keys) {
  return std::make_shared<const secure::TlsContext>(secure::TlsContext::server(keys.identity, keys.certificate_pem));
}

AdmissionSettings admission_of(const ServerKeys& keys, const SecurityOptions& options) {
  AdmissionSettings settings{
      .audience = keys.identity.id(), .issuers = {keys.issuer.public_key()}, .unix_ms = unix_ms_now};
  for (const std::string& text : options.issuers) {
    const auto bytes = secure::bytes_of_text(text);
    secure::PublicKey key{};
    if (!bytes || bytes->size() != key.size()) {
      throw std::invalid_argument("--issuer: '" + text +
                                  "' is no key; copy the one that tandem-token --new-key prints");
    }
    std::ranges::copy(*bytes, key.begin());
    settings.issuers.push_back(key);
  }
  return settings;
}

std::uint64_t unix_ms_now() {
  return static_cast<std::uint64_t>(std::chrono::system_clock::now().time_since_epoch() / std::chrono::milliseconds(1));
}

Duration valid_for(const std::string& text) {
  constexpr Duration kMost = std::chrono::milliseconds(proto::kMaxTokenLife_ms);
  static_assert(kMost == std::chrono::hours(30 * 24));
  Duration life{};
  try {
    life = parse_duration(text, "min");
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(std::string("--valid: ") + error.what());
  }
  if (life > kMost) {
    throw std::invalid_argument("--valid: an invitation is valid for 30 days at most, not '" + text +
                                "'; give 30d or less, and issue it later");
  }
  if (life < std::chrono::milliseconds(1)) {
    throw std::invalid_argument("--valid: an invitation that is valid for '" + text +
                                "' admits no user; give for example 15min");
  }
  return life;
}

proto::Bytes token_for(const Invited& invited, const secure::KeyId& audience, const secure::KeyPair& issuer) {
  wire::TokenClaims claims;
  claims.set_audience(audience.data(), audience.size());
  claims.set_user_name(invited.name);
  claims.set_role(role_named(invited.role));
  claims.set_room(invited.room);
  claims.set_max_force_n(invited.max_force_n);
  claims.set_issued_ms(unix_ms_now());
  claims.set_expires_ms(claims.issued_ms() + static_cast<std::uint64_t>(invited.life / std::chrono::milliseconds(1)));
  return proto::sign_token(claims, issuer);
}

std::string invitation_line(const Invited& invited, const std::string& server, const ServerKeys& keys) {
  const proto::Bytes token = token_for(invited, keys.identity.id(), keys.issuer);
  const auto until = proto::peek_token(token)->expires_ms();
  const std::string program = invited.role == "signal" ? "tandem-signal" : "tandem-client";
  return "invitation (one " + invited.role + ", until " + utc_text(until) + "): " + program + " --join " +
         proto::text_of(proto::Invitation{server, keys.identity.id(), token});
}

bool is_loopback(const std::string& address) {
  return address.starts_with("127.") || address == "::1" || address == "localhost";
}

std::string own_address(bool may_be_v6) {
  ifaddrs* list = nullptr;
  std::string v4, v6;
  if (getifaddrs(&list) != 0) return "127.0.0.1";
  for (const ifaddrs* one = list; one != nullptr; one = one->ifa_next) {
    const bool is_up = (one->ifa_flags & IFF_UP) != 0 && (one->ifa_flags & IFF_LOOPBACK) == 0;
    if (!is_up || one->ifa_addr == nullptr) continue;
    std::array<char, INET6_ADDRSTRLEN> text{};
    if (one->ifa_addr->sa_family == AF_INET && v4.empty()) {
      inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(one->ifa_addr)->sin_addr, text.data(), text.size());
      v4 = text.data();
    } else if (one->ifa_addr->sa_family == AF_INET6 && v6.empty()) {
      const in6_addr& address = reinterpret_cast<const sockaddr_in6*>(one->ifa_addr)->sin6_addr;
      if (IN6_IS_ADDR_LINKLOCAL(&address)) continue;
      inet_ntop(AF_INET6, &address, text.data(), text.size());
      v6 = text.data();
    }
  }
  freeifaddrs(list);
  if (v4.empty() && may_be_v6 && !v6.empty()) return v6;
  return v4.empty() ? "127.0.0.1" : v4;
}

std::string own_host_name() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 && name[0] != '\0' ? name.data() : "localhost";
}

}  // namespace tandem::server
