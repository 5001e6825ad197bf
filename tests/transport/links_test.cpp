#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <map>

#include "tests/support/no_alloc.h"
#include "tests/support/refusal.h"
#include "transport/impaired_link.h"
#include "transport/link_messages.h"
#include "transport/udp_link.h"

namespace knuckle {
namespace {

TEST(ImpairedLink, PerfectByDefaultAndBothWays) {
  ImpairedLink link({}, {}, 1);
  const std::array<std::uint8_t, 3> ping{1, 2, 3}, pong{4, 5, 6};
  Datagram datagram;
  EXPECT_TRUE(link.a().send(ping));
  EXPECT_TRUE(link.b().send(pong));
  ASSERT_TRUE(link.b().receive(datagram));
  EXPECT_TRUE(std::equal(ping.begin(), ping.end(), datagram.view().begin(), datagram.view().end()));
  ASSERT_TRUE(link.a().receive(datagram));
  EXPECT_EQ(datagram.bytes[0], 4);
  EXPECT_FALSE(link.a().receive(datagram));
  EXPECT_FALSE(link.a().send(std::vector<std::uint8_t>(kMaxDatagram + 1)));
}

TEST(ImpairedLink, EachDatagramComesWhenItsModelSaysAndTheQuickerOnesFirst) {
  LinkImpairment impairment;
  impairment.delay = 20ms;
  impairment.jitter = 10ms;
  impairment.loss = 0.1;
  impairment.duplication = 0.2;
  impairment.second_path = 250ms;
  ImpairedLink link(impairment, {}, 1);
  ImpairmentModel model(impairment, 2);  // with the seed of this direction
  std::multimap<Time, std::uint32_t> expected;
  Datagram datagram;
  for (std::uint32_t number = 0; number < 1000; ++number) {
    const Time now(number * 2ms);
    const auto fate = model.send(sizeof number, now);
    for (std::size_t i = 0; i < fate.copies; ++i) expected.emplace(fate.arrivals[i], number);
    link.advance(now);
    while (link.b().receive(datagram)) {
      std::uint32_t came = 0;
      std::memcpy(&came, datagram.bytes.data(), sizeof came);
      ASSERT_FALSE(expected.empty());
      EXPECT_LE(expected.begin()->first, now);
      EXPECT_EQ(expected.begin()->second, came);
      expected.erase(expected.begin());
    }
    ASSERT_TRUE(expected.empty() || expected.begin()->first > now);
    link.a().send({reinterpret_cast<const std::uint8_t*>(&number), sizeof number});
  }
  EXPECT_GT(expected.size(), 100U) << "the second path's last ones are on their way";
}

TEST(ImpairedLink, CutLosesExactlyWhatIsSentMeanwhile) {
  ImpairedLink link({}, {}, 1);
  link.cut(true);
  const std::array<std::uint8_t, 1> byte{1};
  Datagram datagram;
  EXPECT_TRUE(link.a().send(byte)) << "as with UDP, the sender does not learn of it";
  link.cut(false);
  EXPECT_FALSE(link.b().receive(datagram));
  EXPECT_EQ(link.a_to_b().lost, 1U);

  link.cut_b_to_a(true);
  link.a().send(byte);
  link.b().send(byte);
  EXPECT_TRUE(link.b().receive(datagram)) << "cut one way only";
  EXPECT_FALSE(link.a().receive(datagram));
}

TEST(ImpairedLink, BoundedStorageCountsOverflowAndNeverAllocates) {
  LinkImpairment impairment;
  impairment.delay = 1s;
  impairment.jitter = 100ms;
  ImpairedLink link(impairment, {}, 1);
  const std::array<std::uint8_t, 100> bytes{};
  Datagram datagram;
  const test::NoAllocScope scope;
  for (std::size_t i = 0; i < ImpairedLink::kInFlight + 10; ++i) link.a().send(bytes);
  link.advance(Time(2s));
  std::size_t arrived = 0;
  while (link.b().receive(datagram)) ++arrived;
  for (int i = 0; i < 5000; ++i) {
    link.advance(Time(2s + i * 2ms));
    link.a().send(bytes);
    arrived += link.b().receive(datagram) ? 1U : 0U;
  }
  const auto allocations = scope.allocations();
  EXPECT_EQ(allocations, 0U);
  EXPECT_EQ(link.a_to_b().overflowed, 10U);
  EXPECT_GT(arrived, ImpairedLink::kInFlight + 4000);
}

bool wait_for(UdpLink& link, Datagram& datagram) {
  for (int i = 0; i < 200; ++i) {
    if (link.receive(datagram)) return true;
    ::poll(nullptr, 0, 5);
  }
  return false;
}

/// What claims a listening end: a message of an operator's side.
Datagram claim(std::uint32_t sequence = 1) {
  MasterMessage message;
  message.stamp.sequence = sequence;
  return encode(message);
}

TEST(UdpLink, CarriesDatagramsBothWaysOverLoopback) {
  UdpLink slave = UdpLink::listen("127.0.0.1:0");
  UdpLink master = UdpLink::connect("127.0.0.1:" + std::to_string(slave.port()));
  const std::array<std::uint8_t, 3> ping{1, 2, 3};
  Datagram datagram;
  EXPECT_FALSE(slave.send(ping)) << "it has not heard anybody yet";
  EXPECT_FALSE(slave.receive(datagram)) << "must not block";
  ASSERT_TRUE(master.send(claim().view()));
  ASSERT_TRUE(wait_for(slave, datagram));
  ASSERT_TRUE(master.send(ping));
  ASSERT_TRUE(wait_for(slave, datagram));
  EXPECT_TRUE(std::equal(ping.begin(), ping.end(), datagram.view().begin(), datagram.view().end()));
  const std::vector<std::uint8_t> large(kMaxDatagram, 7);
  ASSERT_TRUE(slave.send(large));
  ASSERT_TRUE(wait_for(master, datagram));
  EXPECT_EQ(datagram.size, kMaxDatagram);
  EXPECT_FALSE(master.send(std::vector<std::uint8_t>(kMaxDatagram + 1)));
}

/// As the kernel delivers: loopback is immediate, so that what is not there now was not let in.
bool comes(UdpLink& link, Datagram& datagram) {
  return link.receive(datagram);
}

TEST(UdpLink, StrangersNeitherGetInNorTakeTheAnswersAway) {
  UdpLink slave = UdpLink::listen("127.0.0.1:0");
  const std::string address = "127.0.0.1:" + std::to_string(slave.port());
  UdpLink master = UdpLink::connect(address), stranger = UdpLink::connect(address);
  Datagram datagram;
  ASSERT_TRUE(master.send(claim(1).view()));
  ASSERT_TRUE(wait_for(slave, datagram));
  ASSERT_TRUE(stranger.send(claim(2).view()));
  ASSERT_TRUE(master.send(claim(3).view()));
  ASSERT_TRUE(wait_for(slave, datagram));
  EXPECT_EQ(decode_master(datagram.view())->stamp.sequence, 3U);
  ASSERT_TRUE(slave.send(claim().view()));
  EXPECT_TRUE(wait_for(master, datagram));
  EXPECT_FALSE(comes(stranger, datagram));
  ::poll(nullptr, 0, 1100);  // the first one is gone: nothing is sent to it, and whoever comes now is served
  EXPECT_FALSE(slave.send(claim().view()));
  ASSERT_TRUE(stranger.send(claim(4).view()));
  ASSERT_TRUE(wait_for(slave, datagram));
  EXPECT_EQ(decode_master(datagram.view())->stamp.sequence, 4U);
}

TEST(UdpLink, OnlyWhatAnOperatorsSideSaysClaimsAListeningEndOrKeepsIt) {
  UdpLink slave = UdpLink::listen("127.0.0.1:0");
  const std::string address = "127.0.0.1:" + std::to_string(slave.port());
  UdpLink master = UdpLink::connect(address), stranger = UdpLink::connect(address);
  Datagram datagram;
  const Datagram machines = encode(SlaveMessage{}), operators = claim();
  const std::array<std::uint8_t, 1> junk{7};
  for (const std::span<const std::uint8_t> bytes :
       {std::span<const std::uint8_t>{}, std::span<const std::uint8_t>(junk), machines.view(),
        operators.view().first(20)}) {
    ASSERT_TRUE(stranger.send(bytes));
    ::poll(nullptr, 0, 20);
    EXPECT_FALSE(comes(slave, datagram)) << bytes.size();
    EXPECT_FALSE(slave.send(junk)) << "nothing is sent to whom nothing is known of";
  }
  ASSERT_TRUE(master.send(claim().view()));
  ASSERT_TRUE(wait_for(slave, datagram));
  for (int i = 0; i < 12; ++i) {  // junk from the peer's address does not keep it
    (void)master.send(junk);
    ::poll(nullptr, 0, 100);
    while (slave.receive(datagram)) {
    }
  }
  EXPECT_FALSE(slave.send(junk));
}

TEST(UdpLink, TellsHowLongADatagramWaitedInTheKernel) {
  UdpLink slave = UdpLink::listen("127.0.0.1:0");
  UdpLink master = UdpLink::connect("127.0.0.1:" + std::to_string(slave.port()));
  Datagram datagram;
  // Linux begins to stamp datagrams a moment after the first socket asks for it; one that came before is stamped as it
  // is read.
  for (int i = 0; i < 20 && datagram.waited < 50ms; ++i) {
    ASSERT_TRUE(master.send(claim().view()));
    ::poll(nullptr, 0, 60);
    ASSERT_TRUE(slave.receive(datagram));
  }
  EXPECT_GE(datagram.waited, 50ms);
}

TEST(UdpLink, SaysWhetherAnybodyListens) {
  std::string address;
  {
    const UdpLink gone = UdpLink::listen("127.0.0.1:0");
    address = "127.0.0.1:" + std::to_string(gone.port());
  }
  UdpLink master = UdpLink::connect(address);
  const std::array<std::uint8_t, 1> byte{1};
  Datagram datagram;
  EXPECT_FALSE(master.refused()) << "nothing was sent yet";
  for (int i = 0; i < 200 && !master.refused(); ++i) {
    master.send(byte);
    EXPECT_FALSE(master.receive(datagram));
    ::poll(nullptr, 0, 5);
  }
  EXPECT_TRUE(master.refused());
  UdpLink slave = UdpLink::listen(address);
  for (int i = 0; i < 200 && master.refused(); ++i) {  // it is found as soon as it answers
    master.send(claim().view());
    if (slave.receive(datagram)) slave.send(byte);
    (void)wait_for(master, datagram);
  }
  EXPECT_FALSE(master.refused());
}

std::string refusal(UdpLink (*open)(const std::string&), const std::string& address) {
  return test::refusal([&] { (void)open(address); });
}

TEST(UdpLink, NamesTheAddressItCannotUseAndSaysWhy) {
  const UdpLink first = UdpLink::listen("127.0.0.1:0");
  const std::string taken = "127.0.0.1:" + std::to_string(first.port());
  const std::vector<std::array<std::string, 2>> listening{
      {"localhost", "ADDR:PORT"},
      {"127.0.0.1", "ADDR:PORT"},
      {"127.0.0.1:", "port"},
      {"127.0.0.1:99999", "65535"},
      {"127.0.0.1:-1", "port"},
      {"127.0.0.1:1x", "port"},
      {"a.b.c.d:1", "not an IPv4"},
      {":5683", "ADDR:PORT"},
      {"::1:5683", "[::1]:5683"},
      {"[::1:5683", "[::1]:5683"},
      {"[nonsense]:5683", "not an IPv4"},
      {taken, "another program"},
      {"192.0.2.1:5683", "no such address"},
  };
  for (const auto& [bad, why] : listening) {
    const std::string message = refusal(&UdpLink::listen, bad);
    EXPECT_NE(message.find(bad), std::string::npos) << message;
    EXPECT_NE(message.find(why), std::string::npos) << message;
  }
  const auto connect = [](const std::string& address) { return UdpLink::connect(address, "--connect"); };
  EXPECT_EQ(refusal(connect, "localhost"),
            "--connect localhost: is not HOST:PORT such as arm.example.org:5683, 192.0.2.7:5683 or [2001:db8::7]:5683");
  EXPECT_NE(refusal(connect, "127.0.0.1:0").find("port 0"), std::string::npos);
  EXPECT_NE(refusal(connect, "255.255.255.255:5683").find("broadcast"), std::string::npos);
  EXPECT_NE(refusal(connect, "0.0.0.0:5683").find("single computer"), std::string::npos);
}

TEST(UdpLink, ConnectsToAHostByItsNameAndSaysInOneLineWhereItHasNoAddress) {
  UdpLink machine = UdpLink::listen("127.0.0.1:0");
  UdpLink hand =
      UdpLink::connect("localhost:" + std::to_string(machine.port()));  // where it has a ::1, nobody listens there
  ASSERT_TRUE(hand.send(claim().view()));
  Datagram datagram;
  EXPECT_TRUE(wait_for(machine, datagram));

  const auto connect = [](const std::string& address) { return UdpLink::connect(address, "--connect"); };
  const std::string message = refusal(connect, "nowhere.invalid:5683");  // RFC 2606: no name ends so
  EXPECT_EQ(message.find("--connect nowhere.invalid:5683: \"nowhere.invalid\" has no address: "), 0u) << message;
  EXPECT_EQ(message.find('\n'), std::string::npos) << message;
}

/// Asked of the kernel, not of what is tested.
bool has_ipv6() {
  const int any = ::socket(AF_INET6, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in6 loopback{};
  loopback.sin6_family = AF_INET6;
  loopback.sin6_addr = in6addr_loopback;
  const bool bound = any >= 0 && ::bind(any, reinterpret_cast<const sockaddr*>(&loopback), sizeof loopback) == 0;
  if (any >= 0) ::close(any);
  return bound;
}

TEST(UdpLink, SpeaksIPv6WhereTheComputerDoes) {
  if (!has_ipv6()) GTEST_SKIP() << "NOT TESTED: this computer has no IPv6 loopback";
  UdpLink slave = UdpLink::listen("[::1]:0");
  UdpLink master = UdpLink::connect("[::1]:" + std::to_string(slave.port()));
  const std::array<std::uint8_t, 2> ping{1, 2};
  Datagram datagram;
  ASSERT_TRUE(master.send(claim().view()));
  ASSERT_TRUE(wait_for(slave, datagram));
  ASSERT_TRUE(slave.send(ping));
  EXPECT_TRUE(wait_for(master, datagram));
}

}  // namespace
}  // namespace knuckle
