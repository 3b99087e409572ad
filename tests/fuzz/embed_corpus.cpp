// Writes the seeds for embed_fuzz: valid sequences of calls of the C interface, in the encoding that embed_fuzz reads
// (call_script.hpp).
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

#include "tests/fuzz/call_script.hpp"
#include "tests/fuzz/seed_file.hpp"

namespace {

using tandem::fuzz::Call;

/// Encodes calls as bytes, which CallReader decodes.
class CallWriter {
 public:
  CallWriter& call(Call function) { return byte(static_cast<std::uint8_t>(function)); }
  CallWriter& byte(std::uint8_t value) { return raw(&value, sizeof value); }
  CallWriter& bytes(std::initializer_list<std::uint8_t> values) {
    for (const std::uint8_t value : values) byte(value);
    return *this;
  }
  template <class Number>
  CallWriter& number(Number value) {
    return raw(&value, sizeof value);
  }
  CallWriter& text(const std::string& value) {
    return byte(static_cast<std::uint8_t>(value.size())).raw(value.data(), value.size());
  }
  CallWriter& no_text() { return byte(255); }
  std::span<const std::byte> written() const { return bytes_; }

 private:
  CallWriter& raw(const void* from, std::size_t size) {
    const auto* const begin = static_cast<const std::byte*>(from);
    bytes_.insert(bytes_.end(), begin, begin + size);
    return *this;
  }

  std::vector<std::byte> bytes_;
};

/// Byte that selects the usual case: a struct with the correct struct_size, or the first object of a kind.
constexpr std::uint8_t kUsual = 0;

void open_device(CallWriter& to) {
  to.call(Call::kOpenDevice).byte(kUsual).byte(3).text("wand").text("data sheet");
  for (const double limit : {4.0, 8.0, 1.0, 2.0, 1000.0, 1e-5}) to.number(limit);
}

void open_client(CallWriter& to, bool has_own_device) {
  constexpr std::uint8_t kInsecureWithLink = 16 + 64;
  to.call(Call::kOpenClient).byte(kUsual).byte(kInsecureWithLink).byte(0);
  to.byte(kUsual).byte(has_own_device ? 0 : 254);
  to.no_text().text("ann").no_text().no_text().no_text().text("late-pose").text("hold");
  to.number(0.0).no_text();
  for (int i = 0; i < 6; ++i) to.no_text();
}

void feed(CallWriter& to, double height_m) {
  to.call(Call::kFeed).byte(kUsual).bytes({1, 1, 0});
  for (const double value : {0.0, 0.0, height_m, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.1}) to.number(value);
  to.byte(kUsual).byte(0);
  to.call(Call::kForce).byte(kUsual).byte(kUsual).byte(0);
}

CallWriter reader_of_everything() {
  CallWriter made;
  open_client(made, false);
  made.call(Call::kJoin).byte(0).call(Call::kWaitJoined).byte(2).byte(0).call(Call::kStart).byte(0);
  made.call(Call::kSession).byte(kUsual).byte(0).call(Call::kSnapshot).byte(kUsual).byte(kUsual).byte(0);
  for (const Call each : {Call::kBodies, Call::kUsers, Call::kTicks})
    made.call(each).byte(3).byte(kUsual).byte(0).byte(0);
  made.call(Call::kWaitEvent).byte(2).byte(0).call(Call::kEvent).byte(kUsual).byte(39).byte(0).byte(0);
  made.call(Call::kDescriptor).byte(0).byte(0).call(Call::kConstants).number(-3).number(5);
  made.call(Call::kStop)
      .byte(0)
      .call(Call::kTicks)
      .byte(4)
      .byte(kUsual)
      .byte(0)
      .byte(0)
      .call(Call::kCloseClient)
      .byte(0);
  return made;
}

CallWriter feeder() {
  CallWriter made;
  open_device(made);
  open_client(made, true);
  made.call(Call::kJoin).byte(0).call(Call::kStart).byte(0);
  for (int i = 0; i < 4; ++i) feed(made, 0.01 * i);
  made.call(Call::kCloseDevice).byte(kUsual).byte(0).call(Call::kForce).byte(kUsual).byte(kUsual).byte(0);
  return made;
}

CallWriter commander() {
  CallWriter made;
  open_client(made, false);
  made.call(Call::kJoin).byte(0);
  for (const std::uint8_t which : {0, 1, 2}) made.call(Call::kGrab).bytes({which, 1, 0});
  made.call(Call::kPoint).number(0.1).number(0.2).number(0.3).byte(0).byte(0).byte(0);
  made.call(Call::kParameter).text("coupling.stiffness_n_per_m").number(300.0).byte(0);
  for (const std::uint8_t which : {0, 1, 2}) {
    made.call(Call::kTexts).text("hold").text("scored").bytes({which, 1, 0});
    made.call(Call::kNumbers).number(0.05).number(0.01).number(0.1).bytes({which, 1, 0});
  }
  made.call(Call::kPose).text("best").number(std::uint32_t{2}).bytes({1, 7, 0});
  return made;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc != 2) throw std::runtime_error("usage: embed_corpus FOLDER");
    const std::filesystem::path folder = argv[1];
    tandem::fuzz::write_seed(folder / "reader", reader_of_everything().written());
    tandem::fuzz::write_seed(folder / "feeder", feeder().written());
    tandem::fuzz::write_seed(folder / "commander", commander().written());
    return 0;
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}
