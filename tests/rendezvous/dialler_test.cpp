// Whole paths on this computer: two ends, a rendezvous, and whoever else is in the room.
#include "transport/ice/dialler.h"

#include <gtest/gtest.h>
#include <poll.h>

#include <atomic>
#include <optional>
#include <thread>

#include "core/error.h"
#include "tests/rendezvous/running_rendezvous.h"
#include "tests/rendezvous/two_ends.h"
#include "tests/rendezvous/wire_client.h"

namespace knuckle::ice {
namespace {

using namespace std::chrono_literals;

constexpr int kTries = test::TwoEnds::kTries;

class PathsOnThisComputer : public testing::Test {
 protected:
  void begin_machine() { ends_.begin_machine(rendezvous_->address()); }
  void begin_desk() { ends_.begin_desk(rendezvous_->address()); }
  /// The desk, sooner or later.
  [[nodiscard]] bool says(const std::string& problem) const {
    const auto is_said = [&] { return ends_.desk->problem().find(problem) != std::string::npos; };
    for (int i = 0; i < kTries && !is_said(); ++i) std::this_thread::sleep_for(100ms);
    return is_said();
  }

  std::optional<test::RunningRendezvous> rendezvous_{std::in_place};
  test::TwoEnds ends_;
};

TEST_F(PathsOnThisComputer, AreFoundInWhicheverOrderTheEndsCome) {
  begin_desk();
  begin_machine();
  EXPECT_TRUE(ends_.carries());
  for (int i = 0; i < kTries && ends_.desk->pairs().empty(); ++i) std::this_thread::sleep_for(100ms);
  ASSERT_FALSE(ends_.desk->pairs().empty());
  EXPECT_EQ(ends_.desk->pairs().front().pair.kind, PathKind::kHost);
  EXPECT_EQ(ends_.desk->pairs().front().far_end, "machine");
  EXPECT_GT(ends_.desk->round_trips().count(), 0u);
  EXPECT_EQ(ends_.desk->problem(), "");
}

TEST_F(PathsOnThisComputer, ComeBackAfterTheFarEndHasRestarted) {
  begin_machine();
  begin_desk();
  ASSERT_TRUE(ends_.carries());
  begin_machine();
  EXPECT_TRUE(ends_.carries());
}

TEST_F(PathsOnThisComputer, CarryOnWithoutTheRendezvousAndFindItAgain) {
  begin_machine();
  begin_desk();
  ASSERT_TRUE(ends_.carries());
  const std::string address = rendezvous_->address();
  rendezvous_.reset();
  std::this_thread::sleep_for(300ms);
  EXPECT_TRUE(ends_.carries(20));
  rendezvous_.emplace(address);
  begin_machine();  // needs signals again
  EXPECT_TRUE(ends_.carries());
}

TEST_F(PathsOnThisComputer, AreFoundBesideSomebodyWhoForgesRepeatsAndTalksNonsense) {
  const std::string room = room_of(ends_.desk_identity.fingerprint(), ends_.machine_identity.fingerprint());
  test::WireClient liar(parse_address(rendezvous_->address()));
  liar.say("join " + room);
  const secure::Identity stranger = secure::make_identity("desk");
  const Signer signer(stranger);
  Conversation forged(signer, ends_.machine_identity.fingerprint());
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
  EXPECT_TRUE(ends_.carries());
  for (int i = 0; i < 5; ++i) {
    std::this_thread::sleep_for(100ms);
    EXPECT_TRUE(ends_.carries(20));
  }
  ending = true;
  lying.join();
  EXPECT_FALSE(liar.ended());  // it stayed within the rendezvous's bounds: all of it was passed on
}

TEST_F(PathsOnThisComputer, AreNotFoundToAnEndThatIsNotPairedHere) {
  begin_desk();
  const secure::Identity other = secure::make_identity("other");
  ends_.begin_machine_paired_with(other, rendezvous_->address());
  EXPECT_FALSE(ends_.carries(10));
  EXPECT_TRUE(says("machine is not at the rendezvous")) << ends_.desk->problem();
}

TEST_F(PathsOnThisComputer, EndWhenAPairingIsRevokedAtEitherEndAndComeBackWithIt) {
  begin_machine();
  begin_desk();
  ASSERT_TRUE(ends_.carries());
  for (auto* end : {&ends_.machine, &ends_.desk}) {
    const secure::Peer far = end == &ends_.machine ? secure::Peer{ends_.desk_identity.fingerprint(), "desk"}
                                                   : secure::Peer{ends_.machine_identity.fingerprint(), "machine"};
    secure::Peer revoked = far;
    revoked.revoked = true;
    (*end)->set_peers({revoked});
    bool ended = false;
    for (int i = 0; i < kTries && !ended; ++i) ended = !ends_.carries(1);
    EXPECT_TRUE(ended);
    EXPECT_FALSE(ends_.carries(10));
    (*end)->set_peers({far});
    EXPECT_TRUE(ends_.carries());
  }
}

TEST_F(PathsOnThisComputer, SayWhereTheRendezvousCannotBeReached) {
  const std::string address = rendezvous_->address();
  rendezvous_.reset();
  ends_.begin_desk(address);
  EXPECT_TRUE(says("rendezvous " + address + ": ")) << ends_.desk->problem();
}

TEST(Dialling, RefusesAnAddressWithoutAPort) {
  const secure::Identity identity = secure::make_identity("desk");
  EXPECT_THROW(Dialler({"rendezvous.example.org", {}, secure::Role::kOperator}, identity, {}), InputError);
}

}  // namespace
}  // namespace knuckle::ice
