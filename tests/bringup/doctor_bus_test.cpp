// What the doctor says of a bus, read off simulated nodes; and that it only ever reads.
#include "app/bringup/doctor_bus.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "app/bringup/doctor_command.h"
#include "core/units.h"
#include "machine/load.h"
#include "tests/bringup/hardware_bench.h"
#include "tests/bringup/surveyed.h"
#include "tests/support/bus_nodes.h"
#include "tests/support/rotary_machine.h"
#include "tests/support/says.h"
#include "transport/canopen.h"
#include "transport/lss.h"

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

TEST(DoctorBus, MachineAsItsFileSaysIsHealthyNodeByNode) {
  const BusDiagnosis diagnosis = look(simulated_bus());
  EXPECT_TRUE(healthy(diagnosis.findings)) << faults(diagnosis);
  ASSERT_EQ(diagnosis.nodes.size(), 14U);
  const NodeLine& valve = line(diagnosis, 0x10);
  EXPECT_EQ(valve.name, "boom_valve");
  EXPECT_EQ(valve.device_type, 0x198U);
  EXPECT_EQ(valve.vendor, 0x4B4EU);
  EXPECT_EQ(valve.state, "no heartbeat");  // not configured
  EXPECT_EQ(valve.reading, "INIT, spool 0.0 %");
  EXPECT_TRUE(says(line(diagnosis, 0x20).reading, " bar"));
  EXPECT_EQ(line(diagnosis, 0x40).reading, "E-stop chain closed, pilot off");
  EXPECT_LT(*valve.settings_as_file, *valve.settings);  // watchdogs are off until start-up writes them
}

TEST(DoctorBus, SendsNothingButReadingRequests) {
  const auto bus = simulated_bus();
  struct Seen {
    int reads = 0, asked_for_id = 0, others = 0;
  } seen;
  bus->bus().set_tap({[](void* context, Time, const CanFrame& frame) {
                        auto& s = *static_cast<Seen*>(context);
                        const std::uint32_t function = canopen::function_of(frame.id);
                        if (function == 0x580 || function == 0x700) return;  // of the nodes
                        if (frame == lss::request(lss::Service::kIdentifyUnconfigured)) {
                          ++s.asked_for_id;
                          return;
                        }
                        const auto request = canopen::parse_sdo_request(frame);
                        const bool read = request && request->kind == canopen::SdoRequest::Kind::kUpload;
                        if (read)
                          ++s.reads;
                        else
                          ++s.others;
                      },
                      &seen});
  (void)look(bus);
  EXPECT_GT(seen.reads, 200);
  EXPECT_EQ(seen.asked_for_id, 1);
  EXPECT_EQ(seen.others, 0);
  for (std::uint8_t id = 0x10; id <= 0x40; ++id) {
    if (sim::NodeProtocol* node = bus->machine().nodes().node(id)) {
      EXPECT_EQ(node->state(), canopen::NmtState::kPreOperational);
      EXPECT_EQ(node->value(canopen::kProducerHeartbeat), 0U);
    }
  }
}

TEST(DoctorBus, AnotherDeviceIsAFaultWithBothIdentities) {
  const auto bus = simulated_bus();
  bus->machine().nodes().set_product(0x31, 0x999);
  EXPECT_EQ(faults(look(bus)),
            "node 0x31 arm_encoder: product 0x00000999, the machine file requires 0x00000406: another device; correct "
            "the machine file if this one is intended\n");
  MachineDescription exchanged = solar();
  std::swap(knuckle::test::node_in(exchanged.bus, NodeRole::kValve).id,
            knuckle::test::node_in(exchanged.bus, NodeRole::kTilt).id);
  const std::string told = faults(look(simulated_bus(), exchanged));
  EXPECT_TRUE(says(told,
                   "node 0x38 boom_valve: device type 0x0000019A (CiA 410, inclinometer), the machine file requires "
                   "0x00000198 (CiA 408, hydraulic valve): two node ids may be exchanged"));
}

TEST(DoctorBus, OfANodeWithSeveralChannelsTheBadOneIsNamed) {
  constexpr std::uint8_t kNode = 0x20, kChannel = 4;
  constexpr canopen::Object kValue{canopen::kPressureShort.index, kChannel};
  constexpr canopen::Object kStatus{canopen::kPressureStatus.index, kChannel};
  BusSurvey survey = running(few_nodes());
  BusDiagnosis diagnosis = diagnose(survey, &few_nodes());
  EXPECT_EQ(faults(diagnosis), "");
  const std::string& reading = line(diagnosis, kNode).reading;
  EXPECT_EQ(std::count(reading.begin(), reading.end(), ','), 5) << reading;
  say(survey, kNode, kValue, static_cast<std::uint16_t>(-1000));
  EXPECT_EQ(faults(diagnose(survey, &few_nodes())),
            "node 0x20 pressures: boom_rod_pressure: -100.0 bar is outside the range of 0 to 400 bar: check "
            "transmitter and unit\n");
  say(survey, kNode, kStatus, canopen::kPressureInvalid);
  EXPECT_EQ(faults(diagnose(survey, &few_nodes())),
            "node 0x20 pressures: boom_rod_pressure: status 0x01, value invalid or overloaded: check transmitter and "
            "wiring\n");
}

TEST(DoctorBus, NotesPressuresThatComeWithoutStatusAndWhatThatCosts) {
  MachineDescription file = solar();
  file.bus.nodes[static_cast<std::size_t>(&file.bus.pressure(2) - file.bus.nodes.data())].tpdo_maps = {{0x91300120}};
  const std::string note =
      "node 0x22 arm_head_pressure: sends arm_head_pressure without status (0x6150): a broken transmitter is found "
      "only "
      "where the value leaves its range or contradicts the others\n";
  EXPECT_TRUE(says(said(diagnose(running(file), &file), Finding::Level::kNote), note));
  EXPECT_FALSE(says(said(diagnose(running(), &solar()), Finding::Level::kNote), "status"));
}

TEST(DoctorBus, WhereOthersLeaveTooLittleRoomItIsSaidWhatWouldFit) {
  const auto with_others = [](double share, std::uint32_t id) {
    BusSurvey survey = running();
    survey.heard[id].count = 100;
    survey.heard[id].bits = static_cast<std::uint64_t>(share * survey.listened_s * solar().bus.bit_rate);
    return said(diagnose(survey, &solar()), Finding::Level::kNote);
  };
  EXPECT_FALSE(says(with_others(0.001, 0x2F0), "would fit"));
  const std::string notes = with_others(0.2, 0x2F0);
  EXPECT_TRUE(says(notes,
                   "simulated bus: 20.0 % are frames that the machine file does not have; with those that it has it "
                   "can become 79.6 %, limit 60 %; would fit: "));
  EXPECT_TRUE(says(notes, "bit_rate_kbps = 800 ("));
  EXPECT_TRUE(says(with_others(0.2, canopen::heartbeat_id(0x7E)), "would fit")) << "of a stranger";
  for (const std::uint32_t own : {0x1A2U, 0x080U, 0x722U, 0x701U, 0x0A2U})
    EXPECT_FALSE(says(with_others(0.2, own), "would fit")) << own;
}

TEST(DoctorBus, MissingNodeIsFoundUnderTheWrongId) {
  MachineDescription file = solar();
  knuckle::test::node_in(file.bus, NodeRole::kEncoder, kBucket).id = 0x33;
  const BusDiagnosis diagnosis = look(simulated_bus(), file);
  EXPECT_TRUE(says(faults(diagnosis), "node 0x33 bucket_encoder: does not answer"));
  const std::string notes = said(diagnosis, Finding::Level::kNote);
  EXPECT_TRUE(says(notes,
                   "node 0x32: is not in the machine file (CiA 406, encoder, vendor 0x00004B4E, product 0x00000406)"
                   ": possibly bucket_encoder, expected with node id 0x33"));
}

TEST(DoctorBus, ADeviceThatTheFileHasNotIsListedWithItsSerialAndTheNodesThatItMayBe) {
  const auto bus = simulated_bus();
  bus->machine().inject(0x12, sim::NodeFault::kSilent);
  sim::NodeProtocol& valve = *bus->machine().nodes().node(0x11);
  valve.set_serial(4711);
  valve.start_as(0x7F);
  const BusDiagnosis diagnosis = look(bus);
  EXPECT_EQ(line(diagnosis, 0x7F).serial, 4711U);
  const std::string notes = said(diagnosis, Finding::Level::kNote);
  EXPECT_TRUE(says(notes,
                   "node 0x7F: is not in the machine file (CiA 408, hydraulic valve, vendor 0x00004B4E, product "
                   "0x00000408, serial 4711): possibly arm_valve, expected with node id 0x11, or bucket_valve, "
                   "expected with node id 0x12; knuckle bus assign-id --from 0x7F gives it that id\n"));
}

TEST(DoctorBus, ADeviceWithoutANodeIdIsNoted) {
  const std::string note =
      "simulated bus: a device without a node id is on the bus, perhaps several: knuckle bus "
      "assign-id gives it one\n";
  EXPECT_FALSE(says(said(look(simulated_bus()), Finding::Level::kNote), note));
  const auto bus = simulated_bus();
  bus->machine().nodes().node(0x12)->start_as(lss::kNoNodeId);
  const BusDiagnosis diagnosis = look(bus);
  EXPECT_TRUE(says(said(diagnosis, Finding::Level::kNote), note));
  EXPECT_TRUE(says(faults(diagnosis), "node 0x12 bucket_valve: does not answer"));
}

TEST(DoctorBus, SaysOfEachNodeThatMovesSomethingWhatStopsItAsItIsSet) {
  const auto bus = simulated_bus();
  sim::CanNodes& nodes = bus->machine().nodes();
  nodes.node(0x10)->replace(canopen::kRpdo1Timer, 50);
  nodes.node(0x11)->replace(canopen::kRpdo1Timer, 50);
  nodes.node(0x11)->replace(canopen::kConsumerHeartbeat, 0x01'0096);
  nodes.node(0x40)->replace(canopen::kConsumerHeartbeat, 0x01'0096);
  const BusDiagnosis diagnosis = look(bus);
  EXPECT_EQ(line(diagnosis, 0x10).guard, "stops after 50 ms without set-points");
  EXPECT_EQ(line(diagnosis, 0x11).guard, "stops after 50 ms without set-points, 150 ms without heartbeat of 0x01");
  EXPECT_EQ(line(diagnosis, 0x12).guard, "has no guard until start-up sets it");
  EXPECT_EQ(line(diagnosis, 0x40).guard, "stops after 150 ms without heartbeat of 0x01");
  EXPECT_EQ(line(diagnosis, 0x20).guard, "") << "it moves nothing";
}

TEST(DoctorBus, WhatStartUpRequiresMustBeSo) {
  const auto bus = simulated_bus();
  bus->machine().nodes().node(0x30)->replace(canopen::kEncoderStep, 50000);
  bus->machine().nodes().node(0x11)->replace(canopen::kValveControlMode, 2);
  const std::string told = faults(look(bus));
  EXPECT_TRUE(says(told,
                   "node 0x30 boom_encoder: 0x6005:01 is 0xC350, the machine file requires 0x186A0: set it with "
                   "the manufacturer's tool, or correct the machine file"));
  EXPECT_TRUE(says(told, "node 0x11 arm_valve: 0x6042:00 is 0x2"));
}

TEST(DoctorBus, RotaryEncodersAreReadAsLengthAndAngleOrAreToBePreset) {
  const MachineDescription machine = parse_machine(knuckle::test::rotary_text(), "rotary.toml");
  const auto bus = simulated_bus(machine);
  const double boom_deg = bus->plant().joint_rad[kBoom] / kDegree;
  const BusDiagnosis diagnosis = look(bus, machine);
  EXPECT_TRUE(healthy(diagnosis.findings)) << faults(diagnosis);
  const std::string reading = line(diagnosis, 0x30).reading;
  EXPECT_NEAR(std::stod(reading), bus->plant().cylinder_m[kBoom], 0.01) << reading;
  EXPECT_NEAR(std::stod(reading.substr(reading.find(", ") + 2)), boom_deg, 0.2) << reading;
  bus->machine().nodes().node(0x30)->replace({0x6509, 0}, 5000);
  const BusDiagnosis as_mounted = look(bus, machine);
  EXPECT_EQ(line(as_mounted, 0x30).reading.find("no length, "), 0U) << line(as_mounted, 0x30).reading;
  const std::string notes = said(as_mounted, Finding::Level::kNote);
  EXPECT_TRUE(says(notes, "node 0x30 boom_encoder: reads no length that its cylinder can have"));
}

TEST(DoctorBus, ErrorRegisterAndEmergencyAreToldInWords) {
  const auto bus = simulated_bus();
  sim::NodeProtocol& pressure = *bus->machine().nodes().node(0x25);
  pressure.set_error(true);
  pressure.replace(canopen::kErrorRegister, 0x05);
  bool sent = false;
  bus->each_tick = [&sent](sim::MachineOnBus& b) {
    if (!sent && b.now() > Time{150ms}) sent = b.machine().send_emcy(0x12, 0x4210);
  };
  const BusDiagnosis diagnosis = look(bus);
  const std::string told = faults(diagnosis);
  EXPECT_TRUE(says(told, "node 0x25 bucket_rod_pressure: error register 0x05 (generic, voltage)"));
  EXPECT_TRUE(says(told, "node 0x12 bucket_valve: reports the emergency 0x4210 device temperature (1 received)"));
  EXPECT_EQ(line(diagnosis, 0x12).emergency, 0x4210);
}

TEST(DoctorBus, UnpluggedBusIsToldOnce) {
  const auto bus = simulated_bus();
  bus->bus().silence(sim::MachineOnBus::kMachinePort, true);
  EXPECT_EQ(faults(look(bus)),
            "simulated bus: no frame received, no node answers: check the nodes' power, the plug and the bit rate\n");
  const auto off = simulated_bus();
  off->bus().bus_off(sim::MachineOnBus::kControllerPort);
  EXPECT_TRUE(says(faults(look(off)), "the CAN controller is bus off"));
}

TEST(DoctorBus, AsksNobodyWhileSomebodyElseAsks) {
  const auto bus = simulated_bus();
  struct Count {
    int reads = 0;
  } count;
  bus->bus().set_tap({[](void* context, Time, const CanFrame& frame) {
                        if (canopen::function_of(frame.id) == 0x600) ++static_cast<Count*>(context)->reads;
                      },
                      &count});
  bus->each_tick = [](sim::MachineOnBus& b) {
    if (b.now() == Time{150ms}) b.nodes_end().send(canopen::sdo_upload(0x20, canopen::kDeviceType));
  };
  const BusDiagnosis diagnosis = look(bus);
  EXPECT_EQ(count.reads, 1);
  EXPECT_TRUE(says(faults(diagnosis), "another program uses SDO"));
}

TEST(DoctorBus, LoadIsThatOfTheFramesHeard) {
  const auto bus = simulated_bus();
  bus->each_tick = [](sim::MachineOnBus& b) {
    CanFrame frame;
    frame.id = 0x2F0;
    frame.size = 8;
    b.nodes_end().send(frame);
  };
  const BusDiagnosis diagnosis = look(bus);
  EXPECT_NEAR(diagnosis.load, 1000.0 * worst_case_bits(8) / solar().bus.bit_rate, 0.005);
  EXPECT_TRUE(says(said(diagnosis, Finding::Level::kNote), "frames 0x2F0: "));
}

TEST(DoctorBus, WithoutAMachineFileWhoeverIsThereIsListed) {
  BusAccess access = sim::access_to(simulated_bus());
  const BusDiagnosis diagnosis = diagnose(survey_bus(access, 500000, {}, brief()), nullptr);
  EXPECT_EQ(diagnosis.nodes.size(), 14U);
  EXPECT_TRUE(healthy(diagnosis.findings)) << faults(diagnosis);
  EXPECT_EQ(line(diagnosis, 0x38).device_type, 0x19AU);
}

TEST(DoctorBus, ASilentNodeIsNamedWithWhatToCheckFirstAndToolsAreToldTheSame) {
  const auto bus = simulated_bus();
  bus->machine().inject(0x22, sim::NodeFault::kSilent);
  const BusDiagnosis diagnosis = look(bus);
  EXPECT_EQ(
      faults(diagnosis),
      "node 0x22 arm_head_pressure: does not answer SDO requests: check its power, its plug, its node id and its bit "
      "rate\n");
  EXPECT_EQ(line(diagnosis, 0x22).state, "silent");
  std::ostringstream text;
  for (const std::string& line : diagnosis_lines(diagnosis)) text << line << '\n';
  EXPECT_LT(text.str().find("FAULT node 0x22 arm_head_pressure"), text.str().find("ok    node 0x10 boom_valve"));
  const auto json = nlohmann::json::parse(diagnosis_json(diagnosis).dump());
  ASSERT_EQ(json["nodes"].size(), 14U);
  EXPECT_EQ(json["nodes"][0]["name"], "boom_valve");
  EXPECT_EQ(json["nodes"][0]["guard"], "has no guard until start-up sets it");
  EXPECT_EQ(json["nodes"][0]["serial"], nullptr);
  EXPECT_EQ(json["nodes"][5]["device_type"], nullptr);
  EXPECT_EQ(nlohmann::json::parse(findings_json(diagnosis.findings).dump()).size(), diagnosis.findings.size());
}

}  // namespace
}  // namespace knuckle::bringup
