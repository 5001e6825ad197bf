// LSS frames against the bytes of CiA 305.
#include "transport/lss.h"

#include <gtest/gtest.h>

#include "tests/transport/hex.h"

namespace knuckle::lss {
namespace {

using test::frame;

TEST(Lss, RequestsHaveTheBytesOfCia305) {
  EXPECT_EQ(request(Service::kSwitchAll, 1), frame("7E5#0401000000000000"));
  EXPECT_EQ(request(Service::kSwitchAll, 0), frame("7E5#0400000000000000"));
  EXPECT_EQ(request(Service::kConfigureNodeId, 0x10), frame("7E5#1110000000000000"));
  EXPECT_EQ(request(Service::kStore), frame("7E5#1700000000000000"));
  EXPECT_EQ(request(Service::kSelectVendor, 0x01000019), frame("7E5#4019000001000000"));
  EXPECT_EQ(request(Service::kSelectProduct, 0x53373235), frame("7E5#4135323753000000"));
  EXPECT_EQ(request(Service::kSelectRevision, 0x00010100), frame("7E5#4200010100000000"));
  EXPECT_EQ(request(Service::kSelectSerial, 4711), frame("7E5#4367120000000000"));
  EXPECT_EQ(request(Service::kIdentifyVendor, 1), frame("7E5#4601000000000000"));
  EXPECT_EQ(request(Service::kIdentifyProduct, 1), frame("7E5#4701000000000000"));
  EXPECT_EQ(request(Service::kIdentifyRevisionLow), frame("7E5#4800000000000000"));
  EXPECT_EQ(request(Service::kIdentifyRevisionHigh, 0xFFFFFFFF), frame("7E5#49FFFFFFFF000000"));
  EXPECT_EQ(request(Service::kIdentifySerialLow), frame("7E5#4A00000000000000"));
  EXPECT_EQ(request(Service::kIdentifySerialHigh, 0xFFFFFFFF), frame("7E5#4BFFFFFFFF000000"));
  EXPECT_EQ(request(Service::kIdentifyUnconfigured), frame("7E5#4C00000000000000"));
  EXPECT_EQ(request(Service::kAskVendor), frame("7E5#5A00000000000000"));
  EXPECT_EQ(request(Service::kAskProduct), frame("7E5#5B00000000000000"));
  EXPECT_EQ(request(Service::kAskRevision), frame("7E5#5C00000000000000"));
  EXPECT_EQ(request(Service::kAskSerial), frame("7E5#5D00000000000000"));
  EXPECT_EQ(request(Service::kAskNodeId), frame("7E5#5E00000000000000"));
}

TEST(Lss, AnswersHaveTheBytesOfCia305AndAreParsed) {
  struct Case {
    const char* bytes;
    Message message;
  };
  for (const auto& [bytes, message] :
       {Case{"7E4#4400000000000000", {Service::kSelected, 0}}, Case{"7E4#4F00000000000000", {Service::kIdentified, 0}},
        Case{"7E4#5000000000000000", {Service::kUnconfigured, 0}},
        Case{"7E4#1100000000000000", {Service::kConfigureNodeId, 0}},
        Case{"7E4#1702000000000000", {Service::kStore, 2}},
        Case{"7E4#5A19000001000000", {Service::kAskVendor, 0x01000019}},
        Case{"7E4#5D67120000000000", {Service::kAskSerial, 4711}},
        Case{"7E4#5EFF000000000000", {Service::kAskNodeId, kNoNodeId}}}) {
    EXPECT_EQ(answer(message.service, message.value), frame(bytes));
    EXPECT_EQ(parse_answer(frame(bytes)), message) << bytes;
    EXPECT_FALSE(parse_request(frame(bytes))) << bytes;
  }
  EXPECT_EQ(parse_answer(frame("7E4#11FF2A0000000000"))->code(), 0xFF) << "beside it a code of the device's own";
  EXPECT_EQ(parse_request(frame("7E5#0401000000000000")), (Message{Service::kSwitchAll, 1}));
}

TEST(Lss, StrangeFramesAreNone) {
  for (const char* bad : {"7E4#", "7E4#44", "7E4#44000000000000", "7E4#0000000000000000", "7E4#4500000000000000",
                          "7E4#5100000000000000", "7E4#FFFFFFFFFFFFFFFF", "764#4400000000000000"}) {
    EXPECT_FALSE(parse_answer(frame(bad))) << bad;
  }
  CanFrame longer = frame("7E4#4400000000000000");
  longer.size = 9;
  EXPECT_FALSE(parse_answer(longer));
}

TEST(Lss, ErrorCodesAreReadable) {
  EXPECT_STREQ(error_text(Service::kConfigureNodeId, 1), "it allows no such node id");
  EXPECT_STREQ(error_text(Service::kStore, 1), "it cannot store");
  EXPECT_STREQ(error_text(Service::kStore, 2), "its memory cannot be written");
  EXPECT_STREQ(error_text(Service::kConfigureNodeId, 2), "unknown error code");
  EXPECT_STREQ(error_text(Service::kStore, 0xFF), "for a reason of its own; see its manual");
}

}  // namespace
}  // namespace knuckle::lss
