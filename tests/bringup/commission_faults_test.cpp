// What fails while a machine is commissioned is told by its name, and ends it before anything moves on.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "tests/bringup/commission_script.h"
#include "tests/support/places.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::bringup {
namespace {

using knuckle::test::ProgramRun;
using knuckle::test::TemporaryFolder;

std::string answers(const test::Script& script) {
  std::string lines;
  for (const std::string& word : script) lines += word + "\\n";
  return lines;
}

/// Of the simulated machine, by its words.
struct Commissioning {
  explicit Commissioning(const std::string& faults, const std::string& behind = "") {
    run = knuckle::test::run_program(
        "/bin/sh", {"-c", "printf '" + answers(test::all()) + "' | " + knuckle::test::program("knuckle") +
                              " commission --simulate --machine solar015 --no-log --record " + folder.path().string() +
                              " --out " + out() + " " + faults + behind});
  }
  [[nodiscard]] std::string out() const { return (folder.path() / "o.toml").string(); }
  [[nodiscard]] bool written() const { return std::filesystem::exists(out()); }
  [[nodiscard]] std::string all() const { return run.out + run.err; }
  [[nodiscard]] bool tells(const std::string& text) const { return all().find(text) != std::string::npos; }

  TemporaryFolder folder;
  ProgramRun run;
};

TEST(CommissionFaults, ASensorThatIsInvalidEndsItAndIsNamed) {
  struct Case {
    const char* fault;
    const char* text;
  };
  for (const Case& c : std::initializer_list<Case>{
           {"sensor_invalid:tilt@0", "tilt: reports an impossible slope"},
           {"sensor_invalid:tilt@10", "tilt (node 0x38) reports an impossible value"},
           {"sensor_invalid:tilt@20", "tilt (node 0x38) reports an impossible value"},
           {"sensor_invalid:tilt@40", "tilt (node 0x38) reports an impossible value"},
           {"sensor_invalid:boom_encoder@0", "boom_encoder: reports an impossible value"},
           {"sensor_invalid:boom_encoder@4", "boom_encoder (node 0x30) reports an impossible value"},
           {"sensor_invalid:boom_encoder@10", "boom_encoder (node 0x30) reports an impossible value"},
           {"sensor_invalid:boom_head_pressure@10", "boom_head_pressure (node 0x20) reports an impossible value"},
       }) {
    const Commissioning made(std::string("--fault ") + c.fault);
    EXPECT_EQ(made.run.exit_code, 1) << c.fault;
    EXPECT_TRUE(made.tells(c.text)) << c.fault << made.all();
    EXPECT_FALSE(made.written()) << c.fault;
  }
}

TEST(CommissionFaults, AnInvalidSensorAtItsBeginningEndsItBeforeNodesAreConfigured) {
  for (const char* sensor : {"boom_encoder", "tilt"}) {
    const Commissioning made(std::string("--fault sensor_invalid:") + sensor + "@0");
    EXPECT_FALSE(made.tells("configured and started")) << sensor;
  }
}

TEST(CommissionFaults, ASpoolThatDoesNotFollowIsNamedAndNotThePilotPressureThatItCosts) {
  const Commissioning made("--fault valve_stuck:arm_valve@0");
  EXPECT_EQ(made.run.exit_code, 1);
  EXPECT_TRUE(made.tells("arm_valve: guard not proved: its spool does not follow a small command")) << made.run.out;
  EXPECT_TRUE(made.tells("arm_valve (node 0x11): its spool does not follow its command")) << made.run.err;
  EXPECT_FALSE(made.tells("no pilot pressure"));
}

/// At some moments about the trials of the valves' guards: which of them a moment meets, start-up's length decides.
std::vector<std::string> at_moments(const std::string& fault) {
  std::vector<std::string> all;
  for (double at_s = 11; at_s < 14; at_s += 0.02) all.push_back(fmt::format("--fault {}@{:.2f}", fault, at_s));
  return all;
}

TEST(CommissionFaults, AnErrorBeforeAGuardCouldActIsNoProofAndTold) {
  bool met = false;
  for (const std::string& fault : at_moments("node_emergency:arm_valve")) {
    const Commissioning made(fault);
    met = made.tells("arm_valve: guard not proved: it told error 0xFF00 after");
    if (!met) continue;
    EXPECT_TRUE(made.tells("before its guard could act (50 ms)")) << made.all();
    EXPECT_FALSE(made.tells("arm_valve: guard proved")) << made.all();
    break;
  }
  EXPECT_TRUE(met);
}

TEST(CommissionFaults, AnErrorThatANodeTellsBesideAGuardsTrialIsTold) {
  bool met = false;
  for (const std::string& fault : at_moments("node_emergency:enable")) {
    met = Commissioning(fault).tells("enable (node 0x40): 0xFF00");
    if (met) break;
  }
  EXPECT_TRUE(met);
}

TEST(CommissionFaults, AnOutputThatNobodyCanReadEndsItBeforeAnythingIsConfigured) {
  for (const char* where : {" > /dev/full", " >&-"}) {
    const Commissioning made("", where);
    EXPECT_EQ(made.run.exit_code, 2) << where << made.all();
    EXPECT_TRUE(made.tells("standard output: cannot be written")) << where << made.all();
    EXPECT_FALSE(made.written()) << where;
  }
}

TEST(CommissionFaults, WithoutThemNothingOfTheKindIsTold) {
  const Commissioning made("");
  EXPECT_EQ(made.run.exit_code, 0) << made.all();
  EXPECT_TRUE(made.written());
  EXPECT_FALSE(made.tells("emergency")) << made.run.out;
}

}  // namespace
}  // namespace knuckle::bringup
