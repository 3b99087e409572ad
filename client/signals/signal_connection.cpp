#include "client/signals/signal_connection.hpp"

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <mutex>
#include <stdexcept>
#include <thread>

namespace tandem::client {
namespace {

namespace asio = boost::asio;

constexpr Duration kPollPeriod = std::chrono::milliseconds(5);
/// Time limit for which stop() waits until the leave message is sent.
constexpr Duration kStopWithin = std::chrono::milliseconds(500);

}  // namespace

struct SignalConnection::Impl {
  explicit Impl(SignalConnectionSettings connection)
      : settings(std::move(connection)),
        transport(io, settings.host, settings.port, settings.trust, std::nullopt, clock),
        session(settings.session, transport) {
    transport.attach(session);
    session.on_log = settings.on_log;
  }

  void run() {
    try {
      session.start(clock.now());
      poll();
      io.run();
    } catch (const std::exception& error) {
      {
        const std::lock_guard lock(mutex);
        published.session = {SessionState::kEnded, error.what(), true};
      }
      if (settings.on_log) settings.on_log(error.what());
    }
  }
  void poll() {
    session.poll(clock.now());
    publish();
    timer.expires_after(kPollPeriod);
    timer.async_wait([this](const boost::system::error_code& error) {
      if (!error) poll();
    });
  }
  void publish() {
    const std::lock_guard lock(mutex);
    published.session = session.status();
    published.has_joined = session.has_joined();
    published.names = session.names();
    published.waiting = session.waiting() + posted;
    published.unconfirmed = session.unconfirmed();
    published.sent = session.sent();
    published.refused = session.refused();
  }
  void finish_when_drained(LocalTime deadline) {
    if (transport.is_drained() || clock.now() >= deadline) return io.stop();
    stop_timer.expires_after(kPollPeriod);
    stop_timer.async_wait([this, deadline](const boost::system::error_code&) { finish_when_drained(deadline); });
  }

  SignalConnectionSettings settings;
  SteadyClock clock;
  asio::io_context io{1};
  AsioClientTransport transport;
  SignalSession session;
  asio::steady_timer timer{io};
  asio::steady_timer stop_timer{io};
  mutable std::mutex mutex;  ///< protects `published` and `posted`
  SignalConnectionStatus published;
  std::size_t posted = 0;  ///< number of values that send() has queued and the io thread has not received yet
  std::thread thread;      ///< last member, because the thread uses all members above
};

SignalConnection::SignalConnection(SignalConnectionSettings settings)
    : impl_(std::make_unique<Impl>(std::move(settings))) {
  impl_->thread = std::thread([impl = impl_.get()] { impl->run(); });
}

SignalConnection::~SignalConnection() {
  stop();
}

void SignalConnection::wait_until_joined() {
  for (;;) {
    const SignalConnectionStatus now = status();
    if (now.has_joined) return;
    if (now.session.state == SessionState::kEnded) throw std::runtime_error(now.session.why);
    std::this_thread::sleep_for(kPollPeriod);
  }
}

void SignalConnection::send(Signal signal, Duration age) {
  if (const std::string problem = problem_of(signal); !problem.empty()) throw std::invalid_argument(problem);
  signal.measured = impl_->clock.now() - age;
  {
    const std::lock_guard lock(impl_->mutex);
    ++impl_->posted;
    ++impl_->published.waiting;
  }
  asio::post(impl_->io, [impl = impl_.get(), signal = std::move(signal)] {
    impl->session.set(signal);
    impl->session.poll(impl->clock.now());
    {
      const std::lock_guard lock(impl->mutex);
      --impl->posted;
    }
    impl->publish();
  });
}

bool SignalConnection::flush(Duration patience) {
  const LocalTime deadline = impl_->clock.now() + patience;
  asio::post(impl_->io, [impl = impl_.get()] { impl->session.hasten_confirmation(); });
  for (;;) {
    const SignalConnectionStatus now = status();
    if (now.session.state == SessionState::kEnded) return false;
    if (now.waiting == 0 && now.unconfirmed == 0) return true;
    if (impl_->clock.now() >= deadline) return false;
    std::this_thread::sleep_for(kPollPeriod);
  }
}

SignalConnectionStatus SignalConnection::status() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->published;
}

void SignalConnection::stop() {
  if (!impl_->thread.joinable()) return;
  asio::post(impl_->io, [impl = impl_.get()] {
    impl->session.leave();
    impl->finish_when_drained(impl->clock.now() + kStopWithin);
  });
  impl_->thread.join();
}

}  // namespace tandem::client
