// Incremental hash of content that arrives in pieces.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <span>

struct evp_md_ctx_st;

namespace tandem::secure {

/// SHA-256 over pieces: the cost of each call is bounded by its piece, however large the content is.
/// Fails   std::runtime_error: OpenSSL has no SHA-256 (a broken installation)
class ContentHasher {
 public:
  ContentHasher();
  void add(std::span<const std::byte> piece);
  /// Hash of all pieces so far; nothing can be added afterwards.
  std::array<std::byte, 32> finish();

 private:
  struct Free {
    void operator()(evp_md_ctx_st* context) const;
  };
  std::unique_ptr<evp_md_ctx_st, Free> context_;
};

}  // namespace tandem::secure
