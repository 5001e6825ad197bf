// What a person reads of a reason.
#include "core/reason.h"

#include <gtest/gtest.h>

#include <limits>
#include <utility>

#include "core/time.h"

namespace knuckle {
namespace {

TEST(Reason, SaysWhatWasMeasuredAgainstWhat) {
  constexpr float kNoNumber = std::numeric_limits<float>::quiet_NaN();
  const auto never_ms = static_cast<float>(1e3 * to_seconds(Time{} - kNever));
  const std::pair<Reason, const char*> cases[] = {
      {{ReasonCode::kLinkLost, 0, 1213.4F, 200}, "check the network (1213 ms; limit 200 ms)"},
      {{ReasonCode::kLinkLost, 0, 203.4F, 0.125F}, "check the network (203 ms; limit 0.125 ms)"},
      {{ReasonCode::kLinkLost, 0, never_ms, 200}, "check the network (never yet)"},
      {{ReasonCode::kNodeFault, 0x10, 0, 5}, "(it has started anew)"},
      {{ReasonCode::kNodeFault, 0x10, 4, 5}, "(it is stopped)"},
      {{ReasonCode::kNodeFault, 0x10, 127, 5}, "(it is pre-operational)"},
      {{ReasonCode::kNodeFault, 0x10, 3, 15}, "(its valve's status is 0x0003)"},
      {{ReasonCode::kNodeFault, 0x10, kNoNumber, 5}, "check it, then start again"},
      {{ReasonCode::kNodeFault, 0x10, -1, 5}, "check it, then start again"},
      {{ReasonCode::kNodeFault, 0x10, 1e20F, 5}, "check it, then start again"},
      {{ReasonCode::kNodeFault, 0x10, 4, kNoNumber}, "check it, then start again"},
      {{ReasonCode::kFrameShort, 0x31, 4, 6}, "(frame has 4 bytes, 6 are mapped)"},
      {{ReasonCode::kOtherController, 0, 0x080, 0}, "(heard: SYNC 0x080)"},
      {{ReasonCode::kOtherController, 0, 0x000, 0}, "(heard: NMT 0x000)"},
      {{ReasonCode::kOtherController, 0, 0x701, 0}, "(heard: heartbeat 0x701)"},
      {{ReasonCode::kForeignSender, 0x10, 0x210, 0}, "(heard: set-point 0x210)"},
      {{ReasonCode::kForeignSender, 0x10, 0x610, 0}, "(heard: SDO request 0x610)"},
      {{ReasonCode::kForeignSender, 0x10, 1e20F, 0}, "find it and take it off"},
      {{ReasonCode::kNodeIdTwice, 0x22, 33, 20}, "(33 frames where 20 are due)"},
      {{ReasonCode::kNodeIdTwice, 0x22, 2, 1}, "(two answers to one request)"},
  };
  for (const auto& [reason, end] : cases) EXPECT_TRUE(text(reason).ends_with(end)) << end << " in " << text(reason);
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
