// TLS 1.3 without socket, clock or thread. The transports of both ends pass received bytes through it and send its
// output.
//
//   socket ──▶ receive() ──▶ plain ──▶ session         without a context (--insecure, virtual time): the same calls,
//   socket ◀── to_peer ◀── send() ◀── session          and bytes pass unchanged
//
// Only TLS 1.3, without early data, tickets or resumption, with AES-256-GCM or ChaCha20-Poly1305. ALPN names the
// application, so that another kind of server is not accepted. A peer can trigger at most 32 key updates, and key
// exchange uses only X25519 or P-256.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "common/secure/key_pair.hpp"

struct ssl_ctx_st;
struct ssl_st;

namespace tandem::secure {

inline constexpr std::string_view kAlpn = "tandem/2";

/// Cipher of the datagrams beside a TLS connection: the one that TLS negotiated.
enum class Aead : std::uint8_t { kAes256Gcm, kChaCha20Poly1305 };

/// 32 bytes of key material, secret to the two ends of one TLS connection (RFC 8446 §7.5).
struct Exported {
  Aead aead = Aead::kAes256Gcm;
  Secret secret;
};
/// Labels of the exports.
inline constexpr std::string_view kDatagramExport = "EXPORTER-tandem-datagram-v1";
inline constexpr std::string_view kResumeExport = "EXPORTER-tandem-resume-v1";

/// How a client authenticates its server: `pin`, else a certificate for `host` from an authority in `ca_file`.
struct Trust {
  std::optional<KeyId> pin{};
  std::filesystem::path ca_file{};
  std::string host{};
};

/// Settings shared by the connections of one end.
///
/// Thread  constructed once, then read by one thread
class TlsContext {
 public:
  /// In      certificate_pem  the server's certificate, then those between it and the authority
  /// Fails   std::invalid_argument: no certificate, or one of another key; a key that is neither P-256 nor Ed25519
  static TlsContext server(const KeyPair& key, const std::string& certificate_pem);
  /// Fails   std::invalid_argument: neither pin nor authority, or a file without an authority
  static TlsContext client(const Trust& trust);

  ssl_ctx_st* handle() const { return context_.get(); }
  bool is_client() const { return trust_ != nullptr; }
  const Trust* trust() const { return trust_.get(); }

 private:
  TlsContext() = default;
  std::shared_ptr<ssl_ctx_st> context_;
  std::shared_ptr<const Trust> trust_;  ///< clients only; not moved, because OpenSSL points to it
};

/// One connection. Input from a peer never causes an exception or an assertion.
class TlsStream {
 public:
  /// In      context  null: bytes pass unchanged
  explicit TlsStream(const TlsContext* context);
  ~TlsStream();
  TlsStream(TlsStream&&) noexcept;
  TlsStream& operator=(TlsStream&&) noexcept;

  bool is_plain() const { return ssl_ == nullptr; }
  /// The handshake is complete: bytes are delivered from now on.
  bool is_established() const { return is_established_; }
  /// Bytes were appended to `to_peer`. At a server this means a reply to a complete ClientHello, which usually costs a
  /// signature.
  bool has_answered() const { return has_answered_; }
  /// Begins a client's handshake; does nothing at a server.
  bool start(Bytes& to_peer);
  /// Processes bytes from the peer; appends the decrypted bytes, and the reply to the peer.
  /// Out     false: this connection has failed, see problem(); `to_peer` then holds the alert for the peer
  bool receive(std::span<const std::byte> from_peer, Bytes& plain, Bytes& to_peer);
  /// Encrypts bytes. Sends nothing before the connection is established.
  void send(std::span<const std::byte> plain, Bytes& to_peer);
  /// Appends the close message, from which the peer detects that nothing was truncated.
  void close(Bytes& to_peer);
  /// Readable reason of a failure.
  const std::string& problem() const { return problem_; }

  /// Exports key material; empty: no TLS, or the handshake is incomplete.
  std::optional<Exported> exported(std::string_view label, std::span<const std::byte> context) const;

 private:
  bool shake_hands();
  bool read(Bytes& plain);
  bool fail();
  void collect(Bytes& to_peer);

  struct Free {
    void operator()(ssl_st* ssl) const;
  };
  std::unique_ptr<ssl_st, Free> ssl_;
  const TlsContext* context_;
  bool is_established_ = false;
  bool has_answered_ = false;
  std::string problem_;
};

}  // namespace tandem::secure
