#include "common/recording/recorder_thread.hpp"

#include "common/realtime/realtime.hpp"

namespace tandem::recording {

RecorderThread::RecorderThread(Duration period, std::function<void()> work)
    : thread_([this, period, work = std::move(work)] {
        realtime::drop_realtime();
        while (!is_stopping_.load(std::memory_order_acquire)) {
          std::this_thread::sleep_for(period);
          work();
        }
        work();
      }) {}

RecorderThread::~RecorderThread() {
  stop();
}

void RecorderThread::stop() {
  is_stopping_.store(true, std::memory_order_release);
  if (thread_.joinable()) thread_.join();
}

}  // namespace tandem::recording
