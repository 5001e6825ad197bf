#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>

#include "app/pairing/chosen_link.h"
#include "tests/support/refusal.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::pairing {
namespace {

using test::refusal;

bool says(const std::string& text, const std::string& what) {
  return text.find(what) != std::string::npos;
}

TEST(DialOptions, RefuseWhatGoesWithARendezvousOnly) {
  for (const DialOptions& options :
       {DialOptions{"", "machine", "", ""}, DialOptions{"", "", "stun.example.org:3478", ""},
        DialOptions{"", "", "", "turn.example.org:3478"}})
    EXPECT_TRUE(says(refusal([&] { check(options, secure::Role::kOperator, false); }), "goes with --dial"));
}

TEST(DialOptions, RefuseARendezvousWithoutPairingAndWithoutAPeer) {
  const DialOptions dial{"meet.example.org:5684", "", "", ""};
  EXPECT_TRUE(says(refusal([&] { check(dial, secure::Role::kMachine, true); }), "--insecure"));
  EXPECT_TRUE(says(refusal([&] { check(dial, secure::Role::kOperator, false); }), "needs --peer"));
  EXPECT_EQ(refusal([&] { check(dial, secure::Role::kMachine, false); }), "accepted");
}

TEST(DialOptions, AMalformedAddressIsRefusedByTheNameOfItsOption) {
  const auto refused = [](const DialOptions& options) {
    return refusal([&] { check(options, secure::Role::kOperator, false); });
  };
  EXPECT_TRUE(says(refused({"foo", "machine", "", ""}), "--dial foo: is not HOST:PORT"));
  EXPECT_TRUE(says(refused({"meet:5684", "machine", "foo", ""}), "--stun foo: is not HOST:PORT"));
  EXPECT_TRUE(says(refused({"meet:5684", "machine", "", "foo:x"}), "--turn foo:x: port \"x\" must be"));
  LinkOptions options;
  options.address = "foo";
  EXPECT_TRUE(says(refusal([&] { (void)ChosenLink::listen(options); }), "--listen foo: is not"));
  EXPECT_TRUE(says(refusal([&] { (void)ChosenLink::connect(options); }), "--connect foo: is not"));
}

TEST(DialOptions, RefuseNoneAndBothOfAddressAndRendezvous) {
  LinkOptions options;
  EXPECT_TRUE(says(refusal([&] { (void)ChosenLink::listen(options); }), "--listen"));
  EXPECT_TRUE(says(refusal([&] { (void)ChosenLink::connect(options); }), "--dial"));
  options.address = "127.0.0.1:5683";
  options.dial = {"meet.example.org:5684", "machine", "", ""};
  EXPECT_TRUE(says(refusal([&] { (void)ChosenLink::connect(options); }), "--dial"));
}

TEST(DialOptions, NameTheFarEndByItsPairing) {
  const secure::Peers peers{{{}, "machine", false}, {{}, "old", true}};
  const KeyFolder folder("/nowhere");
  EXPECT_EQ(chosen_peer({"", "machine", "", ""}, peers, folder).name, "machine");
  EXPECT_TRUE(says(refusal([&] { (void)chosen_peer({"", "other", "", ""}, peers, folder); }), "nobody of this name"));
  EXPECT_TRUE(says(refusal([&] { (void)chosen_peer({"", "old", "", ""}, peers, folder); }), "revoked"));
}

TEST(DialOptions, TakeTheRelaysPasswordOnlyFromAFileThatNobodyElseCanRead) {
  const test::TemporaryFolder temporary;
  const KeyFolder folder(temporary.path().string());
  const secure::Identity identity = secure::make_identity("desk");
  const secure::Peers peers{{secure::make_identity("machine").fingerprint(), "machine", false}};
  const DialOptions options{"127.0.0.1:5684", "machine", "", "127.0.0.1:3478"};
  const auto made = [&] {
    return refusal([&] { (void)make_dialler(options, secure::Role::kOperator, folder, identity, peers); });
  };
  const std::string file = folder.path() + "/turn.toml";
  EXPECT_TRUE(says(made(), file + ": cannot be read"));
  std::ofstream(file) << "user = \"knuckle\"\npassword = \"secret\"\n";
  ::chmod(file.c_str(), 0640);
  EXPECT_TRUE(says(made(), "chmod 600"));
  ::chmod(file.c_str(), 0600);
  EXPECT_EQ(made(), "accepted");
  std::ofstream(file, std::ios::app) << "realm = \"x\"\n";
  EXPECT_TRUE(says(made(), "realm"));
}

}  // namespace
}  // namespace knuckle::pairing
