// The hash of content that comes in pieces.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <span>

struct evp_md_ctx_st;

namespace tandem::secure {

/// SHA-256 over pieces: the work of each call is bounded by its piece, however large the whole is.
/// Fails   std::runtime_error when OpenSSL has no SHA-256 (a broken installation)
class ContentHasher {
 public:
  ContentHasher();
  void add(std::span<const std::byte> piece);
  /// Of all pieces so far; nothing can be added afterwards.
  std::array<std::byte, 32> finish();

 private:
  struct Free {
    void operator()(evp_md_ctx_st* context) const;
  };
  std::unique_ptr<evp_md_ctx_st, Free> context_;
};

}  // namespace tandem::secure
