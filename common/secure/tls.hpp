// TLS 1.3 without socket, clock or thread. The transports of client and server pass received bytes in, and send the
// bytes that are appended to `to_peer`.
//
//   socket ──▶ receive() ──▶ plain ──▶ session         without a context (--insecure, virtual time): the same calls,
//   socket ◀── to_peer ◀── send() ◀── session          and bytes pass unchanged
//
// Settings: only TLS 1.3, without early data, tickets or resumption, with AES-256-GCM or ChaCha20-Poly1305. The
// application name is checked by ALPN, so that a server of another application is not accepted. Key exchange uses only
// X25519 or P-256, and a peer can trigger at most 32 key updates.
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

/// Cipher of the datagrams that accompany a TLS connection: the one that was negotiated for the TLS connection.
enum class Aead : std::uint8_t { kAes256Gcm, kChaCha20Poly1305 };

/// Key material of 32 bytes exported from a TLS connection (RFC 8446 §7.5). Both ends of the connection obtain the same
/// bytes, and nobody else can compute them.
struct Exported {
  Aead aead = Aead::kAes256Gcm;
  Secret secret;
};
/// Labels of the two kinds of exported key material.
inline constexpr std::string_view kDatagramExport = "EXPORTER-tandem-datagram-v1";
inline constexpr std::string_view kResumeExport = "EXPORTER-tandem-resume-v1";

/// Method by which a client authenticates its server. If `pin` is set, the server must have this key. Otherwise it
/// needs a certificate for `host` that an authority in `ca_file` issued.
struct Trust {
  std::optional<KeyId> pin{};
  std::filesystem::path ca_file{};
  std::string host{};
};

/// TLS settings shared by all connections of a client or a server.
///
/// Thread  constructed once, then read by one thread
class TlsContext {
 public:
  /// In      certificate_pem  the server's certificate, followed by the intermediate certificates up to the authority
  /// Fails   std::invalid_argument: no certificate, a certificate of another key, or a key that is neither P-256 nor
  ///         Ed25519
  static TlsContext server(const KeyPair& key, const std::string& certificate_pem);
  /// Fails   std::invalid_argument: neither pin nor authority was given, or the file contains no authority
  static TlsContext client(const Trust& trust);

  ssl_ctx_st* handle() const { return context_.get(); }
  bool is_client() const { return trust_ != nullptr; }
  const Trust* trust() const { return trust_.get(); }

 private:
  TlsContext() = default;
  std::shared_ptr<ssl_ctx_st> context_;
  std::shared_ptr<const Trust> trust_;  ///< null at a server. OpenSSL stores the pointer, so the object must not move
};

/// TLS state of one connection. Input from a peer never causes an exception or an assertion failure.
class TlsStream {
 public:
  /// In      context  TLS settings; null: no TLS, bytes pass unchanged
  explicit TlsStream(const TlsContext* context);
  ~TlsStream();
  TlsStream(TlsStream&&) noexcept;
  TlsStream& operator=(TlsStream&&) noexcept;

  bool is_plain() const { return ssl_ == nullptr; }
  /// Returns whether the handshake is complete, so that bytes of the application pass.
  bool is_established() const { return is_established_; }
  /// Returns whether this end has produced bytes for the peer. A server does so after a complete ClientHello; the reply
  /// usually costs a signature, so the server limits the rate of replies.
  bool has_answered() const { return has_answered_; }
  /// Begins the handshake at a client; does nothing at a server.
  bool start(Bytes& to_peer);
  /// Processes bytes from the peer. Appends decrypted bytes to `plain`, and protocol replies for the peer to `to_peer`.
  /// Out     false: the connection has failed, see problem(); `to_peer` then ends with the TLS alert for the peer
  bool receive(std::span<const std::byte> from_peer, Bytes& plain, Bytes& to_peer);
  /// Encrypts bytes for the peer. Discards them if the connection is not established yet.
  void send(std::span<const std::byte> plain, Bytes& to_peer);
  /// Appends the close message of TLS (close_notify). It lets the peer distinguish a regular end of the data from a
  /// truncation.
  void close(Bytes& to_peer);
  /// Returns the readable description of the failure.
  const std::string& problem() const { return problem_; }

  /// Exports key material. Returns nothing without TLS or before the handshake is complete.
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
