// Whole paths on this computer: two ends, a rendezvous, and whoever else is in the room.
#include "transport/ice/dialler.h"

#include <gtest/gtest.h>
#include <poll.h>

#include <atomic>
#include <optional>
#include <thread>

#include "core/error.h"
#include "tests/rendezvous/running_rendezvous.h"
#include "tests/rendezvous/wire_client.h"

namespace knuckle::ice {
namespace {

using namespace std::chrono_literals;

constexpr int kTries = 600;  // of 100 ms: reached only where nothing comes at all

UdpSocket bound() {
  return UdpSocket(open_udp_socket("test", parse_address("127.0.0.1:0"), ::bind, "listen on"));
}

class PathsOnThisComputer : public testing::Test {
 protected:
  void begin_machine() {
    machine_.reset();
    machine_.emplace(DialSetup{rendezvous_->address(), {}, secure::Role::kMachine}, machine_identity_,
                     secure::Peers{{desk_identity_.fingerprint(), "desk", false}});
    machine_->start(local_address(machine_link_.descriptor()));
  }
  void begin_desk() {
    desk_.emplace(DialSetup{rendezvous_->address(), {}, secure::Role::kOperator}, desk_identity_,
                  secure::Peers{{machine_identity_.fingerprint(), "machine", false}});
    desk_link_ = UdpSocket(open_udp_socket("test", parse_address(desk_->address()), ::connect, "reach"));
    desk_->start(local_address(desk_link_.descriptor()));
  }
  /// From desk to machine and back, tried again and again.
  [[nodiscard]] bool carries(int tries = kTries) {
    for (int i = 0; i < tries; ++i) {
      const std::uint8_t mark = ++mark_;
      const std::array<std::uint8_t, 3> sent{0xFF, mark, 7};
      (void)desk_link_.send(sent, {});
      for (int turn = 0; turn < 10; ++turn) {
        echo();
        pollfd waiting{desk_link_.descriptor(), POLLIN, 0};
        (void)::poll(&waiting, 1, 10);
        std::array<std::uint8_t, 64> bytes{};
        SocketAddress from;
        const auto arrival = desk_link_.receive(bytes, from);
        if (arrival && arrival->size == sent.size() && std::equal(sent.begin(), sent.end(), bytes.begin())) return true;
      }
    }
    return false;
  }
  void echo() {
    std::array<std::uint8_t, 64> bytes{};
    SocketAddress from;
    while (const auto arrival = machine_link_.receive(bytes, from))
      (void)machine_link_.send(std::span(bytes).first(arrival->size), from);
  }

  std::optional<test::RunningRendezvous> rendezvous_{std::in_place};
  const secure::Identity desk_identity_ = secure::make_identity("desk"),
                         machine_identity_ = secure::make_identity("machine");
  UdpSocket machine_link_ = bound(), desk_link_;
  std::optional<Dialler> machine_, desk_;
  std::uint8_t mark_ = 0;
};

TEST_F(PathsOnThisComputer, AreFoundInWhicheverOrderTheEndsCome) {
  begin_desk();
  begin_machine();
  EXPECT_TRUE(carries());
  for (int i = 0; i < kTries && desk_->pairs().empty(); ++i) std::this_thread::sleep_for(100ms);
  ASSERT_FALSE(desk_->pairs().empty());
  EXPECT_EQ(desk_->pairs().front().pair.kind, PathKind::kHost);
  EXPECT_EQ(desk_->pairs().front().far_end, "machine");
  EXPECT_GT(desk_->round_trips().count(), 0u);
  EXPECT_EQ(desk_->problem(), "");
}

TEST_F(PathsOnThisComputer, ComeBackAfterTheFarEndHasRestarted) {
  begin_machine();
  begin_desk();
  ASSERT_TRUE(carries());
  begin_machine();
  EXPECT_TRUE(carries());
}

TEST_F(PathsOnThisComputer, CarryOnWithoutTheRendezvousAndFindItAgain) {
  begin_machine();
  begin_desk();
  ASSERT_TRUE(carries());
  const std::string address = rendezvous_->address();
  rendezvous_.reset();
  std::this_thread::sleep_for(300ms);
  EXPECT_TRUE(carries(20));
  rendezvous_.emplace(address);
  begin_machine();  // needs signals again
  EXPECT_TRUE(carries());
}

TEST_F(PathsOnThisComputer, AreFoundBesideSomebodyWhoForgesRepeatsAndTalksNonsense) {
  const std::string room = room_of(desk_identity_.fingerprint(), machine_identity_.fingerprint());
  test::WireClient liar(parse_address(rendezvous_->address()));
  liar.say("join " + room);
  const secure::Identity stranger = secure::make_identity("desk");
  const Signer signer(stranger);
  Conversation forged(signer, machine_identity_.fingerprint());
  begin_machine();
  begin_desk();
  std::atomic<bool> ending{false};
  std::thread lying([&] {
    std::size_t read = 0;
    for (int i = 0; !ending; ++i) {
      Signal offer;
      offer.kind = Signal::Kind::kOffer;
      offer.attempt = static_cast<std::uint32_t>(i);
      offer.user = "abcd";
      offer.password = std::string(22, 'p');
      liar.say("send " + room + " " + base64(forged.say(offer)));
      liar.say("send " + room + " QUJD");
      // What it hears, once more to all.
      const std::string heard = liar.heard();
      const auto at = heard.find("message ", read);
      const auto end = heard.find('\n', at);
      if (at != std::string::npos && end != std::string::npos) {
        liar.say("send " + heard.substr(at + 8, end - at - 8));
        read = end;
      }
      std::this_thread::sleep_for(200ms);
    }
  });
  EXPECT_TRUE(carries());
  for (int i = 0; i < 5; ++i) {
    std::this_thread::sleep_for(100ms);
    EXPECT_TRUE(carries(20));
  }
  ending = true;
  lying.join();
  EXPECT_FALSE(liar.ended());  // it stayed within the rendezvous's bounds: all of it was passed on
}

TEST_F(PathsOnThisComputer, AreNotFoundToAnEndThatIsNotPairedHere) {
  begin_desk();
  const secure::Identity other = secure::make_identity("other");
  machine_.emplace(DialSetup{rendezvous_->address(), {}, secure::Role::kMachine}, machine_identity_,
                   secure::Peers{{other.fingerprint(), "other", false}});
  machine_->start(local_address(machine_link_.descriptor()));
  EXPECT_FALSE(carries(10));
  EXPECT_NE(desk_->problem().find("machine is not at the rendezvous"), std::string::npos) << desk_->problem();
}

TEST_F(PathsOnThisComputer, EndWhenAPairingIsRevokedAtEitherEndAndComeBackWithIt) {
  begin_machine();
  begin_desk();
  ASSERT_TRUE(carries());
  for (auto* end : {&machine_, &desk_}) {
    const secure::Peer far = end == &machine_ ? secure::Peer{desk_identity_.fingerprint(), "desk"}
                                              : secure::Peer{machine_identity_.fingerprint(), "machine"};
    secure::Peer revoked = far;
    revoked.revoked = true;
    (*end)->set_peers({revoked});
    bool ended = false;
    for (int i = 0; i < kTries && !ended; ++i) ended = !carries(1);
    EXPECT_TRUE(ended);
    EXPECT_FALSE(carries(10));
    (*end)->set_peers({far});
    EXPECT_TRUE(carries());
  }
}

TEST_F(PathsOnThisComputer, SayWhereTheRendezvousCannotBeReached) {
  const std::string address = rendezvous_->address();
  rendezvous_.reset();
  desk_.emplace(DialSetup{address, {}, secure::Role::kOperator}, desk_identity_,
                secure::Peers{{machine_identity_.fingerprint(), "machine", false}});
  desk_link_ = bound();
  desk_->start(local_address(desk_link_.descriptor()));
  for (int i = 0; i < kTries && desk_->problem().find("rendezvous " + address + ": ") == std::string::npos; ++i)
    std::this_thread::sleep_for(100ms);
  EXPECT_NE(desk_->problem().find("rendezvous " + address + ": "), std::string::npos) << desk_->problem();
}

TEST(Dialling, RefusesAnAddressWithoutAPort) {
  const secure::Identity identity = secure::make_identity("desk");
  EXPECT_THROW(Dialler({"rendezvous.example.org", {}, secure::Role::kOperator}, identity, {}), InputError);
}

}  // namespace
}  // namespace knuckle::ice
