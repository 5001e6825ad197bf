// Machine files with frames of a DBC.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "app/eds/dbc_import.h"
#include "machine/load.h"
#include "tests/eds/machine_texts.h"
#include "tests/support/refusal.h"

namespace knuckle::test {

/// What the machine's own controller sends.
inline constexpr const char* kSentDbc = R"(VERSION ""
BU_: Machine
BO_ 2566852641 Front: 8 Machine
 SG_ boom : 0|16@1+ (0.0004,-10) [-10|10] "rad" Vector__XXX
 SG_ arm : 16|16@1+ (0.0004,-10) [-10|10] "rad" Vector__XXX
 SG_ bucket : 39|16@0- (0.01,0) [-180|180] "deg" Vector__XXX
BO_ 426 Body: 8 Machine
 SG_ slope : 0|16@1- (0.01,0) [-90|90] "deg" Vector__XXX
 SG_ boom : 16|16@1+ (0.0004,-10) [0|0] "rad" Vector__XXX
 SG_ alive : 48|4@1+ (1,0) [0|14] "" Vector__XXX
 SG_ crc : 56|8@1+ (1,0) [0|255] "" Vector__XXX
BO_ 2147483681 Small: 4 Machine
 SG_ slope : 0|32@1- (1,0) [0|0] "rad" Vector__XXX
BO_ 500 Mixed: 8 Machine
 SG_ which M : 0|8@1+ (1,0) [0|0] "" Vector__XXX
 SG_ slope m1 : 8|16@1- (0.01,0) [0|0] "deg" Vector__XXX
 SG_ pace : 24|16@1+ (1,0) [0|0] "furlong" Vector__XXX
 SG_ turn : 40|8@1+ (0.01,0) [0|0] "rad" Vector__XXX
 SG_ arm m3 : 8|16@1+ (0.0004,-10) [0|0] "rad" Vector__XXX
 SG_ own m1 : 48|8@1+ (1,0) [0|0] "" Vector__XXX
 SG_ alive : 56|8@1+ (1,0) [0|0] "" Vector__XXX
BO_ 502 Nested: 8 Machine
 SG_ outer M : 0|8@1+ (1,0) [0|0] "" Vector__XXX
 SG_ inner m1M : 8|8@1+ (1,0) [0|0] "" Vector__XXX
 SG_ deep m2 : 16|16@1- (0.01,0) [0|0] "deg" Vector__XXX
 SG_ wide m3 : 32|16@1- (0.01,0) [0|0] "deg" Vector__XXX
BO_ 2364539904 Engine: 8 Machine
 SG_ turns : 24|16@1+ (0.125,0) [0|0] "rpm" Vector__XXX
BO_ 501 Rare: 2 Machine
 SG_ slope : 0|16@1- (0.01,0) [0|0] "deg" Vector__XXX
BO_ 503 Alive: 1 Machine
 SG_ count : 0|8@1+ (1,0) [0|0] "" Vector__XXX
BA_DEF_ BO_ "GenMsgCycleTime" INT 0 60000;
BA_DEF_ BO_ "VFrameFormat" ENUM "StandardCAN","ExtendedCAN","reserved","J1939PG";
BA_DEF_DEF_ "GenMsgCycleTime" 0;
BA_DEF_DEF_ "VFrameFormat" "StandardCAN";
BA_ "GenMsgCycleTime" BO_ 2566852641 10;
BA_ "GenMsgCycleTime" BO_ 426 10;
BA_ "GenMsgCycleTime" BO_ 2147483681 10;
BA_ "GenMsgCycleTime" BO_ 500 5;
BA_ "GenMsgCycleTime" BO_ 502 10;
BA_ "GenMsgCycleTime" BO_ 503 10;
BA_ "VFrameFormat" BO_ 2566852641 3;
BA_ "VFrameFormat" BO_ 2364539904 3;
BA_ "GenMsgCycleTime" BO_ 2364539904 100;
SIG_VALTYPE_ 2147483681 slope : 1;
SG_MUL_VAL_ 502 inner outer 1-1;
SG_MUL_VAL_ 502 deep inner 2-2;
SG_MUL_VAL_ 502 wide outer 3-4;
)";

/// On its bus for a frame more than the shipped machine has.
inline std::string roomy_text() {
  return replaced(shipped_text(), "\nvalve_status_every_nth_sync = 4", "\nvalve_status_every_nth_sync = 8");
}

inline eds::Import imported(const eds::ImportOptions& said, const std::string& dbc, const std::string& machine) {
  return eds::with_frames(machine, "m.toml", eds::parse_dbc(dbc, "m.dbc"), eds::wanted_of(said));
}
/// Of the machine file that it has become.
inline BusDescription bus_of(const eds::Import& import) {
  return parse_machine(import.text, "m.toml").bus;
}
inline bool has_line(const std::vector<std::string>& lines, const std::string& line) {
  return std::find(lines.begin(), lines.end(), line) != lines.end();
}

/// In one line, which has `said` in it.
template <typename Act>
void expect_refused(const Act& act, const std::string& said) {
  const std::string line = refusal(act);
  EXPECT_TRUE(says(line, said));
  EXPECT_FALSE(says(line, "\n"));
}

}  // namespace knuckle::test
