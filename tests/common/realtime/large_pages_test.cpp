// Large pages must change only the mapping of memory. Fails if content is changed or becomes read-only.
#include "common/realtime/large_pages.hpp"

#include <gtest/gtest.h>
#include <linux/mman.h>
#include <sys/mman.h>

#include <cstdint>
#include <cstring>
#include <fstream>
#include <numeric>
#include <string>
#include <vector>

#include "tests/support/needs.hpp"

namespace tandem::realtime {
namespace {

constexpr std::size_t kPage = std::size_t{2} << 20U;

/// Returns the number of bytes in large pages of the mapping that contains an address.
std::size_t large_bytes_at(const void* address) {
  const auto wanted = reinterpret_cast<std::uintptr_t>(address);
  std::ifstream file("/proc/self/smaps");
  bool is_in = false;
  for (std::string line; std::getline(file, line);) {
    std::size_t end = 0;
    if (const std::size_t dash = line.find('-'); dash != std::string::npos && dash < line.find(' ')) {
      is_in = std::stoull(line, nullptr, 16) <= wanted && wanted < std::stoull(line.substr(dash + 1), &end, 16);
    } else if (is_in && line.starts_with("AnonHugePages:")) {
      return std::stoull(line.substr(line.find(':') + 1)) * 1024;
    }
  }
  return 0;
}

TEST(LargePages, PreserveTheContentOfMemory) {
  std::vector<std::uint32_t> numbers(4 * kPage / sizeof(std::uint32_t));
  std::iota(numbers.begin(), numbers.end(), 7U);
  const std::vector<std::uint32_t> before = numbers;
  use_large_pages(std::as_bytes(std::span(numbers)));
  EXPECT_EQ(numbers, before);
  numbers.assign(numbers.size(), 3);  // detects pages that are not writable
  EXPECT_EQ(numbers.back(), 3U);
}

/// Returns whether this machine permits the system calls that use_large_pages() needs. They are tried on memory that
/// the tests do not use.
bool can_collapse() {
  constexpr std::size_t kBytes = 4 * kPage;
  void* const memory = ::mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) return false;
  std::memset(memory, 1, kBytes);
  const auto address = reinterpret_cast<std::uintptr_t>(memory);
  auto* const page = static_cast<std::byte*>(memory) + (kPage - address % kPage) % kPage;
  const bool can = ::madvise(page, kPage, MADV_HUGEPAGE) == 0 && ::madvise(page, kPage, MADV_COLLAPSE) == 0;
  ::munmap(memory, kBytes);
  return can;
}

TEST(LargePages, HoldTheMemoryWhereTheKernelHasThem) {
  TANDEM_NEEDS_OF_MACHINE(can_collapse(), "large pages on request (madvise, MADV_COLLAPSE of Linux 6.1)");
  std::vector<std::uint32_t> numbers(4 * kPage / sizeof(std::uint32_t), 7U);
  EXPECT_TRUE(use_large_pages(std::as_bytes(std::span(numbers))));
  EXPECT_GE(large_bytes_at(numbers.data() + numbers.size() / 2), 2 * kPage);
}

TEST(LargePages, LeaveMemorySmallerThanAPage) {
  const std::vector<std::byte> little(kPage - 1);
  EXPECT_FALSE(use_large_pages(little));
  EXPECT_FALSE(use_large_pages({}));
  // This range is as long as a page, but extends from the middle of one page to the middle of the next. It contains no
  // whole page.
  std::vector<std::byte> some(3 * kPage);
  const std::size_t to_page = kPage - reinterpret_cast<std::uintptr_t>(some.data()) % kPage;
  EXPECT_FALSE(use_large_pages(std::span(some).subspan(to_page + kPage / 2, kPage)));
}

}  // namespace
}  // namespace tandem::realtime
