// Whole paths on this computer: two ends and a rendezvous.
#include "transport/ice/dialler.h"

#include <gtest/gtest.h>

#include <optional>
#include <thread>

#include "tests/rendezvous/running_rendezvous.h"
#include "tests/rendezvous/two_ends.h"

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

}  // namespace
}  // namespace knuckle::ice
