// Keys for pictures: what a session's ends make of its secret, and what is left of that.
#include "transport/secure/video_key.h"

#include <gtest/gtest.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <pthread.h>

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <vector>

namespace knuckle::secure {
namespace {

VideoSecret some_secret() {
  VideoSecret secret;
  for (std::size_t i = 0; i < secret.size(); ++i) secret[i] = static_cast<std::uint8_t>(7 * i + 1);
  return secret;
}

/// All of what the key is the beginning of.
std::array<std::uint8_t, 32> digest_of(const VideoSecret& secret, const std::string& camera) {
  std::array<std::uint8_t, 32> digest{};
  HMAC(EVP_sha256(), secret.data(), static_cast<int>(secret.size()),
       reinterpret_cast<const unsigned char*>(camera.data()), camera.size(), digest.data(), nullptr);
  return digest;
}

TEST(VideoKeys, AreTheBeginningOfADigestOfTheCamerasName) {
  const VideoKey key = video_key(some_secret(), "mast");
  const auto digest = digest_of(some_secret(), "mast");
  EXPECT_TRUE(std::equal(key.begin(), key.end(), digest.begin()));
  EXPECT_NE(video_key(some_secret(), "rear"), key);
}

/// What a thread with a stack of its own makes there, and leaves behind.
struct OnOwnStack {
  std::vector<std::uint8_t> stack = std::vector<std::uint8_t>(std::size_t{1} << 20);
  std::unique_ptr<VideoKey> key = std::make_unique<VideoKey>();  // not on that stack
  void run(void* (*make)(void*)) {
    pthread_attr_t own;
    pthread_attr_init(&own);
    ASSERT_EQ(pthread_attr_setstack(&own, stack.data(), stack.size()), 0);
    pthread_t thread{};
    ASSERT_EQ(pthread_create(&thread, &own, make, key.get()), 0);
    pthread_join(thread, nullptr);
    pthread_attr_destroy(&own);
  }
  [[nodiscard]] bool holds(const std::array<std::uint8_t, 32>& bytes) const {
    return std::search(stack.begin(), stack.end(), bytes.begin(), bytes.end()) != stack.end();
  }
};

TEST(VideoKeys, AreMadeWithoutLeavingTheDigestInMemory) {
  const auto digest = digest_of(some_secret(), "mast");
  OnOwnStack made;
  made.run([](void* key) -> void* {
    *static_cast<VideoKey*>(key) = video_key(some_secret(), "mast");
    return nullptr;
  });
  EXPECT_TRUE(std::equal(made.key->begin(), made.key->end(), digest.begin()));
  EXPECT_FALSE(made.holds(digest));
  OnOwnStack careless;  // that it would be seen
  careless.run([](void* key) -> void* {
    const std::array<std::uint8_t, 32> kept = digest_of(some_secret(), "mast");
    std::copy_n(kept.begin(), sizeof(VideoKey), static_cast<VideoKey*>(key)->begin());
    return nullptr;
  });
  EXPECT_TRUE(careless.holds(digest));
}

}  // namespace
}  // namespace knuckle::secure
