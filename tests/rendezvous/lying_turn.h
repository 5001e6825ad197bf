// A TURN server in a test's hand (RFC 5766, UDP): it knows user and password, and answers what a test wants it to. It
// relays nothing.
#pragma once

#include <netinet/in.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <poll.h>

#include <array>
#include <atomic>
#include <cstring>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "transport/socket_address.h"
#include "transport/udp_socket.h"

namespace knuckle::test {

using StunBytes = std::vector<std::uint8_t>;

/// A STUN message that is being written, or was received.
class StunMessage {
 public:
  static constexpr std::size_t kHeader = 20;
  static constexpr std::uint16_t kAllocate = 0x003, kRefresh = 0x004, kSuccess = 0x100, kError = 0x110;
  static constexpr std::uint16_t kUsername = 0x0006, kIntegrity = 0x0008, kErrorCode = 0x0009, kLifetime = 0x000D,
                                 kRealm = 0x0014, kNonce = 0x0015, kRelayed = 0x0016, kMapped = 0x0020,
                                 kAlternate = 0x8023;

  /// nullopt where it is no request.
  static std::optional<StunMessage> request(std::span<const std::uint8_t> datagram) {
    if (datagram.size() < kHeader || datagram[0] > 3 || ((datagram[0] & 1U) | (datagram[1] & 0x10U)) != 0)
      return std::nullopt;
    StunMessage message;
    message.bytes.assign(datagram.begin(), datagram.end());
    return message;
  }
  /// To this request, with its transaction number.
  [[nodiscard]] StunMessage answer(std::uint16_t message_class) const {
    StunMessage made;
    made.bytes.assign(bytes.begin(), bytes.begin() + kHeader);
    const unsigned type = method() | message_class;
    made.bytes[0] = static_cast<std::uint8_t>(type >> 8);
    made.bytes[1] = static_cast<std::uint8_t>(type);
    made.set_length(0);
    return made;
  }
  [[nodiscard]] std::uint16_t method() const { return static_cast<std::uint16_t>((bytes[0] << 8 | bytes[1]) & 0xFEEF); }
  [[nodiscard]] bool has(std::uint16_t attribute) const {
    for (std::size_t at = kHeader; at + 4 <= bytes.size();) {
      if (word(at) == attribute) return true;
      at += 4 + (word(at + 2) + 3U) / 4 * 4;
    }
    return false;
  }

  StunMessage& add(std::uint16_t attribute, std::span<const std::uint8_t> value) {
    put(attribute);
    put(static_cast<std::uint16_t>(value.size()));
    bytes.insert(bytes.end(), value.begin(), value.end());
    bytes.resize((bytes.size() + 3) / 4 * 4);
    set_length(bytes.size() - kHeader);
    return *this;
  }
  StunMessage& add(std::uint16_t attribute, std::string_view value) {
    return add(attribute, std::span(reinterpret_cast<const std::uint8_t*>(value.data()), value.size()));
  }
  StunMessage& add_error(int code) {
    return add(kErrorCode, std::array<std::uint8_t, 4>{0, 0, static_cast<std::uint8_t>(code / 100),
                                                       static_cast<std::uint8_t>(code % 100)});
  }
  StunMessage& add_lifetime(std::uint8_t s) { return add(kLifetime, std::array<std::uint8_t, 4>{0, 0, 0, s}); }
  /// IPv4. @param hidden XORed with the magic number, as all but kAlternate are.
  StunMessage& add_address(std::uint16_t attribute, const SocketAddress& address, bool hidden = true) {
    const auto& four = reinterpret_cast<const sockaddr_in&>(address.bytes);
    std::array<std::uint8_t, 8> value{0, 1};
    std::memcpy(&value[2], &four.sin_port, 2);
    std::memcpy(&value[4], &four.sin_addr, 4);
    static constexpr std::array<std::uint8_t, 6> kMagic{0x21, 0x12, 0x21, 0x12, 0xA4, 0x42};
    for (std::size_t i = 0; hidden && i < kMagic.size(); ++i) value[2 + i] ^= kMagic[i];
    return add(attribute, value);
  }
  /// Last: MESSAGE-INTEGRITY with long-term credentials (RFC 5389, 15.4).
  StunMessage& sign(const std::string& user, const std::string& realm, const std::string& password) {
    const std::string text = user + ":" + realm + ":" + password;
    std::array<std::uint8_t, 16> key{};
    (void)EVP_Digest(text.data(), text.size(), key.data(), nullptr, EVP_md5(), nullptr);
    set_length(bytes.size() - kHeader + 24);
    std::array<std::uint8_t, 20> digest{};
    (void)HMAC(EVP_sha1(), key.data(), static_cast<int>(key.size()), bytes.data(), bytes.size(), digest.data(),
               nullptr);
    return add(kIntegrity, digest);
  }

  StunBytes bytes;

 private:
  [[nodiscard]] std::size_t word(std::size_t at) const {
    return static_cast<std::size_t>(bytes[at] << 8 | bytes[at + 1]);
  }
  void put(std::uint16_t value) {
    bytes.push_back(static_cast<std::uint8_t>(value >> 8));
    bytes.push_back(static_cast<std::uint8_t>(value));
  }
  void set_length(std::size_t length) {
    bytes[2] = static_cast<std::uint8_t>(length >> 8);
    bytes[3] = static_cast<std::uint8_t>(length);
  }
};

class LyingTurn {
 public:
  static constexpr const char *kUser = "knuckle", *kPassword = "relay", *kRealm = "example.org";
  /// What is sent back for a request. @param truth what an honest server would send.
  using Lie = std::function<std::vector<StunBytes>(const StunMessage& request, const StunBytes& truth)>;

  LyingTurn() {
    thread_ = std::thread([this] {
      while (!ending_) step();
    });
  }
  ~LyingTurn() {
    ending_ = true;
    thread_.join();
  }
  LyingTurn(const LyingTurn&) = delete;
  LyingTurn& operator=(const LyingTurn&) = delete;

  [[nodiscard]] SocketAddress address() const { return local_address(socket_.descriptor()); }
  /// From now on; {}: the truth, except that nothing is relayed.
  void tell(Lie lie) {
    const std::lock_guard lock(mutex_);
    lie_ = std::move(lie);
  }
  /// Requests so far.
  [[nodiscard]] int asked() const { return asked_; }

  static StunMessage refusal(const StunMessage& request, int code, const std::string& realm, const std::string& nonce) {
    return request.answer(StunMessage::kError)
        .add_error(code)
        .add(StunMessage::kRealm, realm)
        .add(StunMessage::kNonce, nonce);
  }
  static StunMessage grant(const StunMessage& request, const SocketAddress& relayed, const SocketAddress& mapped,
                           std::uint8_t lifetime_s) {
    StunMessage made = request.answer(StunMessage::kSuccess);
    if (request.method() == StunMessage::kAllocate)
      made.add_address(StunMessage::kRelayed, relayed).add_address(StunMessage::kMapped, mapped);
    if (request.method() <= StunMessage::kRefresh) made.add_lifetime(lifetime_s);
    return made.sign(kUser, kRealm, kPassword);
  }

 private:
  void step() {
    pollfd waiting{socket_.descriptor(), POLLIN, 0};
    (void)::poll(&waiting, 1, 20);
    std::array<std::uint8_t, 2048> bytes;
    SocketAddress from;
    while (const auto arrival = socket_.receive(bytes, from)) {
      const auto request = StunMessage::request(std::span(bytes).first(std::min(arrival->size, bytes.size())));
      if (!request) continue;
      ++asked_;
      const bool shows_itself = request->has(StunMessage::kUsername);
      const StunMessage truth =
          shows_itself ? grant(*request, address_of_relay(), from, 200) : refusal(*request, 401, kRealm, "nonce");
      const std::lock_guard lock(mutex_);
      for (const StunBytes& one : lie_ ? lie_(*request, truth.bytes) : std::vector<StunBytes>{truth.bytes})
        (void)socket_.send(one, from);
    }
  }
  [[nodiscard]] SocketAddress address_of_relay() const { return local_address(relay_.descriptor()); }
  static UdpSocket bound() {
    return UdpSocket(open_udp_socket("turn", parse_address("127.0.0.1:0"), ::bind, "listen on"));
  }

  UdpSocket socket_ = bound(), relay_ = bound();
  std::mutex mutex_;
  Lie lie_;
  std::atomic<int> asked_{0};
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

struct NamedTurnLie {
  std::string name;
  LyingTurn::Lie lie;
  bool grants = false;  ///< The ends get an address of a relay.
};
/// @param elsewhere whose address is given for the relay's. @param self the server's own.
inline std::vector<NamedTurnLie> turn_lies(const SocketAddress& elsewhere, const SocketAddress& self) {
  using All = std::vector<StunBytes>;
  const auto random = std::make_shared<std::mt19937_64>(7);
  const auto below = [random](std::size_t n) { return static_cast<std::size_t>((*random)() % n); };
  const auto shows_itself = [](const StunMessage& request) { return request.has(StunMessage::kUsername); };
  const auto earlier = std::make_shared<All>();
  return {
      {"stalls", [](const StunMessage&, const StunBytes&) { return All{}; }},
      {"garbage",
       [below](const StunMessage& request, const StunBytes&) {
         StunBytes junk(1 + below(1400));
         for (auto& byte : junk) byte = static_cast<std::uint8_t>(below(256));
         StunBytes known = request.answer(StunMessage::kSuccess).bytes;  // of this transaction, and then junk
         known.insert(known.end(), junk.begin(), junk.end());
         return All{{}, junk, known};
       }},
      {"oversize",
       [](const StunMessage& request, const StunBytes& truth) {
         StunMessage large = request.answer(StunMessage::kError).add_error(401);
         large.add(StunMessage::kRealm, std::string(30'000, 'r')).add(StunMessage::kNonce, std::string(30'000, 'n'));
         StunBytes longer = truth;
         longer[2] = longer[3] = 0xFF;
         return All{large.bytes, longer};
       }},
      {"truncated and flipped",
       [below](const StunMessage&, const StunBytes& truth) {
         All all;
         for (int i = 0; i < 20; ++i) {
           StunBytes cut = truth, flipped = truth;
           cut.resize(below(cut.size()));
           flipped[below(flipped.size())] ^= static_cast<std::uint8_t>(1U << below(8));
           all.push_back(cut);
           all.push_back(flipped);
         }
         return all;
       }},
      {"refuses for ever",
       [](const StunMessage& request, const StunBytes&) {
         return All{LyingTurn::refusal(request, 401, LyingTurn::kRealm, "again").bytes};
       }},
      {"another realm each time",
       [below](const StunMessage& request, const StunBytes&) {
         return All{LyingTurn::refusal(request, 401, "realm" + std::to_string(below(1'000'000)), "again").bytes};
       }},
      {"stale nonce for ever",
       [below](const StunMessage& request, const StunBytes&) {
         return All{LyingTurn::refusal(request, 438, LyingTurn::kRealm, std::to_string(below(1'000'000))).bytes};
       }},
      {"sends to itself",
       [self](const StunMessage& request, const StunBytes&) {
         return All{request.answer(StunMessage::kError)
                        .add_error(300)
                        .add_address(StunMessage::kAlternate, self, false)
                        .bytes};
       }},
      {"somebody else's address",
       [elsewhere, shows_itself](const StunMessage& request, const StunBytes& truth) {
         return All{shows_itself(request) ? LyingTurn::grant(request, elsewhere, elsewhere, 200).bytes : truth};
       },
       true},
      {"grants for no time",
       [elsewhere, shows_itself](const StunMessage& request, const StunBytes& truth) {
         return All{shows_itself(request) ? LyingTurn::grant(request, elsewhere, elsewhere, 0).bytes : truth};
       },
       true},
      {"grants, then stalls",
       [shows_itself](const StunMessage& request, const StunBytes& truth) {
         return request.method() == StunMessage::kAllocate ? All{truth} : All{};
       },
       true},
      {"repeats all that it has said",
       [earlier](const StunMessage&, const StunBytes& truth) {
         earlier->push_back(truth);
         if (earlier->size() > 30) earlier->erase(earlier->begin());
         All all = *earlier;
         all.push_back(truth);
         return all;
       },
       true},
  };
}

}  // namespace knuckle::test
