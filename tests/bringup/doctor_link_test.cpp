// `knuckle doctor --connect`: each way in which a handshake fails, against ends that really listen.
#include <gtest/gtest.h>
#include <openssl/evp.h>
#include <openssl/x509.h>
#include <sys/stat.h>

#include <atomic>
#include <thread>

#include "app/bringup/doctor_command.h"
#include "app/pairing/key_folder.h"
#include "app/pairing/pairing_exchange.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"
#include "transport/secure/secure_link.h"
#include "transport/udp_link.h"

namespace knuckle::bringup {
namespace {

using knuckle::test::says;
using secure::Identity;
using secure::Peer;
using secure::SecureLink;

const Identity& machine() {
  static const Identity identity = secure::make_identity("site arm");
  return identity;
}
Peer peer(const Identity& identity, bool revoked = false) {
  return {identity.fingerprint(), identity.name, revoked, false, identity.expires_utc()};
}

/// A machine's side whose loop runs, until the end of the test.
class Machine {
 public:
  Machine(const Identity& identity, secure::Peers peers)
      : link_(SecureLink::listen("127.0.0.1:0", identity, std::move(peers))), loop_([this] { run(); }) {}
  ~Machine() {
    ending_ = true;
    loop_.join();
  }
  Machine(const Machine&) = delete;
  Machine& operator=(const Machine&) = delete;
  [[nodiscard]] std::string address() const { return "127.0.0.1:" + std::to_string(link_->port()); }
  [[nodiscard]] int connected() const { return connected_; }
  [[nodiscard]] int heard() const { return heard_; }

 private:
  void run() {
    Datagram datagram;
    secure::LinkEvent event;
    while (!ending_) {
      while (link_->receive(datagram)) ++heard_;
      while (link_->next(event)) connected_ += event.kind == secure::LinkEvent::Kind::kConnected ? 1 : 0;
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }
  std::unique_ptr<SecureLink> link_;
  std::atomic<bool> ending_{false};
  std::atomic<int> connected_{0}, heard_{0};
  std::thread loop_;
};

struct DoctorLinkThreads : ::testing::Test {
  knuckle::test::TemporaryFolder temporary;
  pairing::KeyFolder folder{temporary.file("keys")};
  Identity desk = folder.make("desk 1");

  void pair_with(const Peer& one) {
    folder.change_peers([&](secure::Peers& peers) { peers.push_back(one); });
  }
  /// All findings, a line each.
  std::string doctor(const std::string& address, std::chrono::milliseconds patience = std::chrono::milliseconds(4000)) {
    std::string text;
    for (const Finding& one : doctor_link({address, folder.path(), patience}, [] { return true; }))
      text += std::string(name(one.level)) + " " + one.about + ": " + one.text + "\n";
    return text;
  }
  /// Of a machine's side that is there meanwhile.
  std::string doctor_of(const Identity& identity, const secure::Peers& peers) {
    const Machine there(identity, peers);
    return doctor(there.address());
  }
};

TEST_F(DoctorLinkThreads, SaysThatAllIsWellButAnExpiryThatIsNearAndTakesNoControl) {
  Machine there(machine(), {peer(desk)});
  Peer soon = peer(machine());
  soon.expires_utc = secure::make_identity("x", 12).expires_utc();
  pair_with(soon);
  const std::string text = doctor(there.address());
  EXPECT_TRUE(says(text, "ok link " + there.address() + ": handshake succeeded with site arm ("));
  EXPECT_TRUE(says(text, "nobody has control there"));
  EXPECT_TRUE(says(text, "note expiry: site arm's key expires on"));
  EXPECT_FALSE(says(text, "FAULT"));
  EXPECT_EQ(there.connected(), 0);
}

TEST_F(DoctorLinkThreads, NamesWhoHasControl) {
  const Identity other = secure::make_identity("desk 2");
  Machine there(machine(), {peer(desk), peer(other)});
  pair_with(peer(machine()));
  const auto op = SecureLink::connect(there.address(), other, {peer(machine())});
  std::atomic<bool> ending{false};
  std::thread loop([&] {
    const std::array<std::uint8_t, 4> bytes{};
    while (!ending) {
      (void)op->send(bytes);
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  });
  for (int i = 0; i < 12'000 && there.heard() == 0; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  EXPECT_TRUE(says(doctor(there.address()), "note link " + there.address() + ": handshake succeeded with site arm ("));
  EXPECT_TRUE(says(doctor(there.address()), "desk 2 has control there now"));
  EXPECT_EQ(there.connected(), 1);
  ending = true;
  loop.join();
}

TEST_F(DoctorLinkThreads, ExplainsWhatIsWrongHere) {
  EXPECT_TRUE(says(doctor("127.0.0.1:9"), "FAULT pairing: this computer is paired with nobody: knuckle pair"));
  pair_with(peer(machine()));
  EXPECT_TRUE(says(doctor("no such name:5683"), "FAULT link: "));
  ::chmod(folder.key_file().c_str(), 0644);
  EXPECT_TRUE(says(doctor("127.0.0.1:9"), "mode 0644 lets others at the private key"));
  std::filesystem::remove(folder.key_file());
  EXPECT_TRUE(says(doctor("127.0.0.1:9"), "knuckle pair makes this computer's key"));
  pairing::write_private_file(folder.key_file(), secure::make_identity("old", -1).pem(), pairing::Existing::kRefuse);
  EXPECT_TRUE(says(doctor("127.0.0.1:9"), "expired on"));
  const Identity later = secure::make_identity("from tomorrow");
  X509_time_adj_ex(X509_getm_notBefore(later.certificate.get()), 1, 0, nullptr);
  X509_sign(later.certificate.get(), later.key.get(), EVP_sha256());
  pairing::write_private_file(folder.key_file(), later.pem(), pairing::Existing::kReplace);
  EXPECT_TRUE(says(doctor("127.0.0.1:9"), "this computer's clock is behind"));
}

TEST_F(DoctorLinkThreads, ExplainsWhatIsWrongThere) {
  pair_with(peer(machine()));
  EXPECT_TRUE(says(doctor_of(machine(), {}), "the far end does not know this computer"));
  EXPECT_TRUE(says(doctor_of(machine(), {peer(desk, true)}), "the far end has revoked this computer's pairing"));
}

TEST_F(DoctorLinkThreads, ExplainsWhatIsWrongWithTheFarEndsKey) {
  const Identity expired = secure::make_identity("old arm", -1), stranger = secure::make_identity("another arm"),
                 revoked = secure::make_identity("sold arm");
  pair_with({expired.fingerprint(), "old arm", false, false, "2031-01-01T00:00:00Z"});
  pair_with(peer(revoked, true));
  EXPECT_TRUE(says(doctor_of(expired, {peer(desk)}),
                   "the far end's certificate has expired, or one of the two clocks is wrong"));
  const std::string text = doctor_of(stranger, {peer(desk)});
  EXPECT_TRUE(says(text, "the far end is not paired with this computer"));
  EXPECT_TRUE(says(text, "it calls itself another arm"));
  EXPECT_TRUE(says(doctor_of(revoked, {peer(desk)}), "the far end's pairing was revoked here"));
}

/// An end that answers every datagram with the same bytes, or not at all.
class Answering {
 public:
  explicit Answering(std::vector<std::uint8_t> answer) : answer_(std::move(answer)), loop_([this] { run(); }) {}
  ~Answering() {
    ending_ = true;
    loop_.join();
  }
  Answering(const Answering&) = delete;
  Answering& operator=(const Answering&) = delete;
  [[nodiscard]] std::string address() const {
    return "127.0.0.1:" + std::to_string(local_address(socket_.descriptor()).port());
  }

 private:
  void run() {
    std::array<std::uint8_t, 2048> bytes;
    SocketAddress from;
    while (!ending_) {
      while (socket_.receive(bytes, from)) {
        if (!answer_.empty()) (void)socket_.send(answer_, from);
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }
  std::vector<std::uint8_t> answer_;
  UdpSocket socket_{open_udp_socket("", parse_address("127.0.0.1:0"), ::bind, "")};
  std::atomic<bool> ending_{false};
  std::thread loop_;
};

TEST_F(DoctorLinkThreads, TellsAClosedPortFromSilenceAndFromAnotherProtocol) {
  using namespace std::chrono_literals;
  pair_with(peer(machine()));
  std::string closed;
  {
    const Answering silent({});
    closed = silent.address();
    EXPECT_TRUE(says(doctor(silent.address(), 200ms), "no answer: is the program running there"));
  }
  EXPECT_TRUE(says(doctor(closed), "no program listens on this port"));
  const Answering echo({'H', 'T', 'T', 'P'});
  EXPECT_TRUE(says(doctor(echo.address(), 200ms), "something answers there, but not in DTLS"));
  const Answering alert({21, 0xFE, 0xFD, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 2, 45});  // fatal, certificate_expired
  EXPECT_TRUE(
      says(doctor(alert.address()), "this computer's certificate has expired, or one of the two clocks is wrong"));
  const Answering version({21, 0xFE, 0xFD, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 2, 70});  // fatal, protocol_version
  EXPECT_TRUE(says(doctor(version.address()), "no DTLS 1.2 handshake with this version's cipher was possible"));
}

TEST_F(DoctorLinkThreads, TellsKnucklePairFromTheMachinesSide) {
  pair_with(peer(machine()));
  const UdpSocket free(open_udp_socket("", parse_address("127.0.0.1:0"), ::bind, ""));
  const SocketAddress address = parse_address("127.0.0.2:" + std::to_string(local_address(free.descriptor()).port()));
  pairing::PairingExchange listening(secure::Role::kMachine, {address}, machine());
  std::atomic<bool> go_on{true};
  std::string told;
  std::thread pair([&] {
    EXPECT_FALSE(listening.meet([&] { return go_on.load(); },
                                [&](const std::string& why) {
                                  told = why;
                                  go_on = false;
                                }));
  });
  EXPECT_TRUE(
      says(doctor(text(address)), "FAULT link " + text(address) + ": knuckle pair runs there, not knuckle slave"));
  for (int i = 0; i < 12'000 && go_on; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  go_on = false;
  pair.join();
  EXPECT_TRUE(says(told, "another program than knuckle pair asks here"));
}

TEST_F(DoctorLinkThreads, ANameIsWellWhereOneOfItsAddressesIs) {
  Machine there(machine(), {peer(desk)});
  std::string closed;
  {
    const Answering gone({});
    closed = gone.address();
  }
  const std::string unreachable = "255.255.255.255:5683";  // no socket may send there without asking
  const auto findings = [&](const std::vector<std::string>& addresses) {
    std::vector<SocketAddress> all;
    for (const std::string& one : addresses) all.push_back(parse_address(one));
    return try_addresses(all, desk, {peer(machine())}, std::chrono::milliseconds(4000), [] { return true; });
  };
  const Findings well = findings({unreachable, closed, there.address()});
  ASSERT_EQ(well.size(), 3U);
  EXPECT_TRUE(healthy(well));
  EXPECT_EQ(well[0].level, Finding::Level::kNote);
  EXPECT_TRUE(says(well[0].text, "cannot reach 255.255.255.255:5683"));
  EXPECT_EQ(well[1].level, Finding::Level::kNote);
  EXPECT_TRUE(says(well[1].text, "no program listens on this port"));
  EXPECT_EQ(well[2].level, Finding::Level::kOk);
  const Findings none = findings({unreachable, closed});
  ASSERT_EQ(none.size(), 2U);
  EXPECT_EQ(none[0].level, Finding::Level::kFault);
  EXPECT_EQ(none[1].level, Finding::Level::kFault);
}

}  // namespace
}  // namespace knuckle::bringup
