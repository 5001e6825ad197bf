// What a person reads of a reason whose machine is known.
#include "machine/reason_text.h"

#include <gtest/gtest.h>

#include "tests/support/few_nodes.h"
#include "tests/support/shipped.h"

namespace knuckle {
namespace {

BusDescription one_transmitter() {
  return parse_machine(test::few_nodes_text(), "few_nodes.toml").bus;
}
BusDescription six_transmitters() {
  return test::shipped("solar015").bus;
}
std::uint8_t place_named(const std::string& signal) {
  std::uint8_t place = 0;
  while (kSignals.at(place).name != signal) ++place;
  return place;
}

TEST(ReasonText, SaysNodeAndSignalByTheirNames) {
  struct Case {
    Reason reason;
    const char *of_one, *of_six;
  };
  const std::uint8_t arm_head = signal_subject(place_named("arm_head_pressure"));
  const Case cases[] = {
      {{ReasonCode::kSensorStale, arm_head, 31, 25},
       "pressures (node 0x20), arm_head_pressure: sensor has stopped sending: check node and cable (31 ms; limit 25 "
       "ms)",
       "arm_head_pressure (node 0x22), arm_head_pressure: sensor has stopped sending: check node and cable (31 ms; "
       "limit 25 ms)"},
      {{ReasonCode::kSensorStale, 0x20, 31, 25},
       "pressures (node 0x20): sensor has stopped sending: check node and cable (31 ms; limit 25 ms)",
       "boom_head_pressure (node 0x20): sensor has stopped sending: check node and cable (31 ms; limit 25 ms)"},
      {{ReasonCode::kNodeFault, 0x11, 127, 5},
       "arm_valve (node 0x11): node is no longer operational: check it, then start again (it is pre-operational)",
       "arm_valve (node 0x11): node is no longer operational: check it, then start again (it is pre-operational)"},
      {{ReasonCode::kNodeSilent, 0x77, 260, 250},
       "node 0x77: heartbeat is missing: check node power and bus (260 ms; limit 250 ms)",
       "node 0x77: heartbeat is missing: check node power and bus (260 ms; limit 250 ms)"},
      {{ReasonCode::kSensorStale, 0xFF, 31, 25},
       "signal 127: sensor has stopped sending: check node and cable (31 ms; limit 25 ms)",
       nullptr},
      {{ReasonCode::kNodeSilent, 0x83, 260, 250},  // not of those that may name a signal
       "node 0x83: heartbeat is missing: check node power and bus (260 ms; limit 250 ms)",
       nullptr},
  };
  for (const auto& [reason, of_one, of_six] : cases) {
    EXPECT_EQ(text(reason, one_transmitter()), of_one);
    if (of_six != nullptr) {
      EXPECT_EQ(text(reason, six_transmitters()), of_six);
    }
    EXPECT_EQ(text_with_code(reason, one_transmitter()), std::string(name(reason.code)) + ": " + of_one);
  }
}

TEST(ReasonText, OfEveryCodeNamesWhatTheCodeIsAbout) {
  const BusDescription bus = one_transmitter();
  for (int i = 0; i < static_cast<int>(ReasonCode::kCount); ++i) {
    const auto code = static_cast<ReasonCode>(i);
    const SubjectKind kind = subject_kind(code);
    const Reason of_node{code, 0x20, 1, 2}, of_signal{code, signal_subject(3), 1, 2};
    const bool node = kind == SubjectKind::kNode || kind == SubjectKind::kNodeOrSignal;
    EXPECT_EQ(subject_text(of_node, bus), node ? "pressures (node 0x20)" : subject_text(of_node)) << name(code);
    const std::string words = "pressures (node 0x20), boom_head_pressure";
    EXPECT_EQ(subject_text(of_signal, bus) == words, kind == SubjectKind::kNodeOrSignal) << name(code);
    EXPECT_EQ(text(of_signal, bus), text_about(subject_text(of_signal, bus), of_signal)) << name(code);
  }
}

TEST(ReasonText, WithoutTheMachineASignalHasItsNameAndANodeItsNumber) {
  EXPECT_EQ(subject_text({ReasonCode::kSensorStale, signal_subject(place_named("slope")), 31, 25}, {}), "slope");
  EXPECT_EQ(subject_text({ReasonCode::kSensorStale, 0x20, 31, 25}, {}), "node 0x20");
}

TEST(ReasonText, FindsTheNodeOfASignal) {
  const BusDescription bus = one_transmitter();
  const auto node = [&bus](ReasonCode code, std::uint8_t subject) { return node_of({code, subject, 0, 0}, bus); };
  EXPECT_EQ(node(ReasonCode::kSensorStale, signal_subject(place_named("bucket_rod_pressure"))), bus.find(0x20));
  EXPECT_EQ(node(ReasonCode::kSensorStale, 0x31), bus.find(0x31));
  EXPECT_EQ(node(ReasonCode::kNodeSilent, 0x11), bus.find(0x11));
  EXPECT_EQ(node(ReasonCode::kSensorStale, 0x77), nullptr);
  EXPECT_EQ(node(ReasonCode::kSensorStale, 0xFF), nullptr);
  EXPECT_EQ(node(ReasonCode::kJointLimit, 0x11), nullptr) << "a joint";
}

TEST(ReasonText, ASignalIsNamedWhereItsNodeHasSeveral) {
  const BusDescription one = one_transmitter(), six = six_transmitters();
  EXPECT_EQ(subject_of(NodeRole::kPressure, 2, one), signal_subject(place_named("arm_head_pressure")));
  EXPECT_EQ(subject_of(NodeRole::kPressure, 2, six), 0x22);
  EXPECT_EQ(subject_of(NodeRole::kEncoder, kArm, one), 0x31);
  EXPECT_EQ(subject_of(NodeRole::kTilt, 0, one), 0x38);
}

// They stand in recordings and on the link: one that is moved names another sensor there.
TEST(ReasonText, SignalsKeepTheirPlaces) {
  std::string places;
  for (std::size_t i = 0; i < 26; ++i) places += std::string(kSignals.at(i).name) + ' ';
  EXPECT_EQ(places,
            "boom_spool arm_spool bucket_spool boom_head_pressure boom_rod_pressure arm_head_pressure arm_rod_pressure "
            "bucket_head_pressure bucket_rod_pressure boom_length boom_angle arm_length arm_angle bucket_length "
            "bucket_angle slope machine_enable e_stop_closed pilot_on engine_speed engine_running oil_temperature "
            "coolant_temperature engine_hours battery_voltage fuel_level ");
}

}  // namespace
}  // namespace knuckle
