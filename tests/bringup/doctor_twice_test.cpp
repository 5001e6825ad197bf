// Heartbeats and frames are counted and measured as heard: one node id that two devices have, and a second controller.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <functional>
#include <nlohmann/json.hpp>

#include "app/bringup/doctor_bus.h"
#include "app/bringup/doctor_command.h"
#include "tests/bringup/hardware_bench.h"
#include "tests/bringup/surveyed.h"
#include "tests/support/says.h"
#include "transport/canopen.h"

namespace knuckle::bringup {
namespace {

using knuckle::test::says;
using test::brief;
using test::faults;
using test::few_nodes;
using test::line;
using test::look;
using test::running;
using test::said;
using test::say;
using test::simulated_bus;
using test::solar;

/// A second device with a node's id, that answers and sends what the first one does.
std::shared_ptr<sim::MachineOnBus> doubled(std::uint8_t node) {
  auto bus = simulated_bus();
  bus->nodes_end().double_node(node, true);
  return bus;
}

TEST(DoctorBus, ANodeIdThatTwoDevicesAnswerToIsAFaultThatNamesIt) {
  for (const std::uint8_t id : std::initializer_list<std::uint8_t>{0x10, 0x22, 0x40}) {
    const BusDiagnosis diagnosis = look(doubled(id));
    const std::string told = faults(diagnosis);
    EXPECT_EQ(std::count(told.begin(), told.end(), '\n'), 1) << told;
    EXPECT_EQ(told.find("node 0x" + fmt::format("{:02X}", id)), 0U) << told;
    EXPECT_TRUE(says(told, "two devices have this node id ("));
    EXPECT_TRUE(says(told, " of its answers came once more"));
  }
}

TEST(DoctorBus, OfANodeWithSeveralPdosTheFramesOfEachAreCountedAndAreOneSign) {
  struct Story {
    const char* what;
    std::array<std::uint64_t, 3> frames;
    bool note, fault;
  };
  for (const auto& [what, frames, note, fault] :
       {Story{"healthy", {200, 200, 200}, false, false}, Story{"the third twice", {200, 200, 400}, false, true},
        Story{"all, as after a delay", {218, 218, 218}, true, false}}) {
    BusSurvey survey = running(few_nodes());
    for (std::size_t pdo = 0; pdo < frames.size(); ++pdo)
      survey.heard[few_nodes().bus.pressure(0).tpdo_id(pdo)] = {frames[pdo], 0};
    const BusDiagnosis diagnosis = diagnose(survey, &few_nodes());
    const char* words = "node 0x20 pressures: two devices have this node id (";
    EXPECT_EQ(faults(diagnosis).find(words) != std::string::npos, fault) << what << ": " << faults(diagnosis);
    words = "node 0x20 pressures: possibly two devices have this node id (";
    const std::string notes = said(diagnosis, Finding::Level::kNote);
    EXPECT_EQ(notes.find(words) != std::string::npos, note) << what << ": " << notes;
  }
}

TEST(DoctorBus, TwoSignsOfANodeIdThatStandsTwiceAreAFaultAndOneIsANote) {
  struct Story {
    const char* what;
    std::function<void(BusSurvey&)> show;
    bool note, fault;
  };
  const auto contradict = [](BusSurvey& s) {
    std::vector<ObjectRead>& read = s.nodes[0x22].objects;
    const auto product = std::find_if(read.rbegin(), read.rend(),
                                      [](const ObjectRead& one) { return one.object == canopen::kProductCode; });
    product->value ^= 1U;
  };
  const Story stories[] = {
      {"healthy", [](BusSurvey&) {}, false, false},
      {"clocks",
       [](BusSurvey& s) {
         s.heard[0x722].count = 25;
         s.heard[0x1A2].count = 405;
       },
       false, false},
      {"errors on the bus alone", [](BusSurvey& s) { s.errors = 100; }, false, false},
      {"one answer more", [](BusSurvey& s) { s.nodes[0x22].second_answers = 1; }, true, false},
      {"answers", [](BusSurvey& s) { s.nodes[0x22].second_answers = 2; }, false, true},
      {"another identity", contradict, true, false},
      {"a heartbeat more often", [](BusSurvey& s) { s.heard[0x722].count = 30; }, true, false},
      {"... with errors",
       [](BusSurvey& s) {
         s.heard[0x722].count = 30;
         s.errors = 3;
       },
       false, true},
      {"... with another identity",
       [&](BusSurvey& s) {
         s.heard[0x722].count = 30;
         contradict(s);
       },
       false, true},
      {"two heartbeats", [](BusSurvey& s) { s.heard[0x722].count = 40; }, false, true},
      {"two of its values to a SYNC", [](BusSurvey& s) { s.heard[0x1A2].count = 800; }, false, true},
      {"a contact that bounces", [](BusSurvey& s) { s.heard[0x1C0].count = s.heard[0x1C0].repeated = 60; }, false,
       false},
      {"inputs that change all the time", [](BusSurvey& s) { s.heard[0x1C0].count = 500; }, false, false},
      {"two sets of inputs", [](BusSurvey& s) { s.heard[0x1C0].count = s.heard[0x1C0].repeated = 90; }, false, true}};
  for (const auto& [what, show, note, fault] : stories) {
    BusSurvey survey = running();
    show(survey);
    const BusDiagnosis diagnosis = diagnose(survey, &solar());
    const char* words = "two devices have this node id (";
    EXPECT_EQ(faults(diagnosis).find(words) != std::string::npos, fault) << what << ": " << faults(diagnosis);
    EXPECT_EQ(said(diagnosis, Finding::Level::kNote).find(words) != std::string::npos, note)
        << what << ": " << said(diagnosis, Finding::Level::kNote);
  }
}

TEST(DoctorBus, TheControllerThatLeadsTheMachineIsNoFaultAndASecondOneIs) {
  struct Story {
    const char* what;
    std::uint64_t heartbeats;
    bool answers;
    const char* fault;
  };
  const std::uint8_t id = solar().bus.controller_id;
  for (const auto& [what, heartbeats, answers, fault] :
       {Story{"one", 40, false, ""}, Story{"one whose clock is fast", 42, false, ""},
        Story{"two", 80, false,
              "node 0x01: two controllers are on the bus (80 frames 0x701 in 2.0 s where 40 are due): stop one of the "
              "two\n"},
        Story{"a node", 40, true, "node 0x01: a device has the controller's own node id: give it another id\n"}}) {
    BusSurvey survey = running();
    survey.sync = true;
    SurveyedNode& node = survey.nodes[id];
    node.id = id;
    node.state = canopen::NmtState::kOperational;
    if (answers) node.objects = {{canopen::kDeviceType, ObjectRead::Answer::kValue, 0x191, {}}};
    survey.heard[canopen::heartbeat_id(id)].count = heartbeats;
    EXPECT_EQ(faults(diagnose(survey, &solar())), fault) << what;
  }
}

/// A bus that has told of errors and frames once its first frame is read.
class Waited final : public CanBus {
 public:
  explicit Waited(std::shared_ptr<CanBus> bus) noexcept : bus_(std::move(bus)) {}
  bool send(const CanFrame& frame) noexcept override { return bus_->send(frame); }
  bool receive(CanFrame& frame) noexcept override {
    errors_ = 7;
    return bus_->receive(frame);
  }
  [[nodiscard]] CanState state() const noexcept override { return bus_->state(); }
  [[nodiscard]] std::uint64_t errors() const noexcept override { return errors_; }

 private:
  std::shared_ptr<CanBus> bus_;
  std::uint64_t errors_ = 0;
};

TEST(DoctorBus, WhatWaitedBeforeItListensCountsNeitherAsFramesNorAsErrorsOfThatTime) {
  const auto machine = simulated_bus();
  for (int i = 0; i < 50; ++i)
    ASSERT_TRUE(machine->nodes_end().send(canopen::heartbeat_frame(0x22, canopen::NmtState::kOperational)));
  BusAccess access("can0", std::make_shared<Waited>(std::shared_ptr<CanBus>(machine, &machine->controllers_end())),
                   [machine](Time due) { return machine->advance(due); });
  access.wait_until(access.now() + 100ms);
  const BusSurvey survey = survey_bus(access, solar().bus.bit_rate, doctor_objects(solar()), brief());
  EXPECT_FALSE(survey.heard.contains(0x722));
  EXPECT_EQ(survey.errors, 0U);
  EXPECT_EQ(survey.nodes.at(0x22).state, canopen::NmtState::kOperational) << "what it says of a node is still known";
}

TEST(DoctorBus, FramesThatAreNotAsTheOneBeforeAreKnown) {
  const auto machine = simulated_bus();
  std::uint8_t inputs = 0;
  BusAccess access("can0", std::shared_ptr<CanBus>(machine, &machine->controllers_end()), [&](Time due) {
    inputs ^= canopen::kInputPilotOn;
    EXPECT_TRUE(machine->nodes_end().send(canopen::enable_inputs_frame(0x1C0, inputs)));
    EXPECT_TRUE(machine->nodes_end().send(canopen::enable_inputs_frame(0x1C1, 0)));
    return machine->advance(due);
  });
  const BusSurvey survey = survey_bus(access, solar().bus.bit_rate, doctor_objects(solar()), brief());
  EXPECT_GT(survey.heard.at(0x1C0).count, 250U);
  EXPECT_EQ(survey.heard.at(0x1C0).repeated, 0U);
  EXPECT_EQ(survey.heard.at(0x1C1).repeated, survey.heard.at(0x1C1).count - 1);
}

/// Heartbeats of a node at this period, of which the first came at once.
HeardFrames beats(std::uint64_t count, Duration period) {
  HeardFrames heard;
  heard.count = count;
  heard.first_at = Time(1s);
  heard.newest_at = heard.first_at + period * (static_cast<std::int64_t>(count) - 1);
  return heard;
}

TEST(DoctorBus, AHeartbeatIsMeasuredAndNotBelieved) {
  struct Story {
    const char* what;
    HeardFrames heard;
    std::uint32_t set_ms;
    const char *note, *fault;
    double measured_ms;
  };
  for (const auto& [what, heard, set_ms, note, fault, measured_ms] :
       {Story{"as wanted", beats(20, 100ms), 100, "", "", 100},
        Story{"slow", beats(15, 140ms), 100,
              "sends its heartbeat every 140 ms, though 0x1017:00 is as node_heartbeat_ms = 100 of the machine file\n",
              "", 140},
        Story{"quick", beats(24, 85ms), 100, "sends its heartbeat every 85 ms, though", "", 85},
        Story{"too slow", beats(8, 250ms), 100, "",
              "sends its heartbeat every 250 ms, though 0x1017:00 is as node_heartbeat_ms = 100 of the machine file: "
              "after "
              "250 ms (node_heartbeat_timeout_ms) it counts as silent; see its manual\n",
              250},
        Story{
            "not set yet", beats(3, 1000ms), 1000,
            "sends its heartbeat every 1000 ms (0x1017:00 is 1000); start-up sets it to node_heartbeat_ms = 100 of the "
            "machine file\n",
            "", 1000},
        Story{"says nothing of it", beats(20, 100ms), 0, "", "", 100},
        Story{"none", beats(0, 100ms), 100, "", "0x1017:00 says a heartbeat every 100 ms, heard none in 2.0 s", 0},
        Story{"one", beats(1, 100ms), 100, "", "0x1017:00 says a heartbeat every 100 ms, heard one in 2.0 s", 0},
        Story{"off", beats(0, 100ms), 0, "", "", 0}}) {
    BusSurvey survey = running();
    survey.heard[0x722] = heard;
    say(survey, 0x22, canopen::kProducerHeartbeat, set_ms);
    const BusDiagnosis diagnosis = diagnose(survey, &solar());
    const std::string notes = said(diagnosis, Finding::Level::kNote), about = "node 0x22 arm_head_pressure: ";
    EXPECT_EQ(notes.find(about + note) != std::string::npos, *note != '\0') << what << ": " << notes;
    EXPECT_EQ(faults(diagnosis).find(about + fault), *fault != '\0' ? 0U : std::string::npos)
        << what << ": " << faults(diagnosis);
    EXPECT_DOUBLE_EQ(line(diagnosis, 0x22).heartbeat_ms.value_or(0), measured_ms) << what;
  }
  BusSurvey booted = running();
  booted.heard[0x722] = beats(3, 500ms);
  booted.nodes[0x22].booted = true;
  EXPECT_FALSE(says(said(diagnose(booted, &solar()), Finding::Level::kNote), "heartbeat"));
}

TEST(DoctorBus, TheHeartbeatsPeriodIsThatOfTheFramesHeard) {
  const auto bus = simulated_bus();
  bus->machine().nodes().node(0x25)->replace(canopen::kProducerHeartbeat, 70);
  const BusDiagnosis diagnosis = look(bus);
  EXPECT_NEAR(line(diagnosis, 0x25).heartbeat_ms.value_or(0), 70, 1);
  EXPECT_EQ(line(diagnosis, 0x24).heartbeat_ms, std::nullopt);
  const auto json = nlohmann::json::parse(diagnosis_json(diagnosis).dump());
  for (const auto& node : json["nodes"]) EXPECT_EQ(node["heartbeat_ms"].is_null(), node["id"] != 0x25) << node;
}

}  // namespace
}  // namespace knuckle::bringup
