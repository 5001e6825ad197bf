// What a person reads of a reason.
#include "core/reason.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/time.h"

namespace knuckle {
namespace {

TEST(Reason, SaysAgeAndLimit) {
  EXPECT_EQ(text({ReasonCode::kLinkLost, 0, 203, 200}),
            "no new packet over the link: check the network (203 ms; limit 200 ms)");
}

TEST(Reason, CallsWhatNeverCameByNoAge) {
  const auto never_ms = static_cast<float>(1e3 * to_seconds(Time{} - kNever));
  EXPECT_EQ(text({ReasonCode::kLinkLost, 0, never_ms, 200}),
            "no new packet over the link: check the network (never yet)");
}

TEST(Reason, SaysThousandsInFull) {
  EXPECT_EQ(text({ReasonCode::kLinkLost, 0, 1213.4F, 200}),
            "no new packet over the link: check the network (1213 ms; limit 200 ms)");
  EXPECT_EQ(text({ReasonCode::kLinkLost, 0, 203.4F, 0.125F}),
            "no new packet over the link: check the network (203 ms; limit 0.125 ms)");
}

TEST(Reason, SaysInWordsWhatANodeHasBecome) {
  EXPECT_EQ(text({ReasonCode::kNodeFault, 0x10, 0, 5}),
            "node 0x10: node is no longer operational: check it, then start again (it has started anew)");
  EXPECT_NE(text({ReasonCode::kNodeFault, 0x10, 4, 5}).find("(it is stopped)"), std::string::npos);
  EXPECT_NE(text({ReasonCode::kNodeFault, 0x10, 127, 5}).find("(it is pre-operational)"), std::string::npos);
  EXPECT_NE(text({ReasonCode::kNodeFault, 0x10, 3, 15}).find("(its valve's status is 0x0003)"), std::string::npos);
  constexpr float kNoNumber = std::numeric_limits<float>::quiet_NaN();
  for (const float foreign : {kNoNumber, -1.F, 1e20F, std::numeric_limits<float>::infinity()}) {
    const std::string none = "node 0x10: node is no longer operational: check it, then start again";
    EXPECT_EQ(text({ReasonCode::kNodeFault, 0x10, foreign, 5}), none);
    EXPECT_EQ(text({ReasonCode::kNodeFault, 0x10, 4, foreign}), none);
  }
}

TEST(Reason, SaysHowManyBytesAFrameHasAndHowManyAreMapped) {
  EXPECT_EQ(text({ReasonCode::kFrameShort, 0x31, 4, 6}),
            "node 0x31: process data is too short to be used: check the node's PDO mapping (frame has 4 bytes, 6 are "
            "mapped)");
}

TEST(Reason, SaysWhatAnotherSenderOnTheBusSent) {
  EXPECT_EQ(text({ReasonCode::kOtherController, 0, 0x080, 0}),
            "another controller is on the bus: stop one of the two (heard: SYNC 0x080)");
  EXPECT_NE(text({ReasonCode::kOtherController, 0, 0x000, 0}).find("(heard: NMT 0x000)"), std::string::npos);
  EXPECT_NE(text({ReasonCode::kOtherController, 0, 0x701, 0}).find("(heard: heartbeat 0x701)"), std::string::npos);
  EXPECT_EQ(text({ReasonCode::kForeignSender, 0x10, 0x210, 0}),
            "node 0x10: another sender on the bus commands this node: find it and take it off (heard: set-point "
            "0x210)");
  EXPECT_NE(text({ReasonCode::kForeignSender, 0x10, 0x610, 0}).find("(heard: SDO request 0x610)"), std::string::npos);
  EXPECT_EQ(text({ReasonCode::kForeignSender, 0x10, 1e20F, 0}).find("heard"), std::string::npos);
}

TEST(Reason, SaysHowANodeIdThatStandsTwiceShows) {
  EXPECT_EQ(text({ReasonCode::kNodeIdTwice, 0x22, 33, 20}),
            "node 0x22: two devices send under this node id: take one off, or give it another id (33 frames where 20 "
            "are due)");
  EXPECT_NE(text({ReasonCode::kNodeIdTwice, 0x22, 2, 1}).find("(two answers to one request)"), std::string::npos);
}

TEST(Reason, NamesASignalByAPlaceAboveAllNodeIdsWhereItsCodeMayNameOne) {
  const Reason stale{ReasonCode::kSensorStale, signal_subject(3), 31, 25};
  EXPECT_GT(stale.subject, 127);
  EXPECT_EQ(signal_of(stale), 3U);
  EXPECT_EQ(text(stale), "signal 3: sensor has stopped sending: check node and cable (31 ms; limit 25 ms)");
  EXPECT_FALSE(signal_of({ReasonCode::kSensorStale, 127, 31, 25})) << "a node id";
  EXPECT_FALSE(signal_of({ReasonCode::kNodeSilent, signal_subject(3), 260, 250})) << "a code of nodes alone";
  EXPECT_FALSE(signal_of({static_cast<ReasonCode>(9999), signal_subject(3), 0, 0})) << "a later version's code";
}

TEST(Reason, HasItsIdentifierInLogs) {
  EXPECT_EQ(text_with_code({ReasonCode::kLinkLost, 0, 203, 200}),
            "link_lost: no new packet over the link: check the network (203 ms; limit 200 ms)");
}

TEST(Reason, StandsWhileCodeAndSubjectStayWhateverIsMeasured) {
  const Reason moving{ReasonCode::kMachineMoving, 1, 0.3F, 0.1F};
  EXPECT_TRUE(same_cause(moving, {ReasonCode::kMachineMoving, 1, 0.4F, 0.1F}));
  EXPECT_FALSE(same_cause(moving, {ReasonCode::kMachineMoving, 2, 0.3F, 0.1F}));
  EXPECT_FALSE(same_cause(moving, {ReasonCode::kHandMoving, 1, 0.3F, 0.1F}));
}

}  // namespace
}  // namespace knuckle
