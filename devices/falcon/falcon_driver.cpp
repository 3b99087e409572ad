#include "devices/falcon/falcon_driver.hpp"

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <string>
#include <utility>

#include "common/base/buttons.hpp"
#include "devices/registry.hpp"

namespace tandem::devices {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Duration kReplyWait = milliseconds(10);
constexpr Duration kLoaderWait = milliseconds(20);
constexpr Duration kSilence = milliseconds(100);
constexpr Duration kFirstPause = milliseconds(100), kMaxPause = seconds(2), kRarely = seconds(5);
constexpr Duration kHomingTimeout = seconds(60);
constexpr Duration kFrozen = seconds(3);
constexpr double kFrozenForce_n = 1;
constexpr int kMaxProbes = 20, kMaxGreetings = 100, kMaxEchoWaits = 10, kMaxAttempts = 10;
constexpr std::size_t kBlock = 62;
constexpr std::uint16_t kLoaderLatency_ms = 16, kRunLatency_ms = 1;
constexpr double kOrigin_m = 0.125;
constexpr double kPulledOut_m = 0.170;
constexpr std::array<std::uint8_t, 3> kGreeting{0x0a, 0x43, 0x0d};
constexpr std::array<std::uint8_t, 4> kGreetingBack{0x0a, 0x44, 0x2c, 0x0d};
constexpr std::array<std::uint8_t, 1> kFaster{0x41};

constexpr std::string_view kUnplugged = "it was unplugged or lost its power; plug it in again";
constexpr std::string_view kSilent = "it does not answer any more; check its cable and its power supply";
constexpr std::string_view kNoFirmware =
    "it has no firmware; give its maker's file (setting firmware, option --firmware); Tandem may not bring it along";
constexpr std::string_view kLoading = "its firmware is loaded";
constexpr std::string_view kLoadAgain = "its firmware was not transferred; it is loaded again";
constexpr std::string_view kNotLoaded =
    "its firmware could not be loaded ten times over; check the file (setting firmware, option --firmware), unplug its "
    "power supply and plug it in again";
constexpr std::string_view kHome =
    "pull its grip out to you, then push it straight in to the end, until its light is blue";
constexpr std::string_view kPullOut = "pull its grip out to you again, until its light is green";
constexpr std::string_view kNotHomed =
    "it was not homed within 60 s; pull its grip out to you, then push it straight in to the end";
constexpr std::string_view kNowhere =
    "its encoder values belong to no possible position of the grip; home it again: plug it in again";
constexpr std::string_view kStandsStill =
    "its encoders do not move by a step although a force is shown; move the grip, or plug it in again";

// Converts a position from the device's frame (x right, y up, z towards the user) to D.
Vec3 in_D(const Vec3& p) {
  return {p.x(), kOrigin_m - p.z(), p.y()};
}

Vec3 vector_from_D(const Vec3& v) {
  return {v.x(), v.z(), -v.y()};
}

std::uint32_t buttons_of(std::uint8_t bits) {
  const bool is_grabbing = (bits & kFalconCentre) != 0;
  const bool is_clutching = (bits & (kFalconLeft | kFalconRight | kFalconForward)) != 0;
  return (is_grabbing ? kButtonGrab : 0U) | (is_clutching ? kButtonClutch : 0U);
}

DeviceSpec with_axes_of_a_falcon(DeviceSpec spec) {
  spec.sensed_rotations = spec.actuated_rotations = 0;
  spec.buttons = kButtonGrab | kButtonClutch;
  return spec;
}

Duration pause_after(int attempts) {
  if (attempts >= kMaxAttempts) return kRarely;
  return std::min(kMaxPause, kFirstPause * (1 << std::min(attempts - 1, 10)));
}

}  // namespace

FalconDriver::FalconDriver(FalconSettings settings, OpenFalcon open, std::unique_ptr<FalconPort> port)
    : settings_(std::move(settings)),
      open_(std::move(open)),
      port_(std::move(port)),
      velocity_(settings_.spec.position_step_m) {
  settings_.spec = with_axes_of_a_falcon(settings_.spec);
  const double counts = settings_.motor_counts_per_n_m;
  if (!(counts >= kMinMotorCounts_per_n_m && counts <= kMaxMotorCounts_per_n_m)) {
    throw std::invalid_argument("a Falcon's motor counts are " + std::to_string(counts) +
                                " per N*m; they must be 100 to 20000");
  }
}

DeviceSample FalconDriver::step(LocalTime now, const Wrench& wrench_on_hand_D) {
  switch (phase_) {
    case Phase::kClosed:
      open(now);
      break;
    case Phase::kProbing:
      probe(now);
      break;
    case Phase::kLoader:
      greet_loader(now);
      break;
    case Phase::kUpload:
      upload(now);
      break;
    case Phase::kRunning:
      return run(now, wrench_on_hand_D);
  }
  return absence_.sample(now);
}

void FalconDriver::open(LocalTime now) {
  if (!absence_.is_attempt_due(now)) return;
  std::string_view reason;
  if (!port_) port_ = open_(reason);
  if (!port_) return absence_.note_absence(reason);
  begin_probing();
}

bool FalconDriver::set_line(std::uint16_t baud, std::uint16_t latency_ms) {
  return port_->control(FtdiRequest::kReset, kFtdiPurgeReceived) &&
         port_->control(FtdiRequest::kReset, kFtdiPurgeToSend) && port_->control(FtdiRequest::kLatency, latency_ms) &&
         port_->control(FtdiRequest::kBaud, baud);
}

// The buffers are purged again after the change of the baud rate, because bytes received during the change are noise.
void FalconDriver::begin_probing() {
  phase_ = Phase::kProbing;
  tries_ = 0;
  parser_.reset();
  set_line(kFtdiBaudRun, kRunLatency_ms);
  port_->control(FtdiRequest::kReset, kFtdiPurgeReceived);
  port_->control(FtdiRequest::kReset, kFtdiPurgeToSend);
}

void FalconDriver::probe(LocalTime now) {
  FalconReply reply;
  if (exchange(FalconCounts::Zero(), kFalconRed, reply)) {
    phase_ = Phase::kRunning;
    absence_.end();
    attempts_ = 0;
    replied_ = now;
    encoders_.start(now);
    has_homing_begun_ = has_pose_ = is_homed_ = is_in_ = false;
    return;
  }
  if (!port_) return lose(now, kUnplugged);
  if (++tries_ < kMaxProbes) return;
  if (!settings_.firmware.empty()) return begin_loader();
  phase_ = Phase::kClosed;  // begins again at the next attempt, with the port still open
  absence_.set_reason(kNoFirmware);
}

void FalconDriver::begin_loader() {
  phase_ = Phase::kLoader;
  tries_ = 0;
  loader_due_ = {};
  if (attempts_ == 0) absence_.set_reason(kLoading);
  set_line(kFtdiBaudLoader, kLoaderLatency_ms);
  port_->control(FtdiRequest::kLine, kFtdi8N1);
  port_->control(FtdiRequest::kFlow, kFtdiNoFlow);
  port_->control(FtdiRequest::kModem, kFtdiRtsLow);
  port_->control(FtdiRequest::kModem, kFtdiDtrLow);
  port_->control(FtdiRequest::kModem, kFtdiDtrHigh);
}

void FalconDriver::greet_loader(LocalTime now) {
  if (now < loader_due_) return;
  if (!port_->write(kGreeting)) return lose(now, kUnplugged);
  const int length = port_->read(bytes_, kLoaderWait);
  if (length < 0) return lose(now, kUnplugged);
  const std::span read = std::span(bytes_).first(static_cast<std::size_t>(length));
  // A zero byte may precede the reply of the loader. Therefore only the last received bytes are compared.
  if (read.size() < kGreetingBack.size() || !std::ranges::equal(read.last(kGreetingBack.size()), kGreetingBack)) {
    if (++tries_ >= kMaxGreetings) fail(now, kLoadAgain);
    return;
  }
  port_->control(FtdiRequest::kModem, kFtdiDtrLow);
  port_->control(FtdiRequest::kBaud, kFtdiBaudUpload);
  const bool is_fast = port_->write(kFaster) && port_->read(bytes_, kLoaderWait) == 1 && bytes_[0] == kFaster[0];
  if (!is_fast) return fail(now, kLoadAgain);
  phase_ = Phase::kUpload;
  uploaded_ = echoed_ = 0;
  tries_ = 0;
}

void FalconDriver::upload(LocalTime now) {
  const std::span firmware(settings_.firmware);
  if (echoed_ == firmware.size()) return begin_probing();
  if (uploaded_ == echoed_) {
    const std::size_t size = std::min(kBlock, firmware.size() - uploaded_);
    if (!port_->write(firmware.subspan(uploaded_, size))) return lose(now, kUnplugged);
    uploaded_ += size;
    tries_ = 0;
  }
  const int length = port_->read(bytes_, kLoaderWait);
  if (length < 0) return lose(now, kUnplugged);
  const auto count = static_cast<std::size_t>(length);
  const bool is_same = count <= uploaded_ - echoed_ &&
                       std::ranges::equal(std::span(bytes_).first(count), firmware.subspan(echoed_, count));
  if (!is_same || ++tries_ > kMaxEchoWaits) return fail(now, kLoadAgain);
  echoed_ += count;
}

void FalconDriver::fail(LocalTime now, std::string_view reason) {
  ++attempts_;
  absence_.set_reason(attempts_ >= kMaxAttempts ? kNotLoaded : reason);
  begin_loader();
  loader_due_ = now + pause_after(attempts_);
}

void FalconDriver::lose(LocalTime now, std::string_view reason) {
  port_.reset();
  phase_ = Phase::kClosed;
  absence_.begin(now, reason);
  attempts_ = 0;
  has_pose_ = is_homed_ = false;
  force_n_ = 0;
  velocity_.reset();
}

/// Sends motor commands and receives a reply. Returns false without a reply. If the connection failed, closes the port.
bool FalconDriver::exchange(const FalconCounts& motors, std::uint8_t lights_and_home, FalconReply& reply) {
  may_be_on_ = may_be_on_ || !motors.isZero();
  if (!port_->write(falcon_request(motors, lights_and_home))) {
    port_.reset();
    return false;
  }
  const bool has_reply = receive(reply);
  // The reply may answer an earlier packet, so it does not prove that the zero has arrived. The zero counts as
  // delivered only if its transfer is complete, too.
  if (has_reply && motors.isZero() && port_->is_written()) may_be_on_ = false;
  return has_reply;
}

bool FalconDriver::receive(FalconReply& reply) {
  const LocalTime end = SteadyClock().now() + 2 * kReplyWait;
  bool has_reply = false;
  int length = port_->read(bytes_, kReplyWait);
  // If several packets have arrived, the newest one is used. An incomplete packet at the end is completed by the next
  // read.
  for (; length > 0; length = port_->read(bytes_, has_reply ? Duration{0} : kReplyWait)) {
    for (const std::uint8_t byte : std::span(bytes_).first(static_cast<std::size_t>(length))) {
      if (const auto one = parser_.parse(byte)) {
        reply = *one;
        has_reply = true;
      }
    }
    // A stream of bytes without valid packets would otherwise keep this loop running and delay the next command.
    if (has_reply || SteadyClock().now() >= end) return has_reply;
  }
  if (length < 0) port_.reset();
  return has_reply && port_ != nullptr;
}

DeviceSample FalconDriver::run(LocalTime now, const Wrench& wrench_on_hand_D) {
  const bool may_push = is_homed_ && !is_in_ && has_pose_ && !encoders_.are_frozen();
  const FalconCounts motors = may_push ? motors_for(wrench_on_hand_D) : FalconCounts(FalconCounts::Zero());
  force_n_ = motors.isZero() ? 0 : wrench_on_hand_D.f.norm();
  const std::uint8_t in_or_out = is_in_ ? kFalconBlue : kFalconGreen;
  const std::uint8_t light = is_homed_ ? in_or_out : kFalconRed;
  FalconReply reply;
  const bool has_reply = exchange(motors, light | kFalconHome, reply);
  if (!port_) {
    lose(now, kUnplugged);
    return absence_.sample(now);
  }
  if (has_reply) {
    replied_ = now;
    return sample_of(now, reply);
  }
  if (now - replied_ > kSilence) {
    lose(now, kSilent);
    return absence_.sample(now);
  }
  // Without a reply, the last sample is returned again with its old time stamp. If replies remain missing, the age of
  // this sample exceeds the limit of DeviceReader, which then reports a fault.
  return is_homed_ && !is_in_ ? last_ : homing_sample(now);
}

FalconCounts FalconDriver::motors_for(const Wrench& wrench_on_hand_D) {
  const auto torques = falcon_torques(p_m_, vector_from_D(wrench_on_hand_D.f));
  return torques ? falcon_motor_counts(*torques, settings_.motor_counts_per_n_m) : FalconCounts(FalconCounts::Zero());
}

DeviceSample FalconDriver::sample_of(LocalTime now, const FalconReply& reply) {
  is_homed_ = (reply.bits & kFalconHomed) == kFalconHomed;
  if (!is_homed_) {
    has_pose_ = false;
    is_in_ = true;
    return homing_sample(now);
  }
  encoders_.note(now, reply.encoders, force_n_);
  const Vec3 angles = falcon_angles(reply.encoders);
  auto p = falcon_forward(angles, p_m_);
  if (!p) p = falcon_forward(angles);
  if (p && p->z() >= kPulledOut_m) is_in_ = false;
  if (is_in_) return homing_sample(now);
  has_homing_begun_ = false;
  has_pose_ = p.has_value();
  last_ = {};
  last_.taken = now;
  last_.state = DeviceState::kReady;
  if (!p || encoders_.are_frozen()) {
    last_.reason = encoders_.are_frozen() ? kStandsStill : kNowhere;
    velocity_.reset();
    return last_;
  }
  p_m_ = *p;
  last_.is_valid = true;
  last_.X_DH.p = in_D(*p);
  last_.V_DH = velocity_.add(now, last_.X_DH);
  last_.buttons = buttons_of(reply.bits);
  return last_;
}

void EncoderWatch::note(LocalTime now, const FalconCounts& encoders, double force_n) noexcept {
  const bool has_moved = encoders != encoders_;
  encoders_ = encoders;
  if (has_moved) are_frozen_ = false;
  if (has_moved || (force_n < kFrozenForce_n && !are_frozen_)) changed_ = now;
  if (now - changed_ > kFrozen) are_frozen_ = true;
}

DeviceSample FalconDriver::homing_sample(LocalTime now) {
  if (!has_homing_begun_) homing_since_ = now;
  has_homing_begun_ = true;
  const bool is_late = now - homing_since_ > kHomingTimeout;
  DeviceSample sample;
  sample.taken = now;
  sample.state = is_late ? DeviceState::kLost : DeviceState::kHoming;
  sample.reason = is_late ? kNotHomed : kHome;
  if (is_homed_) sample.reason = kPullOut;
  return sample;
}

}  // namespace tandem::devices
