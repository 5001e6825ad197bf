// The machine's side as it is shipped, attacked: by OpenSSL's own client, with records that somebody on the way
// changes, repeats, holds back and cuts, with a recorded session, and with floods. The right key does get in, so that
// the refusals mean something. What each of these is worth: docs/network.md.
#include <gtest/gtest.h>

#include <deque>
#include <random>

#include "tests/attacks/attack_rig.h"
#include "transport/secure/dtls_session.h"

namespace knuckle::test {
namespace {

using namespace std::chrono_literals;

/// What `openssl s_client` says of a handshake.
std::string s_client(const std::string& address, const std::string& options) {
  return run_program("/bin/sh",
                     {"-c", "timeout 5 openssl s_client -connect " + address + " " + options + " < /dev/null 2>&1"})
      .out;
}

bool let_in(const std::string& said) {
  return said.find("New, TLSv1.2, Cipher is ECDHE-ECDSA-AES128-GCM-SHA256") != std::string::npos &&
         said.find("alert") == std::string::npos;
}

/// Options that show this certificate and use its key.
std::string with_key(const std::string& file) {
  return " -cert " + file + " -key " + file;
}

TEST_F(Attacks, OnlyAPairedKeyCompletesTheHandshakeOfAnotherProgramAndOnlyOfThisVersionAndCipher) {
  const std::string address = free_address(), desk = with_key(path("desk/key.pem"));
  const auto machine = slave("run", address);
  ASSERT_TRUE(eventually([&] { return let_in(s_client(address, "-dtls1_2" + desk)); }, 20s))
      << "the right key: otherwise the refusals mean nothing";
  for (const std::string& options :
       {std::string("-dtls1_2"), "-dtls1_2" + with_key(path("foreign/key.pem")),
        "-dtls1_2" + with_key(path("revoked/key.pem")), "-dtls1_2" + with_key(path("expired/key.pem")),
        "-dtls1 -cipher DEFAULT:@SECLEVEL=0" + desk, "-dtls1_2 -cipher ECDHE-ECDSA-CHACHA20-POLY1305" + desk,
        "-dtls1_2 -cipher ECDHE-ECDSA-AES256-SHA384" + desk, "-dtls1_2 -cipher NULL:@SECLEVEL=0" + desk,
        "-dtls1_2 -curves secp384r1" + desk})
    EXPECT_FALSE(let_in(s_client(address, options))) << options;
  (void)end(*machine, "run");
  for (const char* why : {"showed no certificate", "is not paired", "was revoked", "has expired"})
    EXPECT_TRUE(says(said_, why));
  EXPECT_EQ(driving_frames("run"), 0);
}

TEST_F(Attacks, RecordsThatAreChangedCutRepeatedOrLateMoveNothingAndStopNothingAlsoAtAMachineThatIsStartedAnew) {
  const std::string address = free_address();
  const auto machine = slave("run", address);
  Middle middle(address);
  const auto op = hand(middle.address());
  ASSERT_TRUE(follows(*op));
  const std::vector<Bytes> recorded = middle.seen();

  std::mt19937_64 random(7);
  const auto below = [&random](std::size_t n) { return static_cast<std::size_t>(random() % n); };
  const auto flipped = [&](Bytes one) {
    one[below(one.size())] ^= static_cast<std::uint8_t>(1U << below(8));
    return one;
  };
  const auto cut = [&](Bytes one) {
    one.resize(below(one.size()));
    return one;
  };
  const auto longer = [&](Bytes one) {
    one.resize(one.size() + 1 + below(900), 0x17);
    return one;
  };
  std::deque<Bytes> earlier;
  middle.set([&](const Bytes& one) {
    // Every tenth is lost; each that arrives has a crowd of false ones around it, and copies of old ones behind it.
    earlier.push_back(one);
    if (earlier.size() > 200) earlier.pop_front();
    std::vector<Bytes> out{flipped(one), cut(one), {}, longer(one)};
    if (below(10) != 0) out.push_back(one);
    out.push_back(earlier[below(earlier.size())]);
    return out;
  });
  EXPECT_TRUE(follows(*op)) << "with false, doubled and old records around each";

  std::vector<Bytes> held;
  middle.set([&held](const Bytes& one) {
    held.push_back(one);
    if (held.size() < 4) return std::vector<Bytes>{};
    std::vector<Bytes> out(held.rbegin(), held.rend());
    held.clear();
    return out;
  });
  EXPECT_TRUE(follows(*op)) << "four at a time, the newest first";

  middle.set([&](const Bytes& one) { return std::vector<Bytes>{flipped(one)}; });
  EXPECT_TRUE(eventually([&] { return !op->sees(Mode::kEngaged); })) << "nothing authentic: as a cut link";
  middle.set({});
  EXPECT_TRUE(follows(*op)) << "led again, by the hand that engages again";
  const auto json = end(*machine, "run");
  EXPECT_EQ(json.at("malformed_datagrams"), 0) << "what is not authentic never reached the messages";
  EXPECT_GT(driving_frames("run"), 0);

  const auto anew = slave("anew", address);
  ASSERT_TRUE(eventually([&] { return let_in(s_client(address, "-dtls1_2" + with_key(path("desk/key.pem")))); }, 20s));
  const UdpSocket thief = any_socket();
  for (int times = 0; times < 2; ++times) {
    for (const Bytes& one : recorded) {
      (void)thief.send(one, parse_address(address));
      std::this_thread::sleep_for(200us);
    }
  }
  const auto result = end(*anew, "anew");
  EXPECT_EQ(driving_frames("anew"), 0);
  EXPECT_EQ(result.at("malformed_datagrams"), 0);
  for (const auto& mode : result.at("modes")) {
    EXPECT_NE(mode.at("mode"), "aligning");
    EXPECT_NE(mode.at("mode"), "engaged");
  }
}

/// Strangers who begin handshakes and do not end them.
class Strangers {
 public:
  explicit Strangers(const std::string& address) : target_(parse_address(address)) {
    for (int i = 0; i < 50; ++i) sockets_.push_back(any_socket());
    Outbox out;
    secure::DtlsSession session(context_);
    (void)session.start(out);
    hello_ = out.datagrams.at(0);
  }
  /// A hello without a cookie, each from another address. @return whether an answer to one has come back.
  bool hello() {
    const UdpSocket& socket = sockets_[next_++ % sockets_.size()];
    (void)socket.send(hello_, target_);
    return answered(socket);
  }
  /// Up to where the machine's side has made its keys; then nothing more.
  void stall() {
    const UdpSocket& socket = sockets_[next_++ % sockets_.size()];
    while (answered(socket)) {
    }
    Outbox out;
    secure::DtlsSession session(context_);
    (void)session.start(out);
    for (int flight = 0; flight < 2; ++flight) {
      for (const Bytes& one : std::exchange(out.datagrams, {})) (void)socket.send(one, target_);
      std::array<std::uint8_t, 2048> bytes;
      SocketAddress from;
      pollfd waiting{socket.descriptor(), POLLIN, 0};
      (void)::poll(&waiting, 1, 50);
      if (const auto arrival = socket.receive(bytes, from); arrival && flight == 0)
        (void)session.hear(std::span(bytes).first(arrival->size), out);
    }
  }

 private:
  struct Outbox final : secure::DtlsSession::Out {
    std::vector<Bytes> datagrams;
    void put(std::span<const std::uint8_t> bytes) override { datagrams.emplace_back(bytes.begin(), bytes.end()); }
  };
  static bool answered(const UdpSocket& socket) {
    std::array<std::uint8_t, 2048> bytes;
    SocketAddress from;
    return socket.receive(bytes, from).has_value();
  }
  const secure::DtlsContext context_{secure::make_identity("stranger"), {}, secure::Role::kOperator};
  const SocketAddress target_;
  std::vector<UdpSocket> sockets_;
  Bytes hello_;
  std::size_t next_ = 0;
};

TEST_F(Attacks, FloodsCostNeitherMemoryNorLinesNorTheSession) {
  const std::string address = free_address();
  const auto machine = slave("run", address);
  const auto op = hand(address);
  ASSERT_TRUE(follows(*op));
  const std::size_t before_kB = status_of(machine->pid(), "VmRSS");
  const SocketAddress target = parse_address(address);
  Strangers strangers(address);
  const Bytes tagged(100, 0xD0);
  int answers = 0;
  std::vector<UdpSocket> attackers;
  for (int i = 0; i < 50; ++i) attackers.push_back(any_socket());
  for (int i = 0; i < 20'000; ++i) {
    const UdpSocket& from = attackers[static_cast<std::size_t>(i % 50)];
    if (strangers.hello()) ++answers;
    (void)from.send(tagged, target);
    (void)from.send({}, target);
    if (i % 10 == 9) std::this_thread::sleep_for(1ms);  // 10 000 hellos a second
  }
  EXPECT_GT(answers, 100) << "hellos that nobody takes for any prove nothing";
  for (int i = 0; i < 200; ++i) strangers.stall();
  EXPECT_TRUE(op->sees(Mode::kEngaged) || follows(*op));
  EXPECT_LT(status_of(machine->pid(), "VmRSS"), before_kB + 4096);
  (void)end(*machine, "run");
  EXPECT_LT(lines_of(said_), 100) << said_;
}

/// Flooded and not, in one run: what a flood costs the machine's loop.
class DeepAttacks : public Attacks {
 protected:
  struct Cost {
    double overruns = 0, wake_p99_us = 0, faults = 0;
  };
  /// Ten seconds of a machine that is led, while `attack` is called again and again by a thread of its own.
  Cost ten_seconds(const std::string& name, const std::function<void(const SocketAddress&)>& attack) {
    const std::string address = free_address();
    const auto machine = slave(name, address);
    const auto op = hand(address);
    EXPECT_TRUE(follows(*op)) << name;
    std::atomic<bool> over{false};
    std::thread attacker([&] {
      while (attack && !over) attack(parse_address(address));
    });
    std::this_thread::sleep_for(10s);
    over = true;
    attacker.join();
    const auto json = end(*machine, name);
    const auto& loop = json.at("realtime").at("slave");
    const Cost cost{loop.at("overruns"), loop.at("wake_us").at("p99"), static_cast<double>(json.at("faults").size())};
    fmt::print("| {} | {} | {:.0f} | {} | {} |\n", name, cost.overruns, cost.wake_p99_us, cost.faults, lines_of(said_));
    return cost;
  }
};

TEST_F(DeepAttacks, FloodsCostNoDeadline) {
  fmt::print("| | overruns of the machine's loop | wake p99, us | faults | lines on standard error |\n");
  const Cost quiet = ten_seconds("no flood", {});
  std::vector<UdpSocket> from;
  for (int i = 0; i < 50; ++i) from.push_back(any_socket());
  const Bytes tagged(300, 0xD0);
  std::size_t next = 0;
  std::unique_ptr<Strangers> strangers;
  const auto of = [&](const SocketAddress& target) -> Strangers& {
    if (!strangers) strangers = std::make_unique<Strangers>(text(target));
    return *strangers;
  };
  const Cost hellos = ten_seconds("10 000 hellos a second", [&](const SocketAddress& target) {
    for (int i = 0; i < 10; ++i) (void)of(target).hello();
    std::this_thread::sleep_for(1ms);
  });
  strangers.reset();
  const Cost stalled = ten_seconds("handshakes that stop after the cookie, as many as there can be",
                                   [&](const SocketAddress& target) { of(target).stall(); });
  const Cost plain = ten_seconds("junk as fast as it can be sent", [&](const SocketAddress& target) {
    (void)from[next++ % from.size()].send(tagged, target);
  });
  for (const Cost& cost : {hellos, stalled, plain}) {
    EXPECT_LE(cost.overruns, quiet.overruns);
    EXPECT_LE(cost.faults, quiet.faults);
  }
}

}  // namespace
}  // namespace knuckle::test
