#include "common/secure/content_hasher.hpp"

#include <openssl/evp.h>

#include <stdexcept>

namespace tandem::secure {
namespace {

void require_hash(bool is_ok) {
  if (!is_ok) throw std::runtime_error("OpenSSL cannot compute SHA-256");
}

}  // namespace

void ContentHasher::Free::operator()(evp_md_ctx_st* context) const {
  EVP_MD_CTX_free(context);
}

ContentHasher::ContentHasher() : context_(EVP_MD_CTX_new()) {
  require_hash(context_ != nullptr && EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr) == 1);
}

void ContentHasher::add(std::span<const std::byte> piece) {
  require_hash(EVP_DigestUpdate(context_.get(), piece.data(), piece.size()) == 1);
}

std::array<std::byte, 32> ContentHasher::finish() {
  std::array<std::byte, 32> hash{};
  unsigned int length = 0;
  require_hash(EVP_DigestFinal_ex(context_.get(), reinterpret_cast<unsigned char*>(hash.data()), &length) == 1 &&
               length == hash.size());
  return hash;
}

}  // namespace tandem::secure
