// Pairings that change while a link dials, from the file to the rendezvous.
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "app/pairing/chosen_link.h"
#include "tests/rendezvous/running_rendezvous.h"
#include "tests/rendezvous/wire_client.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::pairing {
namespace {

using namespace std::chrono_literals;

class DialledLink : public testing::Test {
 protected:
  DialledLink() {
    (void)folder_.make("here");
    options_.keys = folder_.path();
    options_.dial.rendezvous = rendezvous_.address();
  }
  void pair(const secure::Identity& other) {
    folder_.change_peers([&](secure::Peers& peers) {
      peers.push_back({other.fingerprint(), other.name, false, false, other.expires_utc()});
    });
  }
  void revoke(const std::string& name) {
    folder_.change_peers([&](secure::Peers& peers) {
      for (secure::Peer& one : peers) one.revoked = one.revoked || one.name == name;
    });
  }
  [[nodiscard]] std::string join(const secure::Identity& other) const {
    return "join " + ice::room_of(other.fingerprint(), folder_.identity().fingerprint());
  }
  [[nodiscard]] static bool hears(test::WireClient& client, const std::string& what) {
    for (int i = 0; i < 3000 && !client.says(what); ++i) std::this_thread::sleep_for(10ms);
    return client.says(what);
  }

  const test::TemporaryFolder temporary_;
  const KeyFolder folder_{(temporary_.path() / "keys").string()};
  test::RunningRendezvous rendezvous_;
  LinkOptions options_;
  const secure::Identity first_ = secure::make_identity("first"), second_ = secure::make_identity("second");
};

TEST_F(DialledLink, MeetsWhoIsPairedWhileItRunsAndNoMoreWhoIsRevoked) {
  pair(first_);
  const ChosenLink link = ChosenLink::listen(options_);
  {
    test::WireClient second(parse_address(rendezvous_.address()));
    second.say(join(second_));
    ASSERT_TRUE(hears(second, "joined"));
    pair(second_);
    EXPECT_TRUE(hears(second, "message ")) << "newly paired";
  }
  revoke("second");
  for (int i = 0; i < 3000; ++i) {
    test::WireClient again(parse_address(rendezvous_.address()));
    again.say(join(second_));
    ASSERT_TRUE(hears(again, "joined"));
    if (again.says(" 0\n")) return;  // nobody else is there
    std::this_thread::sleep_for(100ms);
  }
  FAIL() << "a revoked end still meets it";
}

TEST_F(DialledLink, OfTheOperatorsSideFollowsTheChosenFarEndAlone) {
  pair(first_);
  options_.dial.peer = "first";
  const ChosenLink link = ChosenLink::connect(options_);
  test::WireClient second(parse_address(rendezvous_.address()));
  second.say(join(second_));
  ASSERT_TRUE(hears(second, "joined"));
  pair(second_);
  revoke("first");
  const auto revoked = [&] { return link.problem().find("pairing was revoked") != std::string::npos; };
  for (int i = 0; i < 3000 && !revoked(); ++i) std::this_thread::sleep_for(10ms);
  EXPECT_TRUE(revoked()) << link.problem();
  EXPECT_FALSE(second.says("entered"));
  EXPECT_TRUE(those_of(second_.fingerprint(), {{first_.fingerprint(), "first"}}).empty());
}

}  // namespace
}  // namespace knuckle::pairing
