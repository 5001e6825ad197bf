// Ends that hold a handshake back, share a key, fall silent, or stand on the way: who leads the machine all the same.
#include <gtest/gtest.h>
#include <openssl/evp.h>
#include <openssl/x509.h>

#include <mutex>
#include <optional>

#include "tests/transport/secure/secure_rig.h"
#include "transport/link_inbox.h"
#include "transport/udp_socket.h"

namespace knuckle::secure {
namespace {

/// The datagrams of a handshake.
struct Outbox final : DtlsSession::Out {
  std::vector<Bytes> datagrams;
  void put(std::span<const std::uint8_t> bytes) override { datagrams.emplace_back(bytes.begin(), bytes.end()); }
};

/// A program of one's own, that is none of ours: it handshakes, but only sends what it is told to.
class OwnClient {
 public:
  OwnClient(const Identity& identity, const std::string& to, Purpose purpose = Purpose::kControl)
      : context_(identity, {peer(machine_identity())}, Role::kOperator, purpose),
        session_(context_),
        socket_(open_udp_socket("", parse_address(to), ::connect, "reach")) {
    (void)session_.start(out_);
  }
  /// @param keep_last what ends the handshake is not sent yet.
  void step(bool keep_last = false) {
    std::array<std::uint8_t, 2048> bytes;
    SocketAddress from;
    while (const auto arrival = socket_.receive(bytes, from)) {
      if (bytes[0] < kObserverTagMark) progress_ = session_.hear(std::span(bytes).first(arrival->size), out_);
    }
    for (const Bytes& datagram : std::exchange(out_.datagrams, {})) {
      for (std::size_t at = 0; at + 13 <= datagram.size();) {
        const std::size_t size = 13U + (static_cast<std::size_t>(datagram[at + 11]) << 8U) + datagram[at + 12];
        const Bytes record(datagram.begin() + static_cast<std::ptrdiff_t>(at),
                           datagram.begin() + static_cast<std::ptrdiff_t>(at + size));
        const bool last = record[0] == 20 || (record[0] == 22 && record[4] == 1);
        (keep_last && last ? kept_ : to_send_).push_back(record);
        at += size;
      }
    }
    if (!keep_last) std::move(kept_.begin(), kept_.end(), std::back_inserter(to_send_)), kept_.clear();
    for (const Bytes& record : std::exchange(to_send_, {})) (void)socket_.send(record, {});
  }
  void say(std::uint8_t value) {
    Sealed sealed;
    if (session_.seal(Inner::kMessage, Bytes{value}, sealed)) (void)socket_.send(sealed.view(), {});
  }
  [[nodiscard]] bool done() const { return progress_ == DtlsSession::Progress::kDone; }
  [[nodiscard]] bool keeps() const { return !kept_.empty(); }

 private:
  DtlsContext context_;
  DtlsSession session_;
  UdpSocket socket_;
  Outbox out_;
  std::vector<Bytes> kept_, to_send_;
  DtlsSession::Progress progress_ = DtlsSession::Progress::kUnderWay;
};

/// A machine whose owner may change its mind about peers.
struct HostileEndsThreads : ::testing::Test {
  std::mutex mutex;
  std::optional<Peers> newer;
  SecureLinkAccess access{.newer_peers = [this] {
    const std::lock_guard lock(mutex);
    return std::exchange(newer, std::nullopt);
  }};
  End machine{SecureLink::listen("127.0.0.1:0", machine_identity(), desks(), {}, access)};

  [[nodiscard]] std::string address() const { return "127.0.0.1:" + std::to_string(machine.link->port()); }
  [[nodiscard]] End desk(const Identity& identity, const SecureLinkTiming& timing = {}) const {
    return {SecureLink::connect(address(), identity, {peer(machine_identity())}, timing)};
  }
  void change_peers(Peers peers) {
    {
      const std::lock_guard lock(mutex);
      newer = std::move(peers);
    }
    EXPECT_TRUE(until([this] {
      machine.step(9);
      const std::lock_guard lock(mutex);
      return !newer.has_value();
    }));
  }
  /// For so many steps of 5 ms.
  void run(int steps, const std::function<void()>& each) {
    for (int i = 0; i < steps; ++i) {
      each();
      machine.step(9);
      ::poll(nullptr, 0, 5);
    }
  }
};

TEST_F(HostileEndsThreads, WhoIsRevokedWhileItsHandshakeIsHeldBackIsNotLetIn) {
  OwnClient held(desk_identity(), address());
  ASSERT_TRUE(until([&] {
    held.step(true);
    machine.step(9);
    return held.keeps();
  }));
  run(40, [&] { held.step(true); });  // the machine has read its certificate
  change_peers({peer(desk_identity(), true)});
  run(60, [&] { held.step(); });
  run(60, [&] { held.say(42); });
  EXPECT_EQ(machine.messages, 0);
  EXPECT_EQ(machine.count(LinkEvent::Kind::kConnected), 0);
  ASSERT_GE(machine.count(LinkEvent::Kind::kRefused), 1);
}

TEST_F(HostileEndsThreads, WhoHadControlIsNotHeardOnceAnotherHasItAlsoWhereThatOneIsSilent) {
  SecureLinkTiming stubborn;
  stubborn.silence = 60s;  // goes on with its session whatever happens
  End first = desk(desk_identity(), stubborn);
  ASSERT_TRUE(until([&] {
    first.step(1);
    machine.step(9);
    return machine.heard == 1;
  }));
  run(230, [] {});  // silent for more than a second
  OwnClient second(other_identity(), address());
  ASSERT_TRUE(until([&] {
    second.step();
    machine.step(9);
    return second.done();
  }));
  run(40, [] {});
  const int before = machine.messages;
  run(100, [&] { first.step(1); });
  EXPECT_EQ(machine.messages, before);
}

TEST_F(HostileEndsThreads, AnotherProgramWithTheSameKeyIsAnotherOperator) {
  End first = desk(desk_identity());
  ASSERT_TRUE(until([&] {
    first.step(1);
    machine.step(9);
    return machine.heard == 1;
  }));
  End second = desk(desk_identity());
  ASSERT_TRUE(until([&] {  // the first one's loop stands still
    second.step(2);
    machine.step(9);
    return machine.heard == 2;
  }));
  EXPECT_EQ(machine.count(LinkEvent::Kind::kConnected), 2);
  EXPECT_EQ(machine.count(LinkEvent::Kind::kRenewed), 0);
  bool mixed = false;
  run(60, [&] {
    (void)first.link->send(Bytes{1});
    second.step(2);
    mixed |= machine.heard == 1;
  });
  EXPECT_FALSE(mixed);
}

/// One whose certificate expires while a test runs.
Identity brief_identity() {
  Identity brief = make_identity("desk 3");
  X509_time_adj_ex(X509_getm_notAfter(brief.certificate.get()), 0, 4, nullptr);
  EXPECT_GT(X509_sign(brief.certificate.get(), brief.key.get(), EVP_sha256()), 0);
  return brief;
}

TEST_F(HostileEndsThreads, PicturesEndWithTheOperatorsCertificate) {
  const Identity brief = brief_identity();
  change_peers({peer(brief)});
  End op = desk(brief);
  std::optional<VideoSecret> secret;
  ASSERT_TRUE(until([&] {
    op.step(1);
    machine.step(9);
    return machine.heard == 1 && machine.link->take(secret);
  }));
  ASSERT_TRUE(secret);
  ASSERT_TRUE(until([&] {
    op.step(1);
    machine.step(9);
    return machine.link->take(secret);
  }));
  EXPECT_FALSE(secret) << "nothing is left to seal pictures with";
}

TEST_F(HostileEndsThreads, AnOperatorWhoseCertificateExpiresIsCutOff) {
  const Identity brief = brief_identity();
  change_peers({peer(brief)});
  End op = desk(brief);
  ASSERT_TRUE(until([&] {
    op.step(1);
    machine.step(9);
    return machine.heard == 1;
  }));
  ASSERT_TRUE(until([&] {
    op.step(1);
    machine.step(9);
    return machine.count(LinkEvent::Kind::kCutOff) == 1;
  }));
  const int before = machine.messages;
  run(60, [&] { op.step(1); });
  EXPECT_EQ(machine.messages, before);
}

TEST_F(HostileEndsThreads, HandshakesThatDoNotGoOnKeepNobodyOut) {
  // Sixteen and more from four addresses, each with a valid cookie, begun anew all the time.
  std::vector<std::unique_ptr<OwnClient>> stalled;
  const auto stall = [&](int i) {
    auto client = std::make_unique<OwnClient>(make_identity("stranger"), address());
    for (int step = 0; step < 10; ++step) {
      client->step(true);
      ::poll(nullptr, 0, 1);
    }
    if (stalled.size() < 20)
      stalled.push_back(std::move(client));
    else
      stalled[static_cast<std::size_t>(i) % 20] = std::move(client);
  };
  for (int i = 0; i < 20; ++i) stall(i);
  End op = desk(desk_identity());
  int i = 20;
  EXPECT_TRUE(until([&] {
    if (i < 40) stall(i++);
    op.step(1);
    machine.step(9);
    return machine.heard == 1;
  }));
}

TEST_F(HostileEndsThreads, WhoPassesTheQuestionOnDoesNotGetTheSession) {
  // Between the two: everything passes, and copies are sent ahead from an address of the thief's own.
  const auto bound = [] { return UdpSocket(open_udp_socket("", parse_address("127.0.0.1:0"), ::bind, "listen on")); };
  const UdpSocket in = bound(), out = bound(), thief = bound();
  const SocketAddress site = parse_address(address());
  End op{SecureLink::connect("127.0.0.1:" + std::to_string(local_address(in.descriptor()).port()), desk_identity(),
                             {peer(machine_identity())})};
  SocketAddress desk_address;
  bool steals = false;
  const auto pass = [&] {
    std::array<std::uint8_t, 2048> bytes;
    SocketAddress from;
    while (const auto arrival = in.receive(bytes, from)) {
      desk_address = from;
      const auto datagram = std::span(bytes).first(arrival->size);
      if (steals && bytes[0] >= kTagMark) (void)thief.send(datagram, site);
      (void)out.send(datagram, site);
    }
    while (const auto arrival = out.receive(bytes, from))
      (void)in.send(std::span(bytes).first(arrival->size), desk_address);
    while (const auto arrival = thief.receive(bytes, from))
      (void)thief.send(std::span(bytes).first(arrival->size), from == site ? desk_address : site);
  };
  ASSERT_TRUE(until([&] {
    op.step(1);
    pass();
    machine.step(9);
    pass();
    return machine.heard == 1 && op.heard == 9;
  }));
  steals = true;
  run(200, [&] {
    op.step(1);
    pass();
  });
  EXPECT_EQ(machine.count(LinkEvent::Kind::kMoved), 0);
  EXPECT_EQ(op.count(LinkEvent::Kind::kMoved), 0);
}

TEST_F(HostileEndsThreads, TimeBehindForgedDatagramsCountsAsAge) {
  // Their tag is the session's: anybody on the way can read it.
  const UdpSocket in(open_udp_socket("", parse_address("127.0.0.1:0"), ::bind, "listen on")),
      out(open_udp_socket("", parse_address("127.0.0.1:0"), ::bind, "listen on"));
  const SocketAddress site = parse_address(address());
  End op{SecureLink::connect("127.0.0.1:" + std::to_string(local_address(in.descriptor()).port()), desk_identity(),
                             {peer(machine_identity())})};
  SocketAddress desk_address;
  Bytes forged;
  const auto pass = [&] {
    std::array<std::uint8_t, 2048> bytes;
    SocketAddress from;
    while (const auto arrival = in.receive(bytes, from)) {
      desk_address = from;
      const auto datagram = std::span(bytes).first(arrival->size);
      if (bytes[0] >= kTagMark) forged.assign(datagram.begin(), datagram.end());
      (void)out.send(datagram, site);
    }
    while (const auto arrival = out.receive(bytes, from))
      (void)in.send(std::span(bytes).first(arrival->size), desk_address);
  };
  ASSERT_TRUE(until([&] {
    op.step(1);
    pass();
    machine.step(9);
    pass();
    return machine.heard == 1 && !forged.empty();
  }));
  LinkInbox inbox(*machine.link);
  Datagram datagram;
  Time now{1s};
  const auto read = [&]() -> std::optional<Duration> {
    std::optional<Duration> age;
    inbox.begin_step(now);
    while (inbox.next(datagram)) age = now - inbox.arrival(datagram);
    return age;
  };
  (void)read();
  forged.back() ^= 1U;
  for (int i = 0; i < 100; ++i) (void)out.send(forged, site);
  (void)op.link->send(Bytes{5});
  pass();
  std::optional<Duration> age;
  int steps = 0;
  for (; !age && steps < 20; ++steps) {
    ::poll(nullptr, 0, 25);
    now += 25ms;
    age = read();
  }
  ASSERT_TRUE(age);
  ASSERT_GT(steps, 1) << "the forged ones are read a bounded number at a time";
  EXPECT_EQ(datagram.bytes[0], 5);
  EXPECT_LE(*age, datagram.waited);
  EXPECT_GE(*age, std::min<Duration>(datagram.waited, (steps - 1) * 25ms));
}

TEST_F(HostileEndsThreads, AnObserverThatRenewsItsKeysKeepsItsPlace) {
  End site{SecureLink::listen("127.0.0.1:0", machine_identity(), desks(), {}, {.most_observers = 1})};
  SecureLinkTiming often;
  often.renew_keys = 200ms;
  End screen{SecureLink::connect("127.0.0.1:" + std::to_string(site.link->port()), desk_identity(),
                                 {peer(machine_identity())}, often, {.purpose = Purpose::kObserve})};
  ASSERT_TRUE(until([&] {
    screen.step(1);
    site.step(9);
    return site.count(LinkEvent::Kind::kObserves) >= 3;
  }));
  EXPECT_EQ(site.count(LinkEvent::Kind::kRefused), 0);
}

}  // namespace
}  // namespace knuckle::secure
