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

/// What is made on a stack of its own, and what is left behind there.
struct OnOwnStack {
  using Make = void (*)(VideoKey& key);
  explicit OnOwnStack(Make what) : make(what) {
    pthread_attr_t own;
    pthread_attr_init(&own);
    EXPECT_EQ(pthread_attr_setstack(&own, stack.data(), stack.size()), 0);
    pthread_t thread{};
    EXPECT_EQ(pthread_create(&thread, &own, &OnOwnStack::run, this), 0);
    pthread_join(thread, nullptr);
    pthread_attr_destroy(&own);
  }
  /// Far down, where the thread's end writes nothing over it.
  static void* run(void* self) {
    std::array<volatile char, std::size_t{1} << 18> above;
    above.front() = 0;
    static_cast<OnOwnStack*>(self)->make(*static_cast<OnOwnStack*>(self)->key);
    above.back() = above.front();
    return nullptr;
  }
  [[nodiscard]] bool holds(const std::array<std::uint8_t, 32>& bytes) const {
    return std::search(stack.begin(), stack.end(), bytes.begin(), bytes.end()) != stack.end();
  }
  const Make make;
  std::vector<std::uint8_t> stack = std::vector<std::uint8_t>(std::size_t{1} << 20);
  const std::unique_ptr<VideoKey> key = std::make_unique<VideoKey>();  // not on that stack
};

TEST(VideoKeys, AreTheBeginningOfADigestOfTheCamerasNameAndLeaveTheRestNowhereInMemory) {
  const auto digest = digest_of(some_secret(), "mast");
  const OnOwnStack made([](VideoKey& key) { key = video_key(some_secret(), "mast"); });
  EXPECT_TRUE(std::equal(made.key->begin(), made.key->end(), digest.begin()));
  EXPECT_NE(video_key(some_secret(), "rear"), *made.key);
  EXPECT_FALSE(made.holds(digest));
  const OnOwnStack careless([](VideoKey& key) {  // that it would be seen
    const std::array<std::uint8_t, 32> kept = digest_of(some_secret(), "mast");
    std::copy_n(kept.begin(), key.size(), key.begin());
  });
  EXPECT_TRUE(careless.holds(digest));
}

}  // namespace
}  // namespace knuckle::secure
