#include "transport/ice/signal.h"

#include <netinet/in.h>
#include <openssl/evp.h>
#include <openssl/rand.h>
#include <openssl/x509.h>

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <string_view>

#include "transport/bytes.h"

namespace knuckle::ice {

namespace {

constexpr std::uint32_t kMagic = 0x31494E4B;                   // "KNI1"
constexpr std::string_view kPurpose = "knuckle ICE signal 1";  // a signature of this key for nothing else fits
constexpr std::size_t kMostFoundation = 32, kLeastUser = 4, kLeastPassword = 22, kMostCredential = 64;
constexpr std::size_t kMostCertificate = 1024, kMostSignature = 80;
constexpr std::uint8_t kFour = 4, kSix = 6;

void must(bool ok, const char* what) {
  if (!ok) throw std::runtime_error(std::string("OpenSSL: ") + what + " failed");
}

struct ContextDeleter {
  void operator()(EVP_MD_CTX* context) const noexcept { EVP_MD_CTX_free(context); }
};
using Context = std::unique_ptr<EVP_MD_CTX, ContextDeleter>;

bool is_ice_text(std::string_view text, std::size_t least, std::size_t most) {
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '+' || c == '/';
  };
  return text.size() >= least && text.size() <= most && std::all_of(text.begin(), text.end(), allowed);
}

/// One host that packets can be sent to: nothing that would reach many, or nobody.
bool is_host(const SocketAddress& address) {
  if (address.size == 0 || address.port() == 0 || address.is_any()) return false;
  if (address.bytes.ss_family == AF_INET) {
    const auto& four = reinterpret_cast<const sockaddr_in&>(address.bytes);
    return ntohl(four.sin_addr.s_addr) >> 28 < 14;  // 224.0.0.0 and above: multicast, reserved, broadcast
  }
  if (address.bytes.ss_family != AF_INET6) return false;
  const auto& six = reinterpret_cast<const sockaddr_in6&>(address.bytes).sin6_addr;
  return !IN6_IS_ADDR_MULTICAST(&six) && !IN6_IS_ADDR_LINKLOCAL(&six) && !IN6_IS_ADDR_V4MAPPED(&six);
}

bool usable(const Candidate& c) {
  return is_host(c.address) && c.priority > 0 && c.kind < Candidate::Kind::kCount &&
         is_ice_text(c.foundation, 1, kMostFoundation);
}

/// A signal's or a signed message's bytes, in the order of the wire.
class Writer {
 public:
  template <std::integral T>
  void put(T value) {
    std::array<std::uint8_t, sizeof(T)> some{};
    ByteWriter(some).put(value);
    put_all(some);
  }
  void put_all(std::span<const std::uint8_t> some) { bytes.insert(bytes.end(), some.begin(), some.end()); }
  void put_text(std::string_view text) {
    put(static_cast<std::uint8_t>(text.size()));
    bytes.insert(bytes.end(), text.begin(), text.end());
  }
  void put_block(std::span<const std::uint8_t> block) {
    put(static_cast<std::uint16_t>(block.size()));
    put_all(block);
  }
  Bytes bytes;
};

class Reader {
 public:
  explicit Reader(std::span<const std::uint8_t> in) : in_(in) {}
  template <std::integral T>
  T get() {
    return ByteReader(take(sizeof(T))).get<T>();
  }
  template <std::size_t N>
  void get(std::array<std::uint8_t, N>& out) {
    const auto taken = take(N);
    if (taken.size() == N) std::copy(taken.begin(), taken.end(), out.begin());
  }
  bool flag() {
    const auto value = get<std::uint8_t>();
    ok_ = ok_ && value <= 1;
    return value == 1;
  }
  std::string text() {
    const auto taken = take(get<std::uint8_t>());
    return {taken.begin(), taken.end()};
  }
  std::span<const std::uint8_t> block(std::size_t most) {
    const auto size = get<std::uint16_t>();
    ok_ = ok_ && size > 0 && size <= most;
    return take(ok_ ? size : 0);
  }
  /// All is read, and nothing was missing.
  [[nodiscard]] bool finished() const { return ok_ && in_.empty(); }

 private:
  std::span<const std::uint8_t> take(std::size_t count) {
    ok_ = ok_ && count <= in_.size();
    if (!ok_) return {};
    const auto taken = in_.first(count);
    in_ = in_.subspan(count);
    return taken;
  }
  std::span<const std::uint8_t> in_;
  bool ok_ = true;
};

void put(Writer& out, const Candidate& c) {
  out.put(static_cast<std::uint8_t>(c.kind));
  out.put(c.priority);
  out.put_text(c.foundation);
  const bool four = c.address.bytes.ss_family == AF_INET;
  out.put(four ? kFour : kSix);
  out.put(c.address.port());
  const auto* host =
      four ? reinterpret_cast<const std::uint8_t*>(&reinterpret_cast<const sockaddr_in&>(c.address.bytes).sin_addr)
           : reinterpret_cast<const std::uint8_t*>(&reinterpret_cast<const sockaddr_in6&>(c.address.bytes).sin6_addr);
  out.put_all({host, four ? sizeof(in_addr) : sizeof(in6_addr)});
}

SocketAddress get_address(Reader& in) {
  SocketAddress address;
  const auto family = in.get<std::uint8_t>();
  const auto port = in.get<std::uint16_t>();
  if (family == kFour) {
    std::array<std::uint8_t, sizeof(in_addr)> host{};
    in.get(host);
    auto& four = reinterpret_cast<sockaddr_in&>(address.bytes);
    four.sin_family = AF_INET;
    four.sin_port = htons(port);
    std::memcpy(&four.sin_addr, host.data(), host.size());
    address.size = sizeof four;
  } else if (family == kSix) {
    std::array<std::uint8_t, sizeof(in6_addr)> host{};
    in.get(host);
    auto& six = reinterpret_cast<sockaddr_in6&>(address.bytes);
    six.sin6_family = AF_INET6;
    six.sin6_port = htons(port);
    std::memcpy(&six.sin6_addr, host.data(), host.size());
    address.size = sizeof six;
  }
  return address;
}

}  // namespace

Nonce random_nonce() {
  Nonce nonce;
  must(RAND_bytes(nonce.data(), static_cast<int>(nonce.size())) == 1, "random number");
  return nonce;
}

Bytes encode(const Signal& s) {
  Writer out;
  out.put(kMagic);
  out.put(static_cast<std::uint8_t>(s.kind));
  out.put_all(s.to.bytes);
  out.put_all(s.session);
  out.put_all(s.challenge);
  out.put_all(s.echo);
  out.put(s.counter);
  if (s.kind != Signal::Kind::kOffer && s.kind != Signal::Kind::kAnswer) return std::move(out.bytes);
  out.put(s.attempt);
  out.put(static_cast<std::uint8_t>(s.direct_only));
  out.put(static_cast<std::uint8_t>(s.complete));
  out.put_text(s.user);
  out.put_text(s.password);
  std::vector<const Candidate*> kept;
  for (const Candidate& one : s.candidates)
    if (usable(one) && kept.size() < kMostCandidates) kept.push_back(&one);
  out.put(static_cast<std::uint8_t>(kept.size()));
  for (const Candidate* one : kept) put(out, *one);
  return std::move(out.bytes);
}

std::optional<Signal> decode(std::span<const std::uint8_t> bytes) {
  Reader in(bytes);
  Signal s;
  const bool known = in.get<std::uint32_t>() == kMagic;
  s.kind = static_cast<Signal::Kind>(in.get<std::uint8_t>());
  if (!known || s.kind >= Signal::Kind::kCount) return std::nullopt;
  in.get(s.to.bytes);
  in.get(s.session);
  in.get(s.challenge);
  in.get(s.echo);
  s.counter = in.get<std::uint64_t>();
  if (s.kind == Signal::Kind::kOffer || s.kind == Signal::Kind::kAnswer) {
    s.attempt = in.get<std::uint32_t>();
    s.direct_only = in.flag();
    s.complete = in.flag();
    s.user = in.text();
    s.password = in.text();
    const std::size_t count = in.get<std::uint8_t>();
    if (count > kMostCandidates || !is_ice_text(s.user, kLeastUser, kMostCredential) ||
        !is_ice_text(s.password, kLeastPassword, kMostCredential))
      return std::nullopt;
    for (std::size_t i = 0; i < count; ++i) {
      Candidate& one = s.candidates.emplace_back();
      one.kind = static_cast<Candidate::Kind>(in.get<std::uint8_t>());
      one.priority = in.get<std::uint32_t>();
      one.foundation = in.text();
      one.address = get_address(in);
      if (!usable(one)) return std::nullopt;
    }
  }
  if (!in.finished()) return std::nullopt;
  return s;
}

Signer::Signer(const secure::Identity& identity) : key_(identity.key.get()), fingerprint_(identity.fingerprint()) {
  EVP_PKEY_up_ref(key_.get());
  const int size = i2d_X509(identity.certificate.get(), nullptr);
  must(size > 0 && static_cast<std::size_t>(size) <= kMostCertificate, "encoding a certificate");
  certificate_.resize(static_cast<std::size_t>(size));
  std::uint8_t* at = certificate_.data();
  i2d_X509(identity.certificate.get(), &at);
}

Bytes Signer::sign(std::span<const std::uint8_t> message) const {
  const Context context(EVP_MD_CTX_new());
  std::array<std::uint8_t, kMostSignature> signature{};
  std::size_t size = signature.size();
  must(context && EVP_DigestSignInit(context.get(), nullptr, EVP_sha256(), nullptr, key_.get()) == 1 &&
           EVP_DigestSignUpdate(context.get(), kPurpose.data(), kPurpose.size()) == 1 &&
           EVP_DigestSignUpdate(context.get(), message.data(), message.size()) == 1 &&
           EVP_DigestSignFinal(context.get(), signature.data(), &size) == 1,
       "signing");
  Writer out;
  out.put_block(message);
  out.put_block(certificate_);
  out.put_block(std::span(signature).first(size));
  return std::move(out.bytes);
}

std::optional<std::span<const std::uint8_t>> verified(std::span<const std::uint8_t> bytes,
                                                      const secure::Fingerprint& by) {
  if (bytes.size() > kMostSignal) return std::nullopt;
  Reader in(bytes);
  const auto message = in.block(kMostSignal);
  const auto certificate = in.block(kMostCertificate);
  const auto signature = in.block(kMostSignature);
  if (!in.finished()) return std::nullopt;
  // Nothing of a certificate that is not pinned is looked at.
  secure::Fingerprint shown;
  must(EVP_Digest(certificate.data(), certificate.size(), shown.bytes.data(), nullptr, EVP_sha256(), nullptr) == 1,
       "digest");
  if (!(shown == by)) return std::nullopt;
  const std::uint8_t* at = certificate.data();
  const secure::Certificate parsed(d2i_X509(nullptr, &at, static_cast<long>(certificate.size())));
  EVP_PKEY* key = parsed ? X509_get0_pubkey(parsed.get()) : nullptr;
  const Context context(EVP_MD_CTX_new());
  const bool ok = key != nullptr && context &&
                  EVP_DigestVerifyInit(context.get(), nullptr, EVP_sha256(), nullptr, key) == 1 &&
                  EVP_DigestVerifyUpdate(context.get(), kPurpose.data(), kPurpose.size()) == 1 &&
                  EVP_DigestVerifyUpdate(context.get(), message.data(), message.size()) == 1 &&
                  EVP_DigestVerifyFinal(context.get(), signature.data(), signature.size()) == 1;
  if (!ok) return std::nullopt;
  return message;
}

Conversation::Conversation(const Signer& signer, const secure::Fingerprint& far)
    : signer_(signer), far_(far), session_(random_nonce()), challenge_(random_nonce()) {}

Bytes Conversation::say(Signal signal, const Nonce& echo) {
  signal.to = far_;
  signal.session = session_;
  signal.challenge = challenge_;
  signal.echo = echo;
  signal.counter = ++counter_;
  return signer_.sign(encode(signal));
}

Conversation::Heard Conversation::hear(std::span<const std::uint8_t> bytes, bool open_to_others) {
  const auto message = verified(bytes, far_);
  auto signal = message ? decode(*message) : std::nullopt;
  if (!signal || !(signal->to == signer_.fingerprint())) return {};
  Heard heard{Verdict::kFresh, false, std::move(*signal)};
  if (far_session_ == heard.signal.session) {
    if (heard.signal.counter <= far_counter_) return {};
  } else if (heard.signal.echo == challenge_ && far_session_ && !open_to_others) {
    heard.verdict = Verdict::kOther;
    return heard;
  } else if (heard.signal.echo == challenge_) {
    heard.new_session = true;
    far_session_ = heard.signal.session;
    challenge_ = random_nonce();  // what echoes the old one and comes later was kept by somebody
  } else {
    heard.verdict = Verdict::kUnproven;
    return heard;
  }
  far_counter_ = heard.signal.counter;
  far_challenge_ = heard.signal.challenge;
  return heard;
}

}  // namespace knuckle::ice
