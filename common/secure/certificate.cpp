#include "common/secure/certificate.hpp"

#include <openssl/pem.h>

#include <algorithm>
#include <cctype>
#include <stdexcept>

#include "common/secure/openssl_handles.hpp"

namespace tandem::secure {
namespace {

constexpr long kDay_s = 24 * 3600;
constexpr long kValidity_s = 3650 * kDay_s;
constexpr long kDevValidity_s = 365 * kDay_s;
/// Maximum time by which a client's clock may lag behind. Certificates are valid from this time before their creation.
constexpr long kClockError_s = kDay_s;
constexpr long kX509v3 = 2;

void require(bool is_good) {
  if (!is_good) throw std::runtime_error("OpenSSL cannot make a certificate");
}

X509Pointer certificate_of(const KeyPair& subject, const std::string& name, long validity_s) {
  X509Pointer certificate(X509_new());
  require(certificate != nullptr);
  X509* const x = certificate.get();
  require(X509_set_version(x, kX509v3) == 1);
  // The serial number must be positive and unique within an authority.
  ASN1_INTEGER_set_uint64(X509_get_serialNumber(x), random_u64() >> 1U);
  X509_gmtime_adj(X509_getm_notBefore(x), -kClockError_s);
  X509_gmtime_adj(X509_getm_notAfter(x), validity_s);
  require(X509_set_pubkey(x, subject.handle()) == 1);
  const auto* const text = reinterpret_cast<const unsigned char*>(name.c_str());
  require(X509_NAME_add_entry_by_txt(X509_get_subject_name(x), "CN", MBSTRING_UTF8, text, -1, -1, 0) == 1);
  return certificate;
}

void extend(X509* certificate, X509* issuer, int kind, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  X509_EXTENSION* const extension = X509V3_EXT_conf_nid(nullptr, &context, kind, value.c_str());
  const bool is_added = extension != nullptr && X509_add_ext(certificate, extension, -1) == 1;
  X509_EXTENSION_free(extension);
  if (!is_added) throw std::invalid_argument("no certificate can be made for \"" + value + "\"");
}

void sign(X509* certificate, const X509* issuer, const KeyPair& key) {
  require(X509_set_issuer_name(certificate, X509_get_subject_name(issuer)) == 1);
  const bool has_own_digest = EVP_PKEY_get_id(key.handle()) == EVP_PKEY_ED25519;
  require(X509_sign(certificate, key.handle(), has_own_digest ? nullptr : EVP_sha256()) > 0);
}

std::string pem_of(X509* certificate) {
  const BioPointer bio(BIO_new(BIO_s_mem()));
  require(PEM_write_bio_X509(bio.get(), certificate) == 1);
  return text_in(bio.get());
}

/// Returns whether `name` is a plausible host name. The name is inserted into text for OpenSSL's configuration parser,
/// so it must not contain separators of that language.
bool is_host_name(const std::string& name) {
  const auto fits = [](unsigned char c) { return std::isalnum(c) != 0 || c == '-' || c == '.'; };
  return !name.empty() && name.size() <= 253 && std::all_of(name.begin(), name.end(), fits);
}

std::string alternative_names(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) {
    if (!is_address(name) && !is_host_name(name)) {
      throw std::invalid_argument("\"" + name + "\" is neither an address nor the name of a host");
    }
    list += (list.empty() ? "" : ",") + std::string(is_address(name) ? "IP:" : "DNS:") + name;
  }
  return list;
}

}  // namespace

std::string self_signed_certificate(const KeyPair& key) {
  const X509Pointer certificate = certificate_of(key, "tandem-server", kValidity_s);
  extend(certificate.get(), certificate.get(), NID_basic_constraints, "critical,CA:FALSE");
  sign(certificate.get(), certificate.get(), key);
  return pem_of(certificate.get());
}

void write_dev_certificates(const std::filesystem::path& folder, const std::vector<std::string>& names) {
  for (const char* file : {"ca.pem", "ca-key.pem", "server.pem", "server-key.pem"}) {
    if (!std::filesystem::exists(folder / file)) continue;
    throw std::invalid_argument((folder / file).string() + " is there already; choose another folder, or remove it");
  }
  const std::string alternatives = alternative_names(names);
  const KeyPair authority_key = KeyPair::make(KeyPair::Kind::kP256), server_key = KeyPair::make(KeyPair::Kind::kP256);
  const X509Pointer authority = certificate_of(authority_key, "Tandem, private authority", kDevValidity_s);
  extend(authority.get(), authority.get(), NID_basic_constraints, "critical,CA:TRUE,pathlen:0");
  extend(authority.get(), authority.get(), NID_key_usage, "critical,keyCertSign,cRLSign");
  extend(authority.get(), authority.get(), NID_subject_key_identifier, "hash");
  sign(authority.get(), authority.get(), authority_key);
  const X509Pointer server = certificate_of(server_key, names.at(0), kDevValidity_s);
  extend(server.get(), authority.get(), NID_basic_constraints, "critical,CA:FALSE");
  extend(server.get(), authority.get(), NID_key_usage, "critical,digitalSignature");
  extend(server.get(), authority.get(), NID_ext_key_usage, "serverAuth");
  extend(server.get(), authority.get(), NID_authority_key_identifier, "keyid");
  extend(server.get(), authority.get(), NID_subject_alt_name, alternatives);
  sign(server.get(), authority.get(), authority_key);
  authority_key.save(folder / "ca-key.pem");
  server_key.save(folder / "server-key.pem");
  write_key_file(folder / "ca.pem", pem_of(authority.get()), false);
  write_key_file(folder / "server.pem", pem_of(server.get()), false);
}

}  // namespace tandem::secure
