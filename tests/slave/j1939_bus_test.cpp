// Who sends a parameter group, whose address it is, and what is asked for: by frames put in and frames that come out.
#include "slave/j1939_bus.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/slave/kept_bus.h"
#include "tests/slave/reasons.h"
#include "tests/support/j1939_machine.h"
#include "tests/support/no_alloc.h"
#include "tests/support/says.h"
#include "transport/j1939.h"

namespace knuckle::slave {
namespace {

constexpr std::uint32_t kClaimed = 0x18EEFFF9U | kExtendedId, kCannotClaim = 0x18EEFFFEU | kExtendedId;
constexpr std::uint64_t kFirstName = 1, kLastName = ~std::uint64_t{0};  // NAMEs before and after Knuckle's

struct HeardJ1939 {
  explicit HeardJ1939(const MachineDescription& of = test::j1939_machine()) : machine(of) { sent.sent.reserve(1000); }
  /// @return identifier under which its values count; 0: they do not.
  std::uint32_t hears(std::uint32_t id, std::vector<std::uint8_t> data = {0, 0, 0, 0, 0, 0, 0, 0}) {
    CanFrame frame{.id = id | kExtendedId, .size = static_cast<std::uint8_t>(data.size()), .data = {}};
    std::copy(data.begin(), data.end(), frame.data.begin());
    return j1939.receive(frame, now) ? frame.id : 0;
  }
  void hears(const CanFrame& frame) {
    CanFrame copy = frame;
    (void)j1939.receive(copy, now);
  }
  void run(Duration time) {
    for (const Time end = now + time; now < end; now += 5ms) j1939.step(sent, now);
  }
  [[nodiscard]] std::vector<CanFrame> taken() {
    std::vector<CanFrame> frames;
    std::swap(frames, sent.sent);
    return frames;
  }
  [[nodiscard]] std::string newest() const {
    return j1939.news_count() == 0 ? "" : text(j1939.news(j1939.news_count() - 1), machine.bus);
  }
  [[nodiscard]] std::uint32_t id_of(int reading) const {
    return machine.bus.broadcast(NodeRole::kReading, reading).frame->id;
  }
  MachineDescription machine;
  J1939Bus j1939{machine.bus};
  test::KeptBus sent;
  Time now{10s};
};

/// Commands from the address that it holds.
struct HoldingJ1939 : HeardJ1939 {
  HoldingJ1939() : HeardJ1939(test::commanded_j1939_machine()) {
    run(300ms);
    EXPECT_TRUE(j1939.may_command());
    (void)taken();
  }
};

TEST(J1939Groups, CountWhateverTheirPriorityFromTheSourceThatTheFileGives) {
  HeardJ1939 bus;
  EXPECT_EQ(bus.hears(0x0CF00400), bus.id_of(0));
  EXPECT_EQ(bus.hears(0x18F00400), bus.id_of(0));
  EXPECT_EQ(bus.hears(0x18FF1021), 0x18FF1021U | kExtendedId) << "no group: as it is";
  EXPECT_EQ(bus.j1939.news_count(), 0U);
  EXPECT_EQ(bus.hears(0x0CF00417), 0U);
  EXPECT_TRUE(
      test::begins(bus.newest(), "engine (PGN 0xF004 of 0x00): also comes from 0x17; the values of 0x00 count"));
  for (int i = 0; i < 100; ++i, bus.now += 10ms) EXPECT_EQ(bus.hears(0x0CF00417), 0U);
  EXPECT_EQ(bus.j1939.news_count(), 1U) << "once, as long as it goes on";
  EXPECT_FALSE(bus.j1939.fault(bus.now));
}

TEST(J1939Groups, WithoutASourceTheFirstSenderCountsUntilItFallsSilent) {
  HeardJ1939 bus;
  for (int i = 0; i < 4; ++i, bus.now += 1s) {
    EXPECT_EQ(bus.hears(0x18FEEE03), bus.id_of(3)) << i;
    EXPECT_EQ(bus.hears(0x18FEEE04), 0U) << i;
  }
  EXPECT_TRUE(test::begins(bus.newest(), "coolant (PGN 0xFEEE): also comes from 0x04; the values of 0x03 count"));
  EXPECT_FALSE(bus.j1939.fault(bus.now)) << "people are told";
  bus.now += 4s;
  EXPECT_EQ(bus.hears(0x18FEEE04), bus.id_of(3)) << "a device may get another address";
}

TEST(J1939Groups, TwoSendersOfWhatTheMachineIsLedByAreAFault) {
  HeardJ1939 bus(test::j1939_machine("id = 0x18FF1021", "pgn = 0xFF10"));
  const std::uint32_t id = bus.machine.bus.broadcast(NodeRole::kEncoder, kBoom).frame->id;
  EXPECT_EQ(bus.hears(0x18FF1021), id);
  EXPECT_FALSE(bus.j1939.fault(bus.now));
  EXPECT_EQ(bus.hears(0x18FF1022), 0U) << "never mixed in";
  const Reason why = bus.j1939.fault(bus.now);
  const auto arm = signal_subject(bus.machine.bus.broadcast(NodeRole::kEncoder, kArm).field->signal);
  test::expect_reason(why, ReasonCode::kGroupTwice, arm, 0x22, 0x21, 0);
  EXPECT_EQ(bus.j1939.news_count(), 0U) << "a fault is told as such";
  bus.now += 1001ms;
  EXPECT_FALSE(bus.j1939.fault(bus.now));
}

TEST(J1939Groups, TheSourceInTheFileSaysWhichOfTwoIsRight) {
  HeardJ1939 bus(test::j1939_machine("id = 0x18FF1021", "pgn = 0xFF10\nsource = 0x22"));
  EXPECT_EQ(bus.hears(0x18FF1021), 0U);
  EXPECT_NE(bus.hears(0x18FF1022), 0U);
  EXPECT_FALSE(bus.j1939.fault(bus.now));
  EXPECT_EQ(bus.j1939.news_count(), 1U);
}

TEST(J1939Address, IsClaimedAndHeldAfterAQuarterOfASecond) {
  HeardJ1939 bus(test::commanded_j1939_machine());
  bus.run(5ms);
  const std::vector<CanFrame> first = bus.taken();
  ASSERT_EQ(first.size(), 2U);
  EXPECT_EQ(first[0].id, 0x18EEFF05U | kExtendedId);
  EXPECT_EQ(first[0].data, (std::array<std::uint8_t, 8>{0x01, 0x00, 0xE0, 0xFF, 0x00, 0xFF, 0xFE, 0x30}));
  EXPECT_EQ(first[1], j1939::request_frame(j1939::kAddressClaim, 0x05, 0xFF)) << "who else is there";
  EXPECT_FALSE(bus.j1939.may_command());
  bus.run(240ms);
  EXPECT_FALSE(bus.j1939.may_command());
  EXPECT_TRUE(bus.taken().empty()) << "nothing else before it is held";
  bus.run(15ms);
  EXPECT_TRUE(bus.j1939.may_command());
}

TEST(J1939Address, IsClaimedAnewAfterItsBusWasGone) {
  for (const CanState gone : {CanState::kBusOff, CanState::kDown}) {
    HoldingJ1939 bus;
    bus.sent.state_now = gone;
    bus.run(5ms);
    EXPECT_FALSE(bus.j1939.may_command()) << "nobody knows who has it meanwhile";
    EXPECT_TRUE(bus.taken().empty());
    bus.sent.state_now = CanState::kActive;
    bus.run(5ms);
    EXPECT_EQ(bus.taken().size(), 2U);
    bus.run(300ms);
    EXPECT_TRUE(bus.j1939.may_command());
  }
}

/// Neutral must go out from the address, in the same step.
TEST(J1939Address, IsHeldWhenTheOtherBusFailsAndSaidAgainOnceThatIsBack) {
  HoldingJ1939 bus;
  bus.sent.state_now = CanState::kDown;  // perhaps both are
  bus.sent.of_bus = 1;
  bus.run(5ms);
  EXPECT_TRUE(bus.j1939.may_command());
  bus.run(45ms);
  (void)bus.taken();
  bus.sent.state_now = CanState::kActive;
  bus.run(10ms);
  const std::vector<CanFrame> said = bus.taken();
  ASSERT_EQ(said.size(), 1U) << "whoever has it now answers";
  EXPECT_EQ(said[0], j1939::claim_frame(J1939Bus::kName, 0x05));
  EXPECT_TRUE(bus.j1939.may_command()) << "neutral goes on";
}

TEST(J1939Address, IsDefendedAgainstAHigherName) {
  HoldingJ1939 bus;
  bus.hears(j1939::claim_frame(kLastName, 0x05));
  bus.run(5ms);
  const std::vector<CanFrame> answer = bus.taken();
  ASSERT_FALSE(answer.empty());
  EXPECT_EQ(answer[0], j1939::claim_frame(J1939Bus::kName, 0x05));
  EXPECT_TRUE(bus.j1939.may_command());
  EXPECT_FALSE(bus.j1939.fault(bus.now));
  EXPECT_TRUE(test::begins(bus.newest(), "another device wants J1939 address 0x05 (NAME 0xFFFFFFFFFFFFFFFF)"));
  for (int i = 0; i < 50; ++i) {
    bus.hears(j1939::claim_frame(kLastName, 0x05));
    bus.run(5ms);
  }
  EXPECT_EQ(bus.j1939.news_count(), 1U) << "told once";
}

TEST(J1939Address, IsLostToALowerOrEqualName) {
  for (const std::uint64_t name : {kFirstName, J1939Bus::kName}) {
    HeardJ1939 bus;
    bus.run(20ms);
    (void)bus.taken();
    bus.hears(j1939::claim_frame(name, 0xF9));
    bus.run(200ms);
    const std::vector<CanFrame> answer = bus.taken();
    ASSERT_EQ(answer.size(), 1U);
    EXPECT_EQ(answer[0], j1939::claim_frame(J1939Bus::kName, j1939::kNoAddress)) << "cannot claim";
    EXPECT_EQ(answer[0].id, kCannotClaim);
    bus.run(30s);
    EXPECT_TRUE(bus.taken().empty()) << "and asks for nothing";
    EXPECT_TRUE(test::says(bus.newest(), "give bus.j1939_address one that nobody has"));
    EXPECT_FALSE(bus.j1939.fault(bus.now)) << "the machine is led all the same";
    EXPECT_TRUE(bus.j1939.may_command());
  }
}

TEST(J1939Address, LostInOperationEndsTheCommandsThatGoOutFromIt) {
  HoldingJ1939 bus;
  bus.run(10s);
  bus.hears(j1939::claim_frame(kFirstName, 0x05));
  EXPECT_FALSE(bus.j1939.may_command()) << "at once";
  const Reason why = bus.j1939.fault(bus.now);
  EXPECT_TRUE(test::is(why, ReasonCode::kAddressLost));
  EXPECT_TRUE(test::says(text(why), "(0x05)"));
  bus.run(60s);
  EXPECT_FALSE(bus.j1939.may_command()) << "until Knuckle is started again";
}

TEST(J1939Address, WhoAsksForItIsAnswered) {
  HeardJ1939 bus;
  bus.hears(j1939::request_frame(j1939::kAddressClaim, 0x21, 0xFF));
  bus.run(10ms);
  EXPECT_EQ(bus.taken().size(), 2U) << "its own claim and request alone: it has no address yet";
  bus.run(300ms);
  (void)bus.taken();
  for (const std::uint8_t to : {std::uint8_t{0xFF}, std::uint8_t{0xF9}}) {
    bus.hears(j1939::request_frame(j1939::kAddressClaim, 0x21, to));
    bus.run(5ms);
    const std::vector<CanFrame> answer = bus.taken();
    ASSERT_EQ(answer.size(), 1U) << int{to};
    EXPECT_EQ(answer[0].id, kClaimed);
  }
  bus.hears(j1939::request_frame(j1939::kAddressClaim, 0x21, 0x22));
  bus.hears(j1939::request_frame(0xFEEC, 0x21, 0xF9));
  bus.run(50ms);
  EXPECT_TRUE(bus.taken().empty()) << "for another address, or another group";
  bus.hears(j1939::claim_frame(kFirstName, 0xF9));
  bus.run(200ms);
  (void)bus.taken();
  bus.hears(j1939::request_frame(j1939::kAddressClaim, 0x21, 0xFF));
  bus.run(5ms);
  EXPECT_EQ(bus.taken().at(0).id, kCannotClaim);
}

TEST(J1939Address, AnotherDeviceUnderTheAddressOfASenderIsTold) {
  HeardJ1939 bus;
  (void)bus.hears(0x18FEEE03);
  for (const std::uint64_t name : {0x11U, 0x11U}) bus.hears(j1939::claim_frame(name, 0x03));
  bus.hears(j1939::claim_frame(0x22, 0x44));
  bus.hears(j1939::claim_frame(0x23, 0x44));
  EXPECT_EQ(bus.j1939.news_count(), 0U) << "the same one again, and one that sends nothing of the file";
  bus.hears(j1939::claim_frame(0x12, 0x03));
  EXPECT_EQ(bus.newest(),
            "coolant (PGN 0xFEEE): its sender's address 0x03 is claimed by another device than before (NAME "
            "0x0000000000000012)");
}

TEST(J1939Requests, GoToTheSenderOnceAPeriod) {
  HeardJ1939 bus;
  bus.run(260ms);
  const CanFrame asks = j1939::request_frame(0xFEE5, 0xF9, 0x00);
  EXPECT_EQ(bus.taken().back(), asks);
  bus.run(10s);
  const std::vector<CanFrame> next = bus.taken();
  ASSERT_EQ(next.size(), 1U);
  EXPECT_EQ(next[0], asks);
  HeardJ1939 anybody(test::j1939_machine("pgn = 0xFEE5\nsource = 0x00", "pgn = 0xFEE5"));
  anybody.run(260ms);
  EXPECT_EQ(anybody.taken().back(), j1939::request_frame(0xFEE5, 0xF9, 0xFF)) << "whoever has it";
  (void)anybody.hears(0x18FEE533);
  anybody.run(10s);
  EXPECT_EQ(anybody.taken().back(), j1939::request_frame(0xFEE5, 0xF9, 0x33)) << "who has answered";
}

TEST(J1939Bus, SaysNothingWithoutAnAddressAndAllocatesNothing) {
  HeardJ1939 silent(test::broadcast_machine());
  silent.run(10s);
  silent.hears(j1939::request_frame(j1939::kAddressClaim, 0x21, 0xFF));
  silent.run(1s);
  EXPECT_TRUE(silent.taken().empty());
  EXPECT_TRUE(silent.j1939.may_command());
  HeardJ1939 bus;
  const test::NoAllocScope scope;
  bus.run(1s);
  for (std::uint8_t i = 0; i < 200; ++i) {
    CanFrame frame{.id = (0x18FEEE00U + i % 5) | kExtendedId, .size = 8, .data = {i}};
    (void)bus.j1939.receive(frame, bus.now);
    bus.hears(j1939::claim_frame(i, i));
    bus.run(5ms);
  }
  EXPECT_EQ(scope.allocations(), 0U);
}

}  // namespace
}  // namespace knuckle::slave
