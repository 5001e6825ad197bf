// `knuckle bus assign-id` on a bus with four equal devices, as they are delivered.
#include "app/eds/assign_id.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <stdexcept>

#include "tests/support/refusal.h"
#include "tests/support/sold_devices.h"

namespace knuckle::eds {
namespace {

using test::SoldDevices;

constexpr const char* kAlone = "unplug all but the one that is to have the id";

IdRequest request(std::uint8_t id) {
  IdRequest one;
  one.id = id;
  return one;
}
IdRequest by_serial(std::uint32_t serial, std::uint8_t id) {
  IdRequest one = request(id);
  one.serial = serial;
  return one;
}
IdRequest from(std::uint8_t before, std::uint8_t id) {
  IdRequest one = request(id);
  one.from = before;
  return one;
}
IdRequest by_objects(std::uint8_t before, std::uint8_t id) {
  IdRequest one = from(before, id);
  one.objects = {SoldDevices::kIdA, SoldDevices::kIdB};
  return one;
}
/// In their order, each under its node id.
void start(SoldDevices& bus, const std::vector<std::uint8_t>& ids) {
  for (std::size_t i = 0; i < ids.size(); ++i) bus.devices[i]->start_as(ids[i]);
  bus.run(5ms);
}
AssignedId assign(SoldDevices& bus, const IdRequest& wanted, CanBus* interface = nullptr) {
  BusAccess access = bus.access(interface);
  AssignedId given = assign_id(access, wanted);
  bus.run(5ms);
  return given;
}
std::string refused(SoldDevices& bus, const IdRequest& wanted, CanBus* interface = nullptr) {
  std::string why = test::refusal([&] { return assign(bus, wanted, interface); });
  bus.run(5ms);
  return why;
}
/// The id a device has, would have from its next reset on, and has kept.
void expect_id(SoldDevices& bus, std::size_t which, std::uint8_t id) {
  sim::NodeProtocol& device = *bus.devices[which];
  EXPECT_EQ(device.id(), id) << which;
  EXPECT_EQ(device.lss().pending(), id) << which;
  EXPECT_EQ(device.lss().stored(), id) << which;
  EXPECT_TRUE(device.lss().waiting()) << which;
}
void expect_nobody_changed(SoldDevices& bus, std::uint8_t id = lss::kNoNodeId) {
  for (std::size_t i = 0; i < bus.devices.size(); ++i) expect_id(bus, i, id);
}
std::size_t count(const SoldDevices& bus, std::uint32_t id) {
  return static_cast<std::size_t>(
      std::count_if(bus.heard.begin(), bus.heard.end(), [id](const CanFrame& frame) { return frame.id == id; }));
}

TEST(AssignId, FourEqualDevicesGetTheirIdsOneAtATimeAndAreFoundUnderThemByTheirSerials) {
  SoldDevices bus({1001, 1002, 1003, 1004});
  for (std::size_t i = 0; i < 4; ++i) {
    bus.plug_in_only(i);
    const auto id = static_cast<std::uint8_t>(0x10 + i);
    const AssignedId given = assign(bus, request(id));
    EXPECT_EQ(given.problem, "");
    EXPECT_EQ(given.device, (lss::Identity{SoldDevices::kVendor, SoldDevices::kProduct, SoldDevices::kRevision,
                                           static_cast<std::uint32_t>(1001 + i)}));
    EXPECT_EQ(given.before, lss::kNoNodeId);
  }
  bus.plug_all_in();
  for (std::size_t i = 0; i < 4; ++i) expect_id(bus, i, static_cast<std::uint8_t>(0x10 + i));
}

TEST(AssignId, AllFourAtOnceAreRefusedWithTheirSerialsAndKeepWhatTheyHave) {
  SoldDevices bus({1004, 1002, 1003, 1001});
  EXPECT_EQ(refused(bus, request(0x10)),
            std::string("can0: 4 devices answer LSS, with the serials 1001, 1002, 1003, 1004: ") + kAlone +
                ", or name it by --serial");
  expect_nobody_changed(bus);
}

TEST(AssignId, ByItsSerialEachOfFourGetsItsIdWhileAllArePluggedIn) {
  SoldDevices bus({1001, 1002, 1003, 1004});
  for (const std::size_t i : {2U, 0U, 3U, 1U}) {
    const auto id = static_cast<std::uint8_t>(0x10 + i);
    EXPECT_EQ(assign(bus, by_serial(static_cast<std::uint32_t>(1001 + i), id)).problem, "");
    expect_id(bus, i, id);
  }
  for (std::size_t i = 0; i < 4; ++i) {
    expect_id(bus, i, static_cast<std::uint8_t>(0x10 + i));
    EXPECT_EQ(count(bus, canopen::heartbeat_id(static_cast<std::uint8_t>(0x10 + i))), 1U) << "started once";
  }
  EXPECT_EQ(refused(bus, by_serial(1005, 0x20)),
            "can0: no device answers LSS as vendor 0x01000019, product 0x53373235, revision "
            "0x00010100, serial 1005");
}

/// An interface that has heard errors where answers collided.
class Disturbed final : public CanBus {
 public:
  Disturbed(CanBus& bus, const std::uint64_t& errors) : bus_(bus), errors_(errors) {}
  bool send(const CanFrame& frame) noexcept override { return bus_.send(frame); }
  bool receive(CanFrame& frame) noexcept override { return bus_.receive(frame); }
  [[nodiscard]] CanState state() const noexcept override { return bus_.state(); }
  [[nodiscard]] std::uint64_t errors() const noexcept override { return errors_; }

 private:
  CanBus& bus_;
  const std::uint64_t& errors_;
};

TEST(AssignId, TwoDevicesWhoseAnswersBecomeOneOnTheWireAreNotTakenForOne) {
  struct Wire {
    const char* what;
    bool first_survives, tells_errors;
    std::string told;
  };
  const std::string lost =
      std::string("can0: answers to LSS are lost or destroyed, as where two devices answer at once: ") + kAlone;
  for (const auto& [what, first_survives, tells_errors, told] :
       {Wire{"unequal answers destroy each other", false, false, lost},
        Wire{"one of them comes through, with errors", true, true, lost},
        Wire{"one of them comes through", true, false,
             std::string("can0: found vendor 0x01000019, product 0x53373235, revision 0x00010100, serial 1001, and "
                         "another device of its kind: ") +
                 kAlone + ", or name it by --serial"}}) {
    for (const bool swapped : {false, true}) {
      SoldDevices bus(swapped ? std::vector<std::uint32_t>{1001, 990} : std::vector<std::uint32_t>{1001, 1002});
      std::uint64_t errors = 0;
      bus.collide = [&, first = first_survives](std::vector<CanFrame>& answers) {
        const bool equal = std::adjacent_find(answers.begin(), answers.end(), std::not_equal_to<>()) == answers.end();
        answers.resize(equal || first ? 1 : 0);
        if (!equal && tells_errors) ++errors;
      };
      Disturbed interface(bus.bus.port(0), errors);
      EXPECT_EQ(refused(bus, request(0x10), &interface), told) << what << swapped;
      expect_nobody_changed(bus);
    }
  }
}

TEST(AssignId, DevicesOfTwoKindsAreRefused) {
  SoldDevices bus({1001, 1002});
  bus.become(1, 7, 1002);
  const std::string told = std::string("can0: devices of more than one kind answer LSS: ") + kAlone;
  EXPECT_EQ(refused(bus, request(0x10)), told);
  EXPECT_EQ(refused(bus, by_serial(1001, 0x10)), told);
  expect_nobody_changed(bus);
}

TEST(AssignId, WithoutADeviceThatAnswersItSaysWhatToCheck) {
  SoldDevices bus({1001});
  bus.devices[0]->remove_lss();
  EXPECT_EQ(
      refused(bus, request(0x10)),
      "can0: no device answers LSS: check its power, its plug and the bit rate; a device without LSS needs --from "
      "and --by-object");
}

TEST(AssignId, ADeviceThatHasAnIdStartsAnewWithTheOtherAndOthersDoNot) {
  SoldDevices bus({1001, 1002});
  start(bus, {0x7F, 0x11});
  bus.heard.clear();
  const AssignedId given = assign(bus, from(0x7F, 0x10));
  EXPECT_EQ(given.problem, "");
  EXPECT_EQ(given.before, 0x7F);
  EXPECT_EQ(given.device.serial, 1001U);
  expect_id(bus, 0, 0x10);
  expect_id(bus, 1, 0x11);
  EXPECT_EQ(count(bus, canopen::heartbeat_id(0x10)), 1U);
  EXPECT_EQ(count(bus, canopen::heartbeat_id(0x11)), 0U);
}

TEST(AssignId, WaitsForADeviceThatBootsForSeconds) {
  for (const std::uint8_t before : {lss::kNoNodeId, std::uint8_t{0x7F}}) {
    SoldDevices bus({1001});
    start(bus, {before});
    bus.devices[0]->set_boot_time(7s);
    EXPECT_EQ(assign(bus, request(0x10)).problem, "");
    expect_id(bus, 0, 0x10);
  }
}

TEST(AssignId, TwoDevicesUnderTheIdThatIsNamedAreRefused) {
  for (const IdRequest& wanted : {from(0x7F, 0x10), by_objects(0x7F, 0x10)}) {
    SoldDevices bus({1001, 1002});
    start(bus, {0x7F, 0x7F});
    EXPECT_EQ(refused(bus, wanted), std::string("can0: 2 devices answer as node 0x7F: ") + kAlone);
    expect_nobody_changed(bus, 0x7F);
  }
  SoldDevices bus({1001});
  EXPECT_EQ(refused(bus, from(0x7F, 0x10)), "can0: node 0x7F: 0x1018:01 cannot be read: no answer");
  bus.devices[0]->remove_lss();
  start(bus, {0x7F});
  EXPECT_EQ(refused(bus, from(0x7F, 0x10)),
            "can0: no device answers LSS as vendor 0x01000019, product 0x53373235, revision 0x00010100, serial 1001; a "
            "device without LSS needs --by-object");
}

TEST(AssignId, ADeviceFoundByLssIsNotResetUnderAnIdThatAnotherOneHasToo) {
  SoldDevices bus({1001, 1002});
  bus.devices[1]->remove_lss();
  start(bus, {0x7F, 0x7F});
  EXPECT_EQ(refused(bus, request(0x10)), std::string("can0: 2 devices answer as node 0x7F: ") + kAlone);
  expect_nobody_changed(bus, 0x7F);
}

TEST(AssignId, ADeviceWhoseSerialOnlyLssTellsIsNotTakenForVerified) {
  SoldDevices bus({1001});
  bool removed = false;
  bus.each_tick = [&] {  // found by its identity, from then on without the object
    if (removed || bus.devices[0]->id() != 0x10) return;
    removed = true;
    bus.devices[0]->remove(canopen::kSerialNumber);
  };
  EXPECT_EQ(assign(bus, request(0x10)).problem,
            "node 0x10 answers, but has no 0x1018:04: whether it is the device with this serial is not known");
}

TEST(AssignId, ByItsObjectsADeviceWithoutLssGetsItsId) {
  SoldDevices bus({1001, 1002});
  sim::NodeProtocol& device = *bus.devices[0];
  device.remove_lss();
  device.keep_id_in({SoldDevices::kIdA, SoldDevices::kIdB});
  start(bus, {0x7F, 0x11});
  bus.heard.clear();
  const AssignedId given = assign(bus, by_objects(0x7F, 0x10));
  EXPECT_EQ(given.problem, "");
  EXPECT_EQ(given.before, 0x7F);
  EXPECT_EQ(given.device.serial, 1001U);
  expect_id(bus, 0, 0x10);
  EXPECT_EQ(device.value(SoldDevices::kIdB), 0x10U);
  EXPECT_EQ(count(bus, canopen::heartbeat_id(0x11)), 0U) << "another one";
  EXPECT_EQ(count(bus, lss::kRequestId), 0U);
}

TEST(AssignId, AnObjectThatDoesNotHoldTheNodeIdIsNotWritten) {
  SoldDevices bus({1001});
  sim::NodeProtocol& device = *bus.devices[0];
  start(bus, {0x7E});
  EXPECT_EQ(refused(bus, by_objects(0x7E, 0x10)),
            "can0: node 0x7E: 0x20F0:00 is 0x7F: an object that holds the node id would be 0x7E");
  start(bus, {0x7F});
  device.remove(SoldDevices::kIdB);
  EXPECT_EQ(refused(bus, by_objects(0x7F, 0x10)), "can0: node 0x7F: 0x20F1:00 cannot be read: object does not exist");
  EXPECT_EQ(device.value(SoldDevices::kIdA), 0x7FU);
}

TEST(AssignId, WhereOneOfTheObjectsCannotBeWrittenTheOthersAreAsBefore) {
  SoldDevices bus({1001});
  sim::NodeProtocol& device = *bus.devices[0];
  start(bus, {0x7F});
  device.refuse(SoldDevices::kIdB, canopen::SdoAbort::kLocalControl);
  EXPECT_EQ(assign(bus, by_objects(0x7F, 0x10)).problem,
            "0x20F1:00 cannot be written: data cannot be stored: local control");
  EXPECT_EQ(device.value(SoldDevices::kIdA), 0x7FU);
}

TEST(AssignId, ADeviceThatDoesNotComeBackOrIsAnotherOneIsTold) {
  SoldDevices bus({1001});
  start(bus, {0x7F});  // what its objects say changes nothing
  EXPECT_EQ(assign(bus, by_objects(0x7F, 0x10)).problem,
            "node 0x10: 0x1018:01 cannot be read: no answer; switch its power off and on, then see what knuckle doctor "
            "--can can0 finds");

  SoldDevices two({1001, 1002});
  bool exchanged = false;
  two.plug_in_only(0);
  two.each_tick = [&] {
    if (exchanged || two.devices[0]->lss().stored() != 0x10) return;
    exchanged = true;
    two.plug_in_only(1);
    two.devices[1]->start_as(0x10);
  };
  EXPECT_EQ(assign(two, request(0x10)).problem,
            "node 0x10 is vendor 0x01000019, product 0x53373235, revision "
            "0x00010100, serial 1002: another device");
}

TEST(AssignId, WhatADeviceDoesNotDoIsTold) {
  SoldDevices bus({1001});
  bus.devices[0]->lss().fail_node_id(1);
  EXPECT_EQ(assign(bus, request(0x10)).problem, "does not take the node id: it allows no such node id (LSS error 1)");
  expect_nobody_changed(bus);
  bus.devices[0]->lss().fail_node_id(0);
  bus.devices[0]->lss().fail_store(2);
  EXPECT_EQ(assign(bus, request(0x10)).problem,
            "does not store its node id, so that it has it until its power is off: its memory cannot be written (LSS "
            "error 2)");
  EXPECT_TRUE(bus.devices[0]->lss().waiting());
}

TEST(AssignId, AnIdInUseIsRefusedBeforeAnyDeviceIsAskedOverLss) {
  SoldDevices bus({1001, 1002});
  start(bus, {lss::kNoNodeId, 0x10});
  EXPECT_EQ(refused(bus, request(0x10)),
            "can0: node id 0x10 is in use: vendor 0x01000019, product 0x53373235, revision 0x00010100, serial 1002; "
            "choose another, or unplug that device");
  // A stopped one answers no SDO request, but is heard.
  bus.devices[1]->replace(canopen::kProducerHeartbeat, 1000);
  bus.bus.port(0).send(canopen::nmt_frame(canopen::NmtCommand::kStop, 0x10));
  bus.run(5ms);
  EXPECT_EQ(refused(bus, request(0x10)),
            "can0: node id 0x10 is in use: heard 0x710; choose another, or unplug that device");
  EXPECT_EQ(count(bus, lss::kRequestId), 0U);
}

TEST(AssignId, WhereSomebodyElseUsesTheBusNothingIsSent) {
  struct Other {
    CanFrame frame;
    std::string told;
  };
  for (const auto& [frame, told] :
       {Other{canopen::sync_frame(),
              "can0: another controller is on the bus: heard SYNC 0x080; stop it, then start again"},
        Other{canopen::heartbeat_frame(1, canopen::NmtState::kOperational),
              "can0: another controller is on the bus: heard heartbeat 0x701; stop it, then start again"},
        Other{canopen::sdo_upload(0x20, canopen::kDeviceType),
              "can0: another program uses SDO: stop it, then start again"},
        Other{lss::request(lss::Service::kAskNodeId), "can0: another program uses LSS: stop it, then start again"}}) {
    SoldDevices bus({1001});
    int tick = 0;
    bus.each_tick = [&, sent = frame] {
      if (++tick % 40 == 0) bus.bus.port(1).send(sent);
    };
    EXPECT_EQ(refused(bus, request(0x10)), told);
    EXPECT_EQ(count(bus, frame.id), bus.heard.size()) << "and nothing else";
    expect_nobody_changed(bus);
  }
}

TEST(AssignId, TheDeviceMustBeTheOneThatTheMachineFileHasUnderTheId) {
  SoldDevices bus({1001});
  IdRequest wanted = request(0x10);
  NodeDescription node;
  node.name = "boom_valve";
  node.channels = {NodeChannel{}};
  node.id = 0x10;
  node.vendor = 0x4B4E;
  node.product = SoldDevices::kProduct;
  wanted.bus.nodes = {node};
  wanted.machine = "my.toml";
  EXPECT_EQ(
      refused(bus, wanted),
      "can0: found vendor 0x01000019, product 0x53373235, revision 0x00010100, serial 1001; node id 0x10 is "
      "boom_valve in my.toml, with vendor 0x00004B4E, product 0x53373235: give it another id, or correct the file "
      "(knuckle bus add)");
  expect_nobody_changed(bus);
  wanted.bus.nodes[0].vendor = SoldDevices::kVendor;
  EXPECT_EQ(assign(bus, wanted).problem, "");
  expect_id(bus, 0, 0x10);
}

struct Stopped : std::runtime_error {
  using std::runtime_error::runtime_error;
};

TEST(AssignId, WheneverItIsInterruptedAllDevicesWaitAgainAndItIsKnownWhetherOneWasTold) {
  bool ended = false;
  int told_stops = 0, untold_stops = 0;
  for (int stop_at = 0; !ended; stop_at += 29) {
    SoldDevices bus({1001, 1002});
    bus.plug_in_only(0);
    BusAccess access = bus.access();
    int checks = 0;
    bool told = false;
    try {
      (void)assign_id(access, request(0x10), [&](bool may_have_another_id) {
        told = may_have_another_id;
        if (++checks > stop_at) throw Stopped("");
      });
      ended = true;
    } catch (const Stopped&) {
    }
    bus.run(10ms);
    EXPECT_TRUE(bus.devices[0]->lss().waiting()) << stop_at;
    if (!told) {
      EXPECT_EQ(bus.devices[0]->lss().pending(), lss::kNoNodeId) << stop_at;
    }
    (told ? told_stops : untold_stops) += 1;
  }
  EXPECT_GT(told_stops, 3);
  EXPECT_GT(untold_stops, 20);
}

/// To devices that have no queue for LSS: they miss a request that follows too soon. After an interrupt it also loses a
/// frame, as where its queue is full.
class Missed final : public CanBus {
 public:
  explicit Missed(SoldDevices& bus) : bus_(bus) {}
  bool send(const CanFrame& frame) noexcept override {
    if (frame.id == lss::kRequestId) {
      const bool too_soon = lss_sent_ && bus_.now - last_ < 5ms, lost = interrupted && !lost_;
      lss_sent_ = true;
      last_ = bus_.now;
      lost_ = lost_ || interrupted;
      if (too_soon || lost) return true;
    }
    return bus_.bus.port(0).send(frame);
  }
  bool receive(CanFrame& frame) noexcept override { return bus_.bus.port(0).receive(frame); }
  [[nodiscard]] CanState state() const noexcept override { return bus_.bus.port(0).state(); }
  [[nodiscard]] bool lss_sent() const noexcept { return lss_sent_; }
  bool interrupted = false;

 private:
  SoldDevices& bus_;
  Time last_{};
  bool lss_sent_ = false, lost_ = false;
};

TEST(AssignId, DevicesThatMissAFrameOfTheInterruptedOneWaitAgainToo) {
  bool ended = false;
  int stops = 0;
  for (int stop_at = 0; !ended; stop_at += 3, ++stops) {
    SoldDevices bus({1001, 1002});
    Missed interface(bus);
    BusAccess access = bus.access(&interface);
    int checks = 0;
    try {
      (void)assign_id(access, by_serial(1001, 0x10), [&](bool) {
        if (!interface.lss_sent() || ++checks <= stop_at) return;
        interface.interrupted = true;
        throw Stopped("");
      });
      ended = true;
    } catch (const Stopped&) {
    }
    bus.run(10ms);
    for (const auto& device : bus.devices) EXPECT_TRUE(device->lss().waiting()) << stop_at;
  }
  EXPECT_GT(stops, 100);
}

}  // namespace
}  // namespace knuckle::eds
