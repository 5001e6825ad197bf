#include "transport/ice/rendezvous_line.h"

#include <gtest/gtest.h>

namespace knuckle::ice {
namespace {

const std::string kRoom(kRoomSize, 'a');

TEST(RendezvousLine, IsTakenInItsWords) {
  EXPECT_TRUE(parse_request("ping"));
  EXPECT_EQ(parse_request("join " + kRoom)->room, kRoom);
  EXPECT_EQ(parse_request("send " + kRoom + " QUJD")->rest, "QUJD");
  EXPECT_TRUE(parse_notice("pong"));
  EXPECT_EQ(parse_notice("joined " + kRoom + " 3")->rest, "3");
  EXPECT_EQ(parse_notice("entered " + kRoom)->room, kRoom);
  EXPECT_EQ(parse_notice("message " + kRoom + " QUJD")->rest, "QUJD");
  EXPECT_EQ(parse_notice("refused too many lines")->rest, "too many lines");
}

TEST(RendezvousLine, IsRefusedWhereAnythingElseIsInIt) {
  const std::string short_room(kRoomSize - 1, 'a'), capital(kRoomSize, 'A');
  for (const std::string& line :
       {std::string(), std::string("PING"), std::string("ping "), "join " + short_room, "join " + capital,
        "join " + kRoom + " ", "join  " + kRoom, "join " + kRoom + " x", "send " + kRoom, "send " + kRoom + " ",
        "send " + kRoom + " QUJ", "send " + kRoom + " QU D", "send " + kRoom + " QUJD QUJD",
        "send " + kRoom + " " + std::string(kMostMessageText + 4, 'A'), "message " + kRoom + " QUJD"})
    EXPECT_FALSE(parse_request(line)) << line;
  for (const std::string& line :
       {std::string("ping"), "joined " + kRoom, "joined " + kRoom + " x", "joined " + kRoom + " 12345",
        "entered " + kRoom + " 1", "message " + kRoom + " \x01\x02\x03\x04", std::string("refused \x1b[2J")})
    EXPECT_FALSE(parse_notice(line)) << line;
}

TEST(RendezvousLine, Base64IsTakenOnlyAsItIsMade) {
  const Bytes bytes{0, 1, 2, 255};
  EXPECT_EQ(bytes_of_base64(base64(bytes)), bytes);
  EXPECT_EQ(bytes_of_base64("QQ=="), Bytes{'A'});
  for (const char* text : {"", "QQ=", "QQ", "Q===", "====", "QR==", "QQ==QQ==", "Q Q="})
    EXPECT_FALSE(bytes_of_base64(text)) << text;
  const Bytes most(kMostSignal, 7);
  EXPECT_EQ(bytes_of_base64(base64(most)), most);
  EXPECT_FALSE(bytes_of_base64(base64(Bytes(kMostSignal + 1, 7))));
}

TEST(RendezvousLine, ARoomIsTheSameFromBothSidesAndForNobodyElse) {
  const auto one = secure::make_identity("a").fingerprint(), two = secure::make_identity("b").fingerprint(),
             three = secure::make_identity("c").fingerprint();
  EXPECT_EQ(room_of(one, two), room_of(two, one));
  EXPECT_NE(room_of(one, two), room_of(one, three));
  EXPECT_EQ(room_of(one, two).size(), kRoomSize);
}

TEST(LineBuffer, GivesWholeLinesAndNoticesOneWithoutAnEnd) {
  LineBuffer buffer;
  ASSERT_TRUE(buffer.add("one\r\ntw"));
  EXPECT_EQ(buffer.next(), "one");
  EXPECT_FALSE(buffer.next());
  ASSERT_TRUE(buffer.add("o\n\n"));
  EXPECT_EQ(buffer.next(), "two");
  EXPECT_EQ(buffer.next(), "");
  EXPECT_TRUE(buffer.add(std::string(kMostLine, 'x')));
  EXPECT_FALSE(buffer.add("x"));
}

}  // namespace
}  // namespace knuckle::ice
