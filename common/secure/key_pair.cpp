#include "common/secure/key_pair.hpp"

#include <openssl/pem.h>
#include <sys/stat.h>

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "common/base/folders.hpp"
#include "common/secure/openssl_handles.hpp"

namespace tandem::secure {
namespace {

constexpr std::size_t kMaxKeyFileBytes = 16 * 1024;

std::shared_ptr<EVP_PKEY> shared(EVP_PKEY* key) {
  return {key, EVP_PKEY_free};
}

[[noreturn]] void refuse(const std::filesystem::path& file) {
  throw std::invalid_argument(file.string() + " cannot be written");
}

[[noreturn]] void refuse_to_replace(const std::filesystem::path& file) {
  throw std::invalid_argument(file.string() + " is there already; choose another place, or remove it");
}

/// Writes a new file. Returns false and changes nothing if the file already exists.
bool write_new(const std::filesystem::path& file, std::string_view text, bool is_private) {
  std::error_code ignored;
  if (std::filesystem::create_directories(file.parent_path(), ignored)) ::chmod(file.parent_path().c_str(), S_IRWXU);
  const std::error_code error = write_new_file(file, {std::as_bytes(std::span(text))}, is_private ? 0600 : 0644);
  if (error && error != std::errc::file_exists) refuse(file);
  return !error;
}

/// Writes the private key to a new file. Returns false if the file already exists.
bool write_private(const std::filesystem::path& file, EVP_PKEY* key) {
  // Secure memory, because OpenSSL wipes it when it is freed.
  const BioPointer bio(BIO_new(BIO_s_secmem()));
  if (PEM_write_bio_PrivateKey(bio.get(), key, nullptr, nullptr, 0, nullptr, nullptr) != 1) refuse(file);
  char* data = nullptr;
  const long size = BIO_get_mem_data(bio.get(), &data);
  return write_new(file, {data, static_cast<std::size_t>(size)}, true);
}

}  // namespace

KeyPair KeyPair::make(Kind kind) {
  EVP_PKEY* const key = kind == Kind::kEd25519 ? EVP_PKEY_Q_keygen(nullptr, nullptr, "ED25519")
                                               : EVP_PKEY_Q_keygen(nullptr, nullptr, "EC", "P-256");
  if (key == nullptr) throw std::runtime_error("OpenSSL cannot make a key; does the system provide random bytes?");
  return KeyPair(shared(key));
}

KeyPair KeyPair::load(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string text(kMaxKeyFileBytes, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  if (text.empty()) throw std::invalid_argument(file.string() + " cannot be read; give the PEM file of a private key");
  // The callback refuses to prompt for a password, because a server may start without a user at a terminal.
  EVP_PKEY* const key = PEM_read_bio_PrivateKey(
      bio_of(text).get(), nullptr, [](char*, int, int, void*) { return -1; }, nullptr);
  wipe(std::as_writable_bytes(std::span(text)));
  if (key == nullptr) {
    throw std::invalid_argument(file.string() +
                                " holds no private key that can be read; give one in PEM, without a password");
  }
  return KeyPair(shared(key));
}

KeyPair KeyPair::load_or_make(const std::filesystem::path& file, Kind kind) {
  if (std::filesystem::exists(file)) return load(file);
  const KeyPair key = make(kind);
  return write_private(file, key.handle()) ? key : load(file);
}

void KeyPair::save(const std::filesystem::path& file) const {
  if (!write_private(file, handle())) refuse_to_replace(file);
}

KeyId KeyPair::id() const {
  unsigned char* der = nullptr;
  const int size = i2d_PUBKEY(handle(), &der);
  KeyId id{};
  EVP_Q_digest(nullptr, "SHA256", nullptr, der, static_cast<std::size_t>(size), octets(id.data()), nullptr);
  OPENSSL_free(der);
  return id;
}

PublicKey KeyPair::public_key() const {
  PublicKey key{};
  std::size_t size = key.size();
  if (EVP_PKEY_get_raw_public_key(handle(), octets(key.data()), &size) != 1 || size != key.size()) {
    throw std::invalid_argument("a key that signs join tokens must be of Ed25519");
  }
  return key;
}

Signature KeyPair::sign(std::span<const std::byte> message) const {
  const DigestPointer context(EVP_MD_CTX_new());
  Signature signature{};
  std::size_t size = signature.size();
  if (EVP_DigestSignInit(context.get(), nullptr, nullptr, nullptr, handle()) != 1 ||
      EVP_DigestSign(context.get(), octets(signature.data()), &size, octets(message.data()), message.size()) != 1) {
    throw std::invalid_argument("a key that signs must be of Ed25519");
  }
  return signature;
}

bool has_signed(const PublicKey& key, std::span<const std::byte> message, const Signature& signature) {
  const KeyPointer handle(EVP_PKEY_new_raw_public_key(EVP_PKEY_ED25519, nullptr, octets(key.data()), key.size()));
  const DigestPointer context(EVP_MD_CTX_new());
  return handle != nullptr && EVP_DigestVerifyInit(context.get(), nullptr, nullptr, nullptr, handle.get()) == 1 &&
         EVP_DigestVerify(context.get(), octets(signature.data()), signature.size(), octets(message.data()),
                          message.size()) == 1;
}

void write_key_file(const std::filesystem::path& file, const std::string& text, bool is_private) {
  if (!write_new(file, text, is_private)) refuse_to_replace(file);
}

}  // namespace tandem::secure
