#include "transport/secure/identity.h"

#include <fcntl.h>
#include <openssl/bio.h>
#include <openssl/ec.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <ctime>

#include "core/descriptor.h"
#include "core/error.h"
#include "core/text.h"
#include "transport/secure/dtls_wire.h"

namespace knuckle::secure {
namespace {

struct BioDeleter {
  void operator()(BIO* bio) const noexcept { BIO_free(bio); }
};
using Memory = std::unique_ptr<BIO, BioDeleter>;

std::string base32(const std::uint8_t* bytes, std::size_t groups) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZ234567";  // RFC 4648
  std::string text;
  for (std::size_t i = 0; i < 4 * groups; ++i) {
    if (i > 0 && i % 4 == 0) text += '-';
    const std::size_t bit = 5 * i;
    const unsigned pair = static_cast<unsigned>(bytes[bit / 8] << 8 | bytes[bit / 8 + 1]);
    text += kDigits[pair >> (11 - bit % 8) & 31U];
  }
  return text;
}

constexpr std::size_t kShortGroups = 4;  // 80 bits: beyond what anybody can search for a second certificate
constexpr std::size_t kCodeGroups = 6;

[[noreturn]] void refuse(const std::string& file, const std::string& why) {
  throw InputError(file + ": " + why);
}

/// The private half belongs to the public one: a file may hold any two.
bool signs_what_it_verifies(EVP_PKEY* key) {
  EVP_PKEY_CTX* context = EVP_PKEY_CTX_new_from_pkey(nullptr, key, nullptr);
  const bool ok = context != nullptr && EVP_PKEY_pairwise_check(context) == 1;
  EVP_PKEY_CTX_free(context);
  return ok;
}

std::string read_private_file(const std::string& file) {
  // A pipe without a writer would keep it waiting.
  const Descriptor descriptor(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  if (!descriptor && errno == ENOENT) refuse(file, "is not there: knuckle pair makes this computer's key");
  if (!descriptor && errno == ELOOP) refuse(file, "is a symbolic link: put the file itself there");
  if (!descriptor) refuse(file, std::strerror(errno));
  struct stat status {};
  std::string text(65536, '\0');
  const bool known = ::fstat(descriptor.get(), &status) == 0;
  const ssize_t got = ::read(descriptor.get(), text.data(), text.size());
  if (known && !S_ISREG(status.st_mode)) refuse(file, "is not a regular file");
  if (!known || got < 0) refuse(file, "cannot be read");
  if (status.st_uid != ::geteuid()) refuse(file, "belongs to another user: nobody else may hold the private key");
  if ((status.st_mode & 077U) != 0) {
    char mode[8];
    *std::to_chars(mode, mode + 7, status.st_mode & 0777U, 8).ptr = '\0';
    refuse(file, std::string("mode 0") + mode + " lets others at the private key: chmod 600, or make a new one");
  }
  text.resize(static_cast<std::size_t>(got));
  return text;
}

}  // namespace

void CertificateDeleter::operator()(X509* certificate) const noexcept {
  X509_free(certificate);
}
void KeyDeleter::operator()(EVP_PKEY* key) const noexcept {
  EVP_PKEY_free(key);
}

std::string hex(const Fingerprint& fingerprint) {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const unsigned byte : fingerprint.bytes) {
    text += kDigits[byte >> 4];
    text += kDigits[byte & 15U];
  }
  return text;
}

std::string short_text(const Fingerprint& fingerprint) {
  return base32(fingerprint.bytes.data(), kShortGroups);
}

std::optional<Fingerprint> fingerprint_of_hex(std::string_view digits) {
  Fingerprint result;
  bool ok = digits.size() == 2 * result.bytes.size();
  for (std::size_t i = 0; ok && i < result.bytes.size(); ++i) {
    const char* at = digits.data() + 2 * i;
    const auto [end, error] = std::from_chars(at, at + 2, result.bytes[i], 16);
    ok = error == std::errc() && end == at + 2;
  }
  return ok ? std::optional(result) : std::nullopt;
}

Fingerprint fingerprint_of(const X509* certificate) {
  Fingerprint result;
  unsigned size = 0;
  must(X509_digest(certificate, EVP_sha256(), result.bytes.data(), &size) == 1 && size == result.bytes.size(),
       "digest of a certificate");
  return result;
}

std::string pairing_code(const Fingerprint& one, const Fingerprint& other) {
  const auto& [low, high] = std::minmax(one.bytes, other.bytes);
  std::array<std::uint8_t, 64> both{};
  std::copy(high.begin(), high.end(), std::copy(low.begin(), low.end(), both.begin()));
  Fingerprint digest;
  must(EVP_Digest(both.data(), both.size(), digest.bytes.data(), nullptr, EVP_sha256(), nullptr) == 1, "digest");
  return base32(digest.bytes.data(), kCodeGroups);
}

bool is_name(std::string_view name) noexcept {
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == ' ' || c == '.' ||
           c == '_' || c == '-';
  };
  return !name.empty() && name.size() <= kMostNameLength && std::all_of(name.begin(), name.end(), allowed) &&
         name.front() != ' ' && name.back() != ' ';
}

std::string common_name(const X509* certificate) {
  char name[kMostNameLength + 1] = {};
  X509_NAME_get_text_by_NID(X509_get_subject_name(certificate), NID_commonName, name, sizeof name);
  return is_name(name) ? name : "unnamed";
}

std::string expires_utc(const X509* certificate) {
  std::tm time{};
  if (ASN1_TIME_to_tm(X509_get0_notAfter(certificate), &time) != 1) return "";
  return utc_text(::timegm(&time));
}

bool Identity::expired() const {
  return X509_cmp_current_time(X509_get0_notAfter(certificate.get())) <= 0;
}

bool Identity::not_yet_valid() const {
  return X509_cmp_current_time(X509_get0_notBefore(certificate.get())) > 0;
}

std::string Identity::pem() const {
  const Memory memory(BIO_new(BIO_s_mem()));
  must(PEM_write_bio_PrivateKey(memory.get(), key.get(), nullptr, nullptr, 0, nullptr, nullptr) == 1 &&
           PEM_write_bio_X509(memory.get(), certificate.get()) == 1,
       "writing PEM");
  char* data = nullptr;
  const long size = BIO_get_mem_data(memory.get(), &data);
  return {data, static_cast<std::size_t>(size)};
}

Identity make_identity(const std::string& name, int days) {
  if (!is_name(name)) {
    throw InputError("name \"" + name + "\": must be 1 to " + std::to_string(kMostNameLength) +
                     " letters, digits, spaces and . _ -");
  }
  Identity made{Key(EVP_EC_gen("P-256")), Certificate(X509_new()), name};
  X509* certificate = made.certificate.get();
  must(made.key && certificate != nullptr, "making a key");
  std::uint64_t serial = 0;
  must(RAND_bytes(reinterpret_cast<unsigned char*>(&serial), sizeof serial) == 1, "random number");
  X509_set_version(certificate, X509_VERSION_3);
  ASN1_INTEGER_set_uint64(X509_get_serialNumber(certificate), serial >> 1);
  X509_time_adj_ex(X509_getm_notBefore(certificate), -1, 0, nullptr);
  X509_time_adj_ex(X509_getm_notAfter(certificate), days, 0, nullptr);
  X509_NAME* subject = X509_get_subject_name(certificate);
  must(X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_ASC, reinterpret_cast<const unsigned char*>(name.c_str()), -1,
                                  -1, 0) == 1 &&
           X509_set_issuer_name(certificate, subject) == 1 && X509_set_pubkey(certificate, made.key.get()) == 1 &&
           X509_sign(certificate, made.key.get(), EVP_sha256()) > 0,
       "making a certificate");
  return made;
}

Identity load_identity(const std::string& file) {
  const std::string text = read_private_file(file);
  const auto memory = [&text] { return Memory(BIO_new_mem_buf(text.data(), static_cast<int>(text.size()))); };
  const auto no_password = [](char*, int, int, void*) { return 0; };
  Identity read{Key(PEM_read_bio_PrivateKey(memory().get(), nullptr, no_password, nullptr)),
                Certificate(PEM_read_bio_X509(memory().get(), nullptr, no_password, nullptr)),
                {}};
  const std::string new_one = ": make a new one (knuckle pair --renew --name NAME) and pair again";
  if (!read.key || !read.certificate) refuse(file, "has no private key with its certificate (PEM)" + new_one);
  char group[32] = {};
  if (EVP_PKEY_get_group_name(read.key.get(), group, sizeof group, nullptr) != 1 ||
      std::strcmp(group, "prime256v1") != 0)
    refuse(file, "its key is not on the curve P-256" + new_one);
  if (X509_check_private_key(read.certificate.get(), read.key.get()) != 1)
    refuse(file, "its certificate is of another key" + new_one);
  if (!signs_what_it_verifies(read.key.get())) refuse(file, "its private key is damaged" + new_one);
  if (X509_self_signed(read.certificate.get(), 1) != 1)
    refuse(file, "its certificate is not signed by its own key" + new_one);
  read.name = common_name(read.certificate.get());
  return read;
}

}  // namespace knuckle::secure
