#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>

#include "app/pairing/chosen_link.h"
#include "tests/support/bad_toml.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::pairing {
namespace {

using test::refusal;

using test::says;

TEST(DialOptions, RefuseWhatIsMissingMalformedOrDoesNotGoTogether) {
  struct Case {
    DialOptions options;
    secure::Role role;
    bool insecure;
    const char* said;
  };
  constexpr auto kOperator = secure::Role::kOperator, kMachine = secure::Role::kMachine;
  const Case cases[]{
      {{"", "machine", "", ""}, kOperator, false, "goes with --dial"},
      {{"", "", "stun.example.org:3478", ""}, kOperator, false, "goes with --dial"},
      {{"", "", "", "turn.example.org:3478"}, kOperator, false, "goes with --dial"},
      {{"meet.example.org:5684", "", "", ""}, kMachine, true, "--insecure"},
      {{"meet.example.org:5684", "", "", ""}, kOperator, false, "needs --peer"},
      {{"meet.example.org:5684", "", "", ""}, kMachine, false, "accepted"},
      {{"foo", "machine", "", ""}, kOperator, false, "--dial foo: is not HOST:PORT"},
      {{"meet:5684", "machine", "foo", ""}, kOperator, false, "--stun foo: is not HOST:PORT"},
      {{"meet:5684", "machine", "", "foo:x"}, kOperator, false, "--turn foo:x: port \"x\" must be"},
  };
  for (const Case& c : cases) EXPECT_TRUE(says(refusal([&] { check(c.options, c.role, c.insecure); }), c.said));
}

TEST(DialOptions, RefuseNoneAndBothOfAddressAndRendezvous) {
  LinkOptions options;
  EXPECT_TRUE(says(refusal([&] { (void)ChosenLink::listen(options); }), "--listen"));
  EXPECT_TRUE(says(refusal([&] { (void)ChosenLink::connect(options); }), "--dial"));
  options.address = "foo";
  EXPECT_TRUE(says(refusal([&] { (void)ChosenLink::listen(options); }), "--listen foo: is not"));
  EXPECT_TRUE(says(refusal([&] { (void)ChosenLink::connect(options); }), "--connect foo: is not"));
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
  const auto make = [&] { (void)make_dialler(options, secure::Role::kOperator, folder, identity, peers); };
  EXPECT_TRUE(says(refusal(make), folder.turn_file() + ": cannot be read"));
  const std::string good = "user = \"knuckle\"\npassword = \"secret\"\n";
  std::ofstream(folder.turn_file()) << good;
  ::chmod(folder.turn_file().c_str(), 0640);
  EXPECT_TRUE(says(refusal(make), "chmod 600"));
  test::expect_bad_tomls_refused(folder.turn_file(), good, make);
}

}  // namespace
}  // namespace knuckle::pairing
