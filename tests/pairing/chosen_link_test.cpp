#include "app/pairing/chosen_link.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <thread>

#include "tests/support/refusal.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"
#include "transport/link_messages.h"

namespace knuckle::pairing {
namespace {

using namespace std::chrono_literals;

TEST(ChosenLink, StrangersAreToldOfOnceHoweverManyKeysAndAddressesTheyUse) {
  const test::TemporaryFolder temporary;
  const KeyFolder folder(temporary.file("keys"));
  const secure::Identity machine = folder.make("machine");
  const secure::Identity desk = secure::make_identity("desk");
  folder.change_peers([&](secure::Peers& peers) {
    peers.push_back({desk.fingerprint(), "desk", false, false, desk.expires_utc()});
  });
  LinkOptions options;
  options.address = "127.0.0.1:0";
  options.keys = folder.path();
  ChosenLink link = ChosenLink::listen(options);
  const std::string address = "127.0.0.1:" + std::to_string(static_cast<secure::SecureLink&>(link.link()).port());

  std::vector<cli::News> news;
  int seen = 0;
  const ChosenLink::Watch watch{[&seen](const secure::LinkEvent&) { ++seen; }, {}, {}};
  for (int stranger = 0; stranger < 5; ++stranger) {
    const auto came = secure::SecureLink::connect(address, secure::make_identity("stranger"),
                                                  {{.fingerprint = machine.fingerprint(), .name = "machine"}});
    for (int tries = 2000; seen == stranger && tries > 0; --tries) {
      for (cli::News& one : link.news(&watch)) news.push_back(std::move(one));
      std::this_thread::sleep_for(5ms);
    }
  }
  EXPECT_GE(seen, 5) << "the audit trail has them all";
  const auto refused = std::count_if(news.begin(), news.end(),
                                     [](const auto& n) { return n.what.find("refused") != std::string::npos; });
  EXPECT_EQ(refused, 1);
}

TEST(ChosenLink, APlainLinkTakesAHostByItsNameAndStaysOnThisComputerUnlessAskedTwice) {
  LinkOptions options;
  options.insecure = 1;
  options.address = "localhost:5683";
  EXPECT_EQ(test::refusal([&] { (void)ChosenLink::connect(options); }), "accepted");
  options.address = "192.0.2.7:5683";
  EXPECT_TRUE(test::begins(test::refusal([&] { (void)ChosenLink::connect(options); }),
                           "--connect 192.0.2.7:5683: --insecure is for this computer's own"));
}

TEST(ChosenLink, NamesBothVersionsWhereTheFarEndsMessagesAreOfAnother) {
  LinkOptions options;
  options.address = "127.0.0.1:0";
  options.insecure = 1;
  ChosenLink machine = ChosenLink::listen(options);
  options.address = machine.where();
  ChosenLink desk = ChosenLink::connect(options);
  Datagram old = encode(MasterMessage{}), datagram;
  old.bytes[2] = 7;
  for (int tries = 200; machine.problem().empty() && tries > 0; --tries) {
    (void)desk.link().send(old.view());
    EXPECT_FALSE(machine.link().receive(datagram)) << "it does not claim this end";
    std::this_thread::sleep_for(5ms);
  }
  EXPECT_EQ(machine.problem(),
            "the far end's messages are of version 7 of the link, this program's of version 11: both sides need the "
            "same version of Knuckle");
  EXPECT_EQ(desk.problem(), "");
}

}  // namespace
}  // namespace knuckle::pairing
