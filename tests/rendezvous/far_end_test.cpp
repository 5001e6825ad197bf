// One end of a path against a far end in the test's hand, which says what the test wants.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <thread>

#include "tests/rendezvous/running_rendezvous.h"
#include "tests/rendezvous/two_ends.h"
#include "tests/rendezvous/wire_client.h"
#include "transport/ice/dialler.h"
#include "transport/ice/rendezvous_line.h"

namespace knuckle::ice {
namespace {

using namespace std::chrono_literals;

constexpr int kPatience = 6000;  // of 10 ms: reached only where nothing comes at all

/// At the rendezvous with a key that is paired, but without ICE.
class FarEnd {
 public:
  FarEnd(const std::string& rendezvous, const secure::Identity& self, const secure::Fingerprint& other)
      : client_(parse_address(rendezvous)),
        signer_(self),
        conversation_(signer_, other),
        room_(room_of(other, self.fingerprint())) {
    client_.say("join " + room_);
  }
  void say(Signal signal) { send(conversation_.say(std::move(signal))); }
  /// The next that counts. A hello is answered, so that what comes after it counts.
  [[nodiscard]] std::optional<Signal> next() {
    for (int i = 0; i < kPatience; ++i) {
      while (const auto line = next_line()) {
        const auto notice = parse_notice(*line);
        const auto bytes = notice && notice->verb == "message" ? bytes_of_base64(notice->rest) : std::nullopt;
        if (!bytes) continue;
        const auto heard = conversation_.hear(*bytes);
        if (heard.verdict == Conversation::Verdict::kUnproven) send(conversation_.answer(heard.signal));
        if (heard.verdict == Conversation::Verdict::kFresh) return heard.signal;
      }
      std::this_thread::sleep_for(10ms);
    }
    return std::nullopt;
  }
  [[nodiscard]] bool hears(const std::string& what) {
    for (int i = 0; i < kPatience && !client_.says(what); ++i) std::this_thread::sleep_for(10ms);
    return client_.says(what);
  }
  [[nodiscard]] std::size_t messages() { return count("message "); }
  [[nodiscard]] std::size_t entered() { return count("entered "); }
  [[nodiscard]] const std::string& room() const { return room_; }

 private:
  [[nodiscard]] std::size_t count(const std::string& what) {
    std::size_t found = 0;
    const std::string heard = client_.heard();
    for (auto at = heard.find(what); at != std::string::npos; at = heard.find(what, at + 1)) ++found;
    return found;
  }
  void send(const Bytes& bytes) { client_.say("send " + room_ + " " + base64(bytes)); }
  [[nodiscard]] std::optional<std::string> next_line() {
    const std::string heard = client_.heard();
    const auto end = heard.find('\n', read_);
    if (end == std::string::npos) return std::nullopt;
    const std::string line = heard.substr(read_, end - read_);
    read_ = end + 1;
    return line;
  }

  test::WireClient client_;
  Signer signer_;
  Conversation conversation_;
  const std::string room_;
  std::size_t read_ = 0;
};

class OneEnd : public testing::Test {
 protected:
  void begin(secure::Role role, const Servers& servers = {}) { begin(role, servers, {peer(far_identity_)}); }
  void begin(secure::Role role, const Servers& servers, const secure::Peers& peers) {
    here_.emplace(DialSetup{rendezvous_.address(), servers, role}, identity_, peers);
    here_->start(local_address(link_.descriptor()));
  }
  static secure::Peer peer(const secure::Identity& identity) { return {identity.fingerprint(), identity.name}; }
  FarEnd far_end() { return far_end(far_identity_); }
  FarEnd far_end(const secure::Identity& identity) {
    return {rendezvous_.address(), identity, identity_.fingerprint()};
  }

  test::RunningRendezvous rendezvous_;
  const secure::Identity identity_ = secure::make_identity("here"), far_identity_ = secure::make_identity("far end");
  UdpSocket link_ = test::bound_socket();
  std::optional<Dialler> here_;
};

TEST_F(OneEnd, IsAtTheRendezvousForThoseWhoAreAdmittedAndFollowsTheirChanges) {
  const secure::Identity other = secure::make_identity("other"), newcomer = secure::make_identity("newcomer");
  secure::Peer revoked = peer(far_identity_), expired = peer(other);
  revoked.revoked = true;
  expired.expires_utc = "2001-01-01T00:00:00Z";
  const secure::Identity friendly = secure::make_identity("friend");
  FarEnd one = far_end(), two = far_end(other), three = far_end(newcomer), admitted = far_end(friendly);
  for (FarEnd* each : {&one, &two, &three, &admitted}) ASSERT_TRUE(each->hears("joined"));
  begin(secure::Role::kMachine, {}, {revoked, expired, peer(friendly)});
  ASSERT_TRUE(admitted.hears("message"));  // rooms are joined in the pairings' order: it was the last
  for (FarEnd* each : {&one, &two, &three}) EXPECT_EQ(each->entered(), 0u);
  revoked.revoked = false;
  expired.expires_utc = "9999-01-01T00:00:00Z";
  here_->set_peers({revoked, expired, peer(newcomer)});
  for (FarEnd* each : {&one, &two, &three}) EXPECT_TRUE(each->hears("message"));
  EXPECT_EQ(admitted.entered(), 1u);
}

TEST_F(OneEnd, OffersAnewWhenTheNetworkChangesDuringAnAttempt) {
  begin(secure::Role::kOperator);
  FarEnd machine = far_end();
  std::optional<Signal> signal;
  do signal = machine.next();
  while (signal && signal->kind != Signal::Kind::kOffer);
  ASSERT_TRUE(signal);
  const std::uint32_t first = signal->attempt;
  Signal again;
  again.kind = Signal::Kind::kAgain;
  machine.say(again);
  do signal = machine.next();
  while (signal && signal->attempt <= first);
  ASSERT_TRUE(signal);
  for (const PathEvent& event : here_->take_events())
    EXPECT_NE(event.kind, PathEvent::Kind::kFailed) << "the first was awaited: it has the addresses of before";
}

TEST_F(OneEnd, AsksTheTurnServerForItsAddressWhereThePathIsToBeWithoutRelay) {
  const UdpSocket turn = test::bound_socket();
  Servers servers;
  servers.turn = HostAndPort{"127.0.0.1", local_address(turn.descriptor()).port()};
  servers.turn_user = "user";
  servers.turn_password = "password";
  begin(secure::Role::kMachine, servers);
  FarEnd desk = far_end();
  ASSERT_TRUE(desk.next());
  Signal offer;
  offer.kind = Signal::Kind::kOffer;
  offer.attempt = 1;
  offer.direct_only = true;
  offer.user = "abcd";
  offer.password = std::string(22, 'p');
  desk.say(offer);
  std::array<std::uint8_t, 512> bytes{};
  SocketAddress from;
  std::optional<UdpSocket::Arrival> question;
  pollfd waiting{turn.descriptor(), POLLIN, 0};
  if (::poll(&waiting, 1, 60'000) == 1) question = turn.receive(bytes, from);
  ASSERT_TRUE(question) << "a TURN server knows the address outside a NAT, too";
  EXPECT_EQ(bytes[0], 0);
  EXPECT_EQ(bytes[1], 1) << "STUN's Binding (RFC 8489), not TURN's Allocate";
}

TEST_F(OneEnd, SaysLittleToWhoComesAndGoesInItsRoom) {
  using Clock = std::chrono::steady_clock;
  const auto began = Clock::now();
  begin(secure::Role::kMachine);
  FarEnd desk = far_end();
  ASSERT_TRUE(desk.hears("message "));
  for (int i = 0; i < 40; ++i) {
    test::WireClient guest(parse_address(rendezvous_.address()));
    guest.say("join " + desk.room());
    for (int turn = 0; turn < kPatience && !guest.says("joined"); ++turn) std::this_thread::sleep_for(1ms);
  }
  std::this_thread::sleep_for(100ms);
  const auto count = desk.messages();
  EXPECT_LE(count, 2 + static_cast<std::size_t>((Clock::now() - began) / 200ms));
}

TEST_F(OneEnd, LeavesItsConnectionToNoProgramThatIsStartedMeanwhile) {
  begin(secure::Role::kMachine);
  FarEnd desk = far_end();
  ASSERT_TRUE(desk.next());
  const SocketAddress there = parse_address(rendezvous_.address());
  int left = 0, connections = 0;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    const int descriptor = std::stoi(entry.path().filename());
    SocketAddress peer;
    peer.size = sizeof peer.bytes;
    if (::getpeername(descriptor, peer.get(), &peer.size) != 0 || !(peer == there)) continue;
    ++connections;
    left += (::fcntl(descriptor, F_GETFD) & FD_CLOEXEC) != 0 ? 0 : 1;
  }
  EXPECT_GE(connections, 2);  // the test's own is one
  EXPECT_EQ(left, 0);
}

}  // namespace
}  // namespace knuckle::ice
