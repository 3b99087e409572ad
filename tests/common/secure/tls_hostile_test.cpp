// A peer with arbitrary TLS behaviour must cause only a bounded cost at the server.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>

#include <filesystem>
#include <thread>
#include <vector>

#include "common/secure/certificate.hpp"
#include "common/secure/tls.hpp"

namespace tandem::secure {
namespace {

using testing::HasSubstr;

/// A client that uses OpenSSL directly, without the restrictions of TlsStream, to play a hostile peer.
class AnyClient {
 public:
  explicit AnyClient(const char* groups) : context_(SSL_CTX_new(TLS_client_method())), ssl_(nullptr) {
    SSL_CTX_set1_groups_list(context_, groups);
    ssl_ = SSL_new(context_);
    SSL_set_bio(ssl_, BIO_new(BIO_s_mem()), BIO_new(BIO_s_mem()));
    const std::string alpn = static_cast<char>(kAlpn.size()) + std::string(kAlpn);
    SSL_set_alpn_protos(ssl_, reinterpret_cast<const unsigned char*>(alpn.data()), static_cast<unsigned>(alpn.size()));
    SSL_set_connect_state(ssl_);
  }
  ~AnyClient() {
    SSL_free(ssl_);
    SSL_CTX_free(context_);
  }
  AnyClient(const AnyClient&) = delete;
  AnyClient& operator=(const AnyClient&) = delete;

  ssl_st* ssl() { return ssl_; }
  Bytes to_server() {
    BIO* const bio = SSL_get_wbio(ssl_);
    Bytes bytes(BIO_ctrl_pending(bio));
    if (!bytes.empty()) BIO_read(bio, bytes.data(), static_cast<int>(bytes.size()));
    return bytes;
  }
  void receive(const Bytes& bytes) {
    if (!bytes.empty()) BIO_write(SSL_get_rbio(ssl_), bytes.data(), static_cast<int>(bytes.size()));
  }
  /// Returns whether the server completes the handshake with this client.
  bool shakes_hands_with(TlsStream& server) {
    for (int i = 0; i < 4; ++i) {
      SSL_do_handshake(ssl_);
      Bytes plain, answer;
      if (!server.receive(to_server(), plain, answer)) return false;
      receive(answer);
    }
    return server.is_established();
  }

 private:
  SSL_CTX* context_;
  SSL* ssl_;
};

class HostilePeer : public testing::Test {
 protected:
  const KeyPair key = KeyPair::make(KeyPair::Kind::kP256);
  const TlsContext context = TlsContext::server(key, self_signed_certificate(key));
  TlsStream server{&context};
};

TEST_F(HostilePeer, MakesNoServerDeriveKeysOfLargeGroups) {
  for (const char* group : {"ffdhe2048", "ffdhe8192", "P-521", "X448"}) {
    AnyClient client(group);
    TlsStream stream(&context);
    EXPECT_FALSE(client.shakes_hands_with(stream)) << group;
  }
  AnyClient usual("X25519");
  EXPECT_TRUE(usual.shakes_hands_with(server));
}

TEST_F(HostilePeer, GetsNoNewKeysWithoutEnd) {
  AnyClient client("X25519");
  ASSERT_TRUE(client.shakes_hands_with(server));
  const auto update = [&client] {
    SSL_key_update(client.ssl(), SSL_KEY_UPDATE_REQUESTED);
    SSL_do_handshake(client.ssl());
  };
  Bytes plain, answer;
  for (int i = 0; i < 10; ++i) update();
  EXPECT_TRUE(server.receive(client.to_server(), plain, answer)) << "some may be";
  for (int i = 0; i < 2000; ++i) update();
  const Bytes many = client.to_server();
  answer.clear();
  EXPECT_FALSE(server.receive(many, plain, answer));
  EXPECT_THAT(server.problem(), HasSubstr("new keys"));
  EXPECT_LT(answer.size(), 10'000u) << "and it is not answered again and again";
}

TEST(ServersKey, AKindOfKeyThatMakesHandshakesSlowIsRefused) {
  const auto file = std::filesystem::path(testing::TempDir()) / "rsa.pem";
  EVP_PKEY* const rsa = EVP_PKEY_Q_keygen(nullptr, nullptr, "RSA", std::size_t{2048});
  FILE* const out = std::fopen(file.c_str(), "w");
  PEM_write_PrivateKey(out, rsa, nullptr, nullptr, 0, nullptr, nullptr);
  std::fclose(out);
  EVP_PKEY_free(rsa);
  const KeyPair key = KeyPair::load(file);
  try {
    TlsContext::server(key, self_signed_certificate(key));
    ADD_FAILURE() << "taken";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), HasSubstr("P-256"));
  }
}

TEST(KeyFiles, AreTheSameForProcessesThatCreateThemAtOnce) {
  const auto file = std::filesystem::path(testing::TempDir()) / "at_once" / "key.pem";
  for (int turn = 0; turn < 20; ++turn) {
    std::filesystem::remove_all(file.parent_path());
    std::vector<KeyId> ids(4);
    std::vector<std::thread> threads;
    for (KeyId& id : ids) {
      threads.emplace_back([&id, &file] { id = KeyPair::load_or_make(file, KeyPair::Kind::kEd25519).id(); });
    }
    for (std::thread& thread : threads) thread.join();
    for (const KeyId& id : ids) ASSERT_EQ(id, KeyPair::load(file).id());
    const auto entries = std::filesystem::directory_iterator(file.parent_path());
    ASSERT_EQ(std::distance(begin(entries), end(entries)), 1) << "no other file may remain";
  }
}

TEST(KeyFiles, AreNeverReplacedAndNeverReadableByOthers) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "kept";
  std::filesystem::remove_all(folder);
  const KeyPair key = KeyPair::make(KeyPair::Kind::kEd25519);
  key.save(folder / "key.pem");
  EXPECT_EQ(std::filesystem::status(folder / "key.pem").permissions() & std::filesystem::perms::mask,
            std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
  EXPECT_THROW(KeyPair::make(KeyPair::Kind::kEd25519).save(folder / "key.pem"), std::invalid_argument);
  EXPECT_EQ(KeyPair::load(folder / "key.pem").id(), key.id());
}

}  // namespace
}  // namespace tandem::secure
