#include "common/secure/tls.hpp"

#include <openssl/err.h>
#include <openssl/pem.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <stdexcept>

#include "common/secure/openssl_handles.hpp"

namespace tandem::secure {
namespace {

constexpr const char* kSuites = "TLS_AES_256_GCM_SHA384:TLS_CHACHA20_POLY1305_SHA256";
constexpr const char* kSuitesWithoutAes = "TLS_CHACHA20_POLY1305_SHA256:TLS_AES_256_GCM_SHA384";
/// Permitted groups of the key exchange. Larger groups are excluded, because a few hundred bytes from an
/// unauthenticated peer could then cost the server up to a tenth of a second.
constexpr std::array<int, 2> kGroups{NID_X25519, NID_X9_62_prime256v1};
/// Maximum number of key updates that a peer may request. A session needs none, and each update costs a key derivation
/// for only a few received bytes.
constexpr std::uintptr_t kMaxKeyUpdates = 32;
/// Number of bytes passed to OpenSSL between two checks of the number of key updates. A key update has at least 22
/// bytes, so at most 23 updates are processed between two checks.
constexpr std::size_t kReceivedAtOnce = 512;

bool has_fast_aes() {
#if defined(__x86_64__) || defined(__i386__)
  return __builtin_cpu_supports("aes") != 0;
#else
  return true;
#endif
}

/// Returns the protocol name in the format of ALPN: a length byte, then the name.
std::string alpn_list() {
  return static_cast<char>(kAlpn.size()) + std::string(kAlpn);
}

/// Returns the number of key updates of a connection so far. The number is stored in the SSL object and not in the
/// TlsStream, whose address changes when it is moved.
std::uintptr_t key_updates_of(const SSL* connection) {
  return reinterpret_cast<std::uintptr_t>(SSL_get_app_data(connection));
}

void count_key_updates(int is_sent, int, int type, const void* message, std::size_t size, SSL* connection, void*) {
  if (is_sent != 0 || type != SSL3_RT_HANDSHAKE || size == 0) return;
  if (*static_cast<const unsigned char*>(message) != SSL3_MT_KEY_UPDATE) return;
  SSL_set_app_data(connection, reinterpret_cast<void*>(key_updates_of(connection) + 1));  // NOLINT: a number
}

std::shared_ptr<SSL_CTX> context_of(const SSL_METHOD* method) {
  std::shared_ptr<SSL_CTX> context(SSL_CTX_new(method), SSL_CTX_free);
  if (context == nullptr) throw std::runtime_error("OpenSSL cannot be used: no TLS context");
  SSL_CTX* const c = context.get();
  SSL_CTX_set_min_proto_version(c, TLS1_3_VERSION);
  SSL_CTX_set_max_proto_version(c, TLS1_3_VERSION);
  SSL_CTX_set_ciphersuites(c, has_fast_aes() ? kSuites : kSuitesWithoutAes);
  std::array<int, kGroups.size()> groups = kGroups;  // a copy, because the OpenSSL macro takes a pointer to non-const
  if (SSL_CTX_set1_groups(c, groups.data(), groups.size()) != 1)
    throw std::runtime_error("OpenSSL has neither X25519 nor P-256");
  SSL_CTX_set_msg_callback(c, count_key_updates);
  SSL_CTX_set_session_cache_mode(c, SSL_SESS_CACHE_OFF);
  SSL_CTX_set_options(
      c, SSL_OP_NO_TICKET | SSL_OP_NO_RENEGOTIATION | SSL_OP_CIPHER_SERVER_PREFERENCE | SSL_OP_PRIORITIZE_CHACHA);
  SSL_CTX_set_num_tickets(c, 0);
  SSL_CTX_set_max_early_data(c, 0);
  SSL_CTX_set_mode(c, SSL_MODE_RELEASE_BUFFERS);
  return context;
}

int choose_alpn(SSL*, const unsigned char** chosen, unsigned char* size, const unsigned char* offered,
                unsigned offered_size, void*) {
  static const std::string kOwn = alpn_list();
  unsigned char* found = nullptr;
  const int result = SSL_select_next_proto(&found, size, reinterpret_cast<const unsigned char*>(kOwn.data()),
                                           static_cast<unsigned>(kOwn.size()), offered, offered_size);
  *chosen = found;
  return result == OPENSSL_NPN_NEGOTIATED ? SSL_TLSEXT_ERR_OK : SSL_TLSEXT_ERR_ALERT_FATAL;
}

/// Verification callback for OpenSSL that replaces its own checks of a certificate. Only the key of the certificate is
/// compared with the pinned key; all other fields are ignored.
int check_pin(X509_STORE_CTX* store, void* trust) {
  const X509* const certificate = X509_STORE_CTX_get0_cert(store);
  KeyId id{};
  unsigned size = 0;
  unsigned char* der = nullptr;
  const int der_size = i2d_X509_PUBKEY(X509_get_X509_PUBKEY(certificate), &der);
  const bool is_digested = der_size > 0 && EVP_Digest(der, static_cast<std::size_t>(der_size), octets(id.data()), &size,
                                                      EVP_sha256(), nullptr) == 1;
  OPENSSL_free(der);
  if (is_digested && is_equal(id, *static_cast<const Trust*>(trust)->pin)) return 1;
  X509_STORE_CTX_set_error(store, X509_V_ERR_CERT_UNTRUSTED);
  return 0;
}

void use_certificates(SSL_CTX* context, const std::string& pem) {
  const BioPointer bio = bio_of(pem);
  const X509Pointer own(PEM_read_bio_X509(bio.get(), nullptr, nullptr, nullptr));
  if (own == nullptr || SSL_CTX_use_certificate(context, own.get()) != 1) {
    throw std::invalid_argument("the server's certificate cannot be read; give one in PEM");
  }
  while (X509* const above = PEM_read_bio_X509(bio.get(), nullptr, nullptr, nullptr)) {
    SSL_CTX_add0_chain_cert(context, above);
  }
  ERR_clear_error();
}

}  // namespace

TlsContext TlsContext::server(const KeyPair& key, const std::string& certificate_pem) {
  TlsContext context;
  context.context_ = context_of(TLS_server_method());
  SSL_CTX* const c = context.handle();
  const bool is_quick = EVP_PKEY_get_base_id(key.handle()) == EVP_PKEY_ED25519 ||
                        (EVP_PKEY_get_base_id(key.handle()) == EVP_PKEY_EC && EVP_PKEY_get_bits(key.handle()) == 256);
  if (!is_quick) {
    throw std::invalid_argument(
        "the server's key is neither of P-256 nor of Ed25519; others take too long for each connection");
  }
  use_certificates(c, certificate_pem);
  if (SSL_CTX_use_PrivateKey(c, key.handle()) != 1 || SSL_CTX_check_private_key(c) != 1) {
    throw std::invalid_argument("the server's certificate is not that of its key");
  }
  SSL_CTX_set_alpn_select_cb(c, choose_alpn, nullptr);
  return context;
}

TlsContext TlsContext::client(const Trust& trust) {
  if (!trust.pin && trust.ca_file.empty()) {
    throw std::invalid_argument("the server is not identified; name its key, or an authority that vouches for it");
  }
  TlsContext context;
  context.context_ = context_of(TLS_client_method());
  context.trust_ = std::make_shared<const Trust>(trust);
  SSL_CTX* const c = context.handle();
  const std::string alpn = alpn_list();
  SSL_CTX_set_alpn_protos(c, reinterpret_cast<const unsigned char*>(alpn.data()), static_cast<unsigned>(alpn.size()));
  SSL_CTX_set_verify(c, SSL_VERIFY_PEER, nullptr);
  if (trust.pin) {
    SSL_CTX_set_cert_verify_callback(c, check_pin, const_cast<Trust*>(context.trust_.get()));
  } else if (SSL_CTX_load_verify_file(c, trust.ca_file.c_str()) != 1) {
    throw std::invalid_argument(trust.ca_file.string() +
                                " holds no certificate of an authority that can be read (PEM)");
  }
  return context;
}

void TlsStream::Free::operator()(ssl_st* ssl) const {
  SSL_free(ssl);
}

TlsStream::TlsStream(const TlsContext* context) : context_(context), is_established_(context == nullptr) {
  if (context == nullptr) return;
  ssl_.reset(SSL_new(context->handle()));
  if (ssl_ == nullptr) throw std::bad_alloc();
  SSL_set_bio(ssl_.get(), BIO_new(BIO_s_mem()), BIO_new(BIO_s_mem()));
  if (!context->is_client()) {
    SSL_set_accept_state(ssl_.get());
    return;
  }
  SSL_set_connect_state(ssl_.get());
  if (context->trust()->pin) return;
  const std::string& host = context->trust()->host;
  if (is_address(host)) {
    X509_VERIFY_PARAM_set1_ip_asc(SSL_get0_param(ssl_.get()), host.c_str());
  } else {
    SSL_set1_host(ssl_.get(), host.c_str());
    SSL_set_tlsext_host_name(ssl_.get(), host.c_str());
  }
}

TlsStream::~TlsStream() = default;
TlsStream::TlsStream(TlsStream&&) noexcept = default;
TlsStream& TlsStream::operator=(TlsStream&&) noexcept = default;

bool TlsStream::start(Bytes& to_peer) {
  if (ssl_ == nullptr || !context_->is_client()) return true;
  const bool is_good = shake_hands();
  collect(to_peer);
  return is_good;
}

/// Advances the handshake. Returns false if the handshake has failed, and true if it is complete or needs more data.
bool TlsStream::shake_hands() {
  ERR_clear_error();
  const int result = SSL_do_handshake(ssl_.get());
  if (result != 1) return SSL_get_error(ssl_.get(), result) == SSL_ERROR_WANT_READ || fail();
  const unsigned char* chosen = nullptr;
  unsigned size = 0;
  SSL_get0_alpn_selected(ssl_.get(), &chosen, &size);
  if (std::string_view(reinterpret_cast<const char*>(chosen), size) != kAlpn) {
    problem_ = "the other end is no Tandem of this version";
    return false;
  }
  is_established_ = true;
  return true;
}

bool TlsStream::fail() {
  const long verdict = SSL_get_verify_result(ssl_.get());
  if (context_->is_client() && verdict != X509_V_OK) {
    problem_ = context_->trust()->pin ? std::string("the server's key is not the one that was named")
                                      : "the server's certificate is not vouched for: " +
                                            std::string(X509_verify_cert_error_string(verdict));
  } else {
    const char* const reason = ERR_reason_error_string(ERR_peek_error());
    problem_ = std::string("TLS: ") + (reason == nullptr ? "the connection ended in between" : reason);
  }
  ERR_clear_error();
  return false;
}

void TlsStream::collect(Bytes& to_peer) {
  BIO* const bio = SSL_get_wbio(ssl_.get());
  const std::size_t waiting = BIO_ctrl_pending(bio);
  if (waiting == 0) return;
  has_answered_ = true;
  const std::size_t before = to_peer.size();
  to_peer.resize(before + waiting);
  BIO_read(bio, to_peer.data() + before, static_cast<int>(waiting));
}

bool TlsStream::receive(std::span<const std::byte> from_peer, Bytes& plain, Bytes& to_peer) {
  if (ssl_ == nullptr) {
    plain.insert(plain.end(), from_peer.begin(), from_peer.end());
    return true;
  }
  bool is_good = true;
  while (is_good && !from_peer.empty()) {
    const auto some = from_peer.first(std::min(from_peer.size(), kReceivedAtOnce));
    from_peer = from_peer.subspan(some.size());
    BIO_write(SSL_get_rbio(ssl_.get()), some.data(), static_cast<int>(some.size()));
    is_good = (is_established_ || shake_hands()) && read(plain);
  }
  collect(to_peer);
  return is_good;
}

/// Decrypts all complete records received so far.
bool TlsStream::read(Bytes& plain) {
  bool is_good = true;
  std::array<std::byte, 4096> piece;
  while (is_good && is_established_) {
    ERR_clear_error();
    const int size = SSL_read(ssl_.get(), piece.data(), static_cast<int>(piece.size()));
    if (size <= 0) {
      const int error = SSL_get_error(ssl_.get(), size);
      // A close message of the peer is no error. The transport then detects that the socket has ended.
      is_good = error == SSL_ERROR_WANT_READ || error == SSL_ERROR_ZERO_RETURN || fail();
      break;
    }
    plain.insert(plain.end(), piece.begin(), piece.begin() + size);
  }
  wipe(piece);
  if (is_good && key_updates_of(ssl_.get()) > kMaxKeyUpdates) {
    problem_ = "the other end requests new keys too often";
    is_good = false;
  }
  return is_good;
}

void TlsStream::send(std::span<const std::byte> plain, Bytes& to_peer) {
  if (ssl_ == nullptr) {
    to_peer.insert(to_peer.end(), plain.begin(), plain.end());
  } else if (is_established_ && !plain.empty()) {
    ERR_clear_error();
    SSL_write(ssl_.get(), plain.data(), static_cast<int>(plain.size()));
    collect(to_peer);
  }
}

void TlsStream::close(Bytes& to_peer) {
  if (ssl_ == nullptr || !is_established_) return;
  ERR_clear_error();
  SSL_shutdown(ssl_.get());
  collect(to_peer);
}

std::optional<Exported> TlsStream::exported(std::string_view label, std::span<const std::byte> context) const {
  if (ssl_ == nullptr || !is_established_) return std::nullopt;
  Exported result;
  const SSL_CIPHER* const cipher = SSL_get_current_cipher(ssl_.get());
  result.aead = SSL_CIPHER_get_cipher_nid(cipher) == NID_chacha20_poly1305 ? Aead::kChaCha20Poly1305 : Aead::kAes256Gcm;
  const std::span<std::byte> out = result.secret.bytes();
  const int is_done = SSL_export_keying_material(ssl_.get(), octets(out.data()), out.size(), label.data(), label.size(),
                                                 octets(context.data()), context.size(), 1);
  if (is_done != 1) return std::nullopt;
  return result;
}

}  // namespace tandem::secure
