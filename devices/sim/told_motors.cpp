#include "devices/sim/told_motors.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace tandem::devices {
namespace {

constexpr std::size_t kCommandBytes = 3 * sizeof(double);
static_assert(kCommandBytes <= PIPE_BUF);

int opened(const std::filesystem::path& file, const std::string& setting) {
  const int descriptor = open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_NONBLOCK | O_CLOEXEC, 0644);
  if (descriptor >= 0) return descriptor;
  throw std::runtime_error(setting + ": " + file.string() + " cannot be written (" +
                           std::generic_category().message(errno) + "); name a file, or a pipe with a reader");
}

}  // namespace

ToldMotors::ToldMotors(std::unique_ptr<Device> device, const std::filesystem::path& file, int realtime_priority,
                       const std::string& setting)
    : device_(std::move(device)), file_(opened(file, setting)), watchdog_(realtime_priority) {
  const std::vector<std::uint8_t> zero(kCommandBytes, 0);
  if (!watchdog_.watch_over({.descriptor = file_, .usb_endpoint = std::nullopt, .bytes = zero}))
    throw std::runtime_error(setting + ": no watchdog could be started; end other programs, then start again");
}

ToldMotors::~ToldMotors() {
  watchdog_.release();
  close(file_);
}

bool ToldMotors::write(LocalTime now, const Wrench& wrench_on_hand_D) noexcept {
  const bool is_on = wrench_on_hand_D.f != Vec3::Zero();
  watchdog_.begin_command();
  may_be_on_ = may_be_on_ || is_on;
  watchdog_.beat(now, may_be_on_);
  if (watchdog_.is_command_obsolete()) return false;
  if (::write(file_, wrench_on_hand_D.f.data(), kCommandBytes) != static_cast<ssize_t>(kCommandBytes)) return false;
  if (!is_on) watchdog_.beat(now, may_be_on_ = false);
  return device_->write(now, wrench_on_hand_D);
}

}  // namespace tandem::devices
