// What a commissioning writes: the machine file with what differs, and the record behind it.
#include "app/bringup/commission_result.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "app/bringup/commission_dialogue.h"
#include "app/motion/led_machine.h"
#include "app/recordings/recording_reader.h"
#include "machine/load.h"
#include "machine/toml_reader.h"
#include "tests/bringup/machine_kinds.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"
#include "transport/canopen.h"

namespace knuckle::bringup {
namespace {

using knuckle::test::says;
using test::solar;

TEST(CommissionResult, IsTheMachineFileWithADeadBandThatDiffersAndTheRecordBehindIt) {
  const std::string drawing = knuckle::test::content(solar().source);
  WizardResult result;
  result.axes[kArm] = {0.45, 0.0123, true, 0.15503, 0.125};
  result.tilt_error_rad = 0.01;
  result.nodes.push_back({});
  result.guards = {{"arm_valve", 0x4B4E, 0x0408, 0x77, true, "spool back", "1 = arm_spool"},
                   {"bucket_valve", 0x4B4E, 0x0409, 0x78, true, "of another product", "1 = bucket_spool"},
                   {"enable", 0x4B4E, 0x0401, {}, false, "stayed on", "1 = machine_enable"},
                   {"gone", 1, 1, 1, true, "x", "1 = boom_spool"}};
  result.findings.push_back({Finding::Level::kNote, "arm", "a \"quoted\" line"});
  result.recordings = {"slow.csv", "fast.csv"};
  const ResultOrigin origin{"can0", "2026-01-02T03:04:05Z", "abc"};
  const std::string text = commissioned_text(drawing, solar(), result, origin);

  const MachineDescription back = parse_machine(text, "found.toml");
  EXPECT_EQ(back.cylinders[kArm].valve.dead_band_extend, 0.155);
  EXPECT_EQ(back.cylinders[kArm].valve.dead_band_retract, 0.11);  // no further off than a ramp may be
  EXPECT_EQ(back.cylinders[kBoom].valve.dead_band_extend, 0.11);
  EXPECT_EQ(back.bus.valve(kArm).guard, (GuardProof{true, 0x77, origin.date}));
  EXPECT_EQ(back.bus.enable().guard, (GuardProof{false, 0, origin.date}));
  EXPECT_EQ(back.bus.valve(kBoom).guard, GuardProof());
  EXPECT_EQ(back.bus.valve(kBucket).guard, (GuardProof{true, 0x78, origin.date, GuardProof::Changed::kDevice}));
  const auto changed_by = [&](const std::string& from, const std::string& to) {
    std::string other = text;
    return parse_machine(other.replace(other.find(from), from.size(), to), "other.toml").bus.valve(kArm).guard.changed;
  };
  using Changed = GuardProof::Changed;
  EXPECT_EQ(changed_by("valve_watchdog_ms = 50 ", "valve_watchdog_ms = 60 "), Changed::kTimes);
  EXPECT_EQ(changed_by("channels = \"1 = arm_spool\"", "channels = \"1 = arm_spool, 2 = boom_spool\""),
            Changed::kChannels);
  EXPECT_EQ(changed_by("channels = \"1 = arm_spool\"\nvalve_watchdog_ms = 50\ncontroller_timeout_ms = 150\n", ""),
            Changed::kNotRecorded);
  std::string changed = drawing;
  const std::size_t arm = changed.find("[cylinders.arm.valve]");
  changed.replace(changed.find("dead_band_extend = 0.11", arm), 23, "dead_band_extend = 0.155");
  EXPECT_EQ(text.compare(0, changed.size(), changed), 0);

  TomlTable record = TomlTable::parse(text, "found.toml").table("commissioning");
  EXPECT_EQ(record.text("bus"), "can0");
  TomlTable axis = record.table("axes").table("arm");
  EXPECT_NEAR(axis.number("encoder_offset_mm", -100, 100), 12.3, 1e-9);
  EXPECT_TRUE(axis.boolean("encoder_preset"));
  EXPECT_NEAR(axis.number("dead_band_retract", 0, 1), 0.125, 1e-9);
  EXPECT_FALSE(record.table("axes").table("boom").has("dead_band_extend"));
  EXPECT_EQ(record.tables("nodes").size(), 1U);
  EXPECT_EQ(record.tables("findings")[0].text("text"), "a \"quoted\" line");

  // Commissioned once more, only what was found then counts.
  EXPECT_EQ(commissioned_text(text, back, result, origin), text);
}

TEST(CommissionResult, ReplacesTheDeadBandsOfAnEarlierIdentification) {
  const std::string file =
      knuckle::test::content(solar().source) +
      "\n[calibration]\nmethod = \"m\"\ndate = \"d\"\ndata_source = \"s\"\ndata_sha256 = \"" + std::string(64, '0') +
      "\"\nprogram = \"p\"\n"
      "[calibration.valves.boom]\ndead_band_extend = 0.1\ndead_band_retract = 0.1\ndelay_ms = 15\n"
      "nominal_flow_Lpm = 30\ncurve_exponent = 1\nretract_share = 1\n[calibration.valves.arm]\ndead_band_extend = "
      "0.1\ndead_band_retract = 0.1\n"
      "delay_ms = 15\nnominal_flow_Lpm = 25\ncurve_exponent = 1\nretract_share = "
      "1\n[calibration.valves.bucket]\ndead_band_extend = 0.1  # was 0.11\n"
      "dead_band_retract = 0.1\ndelay_ms = 15\nnominal_flow_Lpm = 20\ncurve_exponent = 1\nretract_share = 1\n";
  const MachineDescription machine = calibrated(parse_machine(file, "calibrated.toml"));
  WizardResult result;
  result.axes[kBucket].dead_band_extend = 0.2;
  const std::string text = commissioned_text(file, machine, result, {});
  EXPECT_EQ(calibrated(parse_machine(text, "found.toml")).cylinders[kBucket].valve.dead_band_extend, 0.2);
  EXPECT_TRUE(says(text, "# was 0.11"));
}

TEST(CommissionResult, FileThatItCouldNotBePutIntoIsRefusedAtTheBeginning) {
  EXPECT_NO_THROW(check_layout(knuckle::test::content(solar().source), solar()));
  struct Case {
    std::string text, from, to, said;
  };
  for (const Case& c : {
           Case{knuckle::test::content(solar().source), "[cylinders.arm.valve]", "[cylinders.\"arm\".valve]",
                "[cylinders.arm.valve]: commissioning needs dead_band_extend and dead_band_retract on one line each"},
           {knuckle::test::command_text(),
            "boom_angle = { start = 0, bits = 16, scale = 0.0004, offset = -10, unit = \"rad\", sign = -1, "
            "zero_rad = 0.12 }",
            "boom_angle.start = 0\nboom_angle.bits = 16\nboom_angle.scale = 0.0004\nboom_angle.offset = -10\n"
            "boom_angle.unit = \"rad\"\nboom_angle.sign = -1",
            "boom_angle: commissioning needs it on one line"},
           {test::voltages_text(),
            "8 = { signal = \"boom_angle\", range = \"0.5-4.5V\", counts_low = 3276, counts_high = 29490, low = -1.6, "
            "high = 2.4, unit = \"rad\" }",
            "8.signal = \"boom_angle\"\n8.range = \"0.5-4.5V\"\n8.counts_low = 3276\n8.counts_high = 29490\n"
            "8.low = -1.6\n8.high = 2.4\n8.unit = \"rad\"",
            "[bus.node.inputs] boom_angle: commissioning needs it on one line"},
       }) {
    const std::string text = test::with(c.text, c.from, c.to);
    const MachineDescription machine = test::machine_of(text);
    EXPECT_TRUE(says(knuckle::test::refusal([&] { check_layout(text, machine); }), c.said));
  }
}

namespace fs = std::filesystem;
using test::simulated_bus;

class CommissionRecord : public testing::Test {
 protected:
  CommissionRecord() {
    bus_->bus().set_tap({[](void* self, Time at, const CanFrame& frame) {
                           if (frame.id == canopen::kSyncId) static_cast<CommissionRecord*>(self)->syncs_.push_back(at);
                         },
                         this});
  }
  /// SYNC waits for the frame on the wire at most; the first step is a millisecond late.
  void expect_sync_period() const {
    ASSERT_GT(syncs_.size(), 100U);
    for (std::size_t i = 2; i < syncs_.size(); ++i) {
      ASSERT_GT(syncs_[i] - syncs_[i - 1], 4500us) << i << " of " << syncs_.size();
      ASSERT_LT(syncs_[i] - syncs_[i - 1], 5500us) << i << " of " << syncs_.size();
    }
  }
  [[nodiscard]] std::size_t files() const { return static_cast<std::size_t>(folder_.count()); }

  std::shared_ptr<sim::MachineOnBus> bus_ = simulated_bus();
  BusAccess access_ = sim::access_to(bus_);
  std::vector<Time> syncs_;
  knuckle::test::TemporaryFolder folder_;
};

TEST_F(CommissionRecord, TheWayOutKeepsTheBusAtItsRate) {
  motion::LedMachine led(solar(), access_, access_.now());
  led.engage();
  const std::size_t before = syncs_.size();
  led.neutral();
  EXPECT_NEAR(static_cast<double>(syncs_.size() - before), 60, 1) << "300 ms at 200 Hz";
  expect_sync_period();
  EXPECT_EQ(bus_->machine().nodes().outputs().spool_demand, JointVector::Zero());
}

TEST_F(CommissionRecord, WhoeverStopsItInMotionLeavesAClosedMachineAndNoFile) {
  bool moved = false;
  const auto stopped = [&] {
    moved = bus_->plant().cylinder_mps.cwiseAbs().maxCoeff() > 0.02;
    return moved;
  };
  EXPECT_THROW((void)record_motions(solar(), access_, {}, folder_.path().string(), stopped), CommissionEnded);
  EXPECT_TRUE(moved);
  expect_sync_period();
  EXPECT_EQ(bus_->machine().nodes().outputs().spool_demand, JointVector::Zero());
  EXPECT_EQ(files(), 0U);
}

}  // namespace

}  // namespace knuckle::bringup
