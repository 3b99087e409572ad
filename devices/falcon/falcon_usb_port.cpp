// USB connection to a Falcon. Two receive transfers are always pending, so that a reply is received as soon as the
// bridge has it. Transfers are allocated once. The memory of a cancelled transfer is freed only after libusb reports
// its end.
#include <libusb-1.0/libusb.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include "devices/falcon/falcon_packet.hpp"
#include "devices/falcon/falcon_port.hpp"

namespace tandem::devices {
namespace {

constexpr std::uint16_t kVendor = 0x0403, kProduct = 0xcb48;
constexpr int kInterface = 0;
constexpr unsigned char kEndpointOut = 0x02, kEndpointIn = 0x81;
constexpr std::size_t kUsbPacket = 64, kStatusBytes = 2;
constexpr std::size_t kMaxWaiting = 4096;
constexpr unsigned kControlTimeout_ms = 50;
constexpr Duration kWriteTimeout = std::chrono::milliseconds(10);
constexpr Duration kCloseTimeout = std::chrono::milliseconds(200);

constexpr std::string_view kAbsent = "no Falcon is plugged in; plug it in, with its power supply, or use --device sim";
constexpr std::string_view kNoRights =
    "a Falcon is plugged in, but you may not open it; install deploy/udev/70-tandem.rules into /etc/udev/rules.d and "
    "plug "
    "it in again";
constexpr std::string_view kBusy = "a Falcon is plugged in, but another program has it; end that, then start again";
constexpr std::string_view kNoWatchdog =
    "no watchdog could be started for the Falcon (too many processes or open files); end other programs, then start "
    "again";
constexpr std::string_view kNoUsb = "USB cannot be used on this machine (libusb does not start); use --device sim";

timeval timeval_of(Duration duration) {
  const auto us = std::chrono::duration_cast<std::chrono::microseconds>(duration).count();
  return {us / 1000000, us % 1000000};
}

/// A libusb context for one port. Ports do not share a context: with a shared one, a thread could handle the events for
/// which the thread of another port waits.
using Usb = std::shared_ptr<libusb_context>;
/// Opens a context. Returns null if USB cannot be used.
Usb open_usb() {
  libusb_context* made = nullptr;
  return libusb_init(&made) == LIBUSB_SUCCESS ? Usb(made, libusb_exit) : nullptr;
}

bool is_falcon(libusb_device* device) {
  libusb_device_descriptor descriptor{};
  return libusb_get_device_descriptor(device, &descriptor) == LIBUSB_SUCCESS && descriptor.idVendor == kVendor &&
         descriptor.idProduct == kProduct;
}

/// List of all connected Falcons; the devices remain valid while the list exists.
class FalconList {
 public:
  explicit FalconList(Usb usb) : usb_(std::move(usb)) {
    if (usb_ == nullptr) return;
    const ssize_t count = libusb_get_device_list(usb_.get(), &all_);
    for (ssize_t i = 0; i < count; ++i) {
      if (is_falcon(all_[i])) falcons_.push_back(all_[i]);
    }
  }
  ~FalconList() {
    if (all_ != nullptr) libusb_free_device_list(all_, 1);
  }
  FalconList(const FalconList&) = delete;
  FalconList& operator=(const FalconList&) = delete;
  const std::vector<libusb_device*>& falcons() const { return falcons_; }

 private:
  Usb usb_;
  libusb_device** all_ = nullptr;
  std::vector<libusb_device*> falcons_;
};

std::string_view reason_of(int error) {
  return error == LIBUSB_ERROR_ACCESS ? kNoRights : kBusy;
}

class FalconUsbPort final : public FalconPort {
 public:
  FalconUsbPort(Usb usb, libusb_device_handle* handle, Watchdog* watchdog);
  ~FalconUsbPort() override;
  FalconUsbPort(const FalconUsbPort&) = delete;
  FalconUsbPort& operator=(const FalconUsbPort&) = delete;

  bool control(FtdiRequest request, std::uint16_t value) override;
  bool write(std::span<const std::uint8_t> bytes) override;
  bool is_written() const override { return !out_.is_under_way && !is_removed_; }
  int read(std::span<std::uint8_t> bytes, Duration longest) override;

 private:
  struct Transfer {
    libusb_transfer* transfer = nullptr;
    std::array<std::uint8_t, kUsbPacket> buffer{};
    bool is_under_way = false;
    FalconUsbPort* port = nullptr;
  };

  static void LIBUSB_CALL on_received(libusb_transfer* transfer);
  static void LIBUSB_CALL on_sent(libusb_transfer* transfer);
  void prepare(Transfer& transfer, unsigned char endpoint, libusb_transfer_cb_fn done);
  bool submit(Transfer& transfer, std::size_t length);
  void note(const libusb_transfer& transfer);
  /// Handles libusb events until `is_done` returns true, but at most for `longest`.
  template <class Done>
  void work(Duration longest, Done is_done);
  bool is_anything_under_way() const;

  Usb usb_;
  libusb_device_handle* handle_;
  Watchdog* watchdog_;  ///< watchdog of the device; null if there is none
  std::array<Transfer, 2> in_;
  Transfer out_;
  std::vector<std::uint8_t> received_;
  bool is_removed_ = false;
  bool is_closing_ = false;
};

FalconUsbPort::FalconUsbPort(Usb usb, libusb_device_handle* handle, Watchdog* watchdog)
    : usb_(std::move(usb)), handle_(handle), watchdog_(watchdog) {
  received_.reserve(kMaxWaiting);
  prepare(out_, kEndpointOut, on_sent);
  for (Transfer& in : in_) {
    prepare(in, kEndpointIn, on_received);
    if (!submit(in, kUsbPacket)) is_removed_ = true;
  }
}

FalconUsbPort::~FalconUsbPort() {
  work(kWriteTimeout, [this] { return !out_.is_under_way; });
  is_closing_ = true;
  for (Transfer* one : {in_.data(), &in_[1], &out_}) {
    if (one->is_under_way) libusb_cancel_transfer(one->transfer);
  }
  work(kCloseTimeout, [this] { return !is_anything_under_way(); });
  if (watchdog_ != nullptr) watchdog_->release();
  libusb_release_interface(handle_, kInterface);
  libusb_close(handle_);
  // libusb_close() has ended all transfers, so none is in use any more and all can be freed.
  for (Transfer* one : {in_.data(), &in_[1], &out_}) libusb_free_transfer(one->transfer);
}

void FalconUsbPort::prepare(Transfer& transfer, unsigned char endpoint, libusb_transfer_cb_fn done) {
  transfer.port = this;
  transfer.transfer = libusb_alloc_transfer(0);
  if (transfer.transfer == nullptr) throw std::bad_alloc();
  libusb_fill_bulk_transfer(transfer.transfer, handle_, endpoint, transfer.buffer.data(), kUsbPacket, done, &transfer,
                            0);
}

bool FalconUsbPort::submit(Transfer& transfer, std::size_t length) {
  transfer.transfer->length = static_cast<int>(length);
  transfer.is_under_way = libusb_submit_transfer(transfer.transfer) == LIBUSB_SUCCESS;
  return transfer.is_under_way;
}

void FalconUsbPort::note(const libusb_transfer& transfer) {
  static_cast<Transfer*>(transfer.user_data)->is_under_way = false;
  const bool is_good = transfer.status == LIBUSB_TRANSFER_COMPLETED || transfer.status == LIBUSB_TRANSFER_CANCELLED;
  if (!is_good) is_removed_ = true;
}

void FalconUsbPort::on_received(libusb_transfer* transfer) {
  auto& in = *static_cast<Transfer*>(transfer->user_data);
  FalconUsbPort& port = *in.port;
  port.note(*transfer);
  const auto length = static_cast<std::size_t>(std::max(transfer->actual_length, 0));
  if (length > kStatusBytes && port.received_.size() + length <= kMaxWaiting) {
    port.received_.insert(port.received_.end(), in.buffer.begin() + kStatusBytes,
                          in.buffer.begin() + static_cast<std::ptrdiff_t>(std::min(length, kUsbPacket)));
  }
  if (!port.is_removed_ && !port.is_closing_ && !port.submit(in, kUsbPacket)) port.is_removed_ = true;
}

void FalconUsbPort::on_sent(libusb_transfer* transfer) {
  static_cast<Transfer*>(transfer->user_data)->port->note(*transfer);
}

bool FalconUsbPort::is_anything_under_way() const {
  return out_.is_under_way || std::ranges::any_of(in_, &Transfer::is_under_way);
}

template <class Done>
void FalconUsbPort::work(Duration longest, Done is_done) {
  const SteadyClock clock;
  const LocalTime end = clock.now() + longest;
  while (!is_done()) {
    const Duration left = end - clock.now();
    if (left <= Duration{0}) return;
    timeval timeout = timeval_of(left);
    if (libusb_handle_events_timeout_completed(usb_.get(), &timeout, nullptr) != LIBUSB_SUCCESS) return;
  }
}

bool FalconUsbPort::control(FtdiRequest request, std::uint16_t value) {
  constexpr std::uint8_t kVendorOut = 0x40;  // type: vendor request, direction: host to device, recipient: device
  const int sent = libusb_control_transfer(handle_, kVendorOut, static_cast<std::uint8_t>(request), value, 0, nullptr,
                                           0, kControlTimeout_ms);
  if (sent == LIBUSB_ERROR_NO_DEVICE) is_removed_ = true;
  if (request == FtdiRequest::kReset && value == kFtdiPurgeReceived) received_.clear();
  return sent == 0;
}

bool FalconUsbPort::write(std::span<const std::uint8_t> bytes) {
  work(kWriteTimeout, [this] { return !out_.is_under_way || is_removed_; });
  if (is_removed_ || out_.is_under_way || bytes.size() > kUsbPacket) return false;
  std::ranges::copy(bytes, out_.buffer.begin());
  return submit(out_, bytes.size());
}

int FalconUsbPort::read(std::span<std::uint8_t> bytes, Duration longest) {
  work(longest, [this] { return !received_.empty() || is_removed_; });
  if (received_.empty()) return is_removed_ ? -1 : 0;
  const std::size_t count = std::min(bytes.size(), received_.size());
  std::copy_n(received_.begin(), count, bytes.begin());
  received_.erase(received_.begin(), received_.begin() + static_cast<std::ptrdiff_t>(count));
  return static_cast<int>(count);
}

/// Opens a device and claims its interface. On failure returns null and sets `reason` to the cause.
libusb_device_handle* claimed(libusb_device* device, std::string_view& reason) {
  libusb_device_handle* handle = nullptr;
  if (const int error = libusb_open(device, &handle); error != LIBUSB_SUCCESS) {
    reason = reason_of(error);
    return nullptr;
  }
  libusb_set_auto_detach_kernel_driver(handle, 1);
  if (const int error = libusb_claim_interface(handle, kInterface); error == LIBUSB_SUCCESS) return handle;
  libusb_close(handle);
  reason = kBusy;
  return nullptr;
}

/// Returns the zero command of a device that this process has opened. It needs the device's file descriptor, which is
/// looked up in /proc because libusb does not provide it.
std::optional<ZeroCommand> zero_of(libusb_device* device) {
  const FalconPacket zero = falcon_request(FalconCounts::Zero(), kFalconRed | kFalconHome);
  std::array<char, 32> node{};
  std::snprintf(node.data(), node.size(), "/dev/bus/usb/%03d/%03d", libusb_get_bus_number(device),
                libusb_get_device_address(device));
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd", error)) {
    const std::string target = std::filesystem::read_symlink(entry, error).string();
    if (!target.ends_with(node.data())) continue;
    return ZeroCommand{std::stoi(entry.path().filename()), kEndpointOut, {zero.begin(), zero.end()}};
  }
  return std::nullopt;
}

}  // namespace

std::optional<ZeroCommand> falcon_zero() {
  const FalconList list(open_usb());
  for (libusb_device* const device : list.falcons()) {
    if (auto zero = zero_of(device)) return zero;
  }
  return std::nullopt;
}

std::unique_ptr<FalconPort> open_falcon_usb_port(std::string_view& reason, Watchdog* watchdog) {
  const Usb usb = open_usb();
  const FalconList list(usb);
  reason = usb == nullptr ? kNoUsb : kAbsent;
  for (libusb_device* const device : list.falcons()) {
    libusb_device_handle* const handle = claimed(device, reason);
    if (handle == nullptr) continue;
    auto port = std::make_unique<FalconUsbPort>(usb, handle, watchdog);
    if (watchdog == nullptr) return port;
    const auto zero = zero_of(device);
    if (zero && watchdog->watch_over(*zero)) return port;
    reason = kNoWatchdog;
  }
  return nullptr;
}

std::vector<FoundDevice> find_falcons() {
  const FalconList list(open_usb());
  std::vector<FoundDevice> found;
  for (libusb_device* const device : list.falcons()) {
    const std::string where = "USB bus " + std::to_string(libusb_get_bus_number(device)) + ", device " +
                              std::to_string(libusb_get_device_address(device));
    std::string_view problem;
    if (libusb_device_handle* const handle = claimed(device, problem)) {
      libusb_release_interface(handle, kInterface);
      libusb_close(handle);
    }
    found.push_back({where, std::string(problem)});
  }
  return found;
}

}  // namespace tandem::devices
