#include "common/net/host_port.hpp"

#include <gtest/gtest.h>

#include <random>
#include <stdexcept>

#include "tests/support/test_seed.hpp"

namespace tandem::net {
namespace {

TEST(HostPort, ReadsNamesAddressesAndIpv6InBrackets) {
  const struct {
    const char* text;
    const char* host;
    int port;
  } cases[] = {{"rig.example:1234", "rig.example", 1234}, {"rig.example", "rig.example", 0},
               {"192.0.2.1:1", "192.0.2.1", 1},           {"[::1]:47800", "::1", 47800},
               {"[2001:db8::1]", "2001:db8::1", 0},       {"[fe80::1%lo]:65535", "fe80::1%lo", 65535}};
  for (const auto& each : cases) {
    const HostPort read = host_port_of(each.text);
    EXPECT_EQ(read.host, each.host) << each.text;
    EXPECT_EQ(read.port.value_or(0), each.port) << each.text;
  }
}

TEST(HostPort, RefusesAmbiguousText) {
  for (const char* text :
       {"::1", "2001:db8::1:47800", "fe80::1%lo:1", ":47800", "", "rig.example:", "rig.example:0", "rig.example:65536",
        "rig.example:+1", "[::1", "[]:1", "[rig.example]:1", "[192.0.2.1:1", "[::1]47800", "[::1]:", "[::1]]:1"}) {
    EXPECT_THROW(host_port_of(text), std::invalid_argument) << text;
  }
}

TEST(HostPort, ReadsTheTextThatItWrites) {
  std::mt19937_64 random(test::test_seed(3986));
  for (int round = 0; round < 1000; ++round) {
    boost::asio::ip::address_v6::bytes_type bytes{};
    for (auto& byte : bytes) byte = static_cast<unsigned char>(random() % 3 == 0 ? 0 : random());
    const std::string host = random() % 2 == 0
                                 ? boost::asio::ip::address_v6(bytes).to_string()
                                 : boost::asio::ip::address_v4(static_cast<unsigned>(random())).to_string();
    const auto port = static_cast<std::uint16_t>(1 + random() % 65535);
    const HostPort read = host_port_of(text_of(host, port));
    EXPECT_EQ(read.host, host);
    EXPECT_EQ(read.port, port);
  }
}

TEST(HostPort, AHostWithoutAPortIsANameOrAnAddress) {
  EXPECT_EQ(host_without_port("--address", "rig.example"), "rig.example");
  EXPECT_EQ(host_without_port("--address", "2001:db8::1"), "2001:db8::1");
  EXPECT_EQ(host_without_port("--address", "[2001:db8::1]"), "2001:db8::1");
  for (const char* text : {"rig.example:47800", "192.0.2.1:47800", "[2001:db8::1]:47800", "[rig.example]", "", "[]"}) {
    EXPECT_THROW(host_without_port("--address", text), std::invalid_argument) << text;
  }
}

}  // namespace
}  // namespace tandem::net
