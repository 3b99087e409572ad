#include "common/realtime/output.hpp"

#include <poll.h>
#include <signal.h>
#include <spdlog/async_logger.h>
#include <spdlog/details/thread_pool.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/base_sink.h>
#include <unistd.h>

#include <cerrno>
#include <condition_variable>
#include <memory>
#include <mutex>

#include "common/base/units.hpp"

namespace tandem::realtime {
namespace {

constexpr std::size_t kMaxQueuedLines = 1024;
// Maximum time for which finish() waits, much longer than a running reader needs. A server sends disconnect messages
// for up to a second before finish(), so it ends within two seconds.
constexpr Duration kMaxFinish{std::chrono::milliseconds(500)};

/// Counter of completed flushes, on which a thread can wait.
struct Flushes {
  std::mutex mutex;
  std::condition_variable changed;
  int count = 0;
};

/// Writes to a file descriptor on the thread of the pool. This thread blocks while the reader of the output is stopped.
class DescriptorSink : public spdlog::sinks::base_sink<std::mutex> {
 public:
  DescriptorSink(int descriptor, spdlog::details::thread_pool& pool, Flushes& flushes)
      : descriptor_(descriptor), pool_(pool), flushes_(flushes) {}

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    spdlog::memory_buf_t text;
    formatter_->format(message, text);
    write_all(std::string_view(text.data(), text.size()));
    report_lost();
  }
  void flush_() override {
    const std::lock_guard lock(flushes_.mutex);
    ++flushes_.count;
    flushes_.changed.notify_all();
  }

 private:
  void report_lost() {
    const std::size_t lost = pool_.overrun_counter();
    if (lost == reported_lost_ || descriptor_ != STDERR_FILENO) return;
    write_all("(" + std::to_string(lost - reported_lost_) + " lines were dropped, because they were not read)\n");
    reported_lost_ = lost;
  }
  void write_all(std::string_view text) {
    while (!text.empty()) {
      const ssize_t written = ::write(descriptor_, text.data(), text.size());
      if (written >= 0) {
        text.remove_prefix(static_cast<std::size_t>(written));
      } else if (errno == EAGAIN) {
        // Another process that shares the terminal may have made it non-blocking.
        pollfd ready{descriptor_, POLLOUT, 0};
        ::poll(&ready, 1, -1);
      } else if (errno != EINTR) {
        return;
      }
    }
  }

  int descriptor_;
  spdlog::details::thread_pool& pool_;
  Flushes& flushes_;
  std::size_t reported_lost_ = 0;
};

/// Standard output or standard error: the thread and the queue of the stream, and two loggers that write to it.
class Stream {
 public:
  Stream(const std::string& program, int descriptor, Flushes& flushes)
      : pool_(std::make_shared<spdlog::details::thread_pool>(kMaxQueuedLines, 1)) {
    plain_ = logger(program, descriptor, flushes, "%v", "");
    dated_ = logger(program, descriptor, flushes, "%H:%M:%S.%e %l %v", "\n");
  }

  void write(const std::string& text) { plain_->log(spdlog::level::info, text); }
  void write_dated(const std::string& line) { dated_->log(spdlog::level::info, line); }
  void flush() { plain_->flush(); }

 private:
  using Logger = std::shared_ptr<spdlog::async_logger>;

  Logger logger(const std::string& program, int descriptor, Flushes& flushes, const std::string& pattern,
                const std::string& end) {
    auto sink = std::make_shared<DescriptorSink>(descriptor, *pool_, flushes);
    sink->set_formatter(std::make_unique<spdlog::pattern_formatter>(pattern, spdlog::pattern_time_type::local, end));
    return std::make_shared<spdlog::async_logger>(program, std::move(sink), pool_,
                                                  spdlog::async_overflow_policy::overrun_oldest);
  }

  std::shared_ptr<spdlog::details::thread_pool> pool_;
  Logger plain_;
  Logger dated_;
};

void ignore_broken_pipes() {
  struct sigaction ignore {};
  ignore.sa_handler = SIG_IGN;
  sigaction(SIGPIPE, &ignore, nullptr);
}

}  // namespace

std::vector<std::string> LineLimit::admitted(std::string_view kind, const std::string& line, LocalTime now) {
  std::vector<std::string> shown;
  for (auto& [other, window] : windows_) {
    if (now - window.begin >= kWindow) end(other, window, shown);
  }
  auto found = windows_.find(kind);
  if (found == windows_.end()) found = windows_.emplace(std::string(kind), Window{}).first;
  Window& window = found->second;
  if (window.lines == 0) window.begin = now;
  ++window.lines;
  if (window.lines <= kMaxLines) shown.push_back(line);
  if (window.lines == kMaxLines + 1) {
    shown.push_back("more than " + std::to_string(kMaxLines) + " lines a minute of the kind \"" + std::string(kind) +
                    "\": the others are only counted");
  }
  return shown;
}

std::vector<std::string> LineLimit::left_out() {
  std::vector<std::string> shown;
  for (auto& [kind, window] : windows_) end(kind, window, shown);
  return shown;
}

void LineLimit::end(std::string_view kind, Window& window, std::vector<std::string>& shown) {
  if (window.lines > kMaxLines) {
    shown.push_back("left out: " + counted(window.lines - kMaxLines, "line", "lines") + " of the kind \"" +
                    std::string(kind) + "\"");
  }
  window.lines = 0;
}

struct Output::Impl {
  explicit Impl(const std::string& program)
      : out(program, STDOUT_FILENO, flushes), err(program, STDERR_FILENO, flushes) {}

  Flushes flushes;
  Stream out;
  Stream err;
  std::mutex mutex;  // protects `limit`
  LineLimit limit;
};

Output::Output(const std::string& program) : impl_(new Impl(program)) {
  ignore_broken_pipes();
}

void Output::out(const std::string& text) {
  impl_->out.write(text);
}

void Output::err(const std::string& text) {
  impl_->err.write(text);
}

void Output::log(std::string_view kind, const std::string& line) {
  const std::lock_guard lock(impl_->mutex);
  for (const std::string& admitted : impl_->limit.admitted(kind, line, SteadyClock().now()))
    impl_->err.write_dated(admitted);
}

void Output::finish() {
  {
    const std::lock_guard lock(impl_->mutex);
    for (const std::string& left_out : impl_->limit.left_out()) impl_->err.write_dated(left_out);
  }
  std::unique_lock lock(impl_->flushes.mutex);
  const int awaited = impl_->flushes.count + 2;
  impl_->out.flush();
  impl_->err.flush();
  impl_->flushes.changed.wait_for(lock, kMaxFinish, [&] { return impl_->flushes.count >= awaited; });
}

}  // namespace tandem::realtime
