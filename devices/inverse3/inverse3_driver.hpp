// A Haply Inverse3 by its maker's service, which runs on the same machine: JSON over a WebSocket.
//
// The service answers each command with the next state, so there is one command for each state, zero when there is nothing
// to feel. Without a command it sends no state. It is not known what the service does with the last force of a program that is
// stopped or dies. So a watchdog has the connection too, and writes zero to it. From the first command on the watchdog is the only
// writer: a stream of WebSocket frames would be lost with a part of a frame, which a killed or stopped program can leave.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "devices/inverse3/inverse3_messages.hpp"
#include "devices/threaded_device.hpp"
#include "devices/watchdog.hpp"

namespace tandem::devices {

/// "127.0.0.1:10001" as an endpoint.
/// Fails   std::invalid_argument: not an address and a port, or not of this machine
boost::asio::ip::tcp::endpoint inverse3_endpoint(const std::string& service);

/// Base frame D: the axes of the service, its origin where the cursor was first seen.
///
/// Thread  the device's
class Inverse3Driver final : public DeviceDriver {
 public:
  /// In      watchdog  told of each connection; null: none
  Inverse3Driver(DeviceSpec spec, boost::asio::ip::tcp::endpoint service, std::shared_ptr<Watchdog> watchdog = nullptr);
  ~Inverse3Driver() override;
  Inverse3Driver(const Inverse3Driver&) = delete;
  Inverse3Driver& operator=(const Inverse3Driver&) = delete;

  const DeviceSpec& spec() const noexcept override { return spec_; }
  DeviceSample step(LocalTime now, const Wrench& wrench_on_hand_D) override;
  bool may_be_on() const noexcept override;

 private:
  struct Link;

  void connect(LocalTime now);
  void work();
  void read_next(const std::shared_ptr<Link>& link);
  void watch_over();
  void send(const Wrench& wrench_on_hand_D);
  void take(std::string_view text);
  void fail(std::string_view reason);
  DeviceSample sample(LocalTime now);

  DeviceSpec spec_;
  boost::asio::ip::tcp::endpoint service_;
  std::shared_ptr<Watchdog> watchdog_;
  std::string watched_id_;  ///< the device whose zero the watchdog has; empty: none
  boost::asio::io_context io_;
  std::shared_ptr<Link> link_;  ///< null: none
  Absence absence_;
  LocalTime now_{};  ///< of this step
  LocalTime heard_{};
  Vec3 shown_n_ = Vec3::Zero();  ///< sent last
  bool may_be_on_ = false;       ///< a force was sent, and zero has not gone out since
  bool is_new_ = false;          ///< a state came that no command answers yet
  bool is_taken_ = false;        ///< … and that no sample tells yet
  std::optional<Inverse3State> state_;
  std::optional<Vec3> origin_m_;
  DeviceSample last_;
  bool has_last_ = false;  ///< of this connection
};

}  // namespace tandem::devices
