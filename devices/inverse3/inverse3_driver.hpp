// Driver of a Haply Inverse3. It uses the manufacturer's service on the same machine, by JSON over a WebSocket.
//
// The service sends a state only as the answer to a command. The driver therefore sends one command for each received
// state. The force of this command is zero if there is none to display.
//
// A watchdog (devices/watchdog.hpp), which is a separate process, writes zero force when this program is stopped or
// ends. It is needed because the service may continue to apply the last force; the documentation of the service does
// not say. Program and watchdog share one connection. From the first command on, only the watchdog writes to it, and
// the program passes all its frames to the watchdog. If both wrote, a program that is killed or stopped during a write
// could leave a partial WebSocket frame. The service could then not read the zero that follows this frame.
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

/// Parses an endpoint such as "127.0.0.1:10001".
/// Fails   std::invalid_argument: the text is not an address with a port, or the address is not one of this machine
boost::asio::ip::tcp::endpoint inverse3_endpoint(const std::string& service, const std::string& setting = "--service");

/// Driver of one device. Base frame D: the axes are those of the service, the origin is the first position of the
/// cursor.
///
/// Thread  the thread of the device
class Inverse3Driver final : public DeviceDriver {
 public:
  /// In      watchdog  watchdog for each connection; null: no watchdog
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
  void receive(std::string_view text);
  void fail(std::string_view reason);
  DeviceSample sample(LocalTime now);

  DeviceSpec spec_;
  boost::asio::ip::tcp::endpoint service_;
  std::shared_ptr<Watchdog> watchdog_;
  std::string watched_id_;  ///< id of the device that the watchdog supervises; empty: none
  boost::asio::io_context io_;
  std::shared_ptr<Link> link_;  ///< connection to the service; null: not connected
  Absence absence_;
  LocalTime now_{};  ///< time of the current step()
  LocalTime last_received_{};
  Vec3 shown_n_ = Vec3::Zero();  ///< last force sent [N]
  bool may_be_on_ = false;       ///< true: a force was sent, and no zero has been sent completely since
  bool is_new_ = false;          ///< true: no command has been sent since the newest state
  bool is_taken_ = false;        ///< true: the newest state was not yet returned in a sample
  std::optional<Inverse3State> state_;
  std::optional<Vec3> origin_m_;
  DeviceSample last_;
  bool has_last_ = false;  ///< whether last_ was received on this connection
};

}  // namespace tandem::devices
