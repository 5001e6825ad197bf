// `knuckle pair` as it is called: what it refuses, and what it does without a key that can be used.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "app/pairing/key_folder.h"
#include "app/pairing/pairing_exchange.h"
#include "core/error.h"
#include "tests/support/run_inside.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::pairing {
namespace {

struct PairCommand : ::testing::Test {
  test::TemporaryFolder temporary;
  KeyFolder folder{temporary.file("keys")};
  std::string out, err;  // of the last run

  int run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"pair", "--keys", folder.path()});
    const test::ProgramRun done = test::run_inside([&] {
      try {
        return cli::parse_command_line({"knuckle", "", "", {pair_entry()}}, arguments).run();
      } catch (const InputError& error) {
        refusal = error.what();
        return -1;
      }
    });
    out = done.out;
    err = done.err;
    return done.exit_code;
  }
  /// Why it is refused; empty where it is not.
  std::string refused(const std::vector<std::string>& arguments) {
    refusal.clear();
    (void)run(arguments);
    return refusal;
  }
  /// Paired with desk 1, by a key that has expired since.
  void pair_and_expire() {
    (void)folder.make("site arm");
    const secure::Identity desk = secure::make_identity("desk 1");
    folder.change_peers([&](secure::Peers& peers) {
      peers.push_back({desk.fingerprint(), "desk 1", false, false, desk.expires_utc()});
    });
    write_private_file(folder.key_file(), secure::make_identity("site arm", -1).pem(), Existing::kReplace);
  }
  static void expect_says(const std::string& text, const std::string& what) {
    EXPECT_NE(text.find(what), std::string::npos) << text;
  }

 private:
  std::string refusal;
};

TEST_F(PairCommand, ListsAndRevokesAlsoWhereThisComputersKeyHasExpired) {
  pair_and_expire();
  EXPECT_EQ(run({}), 0);
  expect_says(out, "this computer: site arm (");
  expect_says(out, "paired with: desk 1 (");
  expect_says(err, "key.pem: expired on ");
  EXPECT_EQ(run({"--revoke", "desk 1"}), 0);
  EXPECT_TRUE(folder.peers().at(0).revoked);
  const auto written = std::filesystem::last_write_time(folder.peers_file());
  EXPECT_EQ(run({"--revoke", "desk 1"}), 0);
  expect_says(out, "is revoked already: desk 1");
  EXPECT_EQ(std::filesystem::last_write_time(folder.peers_file()), written);
  expect_says(refused({"--connect", "127.0.0.1:5683"}), "expired on ");
}

TEST_F(PairCommand, RevokingNeedsNoKeyAndMakesNone) {
  expect_says(refused({"--revoke", "desk 1"}), "--revoke desk 1: no far end of this name is in ");
  EXPECT_FALSE(std::filesystem::exists(folder.path()));
  pair_and_expire();
  std::filesystem::remove(folder.key_file());
  EXPECT_EQ(run({"--revoke", "desk 1"}), 0);
  EXPECT_TRUE(folder.peers().at(0).revoked);
  EXPECT_FALSE(folder.has_key());
}

TEST_F(PairCommand, SaysWhenItMakesAKeyAndRenewingMakesOneWhereThereIsNoneOrADamagedOne) {
  EXPECT_EQ(run({"--name", "site arm"}), 0);
  expect_says(out, "made this computer's key: site arm (");
  EXPECT_EQ(run({}), 0);
  EXPECT_EQ(out.find("made"), std::string::npos) << out;
  std::filesystem::remove(folder.key_file());
  EXPECT_EQ(run({"--renew", "--name", "site arm"}), 0);
  expect_says(out, "this computer had no key; made: site arm (");
  EXPECT_EQ(out.find("every far end knows the old key"), std::string::npos) << out;
  write_private_file(folder.key_file(), "damaged", Existing::kReplace);
  const std::string why = refused({});
  expect_says(why, "make a new one (knuckle pair --renew --name NAME)");
  EXPECT_EQ(refused({"--renew"}), why);
  EXPECT_EQ(run({"--renew", "--name", "site arm"}), 0);
  EXPECT_EQ(folder.identity().name, "site arm");
}

TEST_F(PairCommand, RefusesAFolderThatIsAFile) {
  std::ofstream(folder.path()) << "mine";
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{}, {"--renew"}, {"--listen", "127.0.0.1:0"}})
    EXPECT_EQ(refused(arguments), folder.path() + ": is no folder");
}

TEST_F(PairCommand, RefusesAMalformedCodeOrAddressByTheNameOfItsOption) {
  for (const std::string& code :
       {std::string("AAAA-AAAA"), std::string("AAAA-AAAA-AAAA-AAAA-AAAA-AAA1"), std::string(29, 'A')})
    expect_says(refused({"--connect", "127.0.0.1:5683", "--code", code}), "--code " + code + ": must be as");
  for (const std::string& code : {std::string("aaaa-AAAA-aaaa-AAAA-aaaa-AAAA"), std::string(24, 'a')})
    expect_says(refused({"--connect", "arm", "--code", code}), "--connect arm:");  // the code is none to complain of
  expect_says(refused({"--connect", "arm"}), "--connect arm: is not HOST:PORT");
  expect_says(refused({"--listen", "arm:5683"}), "--listen arm:5683: \"arm\" is not an IPv4 or IPv6 address");
  expect_says(refused({"--revoke", "desk 1", "--name", "arm"}), "--name arm: does not go with --revoke");
  EXPECT_FALSE(folder.has_key());
}

}  // namespace
}  // namespace knuckle::pairing
