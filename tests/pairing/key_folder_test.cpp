// The folder with key and pairings: modes, whole files, expiry, changes that running programs notice.
#include "app/pairing/key_folder.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <thread>

#include "core/error.h"
#include "tests/support/bad_toml.h"
#include "tests/support/places.h"
#include "tests/support/refusal.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::pairing {
namespace {

namespace fs = std::filesystem;

using test::refusal;

mode_t mode_of(const std::string& file) {
  struct stat status {};
  return ::stat(file.c_str(), &status) == 0 ? status.st_mode & 07777U : 0;
}

struct Folder : ::testing::Test {
  test::TemporaryFolder temporary;
  KeyFolder folder{temporary.file("keys")};
  secure::Peer peer(const std::string& name) const {
    const secure::Identity made = secure::make_identity(name);
    return {made.fingerprint(), name, false, false, made.expires_utc()};
  }
  void add(const secure::Peer& one) {
    folder.change_peers([&](secure::Peers& peers) { peers.push_back(one); });
  }
};

TEST(KeyFolderFiles, AreKeptByTheirNamesWhereverTheyAre) {
  EXPECT_STREQ(kept_name("/x/key.pem"), "is named like a computer's private key");
  for (const char* file : {"peers.toml", "turn.toml", "a/peers.toml"})
    EXPECT_STREQ(kept_name(file), "is named like a file of the pairings") << file;
  for (const char* file : {"other.toml", "key.pem/a.csv", ""}) EXPECT_EQ(kept_name(file), nullptr) << file;
}

TEST_F(Folder, MakesAKeyThatOnlyItsOwnerReads) {
  const secure::Identity made = folder.make("site arm");
  EXPECT_EQ(mode_of(folder.path()), 0700U);
  EXPECT_EQ(mode_of(folder.key_file()), 0600U);
  EXPECT_EQ(folder.identity().fingerprint(), made.fingerprint());
  EXPECT_EQ(folder.identity().name, "site arm");
  EXPECT_NE(refusal([&] { (void)folder.make("again"); }).find("is there already"), std::string::npos);
  EXPECT_EQ(folder.identity().fingerprint(), made.fingerprint());
}

TEST_F(Folder, RefusesAKeyThatOthersCanReadAndAFolderThatTheyCanWrite) {
  (void)folder.make("site arm");
  for (const mode_t mode : {0640U, 0604U, 0660U, 0644U}) {
    ::chmod(folder.key_file().c_str(), mode);
    EXPECT_NE(refusal([&] { (void)folder.identity(); }).find("lets others at the private key"), std::string::npos)
        << mode;
  }
  ::chmod(folder.key_file().c_str(), 0600);
  for (const mode_t mode : {0770U, 0707U, 0777U}) {
    ::chmod(folder.path().c_str(), mode);
    const std::string why = refusal([&] { (void)folder.identity(); });
    EXPECT_NE(why.find("mode 0" +
                       std::string(mode == 0770U   ? "770"
                                   : mode == 0707U ? "707"
                                                   : "777") +
                       " of the folder"),
              std::string::npos)
        << why;
  }
  ::chmod(folder.path().c_str(), 0755);
  EXPECT_EQ(refusal([&] { (void)folder.identity(); }), "accepted") << "who may only look does no harm";
}

TEST_F(Folder, SaysWhyAKeyCannotBeUsed) {
  const struct {
    const char *file, *why;
  } cases[]{{"key_with_a_wrong_bit", "its private key is damaged"},
            {"anothers_certificate", "its certificate is of another key"},
            {"certificate_by_an_authority_with_sha1", "its certificate is not signed by its own key"},
            {"rsa", "its key is not on the curve P-256"},
            {"key_cut", "has no private key with its certificate"}};
  (void)folder.make("site arm");
  for (const auto& [file, why] : cases) {
    // What key_folder_fuzz.cpp reads: the key up to this line.
    const std::string text = test::content(test::source_dir() + "/tests/fuzz/corpus/key_folder/" + file);
    ASSERT_NE(text.find("---\n"), std::string::npos) << file;
    write_private_file(folder.key_file(), text.substr(0, text.find("\n---\n")), Existing::kReplace);
    const std::string message = refusal([&] { (void)folder.identity(); });
    EXPECT_EQ(message.find(folder.key_file() + ": " + why), 0U) << file << ": " << message;
    EXPECT_EQ(folder.renew("site arm").name, "site arm") << "with a name, none is read from the old one";
  }
}

TEST_F(Folder, RefusesAKeyThatIsNoFileOfItsOwn) {
  (void)folder.make("site arm");
  const std::string elsewhere = temporary.file("elsewhere.pem");
  fs::rename(folder.key_file(), elsewhere);
  fs::create_symlink(elsewhere, folder.key_file());
  EXPECT_EQ(refusal([&] { (void)folder.identity(); }),
            folder.key_file() + ": is a symbolic link: put the file itself there");
  fs::remove(folder.key_file());
  ASSERT_EQ(::mkfifo(folder.key_file().c_str(), 0600), 0);
  EXPECT_EQ(refusal([&] { (void)folder.identity(); }), folder.key_file() + ": is not a regular file");
}

TEST_F(Folder, RemovesWhatAKilledProgramLeft) {
  (void)folder.make("site arm");
  const auto left = [&](const std::string& name) { return folder.path() + "/" + name; };
  for (const char* name : {"key.pem.part-8bHWUt", "peers.toml.part-8bHWUt", "key.pem.backup"})
    std::ofstream(left(name)) << "x";
  add(peer("desk 1"));
  EXPECT_FALSE(fs::exists(left("key.pem.part-8bHWUt")));
  EXPECT_FALSE(fs::exists(left("peers.toml.part-8bHWUt")));
  EXPECT_TRUE(fs::exists(left("key.pem.backup"))) << "somebody's own";
}

TEST_F(Folder, RefusesPeersThatOthersCanWrite) {
  (void)folder.make("site arm");
  add(peer("desk 1"));
  EXPECT_EQ(mode_of(folder.peers_file()), 0600U);
  ::chmod(folder.peers_file().c_str(), 0620);
  EXPECT_NE(refusal([&] { (void)folder.peers(); }).find("mode 0620 of the file"), std::string::npos);
}

TEST_F(Folder, KeepsWhatItKnowsOfEachFarEnd) {
  (void)folder.make("site arm");
  secure::Peer observer = peer("wall screen"), revoked = peer("desk 2");
  observer.observer = true;
  revoked.revoked = true;
  for (const secure::Peer& one : {peer("desk 1"), observer, revoked}) add(one);
  const secure::Peers read = folder.peers();
  ASSERT_EQ(read.size(), 3U);
  EXPECT_EQ(read[1].name, "wall screen");
  EXPECT_EQ(read[1].fingerprint, observer.fingerprint);
  EXPECT_EQ(read[1].expires_utc, observer.expires_utc);
  EXPECT_TRUE(read[1].observer && !read[0].observer && !read[2].observer);
  EXPECT_TRUE(read[2].revoked && !read[0].revoked && !read[1].revoked);
}

TEST_F(Folder, RefusesWhateverElseAPeersFileHoldsInOneLineThatNamesIt) {
  (void)folder.make("site arm");
  add(peer("desk 1"));
  add(peer("desk 2"));
  const auto read = [this] { (void)folder.peers(); };
  test::expect_bad_tomls_refused(folder.peers_file(), test::content(folder.peers_file()), read, true);
}

TEST_F(Folder, SaysWhatIsWrongInAPeersFile) {
  (void)folder.make("site arm");
  const auto with = [&](const std::string& text) {
    std::ofstream(folder.peers_file()) << text;
    ::chmod(folder.peers_file().c_str(), 0600);
    return refusal([&] { (void)folder.peers(); });
  };
  const std::string good = "name = \"desk 1\"\nfingerprint = \"" + std::string(64, 'a') +
                           "\"\nexpires = \"2031-01-01T00:00:00Z\"\nrevoked = false\n";
  EXPECT_EQ(with("[[peer]]\nrole = \"operator\"\n" + good), "accepted");
  EXPECT_NE(with("[[peer]]\nrole = \"king\"\n" + good).find("role"), std::string::npos);
  EXPECT_NE(with("[[peer]]\n" + good).find("role"), std::string::npos);
  EXPECT_NE(with("[[peer]]\nrole = \"operator\"\nx = 1\n" + good).find("x"), std::string::npos)
      << with("[[peer]]\nrole = \"operator\"\nx = 1\n" + good);
  EXPECT_NE(with("[[peer]]\nname = \"a\\tb\"\n").find("peers.toml:2"), std::string::npos);
  const std::string one = "[[peer]]\nrole = \"operator\"\n" + good;
  const auto other = [&](const std::string& from, const std::string& to) {
    return std::string(one).replace(one.find(from), from.size(), to);
  };
  const std::string cut = with(other(std::string(64, 'a'), "abc"));
  EXPECT_NE(cut.find("peers.toml:4: key 'peer"), std::string::npos) << cut;
  EXPECT_NE(cut.find("must be 64 hexadecimal digits"), std::string::npos) << cut;
  const std::string twice = with(one + other("desk 1", "desk 2"));
  EXPECT_NE(twice.find("peers.toml:10: key 'peer"), std::string::npos) << twice;
  EXPECT_NE(twice.find("must be of one far end only"), std::string::npos) << twice;
  const std::string same_name = with(one + other(std::string(64, 'a'), std::string(64, 'b')));
  EXPECT_NE(same_name.find("peers.toml:9: key 'peer"), std::string::npos) << same_name;
}

TEST_F(Folder, RenewsTheKeyAndKeepsThePairings) {
  const secure::Identity old = folder.make("site arm");
  add(peer("desk 1"));
  const secure::Identity made = folder.renew("");
  EXPECT_FALSE(made.fingerprint() == old.fingerprint());
  EXPECT_EQ(folder.identity().fingerprint(), made.fingerprint());
  EXPECT_EQ(made.name, "site arm");
  EXPECT_EQ(mode_of(folder.key_file()), 0600U);
  EXPECT_EQ(folder.peers().size(), 1U);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 2) << "no old key left";
}

TEST_F(Folder, RefusesAKeyThatIsNotValidNow) {
  fs::create_directory(folder.path());
  ::chmod(folder.path().c_str(), 0700);
  write_private_file(folder.key_file(), secure::make_identity("old", -1).pem(), Existing::kRefuse);
  EXPECT_NE(refusal([&] { (void)folder.identity(); }).find("expired on"), std::string::npos);
}

TEST_F(Folder, SeveralProgramsAtOnceLoseNoPairing) {
  (void)folder.make("site arm");
  const secure::Peer one = peer("x");
  std::vector<std::thread> programs;
  for (int p = 0; p < 4; ++p) {
    programs.emplace_back([&, p] {
      for (int i = 0; i < 10; ++i) {
        secure::Peer named = one;
        named.name = "desk " + std::to_string(10 * p + i);
        named.fingerprint.bytes[0] = static_cast<std::uint8_t>(10 * p + i);
        KeyFolder(folder.path()).change_peers([&](secure::Peers& peers) { peers.push_back(named); });
      }
    });
  }
  for (std::thread& program : programs) program.join();
  EXPECT_EQ(folder.peers().size(), 40U);
}

TEST(PrivateFile, IsThereWholeOrNotAtAll) {
  const test::TemporaryFolder folder;
  const std::string file = folder.file("key.pem");
  write_private_file(file, "old", Existing::kRefuse);
  EXPECT_THROW(write_private_file(file, "new", Existing::kRefuse), InputError);
  EXPECT_EQ(test::content(file), "old");
  write_private_file(file, "new", Existing::kReplace);
  EXPECT_EQ(test::content(file), "new");
  EXPECT_EQ(folder.count(), 1) << "nothing beside it";
  EXPECT_THROW(write_private_file(folder.file("no/such/folder"), "x", Existing::kReplace), InputError);
}

TEST(Expiry, IsWarnedOfThirtyDaysAhead) {
  const auto in_days = [](int days) { return secure::make_identity("x", days).expires_utc(); };
  EXPECT_EQ(expiry_warning("this computer's", in_days(40)), "");
  EXPECT_NE(expiry_warning(kThisComputers, in_days(29)).find("this computer's key expires on"), std::string::npos);
  EXPECT_NE(expiry_warning(kThisComputers, in_days(29)).find("make a new one here"), std::string::npos);
  EXPECT_NE(expiry_warning("desk 1's", in_days(29)).find("make a new one there"), std::string::npos);
  EXPECT_NE(expiry_warning("desk 1's", in_days(-1)).find("desk 1's key expired on"), std::string::npos);
  EXPECT_EQ(days_left("tomorrow"), std::nullopt);
}

TEST(Expiry, AClockThatIsFarBehindIsToldOf) {
  EXPECT_NE(clock_warning(0).find("this computer's clock is 20758 days or more behind"), std::string::npos)
      << clock_warning(0);
  EXPECT_EQ(clock_warning(2'000'000'000), "");
}

TEST_F(Folder, ARunningProgramNoticesARevocation) {
  (void)folder.make("site arm");
  add(peer("desk 1"));
  PeersWatch watch(folder);
  EXPECT_FALSE(watch.changed());
  EXPECT_EQ(watch.news(), "");
  folder.change_peers([](secure::Peers& peers) { peers.front().revoked = true; });
  const auto changed = watch.changed();
  ASSERT_TRUE(changed);
  EXPECT_TRUE(changed->front().revoked);
  EXPECT_NE(watch.news().find("pairings were changed"), std::string::npos);
  EXPECT_FALSE(watch.changed());
  fs::remove(folder.peers_file());
  const auto removed = watch.changed();
  ASSERT_TRUE(removed);
  EXPECT_TRUE(removed->empty()) << "nobody is paired any more";
}

TEST_F(Folder, AFileThatCannotBeReadChangesNothingAndIsToldOf) {
  (void)folder.make("site arm");
  add(peer("desk 1"));
  PeersWatch watch(folder);
  std::ofstream(folder.peers_file(), std::ios::app) << "[[peer]\n";
  EXPECT_FALSE(watch.changed());
  const std::string news = watch.news();
  EXPECT_NE(news.find("the pairings from before stay in use"), std::string::npos) << news;
}

}  // namespace
}  // namespace knuckle::pairing
