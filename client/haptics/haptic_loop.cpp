#include "client/haptics/haptic_loop.hpp"

#include <future>
#include <memory>
#include <utility>

#include "common/realtime/keep_awake.hpp"

namespace tandem::client {
namespace {

constexpr Duration kMaxShowOut{std::chrono::milliseconds(50)};
constexpr Duration kMaxSpin{std::chrono::microseconds(150)};

}  // namespace

HapticLoop::HapticLoop(HapticLoopSettings settings, HapticCore& core, std::function<void()> after_tick)
    : settings_(settings), core_(core), after_tick_(std::move(after_tick)), trace_(settings.trace_capacity) {}

HapticLoop::~HapticLoop() {
  stop();
}

std::vector<std::string> HapticLoop::start() {
  std::promise<std::vector<std::string>> ready;
  thread_ = std::thread([this, &ready] { run([&ready](auto missing) { ready.set_value(std::move(missing)); }); });
  return ready.get_future().get();
}

void HapticLoop::stop() {
  request_stop();
  if (thread_.joinable()) thread_.join();
}

void HapticLoop::run(const std::function<void(std::vector<std::string>)>& on_ready) {
  std::vector<std::string> missing = realtime::request_realtime(settings_.realtime_priority, settings_.cpu);
  const bool is_realtime = realtime::has_realtime_priority();
  const bool should_keep_awake = settings_.keeps_awake.value_or(realtime::should_keep_awake());
  const std::shared_ptr<const void> awake = should_keep_awake ? realtime::keep_awake() : nullptr;
  report_.keeps_awake = awake != nullptr;
  on_ready(std::move(missing));

  const SteadyClock clock;
  const LocalTime start = clock.now();
  // Only a thread with real-time priority spins before a deadline. Without that priority, spinning would merely take
  // processor time from other threads.
  realtime::PeriodicTimer timer(settings_.period, start, is_realtime ? kMaxSpin : Duration{0});
  LocalTime deadline = start;
  while (!should_stop_.load(std::memory_order_relaxed) && !is_due(deadline)) {
    deadline = timer.wait();
    tick(clock);
  }
  const LocalTime last_deadline = show_out(timer, clock);

  report_.ticks_run = core_.counters().ticks;
  report_.ticks_expected = static_cast<std::uint64_t>((last_deadline - start) / settings_.period);
  report_.tick_rate_hz = static_cast<double>(report_.ticks_run) / to_seconds(clock.now() - start);
  report_.lateness = timer.lateness();
  report_.missed = timer.missed();
  report_.throttle_suspects = is_realtime ? timer.throttle_suspects() : 0;
  is_over_.store(true, std::memory_order_release);
}

bool HapticLoop::is_due(LocalTime deadline) const noexcept {
  const LocalTime began = core_.began_at();
  return settings_.duration && deadline >= began && deadline - began >= *settings_.duration;
}

void HapticLoop::tick(const Clock& clock) noexcept {
  const LocalTime begin = clock.now();
  core_.tick(begin);
  if (!trace_.push(core_.record())) trace_overflows_.fetch_add(1, std::memory_order_relaxed);
  if (after_tick_) after_tick_();
  report_.tick.record(clock.now() - begin);
}

LocalTime HapticLoop::show_out(realtime::PeriodicTimer& timer, const Clock& clock) {
  core_.begin_shutdown();
  const LocalTime give_up = clock.now() + kMaxShowOut;
  LocalTime last_deadline;
  bool is_released = false;
  do {
    last_deadline = timer.wait();
    tick(clock);
    is_released = core_.is_quiet() && core_.write_zero(clock.now());
  } while (!is_released && clock.now() < give_up);
  report_.became_quiet = is_released;
  if (!is_released) core_.write_zero(clock.now());
  return last_deadline;
}

}  // namespace tandem::client
