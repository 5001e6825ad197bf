// Two computers show each other their certificates, with and without somebody who disturbs them.
#include "app/pairing/pairing_exchange.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <thread>

#include "core/error.h"
#include "tests/support/free_address.h"
#include "transport/udp_socket.h"

namespace knuckle::pairing {
namespace {

/// DTLS alert: fatal, handshake_failure.
const std::vector<std::uint8_t> kRefusal{21, 0xFE, 0xFD, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 2, 40};

struct Two : ::testing::Test {
  const secure::Identity machine = secure::make_identity("site arm"), desk = secure::make_identity("desk 1");
  const std::string address = test::free_address();
  std::vector<SocketAddress> far_end{parse_address(address)};  ///< As the caller looked it up.
  std::atomic<bool> go_on{true};
  std::optional<Shown> at_machine, at_desk;
  Verdict machine_says = Verdict::kYes, desk_says = Verdict::kYes;
  Verdict machine_heard = Verdict::kNone, desk_heard = Verdict::kNone;
  std::thread listener, caller;

  void listen() {
    listener = std::thread([this] {
      PairingExchange exchange(secure::Role::kMachine, {parse_address(address)}, machine);
      at_machine = exchange.meet([this] { return go_on.load(); });
      if (at_machine) machine_heard = after(exchange, machine_says);
    });
  }
  void call() {
    caller = std::thread([this] {
      PairingExchange exchange(secure::Role::kOperator, far_end, desk);
      at_desk = exchange.meet([this] { return go_on.load(); });
      if (at_desk) desk_heard = after(exchange, desk_says);
    });
  }
  /// Says so, and hears what the other says.
  Verdict after(PairingExchange& exchange, Verdict verdict) const {
    exchange.say(verdict);
    while (go_on && exchange.heard() == Verdict::kNone) exchange.serve();
    EXPECT_TRUE(exchange.part() || !go_on);
    return exchange.heard();
  }
  void TearDown() override {
    go_on = false;
    for (std::thread* one : {&listener, &caller}) {
      if (one->joinable()) one->join();
    }
  }
  void both_end() {
    caller.join();
    listener.join();
    ASSERT_TRUE(at_machine && at_desk);
    EXPECT_EQ(at_machine->fingerprint, desk.fingerprint());
    EXPECT_EQ(at_machine->name, "desk 1");
    EXPECT_EQ(at_machine->expires_utc, desk.expires_utc());
    EXPECT_EQ(at_desk->fingerprint, machine.fingerprint());
    EXPECT_EQ(at_desk->code, at_machine->code);
    EXPECT_EQ(at_desk->code.size(), 29U) << "120 bits";
    EXPECT_EQ(machine_heard, desk_says);
    EXPECT_EQ(desk_heard, machine_says);
  }
};

using PairingThreads = Two;

TEST_F(PairingThreads, TheSecondToComeFindsTheFirstBothShowTheSameCodeAndEachHearsWhetherTheOtherHasConfirmedIt) {
  machine_says = Verdict::kNo;
  call();
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  listen();
  both_end();
}

TEST_F(PairingThreads, AFloodOfJunkAndHellosOnlyDelaysThem) {
  std::atomic<bool> flood{true};
  std::thread attacker([&] {
    const UdpSocket socket(open_udp_socket("", parse_address("127.0.0.1:0"), ::bind, ""));
    const SocketAddress target = parse_address(address);
    std::vector<std::uint8_t> hello(200, 0), junk(900, 0x16), empty, tagged(60, 0xD0);
    hello[0] = 22;
    hello[1] = 0xFE;
    hello[2] = 0xFF;
    while (flood) {
      for (const auto& bytes : {hello, junk, empty, tagged}) (void)socket.send(bytes, target);
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
  });
  listen();
  call();
  both_end();
  flood = false;
  attacker.join();
}

TEST_F(PairingThreads, IsEndedByItsUserUnderAFlood) {
  const UdpSocket socket(open_udp_socket("", parse_address("127.0.0.1:0"), ::bind, ""));
  const SocketAddress target = parse_address(address);
  listen();
  const std::vector<std::uint8_t> junk(900, 0x16);
  for (int i = 0; i < 2000; ++i) (void)socket.send(junk, target);
  go_on = false;
  listener.join();
  EXPECT_FALSE(at_machine);
}

TEST_F(PairingThreads, SaysWhyItDoesNotSucceedYet) {
  const UdpSocket far(open_udp_socket("", parse_address(address), ::bind, ""));
  std::string told;
  const auto keep_on = [&] {
    std::array<std::uint8_t, 2048> bytes;
    SocketAddress from;
    while (far.receive(bytes, from)) (void)far.send(kRefusal, from);
    return told.empty();
  };
  const auto tell = [&](const std::string& why) { told = why; };
  PairingExchange exchange(secure::Role::kOperator, far_end, desk);
  EXPECT_FALSE(exchange.meet(keep_on, tell));
  EXPECT_NE(told.find("no DTLS 1.2 handshake"), std::string::npos) << told;
}

/// The first address cannot be used, at the second somebody else refuses.
TEST_F(PairingThreads, AllAddressesOfTheFarEndAreTriedInTurn) {
  const UdpSocket other(open_udp_socket("", parse_address("127.0.0.1:0"), ::bind, ""));
  far_end = {parse_address("255.255.255.255:5683"), local_address(other.descriptor()), parse_address(address)};
  listen();
  bool refused = false;
  const auto keep_on = [&] {
    std::array<std::uint8_t, 2048> bytes;
    SocketAddress from;
    for (; other.receive(bytes, from); refused = true) (void)other.send(kRefusal, from);
    return true;
  };
  PairingExchange exchange(secure::Role::kOperator, far_end, desk);
  at_desk = exchange.meet(keep_on);
  if (at_desk) desk_heard = after(exchange, desk_says);
  listener.join();
  EXPECT_TRUE(refused);
  ASSERT_TRUE(at_machine && at_desk);
  EXPECT_EQ(at_desk->fingerprint, machine.fingerprint());
  EXPECT_THROW(PairingExchange(secure::Role::kOperator, {far_end.front()}, desk), InputError);
}

/// Somebody between the two has to show each a certificate of its own.
TEST(PairingCode, DiffersWhereSomebodyIsBetween) {
  const auto print = [](const char* name) { return secure::make_identity(name).fingerprint(); };
  const secure::Fingerprint machine = print("site arm"), desk = print("desk 1"), thief = print("desk 1");
  EXPECT_EQ(secure::pairing_code(machine, desk), secure::pairing_code(desk, machine));
  EXPECT_NE(secure::pairing_code(machine, thief), secure::pairing_code(thief, desk));
  EXPECT_NE(secure::pairing_code(machine, desk), secure::pairing_code(machine, thief));
}

}  // namespace
}  // namespace knuckle::pairing
