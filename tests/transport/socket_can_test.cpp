// The bus over a Linux CAN interface, over socket pairs that carry struct can_frame as CAN sockets do: what a kernel
// without CAN can show. Filters, priorities and a real interface going down are for a kernel that has them.
#include "transport/socket_can.h"

#include <arpa/inet.h>
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <linux/can/error.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <set>
#include <utility>

#include "core/error.h"
#include "tests/support/no_alloc.h"
#include "tests/support/refusal.h"

namespace {

/// Descriptors that are CAN sockets without an interface: no other socket of a computer without CAN fails as they do.
std::set<int> without_interface;

template <typename Call>
Call* real(const char* name) {
  return reinterpret_cast<Call*>(dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" ssize_t send(int socket, const void* data, size_t size, int flags) {
  static auto* const call = real<ssize_t(int, const void*, size_t, int)>("send");
  if (!without_interface.contains(socket)) return call(socket, data, size, flags);
  errno = ENXIO;
  return -1;
}

extern "C" int recvmmsg(int socket, mmsghdr* messages, unsigned count, int flags, timespec* timeout) {
  static auto* const call = real<int(int, mmsghdr*, unsigned, int, timespec*)>("recvmmsg");
  if (!without_interface.contains(socket)) return call(socket, messages, count, flags, timeout);
  errno = ENODEV;
  return -1;
}

namespace knuckle {
namespace {

CanFrame frame(std::uint32_t id, std::uint8_t first, std::uint8_t size = 8) {
  return {id, size, {first, 1, 2, 3, 4, 5, 6, 7}};
}

can_frame wire(canid_t id, std::uint8_t first, std::uint8_t size = 8) {
  can_frame f{};
  f.can_id = id;
  f.len = size;
  for (std::uint8_t i = 0; i < 8; ++i) f.data[i] = i;
  f.data[0] = first;
  return f;
}

can_frame error_frame(canid_t error_class, std::uint8_t controller = 0, std::uint8_t sent = 0, std::uint8_t heard = 0) {
  can_frame f{};
  f.can_id = CAN_ERR_FLAG | error_class;
  f.len = CAN_ERR_DLC;
  f.data[1] = controller;
  f.data[6] = sent;
  f.data[7] = heard;
  return f;
}

std::pair<int, int> pair() {
  int ends[2] = {-1, -1};
  EXPECT_EQ(socketpair(AF_UNIX, SOCK_DGRAM, 0, ends), 0);
  return {ends[0], ends[1]};
}
void put(int end, const can_frame& f) {
  ASSERT_EQ(send(end, &f, sizeof f, 0), ssize_t{sizeof f});
}
std::vector<can_frame> drain(int end) {
  std::vector<can_frame> got;
  can_frame f{};
  while (recv(end, &f, sizeof f, MSG_DONTWAIT) == ssize_t{sizeof f}) got.push_back(f);
  return got;
}

/// The bus, and the kernel's ends of its three sockets in the test's hands.
class SocketCan : public ::testing::Test {
 protected:
  std::vector<CanFrame> receive_all() {
    std::vector<CanFrame> got;
    for (CanFrame f; bus.receive(f);) got.push_back(f);
    return got;
  }
  ~SocketCan() override {
    for (const int end : {process.second, service.second, errors.second}) close(end);
  }

  std::pair<int, int> process = pair(), service = pair(), errors = pair();
  SocketCanBus bus{"can7", SocketCanBus::Sockets{process.first, service.first, errors.first}};
};

TEST(SocketCanOpening, RefusesWhatIsNoCanInterfaceInOneLineThatNamesIt) {
  const auto refusal = [](const std::string& name, std::span<const CanFilter> hear = {}) {
    return test::refusal([&] { const SocketCanBus bus(name, hear); });
  };
  for (const char* name : {"nosuch7", "", "a_name_that_is_longer_than_any"}) {
    const std::string line = refusal(name);
    EXPECT_NE(line.find("\"" + std::string(name) + "\": no such interface"), std::string::npos) << line;
  }
  EXPECT_NE(refusal("lo").find("\"lo\": is not a CAN interface"), std::string::npos);
  const std::vector<CanFilter> extended{0x181, 0x800}, many(513, 0x181);
  EXPECT_NE(refusal("can0", extended).find("identifier 2048 to hear; limit 2047"), std::string::npos);
  const std::vector<CanFilter> beyond{kExtendedId | 0x1FFFFFFF, kExtendedId | 0x20000000};
  EXPECT_NE(refusal("can0", beyond).find("identifier 536870912 to hear; limit 536870911"), std::string::npos);
  EXPECT_NE(refusal("can0", many).find("513 identifiers to hear; limit 512"), std::string::npos);
}

TEST_F(SocketCan, SendsProcessDataAndServicesThroughQueuesOfTheirOwn) {
  for (const std::uint32_t id : {0x000U, 0x080U, 0x091U, 0x210U, 0x701U}) EXPECT_TRUE(bus.send(frame(id, 9, 2)));
  for (const std::uint32_t id : {0x580U, 0x5FFU, 0x600U, 0x67FU}) EXPECT_TRUE(bus.send(frame(id, 9)));
  const auto fast = drain(process.second), slow = drain(service.second);
  ASSERT_EQ(fast.size(), 5U);
  ASSERT_EQ(slow.size(), 4U);
  EXPECT_EQ(fast[3].can_id, 0x210U);
  EXPECT_EQ(fast[3].len, 2);
  EXPECT_EQ(fast[3].data[0], 9);
  EXPECT_EQ(fast[3].data[1], 1);
  EXPECT_EQ(fast[3].data[2], 0) << "bytes beyond the frame's size are nobody's";
  EXPECT_EQ(slow[3].can_id, 0x67FU);
  EXPECT_EQ(bus.counters().sent, 9U);
}

TEST_F(SocketCan, ReceivesEverythingOldestFirstAndProcessDataBeforeServices) {
  constexpr std::uint8_t kMany = 100;  // several batches
  for (std::uint8_t i = 0; i < kMany; ++i) {
    put(service.second, wire(0x590, i));
    put(process.second, wire(0x190, i, 5));
  }
  const auto got = receive_all();
  ASSERT_EQ(got.size(), 2U * kMany);
  for (std::uint8_t i = 0; i < kMany; ++i) {
    EXPECT_EQ(got[i], (CanFrame{0x190, 5, {i, 1, 2, 3, 4, 0, 0, 0}}));
    EXPECT_EQ(got[kMany + i], frame(0x590, i));
  }
  EXPECT_EQ(bus.counters().received, 2U * kMany);
}

TEST_F(SocketCan, IdentifiersOf29BitsKeepTheirFlagBothWays) {
  put(process.second, wire(CAN_EFF_FLAG | 0x18FF0190, 1));
  put(process.second, wire(CAN_EFF_FLAG | 0x190, 2));
  const auto got = receive_all();
  ASSERT_EQ(got.size(), 2U);
  EXPECT_EQ(got[0], frame(kExtendedId | 0x18FF0190, 1));
  EXPECT_EQ(got[1], frame(kExtendedId | 0x190, 2)) << "another than 0x190 of 11 bits";
  for (const std::uint32_t id : {0x18FF0580U, 0x00000601U}) EXPECT_TRUE(bus.send(frame(kExtendedId | id, 9)));
  const auto sent = drain(process.second);
  ASSERT_EQ(sent.size(), 2U) << "services are CANopen's alone";
  EXPECT_EQ(sent[0].can_id, CAN_EFF_FLAG | 0x18FF0580U);
  EXPECT_EQ(sent[1].can_id, CAN_EFF_FLAG | 0x601U);
  EXPECT_TRUE(drain(service.second).empty());
}

TEST_F(SocketCan, WhatIsNoDataFrameIsNotReceived) {
  put(process.second, wire(CAN_RTR_FLAG | 0x190, 2));
  put(process.second, wire(CAN_ERR_FLAG | CAN_ERR_BUSOFF, 3));
  put(process.second, wire(0x190, 4, 9));
  ASSERT_EQ(send(process.second, "short", 5, 0), 5);
  put(process.second, wire(0x190, 5));
  const auto got = receive_all();
  ASSERT_EQ(got.size(), 1U);
  EXPECT_EQ(got[0], frame(0x190, 5));
  EXPECT_EQ(bus.state(), CanState::kActive);
}

TEST_F(SocketCan, WhatAFullQueueDoesNotTakeIsDroppedCountedAndNeverSentLater) {
  const int short_queue = 8192;
  ASSERT_EQ(setsockopt(process.first, SOL_SOCKET, SO_SNDBUF, &short_queue, sizeof short_queue), 0);
  std::uint8_t taken = 0;
  while (taken < 0xF0 && bus.send(frame(0x210, taken))) ++taken;
  ASSERT_GT(taken, 0);
  ASSERT_LT(taken, 0xF0);
  EXPECT_FALSE(bus.send(frame(0x210, 0xF1)));
  EXPECT_EQ(bus.counters().queue_full, 2U);
  EXPECT_TRUE(bus.send(frame(0x610, 0))) << "services have a queue of their own";
  EXPECT_EQ(bus.state(), CanState::kActive);
  const auto old = drain(process.second);
  EXPECT_TRUE(bus.send(frame(0x210, 0xFE)));
  const auto then = drain(process.second);
  EXPECT_EQ(old.size(), taken);
  ASSERT_EQ(then.size(), 1U);
  EXPECT_EQ(then[0].data[0], 0xFE) << "the newest, and nothing that was dropped";
}

TEST_F(SocketCan, BusOffSilencesUntilItIsAcknowledgedAndTheControllerIsBack) {
  put(errors.second, error_frame(CAN_ERR_BUSOFF));
  receive_all();
  EXPECT_EQ(bus.state(), CanState::kBusOff);
  EXPECT_FALSE(bus.send(frame(0x080, 0, 0)));
  bus.acknowledge();
  EXPECT_EQ(bus.state(), CanState::kBusOff) << "it is still off";
  put(errors.second, error_frame(CAN_ERR_RESTARTED));
  receive_all();
  EXPECT_EQ(bus.state(), CanState::kBusOff) << "a restart by kernel or integrator is nobody's wish to go on";
  EXPECT_FALSE(bus.send(frame(0x210, 7)));
  EXPECT_TRUE(drain(process.second).empty());
  EXPECT_EQ(bus.counters().not_sendable, 2U);
  bus.acknowledge();
  EXPECT_EQ(bus.state(), CanState::kActive);
  EXPECT_TRUE(bus.send(frame(0x080, 0, 0)));
  EXPECT_EQ(bus.counters().bus_off, 1U);
  EXPECT_EQ(bus.counters().restarts, 1U);
}

TEST_F(SocketCan, ErrorFramesAreCountedAndTheirStatesFollowed) {
  put(errors.second, error_frame(CAN_ERR_CRTL | CAN_ERR_ACK, CAN_ERR_CRTL_TX_PASSIVE, 128, 3));
  put(errors.second, error_frame(CAN_ERR_PROT | CAN_ERR_BUSERROR));
  put(errors.second, error_frame(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_OVERFLOW, 129, 4));
  receive_all();
  EXPECT_EQ(bus.state(), CanState::kPassive);
  EXPECT_TRUE(bus.send(frame(0x080, 0, 0))) << "a passive controller still sends";
  const CanCounters& c = bus.counters();
  EXPECT_EQ(c.error_frames, 3U);
  EXPECT_EQ(c.passive, 1U);
  EXPECT_EQ(c.no_acknowledge, 1U);
  EXPECT_EQ(c.protocol_errors, 1U);
  EXPECT_EQ(c.controller_overflows, 1U);
  EXPECT_EQ(c.transmit_errors, 129);
  EXPECT_EQ(c.receive_errors, 4);
  put(errors.second, error_frame(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_WARNING, 127));
  receive_all();
  EXPECT_EQ(bus.state(), CanState::kActive);
}

TEST_F(SocketCan, AFloodOfErrorFramesKeepsNobodyBusyAndDisplacesNoData) {
  put(process.second, wire(0x190, 42));
  int flood = 0;
  const can_frame f = error_frame(CAN_ERR_PROT | CAN_ERR_BUSERROR);
  while (send(errors.second, &f, sizeof f, MSG_DONTWAIT) > 0) ++flood;
  CanFrame got;
  ASSERT_TRUE(bus.receive(got));
  EXPECT_EQ(got, frame(0x190, 42));
  EXPECT_LE(bus.counters().error_frames, 256U);
  receive_all();
  receive_all();
  EXPECT_EQ(bus.counters().error_frames, static_cast<unsigned>(flood));
}

/// The bus of an adapter that is pulled and plugged in again: sockets of then and of now.
class PulledAdapter : public ::testing::Test {
 protected:
  ~PulledAdapter() override {
    without_interface.clear();
    for (const auto& ends : {old[0], old[1], old[2], fresh[0], fresh[1], fresh[2]}) close(ends.second);
  }
  void pull() { without_interface = {old[0].first, old[1].first, old[2].first}; }
  /// One step of the loop: it receives, then sends. @return whether it could send.
  bool step() {
    heard.clear();
    for (CanFrame f; bus.receive(f);) heard.push_back(f);
    return bus.send(frame(0x080, 0, 0));
  }
  SocketCanBus::Sockets open_again() {
    if (!there) throw InputError("CAN interface \"can7\": no such interface");
    without_interface.clear();  // the same descriptors, with other sockets behind them
    return {fresh[0].first, fresh[1].first, fresh[2].first};
  }

  std::array<std::pair<int, int>, 3> old{pair(), pair(), pair()}, fresh{pair(), pair(), pair()};
  bool there = false;
  std::vector<CanFrame> heard;
  SocketCanBus bus{"can7", SocketCanBus::Sockets{old[0].first, old[1].first, old[2].first},
                   [this] { return open_again(); }};
};

TEST_F(PulledAdapter, IsLookedForOnlyOnceItIsGoneAndComesBackDownUntilItSendsAgainAndAgain) {
  there = true;
  EXPECT_TRUE(step());
  EXPECT_FALSE(bus.find_again()) << "nothing is missing";
  for (unsigned times = 1; times <= 2; ++times) {
    there = false;
    put(times == 1 ? old[0].second : fresh[0].second, wire(0x190, 1));
    pull();
    EXPECT_FALSE(step());
    EXPECT_EQ(bus.state(), CanState::kDown);
    EXPECT_NE(bus.diagnosis().find("plug the adapter in again"), std::string::npos) << bus.diagnosis();
    EXPECT_FALSE(bus.find_again());
    EXPECT_FALSE(step());
    if (times == 2) {
      for (auto& ends : fresh) {
        close(ends.second);
        ends = pair();
      }
    }
    there = true;
    EXPECT_TRUE(bus.find_again());
    EXPECT_FALSE(bus.find_again()) << "told once";
    EXPECT_EQ(bus.state(), CanState::kDown) << "nobody goes on as if nothing had been";
    put(fresh[0].second, wire(0x190, 2));
    EXPECT_TRUE(step());
    ASSERT_EQ(heard.size(), 1U);
    EXPECT_EQ(heard[0], frame(0x190, 2)) << "and nothing from before";
    EXPECT_EQ(drain(fresh[0].second).size(), 1U);
    EXPECT_TRUE(step());
    EXPECT_EQ(bus.state(), CanState::kActive);
    EXPECT_EQ(bus.counters().downs, times);
  }
}

TEST_F(PulledAdapter, WhileItIsGoneTheLoopTouchesNoSocketThatIsBeingReplaced) {
  pull();
  step();
  without_interface.clear();  // as if the sockets could be used again already
  EXPECT_FALSE(step());
  EXPECT_TRUE(drain(old[0].second).empty());
}

TEST_F(PulledAdapter, NeitherItsLossNorItsReturnAllocatesInTheLoop) {
  pull();
  CanFrame f;
  {
    const test::NoAllocScope scope;
    (void)bus.send(frame(0x080, 0, 0));
    (void)bus.receive(f);
    EXPECT_EQ(scope.allocations(), 0U);
  }
  there = true;
  ASSERT_TRUE(bus.find_again());
  const test::NoAllocScope scope;
  EXPECT_TRUE(bus.send(frame(0x080, 0, 0)));
  (void)bus.receive(f);
  EXPECT_EQ(scope.allocations(), 0U);
}

TEST_F(SocketCan, AllocatesNothing) {
  std::size_t received = 0;
  for (std::uint8_t i = 0; i < 8; ++i) put(process.second, wire(0x190, i));
  put(errors.second, error_frame(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_PASSIVE));
  const test::NoAllocScope scope;
  for (CanFrame f; bus.receive(f);) ++received;
  while (bus.send(frame(0x210, 1))) {
  }
  bus.acknowledge();
  EXPECT_EQ(scope.allocations(), 0U);
  EXPECT_EQ(received, 8U);
}

/// Datagram sockets of the internet know the same option as CAN sockets, and overflow as they do.
TEST(SocketCanOverflow, FramesThatTheKernelLostAreCounted) {
  const auto bound = [](sockaddr_in& address) {
    const int s = socket(AF_INET, SOCK_DGRAM, 0);
    address = {};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    EXPECT_EQ(bind(s, reinterpret_cast<sockaddr*>(&address), size), 0);
    EXPECT_EQ(getsockname(s, reinterpret_cast<sockaddr*>(&address), &size), 0);
    return s;
  };
  sockaddr_in here{}, there{};
  const int process = bound(here), service = bound(there), errors = bound(there), sender = bound(there);
  const int on = 1, little = 4096;
  ASSERT_EQ(setsockopt(process, SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on), 0);
  ASSERT_EQ(setsockopt(process, SOL_SOCKET, SO_RCVBUF, &little, sizeof little), 0);
  SocketCanBus bus("can7", SocketCanBus::Sockets{process, service, errors});
  std::uint64_t sent = 0;
  const auto put = [&](int times) {
    const can_frame f = wire(0x190, 0);
    for (int i = 0; i < times; ++i) {
      ASSERT_EQ(sendto(sender, &f, sizeof f, 0, reinterpret_cast<sockaddr*>(&here), sizeof here), ssize_t{sizeof f});
      ++sent;
    }
  };
  for (const int burst : {500, 1, 500, 1}) {  // the loss is told with the next frame that fits
    put(burst);
    for (CanFrame f; bus.receive(f);) {
    }
  }
  EXPECT_GT(bus.counters().overflows, 0U);
  EXPECT_EQ(bus.counters().received + bus.counters().overflows, sent);
  close(sender);
}

TEST(CanHealth, InterfaceThatGoesDownIsDownForAtLeastOneLookAndUpOnceItSends) {
  CanHealth health;
  health.on_receive_error(ENETDOWN);
  EXPECT_EQ(health.state(), CanState::kDown);
  health.on_sent();
  EXPECT_EQ(health.state(), CanState::kDown) << "down and up between two steps must not go unnoticed";
  health.on_look();
  EXPECT_EQ(health.state(), CanState::kActive);
  health.on_send_error(ENETDOWN);
  health.on_send_error(ENETDOWN);
  health.on_look();
  EXPECT_EQ(health.state(), CanState::kDown);
  EXPECT_EQ(health.counters().downs, 2U);
  EXPECT_EQ(health.counters().not_sendable, 2U);
}

TEST(CanHealth, BusOffOutlivesAnInterfaceThatWentDownAndUp) {
  CanHealth health;
  health.on_error_frame(CAN_ERR_BUSOFF, {});
  health.on_receive_error(ENETDOWN);
  EXPECT_EQ(health.state(), CanState::kDown);
  health.on_sent();
  health.on_look();
  EXPECT_EQ(health.state(), CanState::kBusOff);
  health.acknowledge();
  EXPECT_EQ(health.state(), CanState::kActive);
}

TEST(CanHealth, PassiveWithoutAReportedEndIsForgottenOnAskingOnceFramesWereHeard) {
  CanHealth health;
  health.on_received();
  health.on_error_frame(CAN_ERR_CRTL, {0, CAN_ERR_CRTL_RX_PASSIVE});
  health.acknowledge();
  EXPECT_EQ(health.state(), CanState::kPassive);
  health.on_received();
  EXPECT_EQ(health.state(), CanState::kPassive);
  health.acknowledge();
  EXPECT_EQ(health.state(), CanState::kActive);
}

TEST(CanHealth, FullQueueIsNoDownAndNothingToReadIsNoError) {
  CanHealth health;
  health.on_send_error(ENOBUFS);
  health.on_send_error(EAGAIN);
  health.on_receive_error(EAGAIN);
  EXPECT_EQ(health.state(), CanState::kActive);
  EXPECT_EQ(health.counters().queue_full, 2U);
}

TEST(CanHealth, SaysWhatIsWrongAndWhatToDo) {
  const std::array<std::uint8_t, 8> passive{0, CAN_ERR_CRTL_TX_PASSIVE};
  const auto says = [](const CanHealth& health, const char* words) {
    return health.diagnosis("can7").find(words) != std::string::npos && health.diagnosis("can7").starts_with("can7: ");
  };
  CanHealth health;
  EXPECT_EQ(health.diagnosis("can7"), "");
  health.on_send_error(ENOBUFS);
  EXPECT_TRUE(says(health, "no frame is sent or received"));
  health.on_error_frame(CAN_ERR_CRTL, passive);
  EXPECT_TRUE(says(health, "no frame received: wrong bit rate")) << health.diagnosis("can7");
  health.on_received();
  EXPECT_TRUE(says(health, "many frames are damaged")) << health.diagnosis("can7");
  health.on_error_frame(CAN_ERR_CRTL, {0, CAN_ERR_CRTL_ACTIVE});
  EXPECT_EQ(health.diagnosis("can7"), "");
  health.on_error_frame(CAN_ERR_CRTL, passive);
  EXPECT_TRUE(says(health, "no frame received since")) << health.diagnosis("can7");
  health.on_error_frame(CAN_ERR_BUSOFF, {});
  EXPECT_TRUE(says(health, "ip link set can7 type can restart"));
  health.on_error_frame(CAN_ERR_RESTARTED, {});
  EXPECT_TRUE(says(health, "acknowledge"));
  health.on_send_error(ENETDOWN);
  EXPECT_TRUE(says(health, "ip link set can7 up"));
  health.on_send_error(ENXIO);
  EXPECT_TRUE(says(health, "plug the adapter in again"));
}

}  // namespace
}  // namespace knuckle
