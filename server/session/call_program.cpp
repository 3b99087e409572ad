#include "server/session/call_program.hpp"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <thread>

#include "common/base/units.hpp"

namespace tandem::server {
namespace {

constexpr Duration kPollPeriod = std::chrono::milliseconds(5);
/// Time that finish() grants a running program to end.
constexpr Duration kFinishWithin = std::chrono::seconds(1);

struct Call {
  std::string room;
  std::string reason;
};

/// Starts the program in a process group of its own, with default signal handling. The program does not inherit the
/// server's files and sockets. Returns its process id and 0; after a failure, 0 and the error number.
std::pair<pid_t, int> started(const std::string& program, const Call& call) {
  std::array<std::string, 3> texts{program, call.room, call.reason};
  std::array<char*, 4> arguments{texts[0].data(), texts[1].data(), texts[2].data(), nullptr};
  posix_spawn_file_actions_t files;
  posix_spawnattr_t attributes;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&files, STDERR_FILENO, STDOUT_FILENO);
  posix_spawn_file_actions_addclosefrom_np(&files, STDERR_FILENO + 1);
  posix_spawnattr_init(&attributes);
  sigset_t none, defaults;
  sigemptyset(&none);
  sigfillset(&defaults);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &defaults);
  posix_spawnattr_setpgroup(&attributes, 0);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
  pid_t process = 0;
  const int error = posix_spawn(&process, program.c_str(), &files, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  return {error == 0 ? process : 0, error};
}

}  // namespace

struct CallProgram::Impl {
  Impl(std::string file, std::function<void(const std::string&)> news, Duration longest)
      : program(std::move(file)), on_news(std::move(news)), limit(longest), thread([this] { run(); }) {}

  void run() {
    for (;;) {
      Call next;
      {
        std::unique_lock lock(mutex);
        changed.wait(lock, [this] { return stop_by || !waiting.empty(); });
        if (stop_by) break;
        next = waiting.front();
        waiting.pop_front();
      }
      const std::string what = described(next);
      const auto [process, error] = started(program, next);
      on_news(process == 0 ? what + " could not be started: " + std::strerror(error) : what + wait_for(process));
    }
    report_waiting();
  }
  /// Reports the calls that are still queued when the server stops, because they are never executed.
  void report_waiting() {
    std::deque<Call> calls;
    {
      const std::lock_guard lock(mutex);
      calls.swap(waiting);
    }
    for (const Call& call : calls) on_news(described(call) + " was not run: the server stops");
  }
  std::string described(const Call& call) const {
    return program + " for room " + call.room + " (" + call.reason + ")";
  }
  /// Waits until the process ends. Kills its process group when the time limit is exceeded, or when the server stops
  /// and the grace period is over. Returns the result as text.
  std::string wait_for(pid_t process) {
    const SteadyClock clock;
    const LocalTime start = clock.now();
    for (;;) {
      int status = 0;
      const pid_t ended = ::waitpid(process, &status, WNOHANG);
      const std::string took = " after " + std::to_string((clock.now() - start) / std::chrono::milliseconds(1)) + " ms";
      // The system discards the exit code if the server was started with SIGCHLD ignored.
      if (ended < 0 && errno != EINTR) {
        return " ended with an unknown exit code" + took + "; start the server without SIGCHLD ignored";
      }
      if (ended == process) {
        if (WIFSIGNALED(status)) return " failed: it was ended by signal " + std::to_string(WTERMSIG(status)) + took;
        const int code = WEXITSTATUS(status);
        return (code == 0 ? " was run: exit code 0" : " failed: exit code " + std::to_string(code)) + took;
      }
      if (clock.now() - start >= limit || must_end(clock.now())) {
        ::kill(-process, SIGKILL);
        ::waitpid(process, &status, 0);
        return " failed: it was killed" + took;
      }
      std::this_thread::sleep_for(kPollPeriod);
    }
  }
  bool must_end(LocalTime now) {
    const std::lock_guard lock(mutex);
    return stop_by && now >= *stop_by;
  }

  const std::string program;
  const std::function<void(const std::string&)> on_news;
  const Duration limit;
  std::mutex mutex;  ///< protects the next two
  std::deque<Call> waiting;
  std::optional<LocalTime> stop_by;
  std::condition_variable changed;
  std::thread thread;  ///< last member, because the thread uses all of the above
};

CallProgram::CallProgram(const std::filesystem::path& program, std::function<void(const std::string&)> on_news,
                         Duration limit) {
  const std::filesystem::path file = std::filesystem::absolute(program);
  if (!std::filesystem::is_regular_file(file) || ::access(file.c_str(), X_OK) != 0) {
    throw std::invalid_argument("--on-call: " + file.string() + " cannot be executed; give the path of a program");
  }
  impl_ = std::make_unique<Impl>(file.string(), std::move(on_news), limit);
}

CallProgram::~CallProgram() {
  finish();
}

void CallProgram::call(const std::string& room, const std::string& reason) {
  {
    const std::lock_guard lock(impl_->mutex);
    if (impl_->waiting.size() < kMaxWaiting) {
      impl_->waiting.push_back({room, reason});
      impl_->changed.notify_one();
      return;
    }
  }
  impl_->on_news(impl_->program + " for room " + room + " failed: too many calls wait");
}

void CallProgram::finish() {
  if (!impl_->thread.joinable()) return;
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->stop_by = SteadyClock().now() + kFinishWithin;
    impl_->changed.notify_one();
  }
  impl_->thread.join();
}

}  // namespace tandem::server
