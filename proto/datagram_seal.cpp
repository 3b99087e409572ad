#include "proto/datagram_seal.hpp"

#include <openssl/core_names.h>
#include <openssl/evp.h>
#include <openssl/kdf.h>

#include <algorithm>
#include <boost/endian/conversion.hpp>
#include <stdexcept>

namespace tandem::proto {
namespace {

constexpr std::size_t kKeyBytes = 32;
constexpr std::size_t kIvBytes = 12;

struct FreeContext {
  void operator()(EVP_CIPHER_CTX* context) const { EVP_CIPHER_CTX_free(context); }
};
using ContextPointer = std::unique_ptr<EVP_CIPHER_CTX, FreeContext>;
using Iv = std::array<std::byte, kIvBytes>;

const unsigned char* octets(const std::byte* bytes) {
  return reinterpret_cast<const unsigned char*>(bytes);
}
unsigned char* octets(std::byte* bytes) {
  return reinterpret_cast<unsigned char*>(bytes);
}

/// Returns the cipher. OpenSSL is asked for it only once, because fetching it takes longer than encrypting a datagram.
const EVP_CIPHER* cipher_of(secure::Aead aead) {
  static EVP_CIPHER* const kAes = EVP_CIPHER_fetch(nullptr, "AES-256-GCM", nullptr);
  static EVP_CIPHER* const kChaCha = EVP_CIPHER_fetch(nullptr, "ChaCha20-Poly1305", nullptr);
  return aead == secure::Aead::kAes256Gcm ? kAes : kChaCha;
}

/// Performs HKDF-Expand with SHA-256 (RFC 5869).
void expand(const secure::Secret& secret, std::string_view label, std::span<std::byte> out) {
  EVP_KDF* const kdf = EVP_KDF_fetch(nullptr, "HKDF", nullptr);
  EVP_KDF_CTX* const context = EVP_KDF_CTX_new(kdf);
  int mode = EVP_KDF_HKDF_MODE_EXPAND_ONLY;
  const OSSL_PARAM parameters[] = {
      OSSL_PARAM_construct_utf8_string(OSSL_KDF_PARAM_DIGEST, const_cast<char*>("SHA256"), 0),
      OSSL_PARAM_construct_int(OSSL_KDF_PARAM_MODE, &mode),
      OSSL_PARAM_construct_octet_string(OSSL_KDF_PARAM_KEY, const_cast<std::byte*>(secret.bytes().data()),
                                        secret.bytes().size()),
      OSSL_PARAM_construct_octet_string(OSSL_KDF_PARAM_INFO, const_cast<char*>(label.data()), label.size()),
      OSSL_PARAM_construct_end()};
  const bool is_good = EVP_KDF_derive(context, octets(out.data()), out.size(), parameters) == 1;
  EVP_KDF_CTX_free(context);
  EVP_KDF_free(kdf);
  if (!is_good) throw std::runtime_error("OpenSSL cannot derive a key (HKDF)");
}

/// Key of one epoch: a cipher context and an IV.
struct EpochKey {
  void derive(secure::Aead aead, const secure::Secret& chain, bool is_for_opening) {
    secure::Secret key;
    expand(chain, "key", key.bytes());
    expand(chain, "iv", iv);
    if (context == nullptr) context.reset(EVP_CIPHER_CTX_new());
    EVP_CIPHER_CTX* const c = context.get();
    const bool is_good = c != nullptr && EVP_CipherInit_ex2(c, cipher_of(aead), octets(key.bytes().data()), nullptr,
                                                            is_for_opening ? 0 : 1, nullptr) == 1;
    if (!is_good) throw std::runtime_error("OpenSSL cannot use a key for datagrams");
  }
  bool begin(std::uint64_t sequence) {
    Iv nonce = iv;
    std::array<std::byte, sizeof sequence> counter{};
    boost::endian::store_big_u64(octets(counter.data()), sequence);
    for (std::size_t i = 0; i < counter.size(); ++i) nonce[kIvBytes - counter.size() + i] ^= counter[i];
    return EVP_CipherInit_ex2(context.get(), nullptr, nullptr, octets(nonce.data()), -1, nullptr) == 1;
  }
  ~EpochKey() { secure::wipe(iv); }

  ContextPointer context;
  Iv iv{};
};

}  // namespace

struct DatagramSeal::Keys {
  Keys(const secure::Exported& exported, bool opens, bool goes_up) : aead(exported.aead), is_for_opening(opens) {
    expand(exported.secret, goes_up ? "up" : "down", chain.bytes());
    current.derive(aead, chain, is_for_opening);
    if (is_for_opening) prepare_next();
  }
  ~Keys() { secure::wipe(opened); }
  void prepare_next() {
    ratchet();
    next.derive(aead, chain, is_for_opening);
  }
  void ratchet() {
    secure::Secret following;
    expand(chain, "next", following.bytes());
    chain = following;
  }
  bool open(EpochKey& key, std::uint64_t sequence, std::span<const std::byte> datagram);

  secure::Aead aead;
  bool is_for_opening;
  secure::Secret chain;  ///< chain secret of the newest epoch for which a key was derived
  EpochKey current;
  /// Key of the next epoch, for decryption only. It is derived before the first datagram of that epoch arrives. A
  /// forged epoch number therefore cannot cause the cost of a derivation.
  EpochKey next;
  std::array<std::byte, kMaxPayloadBytes> opened{};
};

std::array<std::byte, 8> seal_context(ConnectionId connection) {
  std::array<std::byte, 8> context{};
  boost::endian::store_big_u64(octets(context.data()), connection.value);
  return context;
}

DatagramSeal::DatagramSeal(const std::optional<secure::Exported>& exported, Use use, bool goes_up, std::uint8_t epoch)
    : epoch_(epoch) {
  if (exported) keys_ = std::make_unique<Keys>(*exported, use == Use::kOpen, goes_up);
}

DatagramSeal::~DatagramSeal() = default;
DatagramSeal::DatagramSeal(DatagramSeal&&) noexcept = default;
DatagramSeal& DatagramSeal::operator=(DatagramSeal&&) noexcept = default;

void DatagramSeal::advance() {
  if (keys_->is_for_opening) {
    std::swap(keys_->current.context, keys_->next.context);
    std::swap(keys_->current.iv, keys_->next.iv);
    keys_->prepare_next();
  } else {
    keys_->ratchet();
    keys_->current.derive(keys_->aead, keys_->chain, false);
  }
  epoch_ = static_cast<std::uint8_t>((epoch_ + 1U) & kMaxEpoch);
  sealed_ = 0;
}

void DatagramSeal::keep_fresh(LocalTime now) {
  if (epoch_began_ == LocalTime{}) epoch_began_ = now;
  if (is_null() || (sealed_ < kMaxDatagramsPerEpoch && now - epoch_began_ < kMaxEpochAge)) return;
  advance();
  epoch_began_ = now;
}

void DatagramSeal::seal(std::uint64_t sequence, std::span<std::byte> datagram) {
  if (is_null()) return;
  ++sealed_;
  EVP_CIPHER_CTX* const c = keys_->current.context.get();
  const std::span<std::byte> payload = datagram.subspan(kDatagramHeaderBytes);
  int size = 0;
  const bool is_sealed =
      keys_->current.begin(sequence) && EVP_CipherUpdate(c, nullptr, &size, octets(datagram.data()), kTagOffset) == 1 &&
      EVP_CipherUpdate(c, octets(payload.data()), &size, octets(payload.data()), static_cast<int>(payload.size())) ==
          1 &&
      EVP_CipherFinal_ex(c, octets(payload.data()), &size) == 1 &&
      EVP_CIPHER_CTX_ctrl(c, EVP_CTRL_AEAD_GET_TAG, kTagBytes, octets(datagram.data() + kTagOffset)) == 1;
  // A failure here is a bug of this code or of OpenSSL. The payload is wiped, so that it cannot be sent unencrypted.
  if (!is_sealed) secure::wipe(payload);
}

bool DatagramSeal::Keys::open(EpochKey& key, std::uint64_t sequence, std::span<const std::byte> datagram) {
  EVP_CIPHER_CTX* const c = key.context.get();
  const auto sealed = datagram.subspan(kDatagramHeaderBytes);
  std::array<std::byte, kTagBytes> tag{};
  std::ranges::copy(datagram.subspan(kTagOffset, kTagBytes), tag.begin());
  int size = 0;
  return sealed.size() <= opened.size() && key.begin(sequence) &&
         EVP_CipherUpdate(c, nullptr, &size, octets(datagram.data()), kTagOffset) == 1 &&
         EVP_CipherUpdate(c, octets(opened.data()), &size, octets(sealed.data()), static_cast<int>(sealed.size())) ==
             1 &&
         EVP_CIPHER_CTX_ctrl(c, EVP_CTRL_AEAD_SET_TAG, kTagBytes, octets(tag.data())) == 1 &&
         EVP_CipherFinal_ex(c, octets(opened.data()), &size) == 1;
}

DropReason DatagramSeal::open_null(const DatagramHeader& header, std::span<const std::byte> datagram) const {
  if (header.epoch != epoch_) return DropReason::kUnknownConnection;
  const auto tag = datagram.subspan(kTagOffset, kTagBytes);
  return std::ranges::all_of(tag, [](std::byte b) { return b == std::byte{0}; }) ? DropReason::kNone : DropReason::kTag;
}

DropReason DatagramSeal::open(const DatagramHeader& header, std::span<const std::byte> datagram,
                              std::span<const std::byte>& payload) {
  if (is_null()) {
    payload = payload_of(datagram);
    return open_null(header, datagram);
  }
  const bool is_next = header.epoch == ((epoch_ + 1U) & kMaxEpoch);
  if (header.epoch != epoch_ && !is_next) return DropReason::kUnknownConnection;
  if (!keys_->open(is_next ? keys_->next : keys_->current, header.sequence, datagram)) return DropReason::kTag;
  if (is_next) advance();
  payload = std::span(keys_->opened).first(datagram.size() - kDatagramHeaderBytes);
  return DropReason::kNone;
}

}  // namespace tandem::proto
