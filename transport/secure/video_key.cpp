#include "transport/secure/video_key.h"

#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>

#include <algorithm>

#include "transport/secure/dtls_wire.h"

namespace knuckle::secure {

VideoKey video_key(const VideoSecret& secret, std::string_view camera) {
  std::array<std::uint8_t, EVP_MAX_MD_SIZE> digest;
  unsigned size = 0;
  const auto* name = reinterpret_cast<const unsigned char*>(camera.data());
  must(HMAC(EVP_sha256(), secret.data(), static_cast<int>(secret.size()), name, camera.size(), digest.data(), &size) !=
           nullptr,
       "making a key for pictures");
  VideoKey key;
  std::copy_n(digest.begin(), key.size(), key.begin());
  OPENSSL_cleanse(digest.data(), digest.size());
  return key;
}

}  // namespace knuckle::secure
