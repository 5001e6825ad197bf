#include "app/rendezvous/rendezvous_server.h"

#include <gtest/gtest.h>

#include <functional>
#include <memory>

#include "tests/rendezvous/wire_client.h"

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
    for (int i = 0; i < 2000; ++i) {
      server_->step(2ms);
      if (so()) return true;
    }
    return false;
  }
  void work() {
    for (int i = 0; i < 20; ++i) server_->step(1ms);
  }
  std::unique_ptr<RendezvousServer> server_;
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

TEST_F(Rendezvous, LetsNobodySpeakIntoARoomThatTheyHaveNotJoined) {
  const auto inside = member();
  const auto outside = member(kOther);
  outside->say("send " + kRoom + " QUJD");
  EXPECT_TRUE(until([&] { return outside->ended(); }));
  EXPECT_TRUE(outside->says("refused not in this room"));
  EXPECT_FALSE(inside->says("message"));
}

TEST_F(Rendezvous, EndsWhoTalksNonsense) {
  const auto inside = member();
  for (const std::string& junk :
       {std::string("GET / HTTP/1.1\r\n"), std::string("\0\0\0\n", 4), std::string("join x\n"),
        std::string("\x16\x03\x01\x02\n"), "send " + kRoom + " !!!!\n"}) {
    const auto one = client();
    one->raw(junk);
    EXPECT_TRUE(until([&] { return one->ended(); })) << junk;
  }
  EXPECT_FALSE(inside->ended());
  EXPECT_EQ(server_->counters().junk, 5u);
}

TEST_F(Rendezvous, EndsALineWithoutAnEnd) {
  const auto one = client();
  one->raw(std::string(3 * ice::kMostLine, 'x'));
  EXPECT_TRUE(until([&] { return one->ended(); }));
}

TEST_F(Rendezvous, EndsAFloodAndServesTheOthers) {
  const auto one = member(), two = member(), flood = member();
  std::string lines;
  for (int i = 0; i < 200; ++i) lines += "ping\n";
  flood->raw(lines);
  EXPECT_TRUE(until([&] { return flood->ended(); }));
  EXPECT_EQ(server_->counters().floods, 1u);
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
  Bounds bounds;
  bounds.idle = 300ms;
  bounds.first = 30ms;
  begin(bounds);
  const auto joined = member(), idler = client();
  for (int i = 0; i < 3; ++i) idler->say("ping");  // words alone keep nobody there
  EXPECT_TRUE(until([&] { return idler->ended(); }));
  EXPECT_FALSE(joined->ended());
  EXPECT_TRUE(until([&] { return joined->ended(); }));
  EXPECT_EQ(server_->counters().idle, 2u);
}

TEST_F(Rendezvous, BoundsConnectionsOfAnAddressAndInAll) {
  Bounds bounds;
  bounds.clients_of_address = 3;
  begin(bounds);
  const auto one = member(), two = member(), three = member(), four = client();
  EXPECT_TRUE(until([&] { return four->ended(); }));
  EXPECT_EQ(server_->counters().turned_away, 1u);
  EXPECT_EQ(server_->clients(), 3u);
}

TEST_F(Rendezvous, BoundsTheRoomsOfAClient) {
  Bounds bounds;
  bounds.rooms_of_client = 2;
  begin(bounds);
  const auto one = client();
  for (const char digit : {'a', 'b', 'c'}) one->say("join " + std::string(ice::kRoomSize, digit));
  EXPECT_TRUE(until([&] { return one->ended(); }));
  EXPECT_TRUE(one->says("refused too many rooms"));
}

TEST_F(Rendezvous, AFullRoomGivesThePlaceOfWhoeverWasSilentLongest) {
  Bounds bounds;
  bounds.members = 2;
  begin(bounds);
  const auto dead = member(), alive = member();
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
