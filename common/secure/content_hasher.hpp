// Incremental hash of content that arrives in pieces.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <span>

struct evp_md_ctx_st;

namespace tandem::secure {

/// Computes the SHA-256 of content that arrives in pieces. The cost of a call is proportional to the size of its piece.
/// Fails   std::runtime_error: OpenSSL has no SHA-256 (a broken installation)
class ContentHasher {
 public:
  ContentHasher();
  void add(std::span<const std::byte> piece);
  /// Returns the hash of all pieces so far. Afterwards add() must not be called.
  std::array<std::byte, 32> finish();

 private:
  struct Free {
    void operator()(evp_md_ctx_st* context) const;
  };
  std::unique_ptr<evp_md_ctx_st, Free> context_;
};

}  // namespace tandem::secure
