// Any key.pem and any peers.toml, with a line "---" between them: each refused in one line, or a key that can make a
// link, and pairings that are the same when they are written again.
#include <openssl/evp.h>
#include <openssl/x509.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "app/pairing/key_folder.h"
#include "core/text.h"
#include "tests/fuzz/folder_in_memory.h"
#include "tests/fuzz/require.h"
#include "transport/secure/dtls_session.h"

namespace {

using namespace knuckle;

using knuckle::test::refused_or;
using knuckle::test::require;

bool same(const secure::Peer& one, const secure::Peer& other) {
  return one.fingerprint == other.fingerprint && one.name == other.name && one.revoked == other.revoked &&
         one.observer == other.observer && one.expires_utc == other.expires_utc;
}

/// What `key` signs is what its certificate verifies, or no handshake would ever succeed.
bool signs_for_its_certificate(const secure::Identity& identity) {
  const std::string message = "message";
  const auto* bytes = reinterpret_cast<const unsigned char*>(message.data());
  std::array<unsigned char, 128> signature{};
  std::size_t size = signature.size();
  EVP_MD_CTX* context = EVP_MD_CTX_new();
  const bool ok =
      EVP_DigestSignInit(context, nullptr, EVP_sha256(), nullptr, identity.key.get()) == 1 &&
      EVP_DigestSign(context, signature.data(), &size, bytes, message.size()) == 1 && EVP_MD_CTX_reset(context) == 1 &&
      EVP_DigestVerifyInit(context, nullptr, EVP_sha256(), nullptr, X509_get0_pubkey(identity.certificate.get())) ==
          1 &&
      EVP_DigestVerify(context, signature.data(), size, bytes, message.size()) == 1;
  EVP_MD_CTX_free(context);
  return ok;
}

void check_key(const pairing::KeyFolder& folder) {
  const secure::Identity identity = secure::load_identity(folder.key_file());
  require(secure::is_name(identity.name) && printable(identity.expires_utc()) == identity.expires_utc());
  require(signs_for_its_certificate(identity));
  const secure::DtlsContext machine(identity, {}, secure::Role::kMachine), desk(identity, {}, secure::Role::kOperator);
  (void)folder.identity();
}

void check_peers(const pairing::KeyFolder& folder) {
  const secure::Peers read = folder.peers();
  for (const secure::Peer& peer : read) {
    require(secure::is_name(peer.name));
    const std::string warning = pairing::expiry_warning(peer.name, peer.expires_utc);
    require(printable(warning) == warning);
  }
  folder.change_peers([](secure::Peers&) {});
  const secure::Peers again = folder.peers();
  require(std::equal(read.begin(), read.end(), again.begin(), again.end(), same));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::string_view kBetween = "---\n";
  static const test::FolderInMemory in_memory;
  static const pairing::KeyFolder folder(in_memory.path());
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  std::size_t at = text.starts_with(kBetween) ? 0 : text.find("\n---\n");
  if (at != 0 && at != std::string_view::npos) ++at;
  in_memory.put("key.pem", text.substr(0, at));
  in_memory.put("peers.toml", at == std::string_view::npos ? "" : text.substr(at + kBetween.size()));
  refused_or([] { check_key(folder); });
  refused_or([] { check_peers(folder); });
  return 0;
}
