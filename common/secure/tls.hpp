// TLS 1.3 between bytes and bytes: no socket, no clock, no thread. The transports of both ends put what they read
// through it, and send what comes out.
//
//   socket ──▶ receive() ──▶ plain ──▶ session         without a context (--insecure, virtual time): the same calls,
//   socket ◀── to_peer ◀── send() ◀── session          and the bytes go through as they are
//
// TLS 1.3 only, without early data, tickets or resumption, by AES-256-GCM or ChaCha20-Poly1305; the application is
// named by ALPN, so that a server of something else is not taken for one of ours. A peer can make the other end derive
// keys 32 times, and only by X25519 or P-256.
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

/// How datagrams beside a TLS connection are sealed: by the cipher that it negotiated.
enum class Aead : std::uint8_t { kAes256Gcm, kChaCha20Poly1305 };

/// 32 bytes that only the two ends of one TLS connection know (RFC 8446 §7.5).
struct Exported {
  Aead aead = Aead::kAes256Gcm;
  Secret secret;
};
/// What the exports are for.
inline constexpr std::string_view kDatagramExport = "EXPORTER-tandem-datagram-v1";
inline constexpr std::string_view kResumeExport = "EXPORTER-tandem-resume-v1";

/// By what a client knows its server: `pin`, else a certificate for `host` under the authorities of `ca_file`.
struct Trust {
  std::optional<KeyId> pin{};
  std::filesystem::path ca_file{};
  std::string host{};
};

/// Shared by the connections of one end.
///
/// Thread  made once, then read by one thread
class TlsContext {
 public:
  /// In      certificate_pem  the server's, then those between it and the authority
  /// Fails   std::invalid_argument: no certificate, or not that of the key; a key that is neither of P-256 nor of
  ///         Ed25519
  static TlsContext server(const KeyPair& key, const std::string& certificate_pem);
  /// Fails   std::invalid_argument: neither pin nor authority, or a file that holds none
  static TlsContext client(const Trust& trust);

  ssl_ctx_st* handle() const { return context_.get(); }
  bool is_client() const { return trust_ != nullptr; }
  const Trust* trust() const { return trust_.get(); }

 private:
  TlsContext() = default;
  std::shared_ptr<ssl_ctx_st> context_;
  std::shared_ptr<const Trust> trust_;  ///< of a client; not moved, for OpenSSL points to it
};

/// One connection. Never throws and never asserts for what a peer sends.
class TlsStream {
 public:
  /// In      context  null: bytes go through as they are
  explicit TlsStream(const TlsContext* context);
  ~TlsStream();
  TlsStream(TlsStream&&) noexcept;
  TlsStream& operator=(TlsStream&&) noexcept;

  bool is_plain() const { return ssl_ == nullptr; }
  /// Both ends know each other: from now on bytes are delivered.
  bool is_established() const { return is_established_; }
  /// Something was appended to `to_peer`: of a server, what a whole greeting is answered with, a signature mostly.
  bool has_answered() const { return has_answered_; }
  /// A client's first words; nothing of a server.
  bool start(Bytes& to_peer);
  /// Takes what came from the peer; appends what it said, and what the peer has to be sent.
  /// Out     false: this connection cannot go on, for problem(); what is in `to_peer` tells the peer
  bool receive(std::span<const std::byte> from_peer, Bytes& plain, Bytes& to_peer);
  /// Before the connection is established nothing is sent.
  void send(std::span<const std::byte> plain, Bytes& to_peer);
  /// The last words: the peer then knows that nothing was cut off.
  void close(Bytes& to_peer);
  /// In words for people.
  const std::string& problem() const { return problem_; }

  /// Nothing: the bytes go through as they are, or the handshake is not done.
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
