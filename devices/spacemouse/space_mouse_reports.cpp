#include "devices/spacemouse/space_mouse_reports.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "common/base/buttons.hpp"

namespace tandem::devices {
namespace {

constexpr std::uint8_t kTranslation = 1, kRotation = 2, kButtonsId = 3;
constexpr std::size_t kSplitLength = 7, kJoinedLength = 13, kMinButtonsLength = 2;
/// Number of counts at full deflection, as all models declare it.
constexpr double kFull = 350;
/// Dead zone in counts; our choice.
constexpr double kRest = 8;

double part_of_full(std::uint8_t low, std::uint8_t high) {
  const auto counts = static_cast<std::int16_t>(static_cast<std::uint16_t>(low | high << 8U));
  if (std::abs(static_cast<double>(counts)) <= kRest) return 0;
  return std::clamp(counts / kFull, -1.0, 1.0);
}

}  // namespace

SpaceMouseReports::Kind SpaceMouseReports::parse(std::span<const std::uint8_t> report) noexcept {
  if (report.empty()) return Kind::kBad;
  const std::uint8_t id = report[0];
  const std::size_t length = report.size();
  if (id == kTranslation || id == kRotation) {
    const bool is_joined = id == kTranslation && length == kJoinedLength;
    if (!is_joined && length != kSplitLength) return Kind::kBad;
    read_three(report.subspan(1, 6), id == kTranslation ? 0 : 3);
    if (is_joined) read_three(report.subspan(7, 6), 3);
    return Kind::kMotion;
  }
  if (id != kButtonsId) return Kind::kOther;
  if (length < kMinButtonsLength) return Kind::kBad;
  buttons_ = ((report[1] & 1U) != 0 ? kButtonGrab : 0U) | ((report[1] & 2U) != 0 ? kButtonClutch : 0U);
  return Kind::kButtons;
}

void SpaceMouseReports::read_three(std::span<const std::uint8_t> bytes, int first) noexcept {
  deflection_[first] = part_of_full(bytes[0], bytes[1]);
  deflection_[first + 1] = -part_of_full(bytes[2], bytes[3]);
  deflection_[first + 2] = -part_of_full(bytes[4], bytes[5]);
}

}  // namespace tandem::devices
