// Ends that hold a handshake back, share a key, fall silent, or stand on the way: who leads the machine all the same.
#include <gtest/gtest.h>
#include <openssl/evp.h>
#include <openssl/x509.h>

#include "tests/transport/secure/secure_rig.h"
#include "transport/link_inbox.h"
#include "transport/udp_socket.h"

namespace knuckle::secure {
namespace {

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

using HostileEndsThreads = SecureLinkThreads;

TEST_F(HostileEndsThreads, WhoIsRevokedWhileItsHandshakeIsHeldBackIsNotLetIn) {
  OwnClient held(desk_identity(), address());
  ASSERT_TRUE(until([&] {
    held.step(true);
    machine.step(9);
    return held.keeps();
  }));
  run(40, [&] { held.step(true); });  // the machine has read its certificate
  change_peers_now({peer(desk_identity(), true)});
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
  ASSERT_TRUE(talk(first));
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
  ASSERT_TRUE(talk(first, 1));
  End second = desk(desk_identity());
  ASSERT_TRUE(talk(second, 2)) << "the first one's loop stands still";
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

TEST_F(HostileEndsThreads, AnOperatorWhoseCertificateExpiresIsCutOffAndItsPicturesEnd) {
  Identity brief = make_identity("desk 3");
  X509_time_adj_ex(X509_getm_notAfter(brief.certificate.get()), 0, 4, nullptr);
  ASSERT_GT(X509_sign(brief.certificate.get(), brief.key.get(), EVP_sha256()), 0);
  change_peers_now({peer(brief)});
  End op = desk(brief);
  std::optional<VideoSecret> secret;
  ASSERT_TRUE(talk_until(op, 1, [&] { return machine.heard == 1 && machine.link->take(secret); }));
  ASSERT_TRUE(secret);
  ASSERT_TRUE(talk_until(op, 1, [&] { return machine.count(LinkEvent::Kind::kCutOff) == 1; }));
  EXPECT_TRUE(talk_until(op, 1, [&] { return machine.link->take(secret); }));
  EXPECT_FALSE(secret) << "nothing is left to seal pictures with";
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

/// Somebody between the two, through whom everything passes.
class OnTheWay {
 public:
  explicit OnTheWay(const std::string& site) : site_(parse_address(site)) {}
  [[nodiscard]] std::string address() const { return text(local_address(in_.descriptor())); }
  /// @param seen each datagram of the desk's, before it goes on.
  void pass(const std::function<void(std::span<const std::uint8_t>)>& seen) {
    std::array<std::uint8_t, 2048> bytes;
    SocketAddress from;
    while (const auto arrival = in_.receive(bytes, from)) {
      desk_ = from;
      const auto datagram = std::span(bytes).first(arrival->size);
      seen(datagram);
      send_on(datagram);
    }
    while (const auto arrival = out_.receive(bytes, from)) (void)in_.send(std::span(bytes).first(arrival->size), desk_);
  }
  void send_on(std::span<const std::uint8_t> datagram) const { (void)out_.send(datagram, site_); }
  [[nodiscard]] const SocketAddress& site() const { return site_; }
  [[nodiscard]] const SocketAddress& desk() const { return desk_; }

 private:
  const UdpSocket in_ = SecureLinkThreads::bound_socket(), out_ = SecureLinkThreads::bound_socket();
  const SocketAddress site_;
  SocketAddress desk_;
};

TEST_F(HostileEndsThreads, WhoSendsCopiesAheadAndPassesTheQuestionOnGetsNeitherTheSessionNorItsWords) {
  const UdpSocket thief = bound_socket();
  OnTheWay way(address());
  End op{SecureLink::connect(way.address(), desk_identity(), {peer(machine_identity())})};
  bool steals = false;
  const auto both = [&] {
    op.step(1);
    way.pass([&](std::span<const std::uint8_t> datagram) {
      if (steals && datagram[0] >= kTagMark) (void)thief.send(datagram, way.site());
    });
    machine.step(9);
    (void)machine.link->send(Bytes(200, 9));
    std::array<std::uint8_t, 2048> bytes;
    SocketAddress from;
    while (const auto arrival = thief.receive(bytes, from)) {
      EXPECT_LT(arrival->size, 100U) << "a question, not the machine's words";
      (void)thief.send(std::span(bytes).first(arrival->size), from == way.site() ? way.desk() : way.site());
    }
    return machine.heard == 1 && op.heard == 9;
  };
  ASSERT_TRUE(until(both));
  steals = true;
  run(200, both);
  EXPECT_EQ(machine.count(LinkEvent::Kind::kMoved), 0);
  EXPECT_EQ(op.count(LinkEvent::Kind::kMoved), 0);
}

TEST_F(HostileEndsThreads, TimeBehindForgedDatagramsCountsAsAge) {
  // Their tag is the session's: anybody on the way can read it.
  OnTheWay way(address());
  End op{SecureLink::connect(way.address(), desk_identity(), {peer(machine_identity())})};
  Bytes forged;
  const auto pass = [&] {
    way.pass([&](std::span<const std::uint8_t> datagram) {
      if (datagram[0] >= kTagMark) forged.assign(datagram.begin(), datagram.end());
    });
  };
  ASSERT_TRUE(talk_until(op, 1, [&] {
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
  for (int i = 0; i < 100; ++i) way.send_on(forged);
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
  machine.link = listening({.most_observers = 1});
  SecureLinkTiming often;
  often.renew_keys = 200ms;
  End watcher = screen(desk_identity(), often);
  EXPECT_TRUE(talk_until(watcher, 1, [&] { return machine.count(LinkEvent::Kind::kObserves) >= 3; }));
  EXPECT_EQ(machine.count(LinkEvent::Kind::kRefused), 0);
}

}  // namespace
}  // namespace knuckle::secure
