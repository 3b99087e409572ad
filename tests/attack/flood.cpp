// Sends copies of one datagram to a local port, in batches by sendmmsg(), because a script cannot reach the required
// rate.
//
//   attack-flood PORT SECONDS RATE HEX [--count]
//
// RATE is the maximum rate in datagrams per second; 0 means no limit. With --count, bytes 9 to 16 contain a sequence
// number that increases by one with each datagram. The program prints {"sent": n, "seconds": s}. It sends only to
// 127.0.0.1, for at most one minute.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

namespace {

using SteadyTime = std::chrono::steady_clock;

constexpr std::size_t kBatch = 64;
constexpr double kMaxSeconds = 60;
constexpr std::size_t kSequenceAt = 9, kSequenceBytes = 8;

std::vector<unsigned char> from_hex(std::string_view text) {
  std::vector<unsigned char> bytes;
  for (std::size_t i = 0; i + 1 < text.size(); i += 2) {
    bytes.push_back(static_cast<unsigned char>(std::stoul(std::string(text.substr(i, 2)), nullptr, 16)));
  }
  return bytes;
}

void write_sequence(std::vector<unsigned char>& datagram, std::uint64_t sequence) {
  for (std::size_t i = 0; i < kSequenceBytes; ++i) {
    datagram[kSequenceAt + i] = static_cast<unsigned char>(sequence >> (8 * (kSequenceBytes - 1 - i)));
  }
}

std::uint64_t read_sequence(const std::vector<unsigned char>& datagram) {
  std::uint64_t sequence = 0;
  for (std::size_t i = 0; i < kSequenceBytes; ++i) sequence = sequence << 8 | datagram[kSequenceAt + i];
  return sequence;
}

int connected_socket(int port) {
  const int descriptor = ::socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(port));
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (descriptor < 0 || ::connect(descriptor, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) std::exit(2);
  return descriptor;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 5) {
    std::fputs("usage: attack-flood PORT SECONDS RATE HEX [--count]\n", stderr);
    return 2;
  }
  const double seconds = std::min(kMaxSeconds, std::atof(argv[2])), rate = std::atof(argv[3]);
  std::vector<std::vector<unsigned char>> datagrams(kBatch, from_hex(argv[4]));
  const bool counts = argc > 5 && datagrams[0].size() >= kSequenceAt + kSequenceBytes;
  std::uint64_t sequence = counts ? read_sequence(datagrams[0]) : 0;
  std::array<iovec, kBatch> parts{};
  std::array<mmsghdr, kBatch> messages{};
  for (std::size_t i = 0; i < kBatch; ++i) {
    parts[i] = {datagrams[i].data(), datagrams[i].size()};
    messages[i].msg_hdr.msg_iov = &parts[i];
    messages[i].msg_hdr.msg_iovlen = 1;
  }
  const int descriptor = connected_socket(std::atoi(argv[1]));
  const auto begin = SteadyTime::now();
  const auto passed = [begin] { return std::chrono::duration<double>(SteadyTime::now() - begin).count(); };
  std::uint64_t sent = 0;
  while (passed() < seconds) {
    if (rate > 0 && static_cast<double>(sent) > rate * passed()) {
      std::this_thread::sleep_for(std::chrono::microseconds(200));
      continue;
    }
    for (std::vector<unsigned char>& datagram : datagrams) {
      if (counts) write_sequence(datagram, sequence++);
    }
    sent += static_cast<std::uint64_t>(std::max(0, ::sendmmsg(descriptor, messages.data(), kBatch, 0)));
  }
  std::printf("{\"sent\": %llu, \"seconds\": %.3f}\n", static_cast<unsigned long long>(sent), passed());
  ::close(descriptor);
}
