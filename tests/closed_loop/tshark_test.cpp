// Wireshark's CANopen decoder as the judge of what is on the wire: every frame kind, and nothing it finds fault with.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <set>
#include <sstream>

#include "tests/closed_loop/session_rig.h"
#include "tests/slave/bench_machine.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"
#include "transport/timed_frame.h"

namespace knuckle::test {
namespace {

/// One frame as tshark tells of it.
struct Decoded {
  std::string kind, malformed, severity, emergency, abort, state, index;
  [[nodiscard]] bool faulty() const {
    const bool named = kind.find("nknown") == std::string::npos && !kind.empty();
    return !named || !malformed.empty() || !severity.empty() || kind.find("alformed") != std::string::npos;
  }
};

class Tshark : public ::testing::Test {
 protected:
  void SetUp() override {
    if (run_program("tshark", {"--version"}).exit_code != 0)
      GTEST_SKIP() << "NOT TESTED: tshark is not installed, so nobody else has looked at our CAN frames";
  }

  /// Frames in the order of the log. Text that is empty where a frame has no such field.
  [[nodiscard]] std::vector<Decoded> decode(const std::string& log) const {
    const std::string file = folder_.file("session.log");
    std::ofstream(file) << log;
    std::vector<std::string> arguments{"-r", file,     "-d", "can.subdissector,canopen",
                                       "-T", "fields", "-E", "separator=|"};
    for (const char* field : {"_ws.col.Info", "_ws.malformed", "_ws.expert.severity", "canopen.em.err_code",
                              "canopen.sdo.abort_code", "canopen.nmt_guard.state", "canopen.sdo.main_idx"}) {
      arguments.insert(arguments.end(), {"-e", field});
    }
    const ProgramRun run = run_program("tshark", arguments);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    std::vector<Decoded> frames;
    std::istringstream lines(run.out);
    for (std::string line; std::getline(lines, line);) {
      std::array<std::string, 7> cells;
      std::istringstream row(line);
      for (std::string& cell : cells) std::getline(row, cell, '|');
      frames.push_back({cells[0], cells[1], cells[2], cells[3], cells[4], cells[5], cells[6]});
    }
    return frames;
  }

 private:
  TemporaryFolder folder_;
};

/// What a frame is by its identifier (CiA 301, pre-defined connection set), in tshark's words.
std::string expected_kind(std::uint32_t id) {
  if (id == 0) return "NMT: ";
  if (id == 0x080) return "SYNC";
  switch (id & 0x780U) {
    case 0x080:
      return "EMCY";
    case 0x180:
      return "PDO1 (tx)";
    case 0x200:
      return "PDO1 (rx)";
    case 0x580:
      return "Default-SDO (tx): ";
    case 0x600:
      return "Default-SDO (rx): ";
    case 0x700:
      return "NMT Error Control: ";
    default:
      return "no frame of ours";
  }
}

void expect_flawless(const std::vector<Decoded>& decoded, const std::vector<std::uint32_t>& ids) {
  ASSERT_EQ(decoded.size(), ids.size());
  for (std::size_t i = 0; i < ids.size(); ++i) {
    ASSERT_FALSE(decoded[i].faulty()) << "frame " << i + 1 << ": " << decoded[i].kind << " " << decoded[i].malformed;
    ASSERT_TRUE(decoded[i].kind.starts_with(expected_kind(ids[i]))) << "frame " << i + 1 << ": " << decoded[i].kind;
  }
}

TEST_F(Tshark, DecodesEveryFrameKindWithItsContent) {
  BenchMachine m;
  ASSERT_TRUE(m.engage());
  m.move(JointVector(0.2, -0.2, -0.2), 200ms);
  ASSERT_TRUE(m.nodes.send_emcy(0x25, 0x5030));
  m.bus.port(0).send(canopen::sdo_upload(0x10, {0x2FFF, 0}));          // no such object
  m.bus.port(0).send(canopen::sdo_download(0x11, {0x1000, 0}, 7, 4));  // not to be written
  m.bus.port(0).send(canopen::nmt_frame(canopen::NmtCommand::kStop, 0x38));
  m.bus.port(0).send(canopen::nmt_frame(canopen::NmtCommand::kResetNode, 0x24));
  m.bus.port(0).send(canopen::nmt_frame(canopen::NmtCommand::kResetCommunication, 0x32));
  m.run(300ms);
  ASSERT_TRUE(m.nodes.send_emcy(0x25, 0));
  m.run(50ms);

  std::stringstream log;
  std::vector<std::uint32_t> ids;
  for (const auto& w : m.wire) {
    log << candump_line(w.at, w.frame) << '\n';
    ids.push_back(w.frame.id);
  }
  const auto decoded = decode(log.str());
  expect_flawless(decoded, ids);
  std::set<std::string> kinds, emergencies, aborts, states, indices;
  for (const Decoded& d : decoded) {
    kinds.insert(d.kind.substr(0, d.kind.find(" [")));
    emergencies.insert(d.emergency);
    aborts.insert(d.abort);
    states.insert(d.state);
    indices.insert(d.index);
  }
  for (const char* kind :
       {"NMT: Reset node", "NMT: Enter pre-operational state", "NMT: Start remote node", "NMT: Stop remote node",
        "NMT: Reset communication", "SYNC", "EMCY", "PDO1 (tx)", "PDO1 (rx)", "NMT Error Control: Boot-up",
        "NMT Error Control: Pre-operational", "NMT Error Control: Operational", "NMT Error Control: Stopped",
        "Default-SDO (rx): Initiate upload request", "Default-SDO (tx): Initiate upload response",
        "Default-SDO (rx): Initiate download request", "Default-SDO (tx): Initiate download response",
        "Default-SDO (tx): Abort transfer"}) {
    EXPECT_TRUE(kinds.contains(kind)) << kind;
  }
  EXPECT_EQ(emergencies, (std::set<std::string>{"", "0x0000", "0x5030"}));
  EXPECT_EQ(aborts, (std::set<std::string>{"", "0x06020000", "0x06010002"}));
  EXPECT_EQ(states, (std::set<std::string>{"", "0x00", "0x04", "0x05", "0x7f"}));
  for (const char* index : {"0x1000", "0x1018", "0x1016", "0x1017", "0x1400", "0x1600", "0x1800", "0x1a00", "0x6042",
                            "0x6131", "0x6132", "0x6005", "0x6000"}) {
    EXPECT_TRUE(indices.contains(index)) << index;
  }
}

TEST_F(Tshark, FindsNoFaultInASessionThatEndsInOne) {
  session::SessionSetup setup = session_setup("free_motion", 1);
  setup.scenario.faults = {{sim::FaultKind::kNodeEmergency, 1, 1.0, 0.5, 0x21}};
  setup.scenario.duration_s = 8;
  std::stringstream log;
  std::vector<std::uint32_t> ids;
  for (const TimedFrame& f : run_session(setup).frames) {
    log << candump_line(f.at, f.frame) << '\n';
    ids.push_back(f.frame.id);
  }
  ASSERT_GT(ids.size(), 10000U);
  const auto decoded = decode(log.str());
  expect_flawless(decoded, ids);
  EXPECT_TRUE(std::any_of(decoded.begin(), decoded.end(), [](const Decoded& d) { return d.emergency == "0xff00"; }));
}

TEST_F(Tshark, WouldSeeABrokenFrame) {
  const std::array<std::string, 7> frames{
      "610#4000", "090#3081", "000#01", "710#33", "000#7700", "590#FF00100000000206", "780#00"};
  std::string log;
  for (const std::string& frame : frames) log += "(0000000000.000000) can0 " + frame + "\n";
  const auto decoded = decode(log);
  ASSERT_EQ(decoded.size(), frames.size());
  for (std::size_t i = 0; i < frames.size(); ++i) EXPECT_TRUE(decoded[i].faulty()) << frames[i] << decoded[i].kind;
}

}  // namespace
}  // namespace knuckle::test
