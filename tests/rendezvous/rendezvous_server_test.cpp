#include "app/rendezvous/rendezvous_server.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <functional>

#include "tests/rendezvous/wire_client.h"
#include "tests/support/refusal.h"

namespace knuckle::rendezvous {
namespace {

using namespace std::chrono_literals;
using test::WireClient;

const std::string kRoom(ice::kRoomSize, 'a'), kOther(ice::kRoomSize, 'b');

class Rendezvous : public testing::Test {
 protected:
  Rendezvous() { begin({}); }
  void begin(const Bounds& bounds) { server_ = std::make_unique<RendezvousServer>("127.0.0.1:0", bounds); }
  std::unique_ptr<WireClient> client() { return std::make_unique<WireClient>(server_->address()); }
  std::unique_ptr<WireClient> member(const std::string& room = kRoom) {
    auto made = client();
    made->say("join " + room);
    EXPECT_TRUE(until([&] { return made->says("joined " + room); }));
    return made;
  }
  /// The server works on until it is so.
  [[nodiscard]] bool until(const std::function<bool()>& so) {
    for (int i = 0; i < 30'000; ++i) {
      server_->step(2ms, now_);
      if (so()) return true;
    }
    return false;
  }
  void work() {
    for (int i = 0; i < 20; ++i) server_->step(1ms, now_);
  }
  std::unique_ptr<RendezvousServer> server_;
  RendezvousServer::Clock::time_point now_ = RendezvousServer::Clock::now();  // goes on where a test says so
};

TEST_F(Rendezvous, PassesAMessageToTheOthersInTheRoomAndToNobodyElse) {
  const auto one = member(), two = member(), stranger = member(kOther);
  EXPECT_TRUE(one->says("entered " + kRoom));
  EXPECT_TRUE(two->says("joined " + kRoom + " 1"));
  one->say("send " + kRoom + " QUJD");
  EXPECT_TRUE(until([&] { return two->says("message " + kRoom + " QUJD\n"); }));
  work();
  EXPECT_FALSE(one->says("message"));
  EXPECT_FALSE(stranger->says("message"));
  EXPECT_FALSE(stranger->says("entered"));
}

TEST_F(Rendezvous, EndsWhoTalksNonsenseFloodsOrGoesWhereNobodyMayAndServesTheOthers) {
  Bounds bounds;
  bounds.rooms_of_client = 2;
  begin(bounds);
  const auto one = member(), two = member();
  std::string rooms, flood;
  for (const char digit : {'c', 'd', 'e'}) rooms += "join " + std::string(ice::kRoomSize, digit) + "\n";
  for (int i = 0; i < 200; ++i) flood += "ping\n";
  const std::string no_line = "not a line of this protocol";
  const std::vector<std::array<std::string, 2>> cases{
      {"GET / HTTP/1.1\r\n", no_line},
      {std::string("\0\0\0\n", 4), no_line},
      {"join x\n", no_line},
      {"\x16\x03\x01\x02\n", no_line},
      {"send " + kRoom + " !!!!\n", no_line},
      {std::string(3 * ice::kMostLine, 'x'), "line too long"},
      {"join " + kOther + "\nsend " + kRoom + " QUJD\n", "not in this room"},
      {rooms, "too many rooms"},
      {flood, "too many lines"},
  };
  for (const auto& [says, why] : cases) {
    const auto guest = client();
    guest->raw(says);
    EXPECT_TRUE(until([&] { return guest->ended(); })) << why;
    EXPECT_TRUE(why == "line too long" || why == "too many lines" || guest->says("refused " + why)) << why;
  }
  EXPECT_EQ(server_->counters().junk, 8u);
  EXPECT_EQ(server_->counters().floods, 1u);
  EXPECT_FALSE(one->ended());
  EXPECT_FALSE(two->says("message"));
  one->say("send " + kRoom + " QUJD");
  EXPECT_TRUE(until([&] { return two->says("message"); }));
}

TEST_F(Rendezvous, EndsWhoDoesNotReadAndServesTheOthers) {
  Bounds bounds;
  bounds.lines_per_s = 1e6;
  bounds.burst = 1e6;
  begin(bounds);
  const auto one = member(), two = member();
  WireClient stalled(server_->address(), 4096);
  stalled.say("join " + kRoom);
  work();
  ASSERT_EQ(server_->clients(), 3u);
  const std::string message = "send " + kRoom + " " + std::string(ice::kMostMessageText, 'A');
  for (int i = 0; i < 4000 && server_->counters().stalled == 0; ++i) {
    one->say(message);
    (void)until([&] { return two->heard().size() > 0; });
  }
  EXPECT_EQ(server_->counters().stalled, 1u);
  EXPECT_EQ(server_->clients(), 2u);
  EXPECT_FALSE(two->ended());
}

TEST_F(Rendezvous, EndsWhoIsSilentAndWhoNeverJoins) {
  const auto joined = member(), idler = client();
  work();
  now_ += Bounds().first;
  for (int i = 0; i < 3; ++i) idler->say("ping");  // words alone keep nobody there
  EXPECT_TRUE(until([&] { return idler->ended(); }));
  work();
  EXPECT_FALSE(joined->ended());
  now_ += Bounds().idle;
  EXPECT_TRUE(until([&] { return joined->ended(); }));
  EXPECT_EQ(server_->counters().idle, 2u);
}

/// What this process may have open, until the end of the test.
class FileLimit {
 public:
  explicit FileLimit(rlim_t most) {
    ::getrlimit(RLIMIT_NOFILE, &before_);
    set({most, before_.rlim_max});
  }
  ~FileLimit() { set(before_); }
  FileLimit(const FileLimit&) = delete;
  FileLimit& operator=(const FileLimit&) = delete;

 private:
  static void set(const rlimit& limit) { EXPECT_EQ(::setrlimit(RLIMIT_NOFILE, &limit), 0); }
  rlimit before_{};
};

TEST_F(Rendezvous, TakesNoMoreConnectionsThanItMayHaveFilesOpen) {
  constexpr std::size_t kMost = 40;
  {
    const FileLimit limit(kMost);
    begin({});
  }
  std::vector<std::unique_ptr<WireClient>> crowd;
  while (crowd.size() < kMost) crowd.push_back(client());
  EXPECT_TRUE(until([&] { return server_->counters().accepted + server_->counters().turned_away == kMost; }));
  EXPECT_GT(server_->counters().accepted, 0u);
  EXPECT_GE(server_->counters().turned_away, 8u) << "its own descriptors, and some to turn others away with";
  EXPECT_TRUE(until([&] { return crowd.back()->ended(); }));
}

TEST(RendezvousAddress, ThatIsMalformedIsRefusedByTheNameOfItsOption) {
  const std::string said = test::refusal([&] { const RendezvousServer server("foo"); });
  EXPECT_EQ(said.rfind("--listen foo: ", 0), 0u) << said;
}

TEST(RendezvousNetwork, OfIPv6IsAllThatOneComputerMayHave) {
  const auto network = [](const std::string& address) { return network_of(parse_address(address)); };
  EXPECT_EQ(network("[2001:db8:0:1::7]:1000"), network("[2001:db8:0:1:ffff:ffff:ffff:ffff]:2000"));
  EXPECT_NE(network("[2001:db8:0:1::7]:1000"), network("[2001:db8:0:2::7]:1000"));
  EXPECT_EQ(network("192.0.2.7:1000"), network("192.0.2.7:2000"));
  EXPECT_NE(network("192.0.2.7:1000"), network("192.0.2.8:1000"));
  EXPECT_EQ(network("[::ffff:192.0.2.7]:1000"), network("192.0.2.7:1000"));
  EXPECT_NE(network("[::ffff:192.0.2.7]:1000"), network("[::ffff:192.0.2.8]:1000"));
}

TEST_F(Rendezvous, BoundsConnectionsOfAnAddressAndInAll) {
  Bounds bounds;
  bounds.clients_of_network = 3;
  begin(bounds);
  const auto one = member(), two = member(), three = member(), four = client();
  EXPECT_TRUE(until([&] { return four->ended(); }));
  EXPECT_EQ(server_->counters().turned_away, 1u);
  EXPECT_EQ(server_->clients(), 3u);
}

TEST_F(Rendezvous, AFullRoomGivesThePlaceOfWhoeverWasSilentLongest) {
  Bounds bounds;
  bounds.members = 2;
  begin(bounds);
  const auto dead = member(), alive = member();
  now_ += 1s;
  alive->say("ping");
  EXPECT_TRUE(until([&] { return alive->says("pong"); }));
  const auto again = member();
  EXPECT_TRUE(until([&] { return dead->ended(); }));
  again->say("send " + kRoom + " QUJD");
  EXPECT_TRUE(until([&] { return alive->says("message"); }));
}

TEST_F(Rendezvous, ForgetsRoomsThatNobodyIsIn) {
  { const auto one = member(); }
  EXPECT_TRUE(until([&] { return server_->clients() == 0; }));
  const auto next = member();
  EXPECT_TRUE(next->says("joined " + kRoom + " 0"));
}

}  // namespace
}  // namespace knuckle::rendezvous
