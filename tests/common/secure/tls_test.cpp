#include "common/secure/tls.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <fstream>
#include <functional>

#include "common/secure/certificate.hpp"

namespace tandem::secure {
namespace {

using testing::HasSubstr;

Bytes bytes_in(std::string_view text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

std::string text_in_file(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::string failure_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

/// A client and a server in one process. The test transports the bytes between them.
struct Pair {
  Pair(const TlsContext& client_context, const TlsContext& server_context)
      : client(&client_context), server(&server_context) {
    client.start(to_server);
    for (int i = 0; i < 4; ++i) carry();
  }
  void carry() {
    server_is_good = server.receive(std::exchange(to_server, {}), at_server, to_client) && server_is_good;
    client_is_good = client.receive(std::exchange(to_client, {}), at_client, to_server) && client_is_good;
  }

  TlsStream client, server;
  Bytes to_server, to_client, at_server, at_client;
  bool client_is_good = true, server_is_good = true;
};

class Tls : public testing::Test {
 protected:
  const KeyPair key = KeyPair::make(KeyPair::Kind::kP256);
  const TlsContext server = TlsContext::server(key, self_signed_certificate(key));
  const TlsContext client = TlsContext::client({.pin = key.id()});
};

TEST_F(Tls, CarriesBytesBothWaysBetweenAServerAndAClientThatPinsItsKey) {
  Pair pair(client, server);
  ASSERT_TRUE(pair.client.is_established()) << pair.client.problem();
  ASSERT_TRUE(pair.server.is_established()) << pair.server.problem();
  pair.client.send(bytes_in("hello"), pair.to_server);
  EXPECT_TRUE(std::ranges::search(pair.to_server, bytes_in("hello")).empty());
  pair.server.send(bytes_in("welcome"), pair.to_client);
  pair.carry();
  EXPECT_EQ(pair.at_server, bytes_in("hello"));
  EXPECT_EQ(pair.at_client, bytes_in("welcome"));
}

TEST_F(Tls, IsTheSameByteByByte) {
  TlsStream a(&client), b(&server);
  Bytes to_b, to_a, none;
  a.start(to_b);
  for (int turn = 0; turn < 3; ++turn) {
    for (const std::byte byte : std::exchange(to_b, {})) ASSERT_TRUE(b.receive(std::span(&byte, 1), none, to_a));
    for (const std::byte byte : std::exchange(to_a, {})) ASSERT_TRUE(a.receive(std::span(&byte, 1), none, to_b));
  }
  EXPECT_TRUE(a.is_established() && b.is_established());
}

TEST_F(Tls, RefusesAServerWithAnotherKey) {
  const KeyPair other = KeyPair::make(KeyPair::Kind::kP256);
  Pair pair(client, TlsContext::server(other, self_signed_certificate(other)));
  EXPECT_FALSE(pair.client_is_good);
  EXPECT_FALSE(pair.client.is_established());
  EXPECT_THAT(pair.client.problem(), HasSubstr("key is not the one"));
  EXPECT_FALSE(pair.server_is_good) << "the server must fail after the client's alert";
}

TEST_F(Tls, BothEndsExportTheSameSecretAndNoOtherConnectionDoes) {
  Pair pair(client, server), other(client, server);
  const Bytes context = bytes_in("context");
  const auto a = pair.client.exported(kDatagramExport, context), b = pair.server.exported(kDatagramExport, context);
  ASSERT_TRUE(a && b);
  EXPECT_TRUE(is_equal(a->secret.bytes(), b->secret.bytes()));
  EXPECT_EQ(a->aead, b->aead);
  for (const auto& different : {pair.client.exported(kResumeExport, context), pair.client.exported(kDatagramExport, {}),
                                other.client.exported(kDatagramExport, context)}) {
    ASSERT_TRUE(different);
    EXPECT_FALSE(is_equal(a->secret.bytes(), different->secret.bytes()));
  }
}

TEST_F(Tls, NothingIsExportedOrSentBeforeTheHandshakeIsDone) {
  TlsStream stream(&server);
  Bytes out;
  stream.send(bytes_in("secret"), out);
  EXPECT_TRUE(out.empty());
  EXPECT_FALSE(stream.exported(kDatagramExport, {}));
}

TEST_F(Tls, NonTlsBytesEndOnlyTheirConnection) {
  for (const std::string& words :
       {std::string("GET / HTTP/1.1\r\n\r\n"), std::string(100, '\xFF'), std::string(5, '\0')}) {
    TlsStream stream(&server);
    Bytes plain, out;
    EXPECT_FALSE(stream.receive(bytes_in(words), plain, out));
    EXPECT_THAT(stream.problem(), HasSubstr("TLS"));
    EXPECT_TRUE(plain.empty());
  }
}

TEST_F(Tls, AChangedRecordEndsTheConnectionAndDeliversNothing) {
  Pair pair(client, server);
  pair.client.send(bytes_in("hello"), pair.to_server);
  pair.to_server[7] ^= std::byte{1};
  pair.carry();
  EXPECT_FALSE(pair.server_is_good);
  EXPECT_TRUE(pair.at_server.empty());
}

TEST_F(Tls, WithoutAContextBytesGoThroughAsTheyAre) {
  TlsStream stream(nullptr);
  Bytes plain, out;
  EXPECT_TRUE(stream.is_plain() && stream.is_established());
  EXPECT_TRUE(stream.receive(bytes_in("in"), plain, out));
  stream.send(bytes_in("out"), out);
  EXPECT_EQ(plain, bytes_in("in"));
  EXPECT_EQ(out, bytes_in("out"));
  EXPECT_FALSE(stream.exported(kDatagramExport, {}));
}

class Authority : public testing::Test {
 protected:
  Authority() {
    std::filesystem::remove_all(folder);
    write_dev_certificates(folder, {"127.0.0.1", "server.example.org"});
  }
  TlsContext server_of(const std::filesystem::path& place) const {
    return TlsContext::server(KeyPair::load(place / "server-key.pem"), text_in_file(place / "server.pem"));
  }
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "authority";
};

TEST_F(Authority, VouchesForTheNamesOfItsServerAndNoOther) {
  const TlsContext server = server_of(folder);
  for (const char* host : {"127.0.0.1", "server.example.org"}) {
    Pair pair(TlsContext::client({.ca_file = folder / "ca.pem", .host = host}), server);
    EXPECT_TRUE(pair.client.is_established()) << host << ": " << pair.client.problem();
  }
  for (const char* host : {"127.0.0.2", "other.example.org"}) {
    Pair pair(TlsContext::client({.ca_file = folder / "ca.pem", .host = host}), server);
    EXPECT_FALSE(pair.client.is_established()) << host;
    EXPECT_THAT(pair.client.problem(), HasSubstr("mismatch"));
  }
}

TEST_F(Authority, DoesNotVouchForAnothersServer) {
  const auto elsewhere = std::filesystem::path(testing::TempDir()) / "elsewhere";
  std::filesystem::remove_all(elsewhere);
  write_dev_certificates(elsewhere, {"127.0.0.1"});
  Pair pair(TlsContext::client({.ca_file = folder / "ca.pem", .host = "127.0.0.1"}), server_of(elsewhere));
  EXPECT_FALSE(pair.client.is_established());
  EXPECT_THAT(pair.client.problem(), HasSubstr("not vouched for"));
}

TEST_F(Authority, KeepsItsKeysToItselfAndOverwritesNone) {
  for (const char* file : {"ca-key.pem", "server-key.pem"}) {
    struct stat status {};
    ASSERT_EQ(::stat((folder / file).c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777U, 0600U) << file;
  }
  EXPECT_THAT(failure_of([this] { write_dev_certificates(folder, {"127.0.0.1"}); }), HasSubstr("there already"));
}

TEST(DevCertificates, RefuseAnInvalidName) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "bad_names";
  for (const char* name : {"a,IP:10.0.0.1", "", "a b"}) {
    EXPECT_THAT(failure_of([&] { write_dev_certificates(folder, {name}); }), HasSubstr("neither")) << name;
  }
}

TEST(KeyPair, IsTheSameAfterItsFile) {
  const auto file = std::filesystem::path(testing::TempDir()) / "keys" / "key.pem";
  std::filesystem::remove_all(file.parent_path());
  const KeyPair made = KeyPair::load_or_make(file, KeyPair::Kind::kEd25519);
  EXPECT_EQ(KeyPair::load_or_make(file, KeyPair::Kind::kEd25519).id(), made.id());
  std::ofstream(file) << "no key";
  EXPECT_THAT(failure_of([&] { KeyPair::load(file); }), HasSubstr(file.string()));
}

TEST(KeyPair, MakesASignatureThatOnlyItsPublicKeyConfirms) {
  const KeyPair key = KeyPair::make(KeyPair::Kind::kEd25519), other = KeyPair::make(KeyPair::Kind::kEd25519);
  const Bytes message = bytes_in("message");
  Signature signature = key.sign(message);
  EXPECT_TRUE(has_signed(key.public_key(), message, signature));
  EXPECT_FALSE(has_signed(other.public_key(), message, signature));
  EXPECT_FALSE(has_signed(key.public_key(), bytes_in("massage"), signature));
  signature[5] ^= std::byte{1};
  EXPECT_FALSE(has_signed(key.public_key(), message, signature));
  EXPECT_FALSE(has_signed(PublicKey{}, message, signature));
}

TEST(Text, OfBytesReadsBackAndOtherTextIsRefused) {
  for (std::size_t size = 0; size < 40; ++size) {
    Bytes bytes(size);
    fill_random(bytes);
    EXPECT_EQ(bytes_of_text(text_of(bytes)), bytes);
  }
  EXPECT_EQ(text_of(bytes_in("\xFB\xFF")), "-_8");
  for (const char* text : {"A", "AB", "A=", "-_9", "AA A", "AA+A"}) EXPECT_FALSE(bytes_of_text(text)) << text;
}

}  // namespace
}  // namespace tandem::secure
