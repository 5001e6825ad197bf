// The folder with key and pairings: modes, whole files, expiry, changes that running programs notice.
#include "app/pairing/key_folder.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <thread>

#include "core/error.h"
#include "tests/support/bad_toml.h"
#include "tests/support/places.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::pairing {
namespace {

namespace fs = std::filesystem;

using test::refusal;
using test::says;

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

TEST_F(Folder, RefusesFilesThatOthersCanReadOrWriteAndAFolderThatTheyCanWrite) {
  (void)folder.make("site arm");
  add(peer("desk 1"));
  EXPECT_EQ(mode_of(folder.peers_file()), 0600U);
  struct Case {
    std::string path;
    mode_t mode;
    const char* why;
  };
  const std::string key = folder.key_file(), peers = folder.peers_file();
  for (const auto& [path, mode, why] :
       {Case{key, 0640, "lets others at the private key"}, Case{key, 0604, "lets others at the private key"},
        Case{folder.path(), 0770, "mode 0770 of the folder"}, Case{folder.path(), 0707, "mode 0707 of the folder"},
        Case{peers, 0620, "mode 0620 of the file"},
        Case{folder.path(), 0755, "accepted"}}) {  // who may only look does no harm
    const mode_t before = mode_of(path);
    ::chmod(path.c_str(), mode);
    EXPECT_TRUE(says(refusal([&] {
                       (void)folder.identity();
                       (void)folder.peers();
                     }),
                     why));
    ::chmod(path.c_str(), before);
  }
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

TEST_F(Folder, SaysWhatIsWrongInAPeersFileAndWhere) {
  (void)folder.make("site arm");
  const std::string digits(64, 'a');
  const std::string one = "[[peer]]\nrole = \"operator\"\nname = \"desk 1\"\nfingerprint = \"" + digits +
                          "\"\nexpires = \"2031-01-01T00:00:00Z\"\nrevoked = false\n";
  const auto with = [&](const std::string& from, const std::string& to) {
    return std::string(one).replace(one.find(from), from.size(), to);
  };
  const auto read = [this] { (void)folder.peers(); };
  const std::vector<std::array<std::string, 2>> cases{
      {with("operator", "king"), "role"},
      {with("role = \"operator\"\n", ""), "role"},
      {with("role", "x = 1\nrole"), "x"},
      {with("desk 1", "a\\tb"), "peers.toml:3"},
      {with(digits, "abc"), "peers.toml:4: key 'peer"},
      {with(digits, "abc"), "must be 64 hexadecimal digits"},
      {one + with("desk 1", "desk 2"), "peers.toml:10: key 'peer"},
      {one + with("desk 1", "desk 2"), "must be of one far end only"},
      {one + with(digits, std::string(64, 'b')), "peers.toml:9: key 'peer"},
  };
  for (const auto& [text, why] : cases) {
    write_private_file(folder.peers_file(), text, Existing::kReplace);
    EXPECT_TRUE(says(refusal(read), why)) << text;
  }
  test::expect_bad_tomls_refused(folder.peers_file(), one, read, true);
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

TEST_F(Folder, ARunningProgramNoticesARevocationAndKeepsWhatItKnewWhereTheFileCannotBeRead) {
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
  std::ofstream(folder.peers_file(), std::ios::app) << "[[peer]\n";
  EXPECT_FALSE(watch.changed());
  EXPECT_TRUE(says(watch.news(), "the pairings from before stay in use"));
  fs::remove(folder.peers_file());
  const auto removed = watch.changed();
  ASSERT_TRUE(removed);
  EXPECT_TRUE(removed->empty()) << "nobody is paired any more";
}

}  // namespace
}  // namespace knuckle::pairing
