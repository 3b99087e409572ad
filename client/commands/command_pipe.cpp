// See command_pipe.hpp.
#include "client/commands/command_pipe.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

#include "client/commands/command.hpp"
#include "common/base/time.hpp"

namespace tandem::client {
namespace {

constexpr Duration kFinishWithin = std::chrono::milliseconds(500);
constexpr int kPollPeriod_ms = 100;
// Number of bytes that can be written to a pipe without blocking, once poll() has reported the pipe as writable
// (POLLOUT). POSIX guarantees this number (_POSIX_PIPE_BUF).
constexpr std::size_t kMaxWriteBytes = 512;

}  // namespace

struct CommandPipe::Impl {
  enum class Turn : std::uint8_t { kRead, kPop, kAnswer, kWrite };

  Impl(int lines_in, int answers_out) : lines(lines_in), answers(answers_out), wake(eventfd(0, EFD_CLOEXEC)) {
    if (wake < 0) throw std::system_error(errno, std::generic_category(), "cannot open an eventfd");
  }
  ~Impl() { ::close(wake); }

  void run();
  bool read_line();
  bool has_input();
  bool write_answer();
  bool can_write() const;
  bool is_closing() const {
    const std::lock_guard lock(mutex);
    return should_stop;
  }

  const int lines;
  const int answers;
  const int wake;  ///< descriptor that becomes readable when the thread must stop

  // Only the pipe's own thread uses the next three members.
  std::array<char, 4096> buffer{};
  std::string_view unread;
  bool has_ended = false;

  mutable std::mutex mutex;  // protects all members below it
  std::condition_variable changed;
  Turn turn = Turn::kRead;
  std::string text;  ///< in the turn kPop the current line, in the turn kWrite its answer
  std::string why_not_written;
  bool should_stop = false;
  LocalTime give_up{};  ///< deadline for writing the last answer; used once should_stop is set
  bool is_over = false;
};

void CommandPipe::Impl::run() {
  while (read_line()) {
    std::unique_lock lock(mutex);
    turn = Turn::kPop;
    changed.wait(lock, [this] { return turn == Turn::kWrite || should_stop; });
    if (turn != Turn::kWrite) break;
    lock.unlock();
    if (!write_answer()) break;
    lock.lock();
    text.clear();
    turn = Turn::kRead;
  }
  const std::lock_guard lock(mutex);
  is_over = true;
  changed.notify_all();
}

/// Reads a line. Returns false if the input has no more lines.
bool CommandPipe::Impl::read_line() {
  std::string line;
  bool has_some = false;
  while (true) {
    if (unread.empty() && !has_input()) break;
    const std::size_t end = std::min(unread.find('\n'), unread.size());
    line.append(unread.substr(0, std::min(end, kMaxCommandBytes + 1 - line.size())));
    const bool is_whole = end < unread.size();
    unread.remove_prefix(is_whole ? end + 1 : end);
    has_some = true;
    if (is_whole) break;
  }
  if (!has_some || is_closing()) return false;
  const std::lock_guard lock(mutex);
  text = std::move(line);
  return true;
}

/// Waits for input. Returns false if the input has ended, or if the thread must stop.
bool CommandPipe::Impl::has_input() {
  while (!has_ended && !is_closing()) {
    std::array<pollfd, 2> watched{{{lines, POLLIN, 0}, {wake, POLLIN, 0}}};
    if (::poll(watched.data(), watched.size(), -1) < 0) {
      has_ended = errno != EINTR;
      continue;
    }
    if (watched[0].revents == 0) continue;
    const ssize_t count = ::read(lines, buffer.data(), buffer.size());
    if (count > 0) {
      unread = std::string_view(buffer.data(), static_cast<std::size_t>(count));
      return true;
    }
    has_ended = count == 0 || (errno != EINTR && errno != EAGAIN);
  }
  return false;
}

/// Writes the answer. Returns false if the reader has closed the pipe, or if the answer could not be written before the
/// deadline.
bool CommandPipe::Impl::write_answer() {
  std::string answer;
  {
    const std::lock_guard lock(mutex);
    answer = text + "\n";
  }
  std::string_view left = answer;
  while (!left.empty()) {
    if (!can_write()) {
      const std::lock_guard lock(mutex);
      why_not_written = "its reader read none before the program ended";
      return false;
    }
    const ssize_t count = ::write(answers, left.data(), std::min(left.size(), kMaxWriteBytes));
    if (count >= 0) {
      left.remove_prefix(static_cast<std::size_t>(count));
    } else if (errno != EINTR && errno != EAGAIN) {
      const std::lock_guard lock(mutex);
      why_not_written = std::generic_category().message(errno);
      return false;
    }
  }
  return true;
}

/// Waits until an answer can be written. Returns false after the deadline.
bool CommandPipe::Impl::can_write() const {
  while (true) {
    pollfd watched{answers, POLLOUT, 0};
    if (::poll(&watched, 1, kPollPeriod_ms) > 0) return true;
    const std::lock_guard lock(mutex);
    if (should_stop && SteadyClock().now() > give_up) return false;
  }
}

CommandPipe::CommandPipe(int lines, int answers) : impl_(std::make_shared<Impl>(lines, answers)) {
  std::thread([impl = impl_] { impl->run(); }).detach();
}

CommandPipe::~CommandPipe() {
  finish();
}

std::optional<std::string> CommandPipe::pop_line() {
  const std::lock_guard lock(impl_->mutex);
  if (impl_->turn != Impl::Turn::kPop) return std::nullopt;
  impl_->turn = Impl::Turn::kAnswer;
  return std::exchange(impl_->text, {});
}

void CommandPipe::answer(const std::string& answer) {
  const std::lock_guard lock(impl_->mutex);
  impl_->text = answer;
  impl_->turn = Impl::Turn::kWrite;
  impl_->changed.notify_all();
}

bool CommandPipe::is_over() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->is_over;
}

std::string CommandPipe::problem() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->why_not_written;
}

void CommandPipe::finish() {
  std::unique_lock lock(impl_->mutex);
  if (!std::exchange(impl_->should_stop, true)) impl_->give_up = SteadyClock().now() + kFinishWithin;
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = ::write(impl_->wake, &one, sizeof one);
  impl_->changed.notify_all();
  impl_->changed.wait_for(lock, 2 * kFinishWithin, [this] { return impl_->is_over; });
}

}  // namespace tandem::client
