#include "common/realtime/large_pages.hpp"

#include <linux/mman.h>
#include <sys/mman.h>

#include <cstdint>

namespace tandem::realtime {

bool use_large_pages(std::span<const std::byte> memory) noexcept {
  constexpr std::uintptr_t kPage = std::uintptr_t{2} << 20U;
  const auto address = reinterpret_cast<std::uintptr_t>(memory.data());
  const std::uintptr_t before = (kPage - address % kPage) % kPage;
  if (memory.size() < before + kPage) return false;
  const std::uintptr_t bytes = (memory.size() - before) / kPage * kPage;
  // The contents are neither read nor changed, but madvise() takes a pointer to non-const.
  auto* const pages = const_cast<std::byte*>(memory.data() + before);
  return ::madvise(pages, bytes, MADV_HUGEPAGE) == 0 && ::madvise(pages, bytes, MADV_COLLAPSE) == 0;
}

}  // namespace tandem::realtime
