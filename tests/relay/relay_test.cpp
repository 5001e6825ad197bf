// The relay between sockets of the test, in the test's own thread. What is asserted of times is what the relay must not
// do sooner, or what it says of itself; how late this computer wakes it is not.
#include "app/relay/relay.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"

namespace knuckle::relay {
namespace {

constexpr const char* kAnyPort = "127.0.0.1:0";

/// A socket as a program of either side has one.
class Side {
 public:
  explicit Side(const std::string& address = kAnyPort)
      : socket_(open_udp_socket(address, parse_address(address), ::bind, "listen on")) {}
  [[nodiscard]] SocketAddress address() const { return local_address(socket_.descriptor()); }
  [[nodiscard]] int send(const std::string& bytes, const SocketAddress& to) const {
    return socket_.send({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, to);
  }
  /// What came, and from whom.
  struct Heard {
    std::string bytes;
    SocketAddress from;
  };
  [[nodiscard]] std::vector<Heard> heard() const {
    std::array<std::uint8_t, 65536> buffer{};
    std::vector<Heard> all;
    SocketAddress from;
    while (const auto arrival = socket_.receive(buffer, from))
      all.push_back({{buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(arrival->size)}, from});
    return all;
  }

 private:
  UdpSocket socket_;
};

struct Rig {
  explicit Rig(const LinkImpairment& to_machine = {}, const LinkImpairment& to_operator = {},
               const std::string& host = kAnyPort)
      : machine(host),
        relay(
            {.listen = host, .connect = text(machine.address()), .to_machine = to_machine, .to_operator = to_operator}),
        person(host) {}
  void run(Duration length) { relay.run_until(clock, clock.now() + length); }
  /// The relay's time goes on at once. However long this computer stands still, it is little beside it.
  void skip(Duration length) {
    clock = RealtimeClock(clock.now() + length);
    run(0ms);
  }
  /// The next datagram that comes, in 5 s.
  std::optional<Side::Heard> next(const Side& side) {
    const Time patience = clock.now() + 5s;
    while (clock.now() < patience) {
      for (auto& heard : side.heard()) return heard;
      run(1ms);
    }
    return std::nullopt;
  }
  std::string events() {
    std::string all;
    for (const RelayEvent& event : relay.take_events()) all += event.what + "\n";
    return all;
  }

  Side machine;
  Relay relay;
  Side person;
  RealtimeClock clock;
};

TEST(Relay, ForwardsWhatItGetsBothWaysAsItIs) {
  Rig rig;
  std::string all_bytes;
  for (int i = 0; i < 1024; ++i) all_bytes += static_cast<char>(i);
  for (const std::string& bytes : {std::string("ping"), std::string(), all_bytes, std::string(Flow::kMostBytes, 'x')}) {
    ASSERT_EQ(rig.person.send(bytes, rig.relay.address()), 0);
    const auto there = rig.next(rig.machine);
    ASSERT_TRUE(there);
    EXPECT_EQ(there->bytes, bytes);
    ASSERT_EQ(rig.machine.send("answer to " + bytes.substr(0, 1000), there->from), 0);
    const auto back = rig.next(rig.person);
    ASSERT_TRUE(back);
    EXPECT_EQ(back->bytes, "answer to " + bytes.substr(0, 1000));
    EXPECT_TRUE(back->from == rig.relay.address());
  }
  const auto reports = rig.relay.reports();
  ASSERT_EQ(reports.size(), 1U);
  EXPECT_EQ(reports[0].to_machine.forwarded, 4U);
  EXPECT_EQ(reports[0].to_operator.forwarded, 4U);
  EXPECT_EQ(reports[0].to_machine.forwarded_bytes, 4 + 0 + 1024 + Flow::kMostBytes);
}

TEST(Relay, DropsAndCountsWhatIsTooLongForAPathOf1500Bytes) {
  Rig rig;
  ASSERT_EQ(rig.person.send(std::string(Flow::kMostBytes + 1, 'x'), rig.relay.address()), 0);
  ASSERT_EQ(rig.person.send("short", rig.relay.address()), 0);
  const auto there = rig.next(rig.machine);
  ASSERT_TRUE(there);
  EXPECT_EQ(there->bytes, "short");
  ASSERT_EQ(rig.machine.send(std::string(20'000, 'x'), there->from), 0);
  rig.run(5ms);
  EXPECT_TRUE(rig.person.heard().empty());
  EXPECT_EQ(rig.relay.reports()[0].to_machine.too_long, 1U);
  EXPECT_EQ(rig.relay.reports()[0].to_operator.too_long, 1U);
}

TEST(Relay, DelaysEachDirectionByItsOwnAndNeverLess) {
  LinkImpairment up, down;
  up.delay = 30ms;
  down.delay = 5ms;
  Rig rig(up, down);
  for (int i = 0; i < 20; ++i) {
    ASSERT_EQ(rig.person.send("up", rig.relay.address()), 0);
    rig.run(2ms);
  }
  const auto there = rig.next(rig.machine);
  ASSERT_TRUE(there);
  for (int i = 0; i < 20; ++i) ASSERT_EQ(rig.machine.send("down", there->from), 0);
  rig.run(60ms);
  const FlowReport report = rig.relay.reports()[0];
  EXPECT_EQ(report.to_machine.forwarded, 20U);
  EXPECT_EQ(report.to_operator.forwarded, 20U);
  EXPECT_EQ(report.to_machine.delay.count_below(Duration(28 << 20)), 0U) << "29.4 ms";
  EXPECT_EQ(report.to_operator.delay.count_below(Duration(9 << 19)), 0U) << "4.7 ms";
}

TEST(Relay, LosesAndRepeatsAsItsModelSays) {
  LinkImpairment up;
  up.loss = 0.3;
  up.duplication = 0.2;
  Rig rig(up);
  for (int i = 0; i < 200; ++i) {
    ASSERT_EQ(rig.person.send("x", rig.relay.address()), 0);
    rig.run(0ms);
  }
  rig.run(30ms);
  const DirectionReport report = rig.relay.reports()[0].to_machine;
  EXPECT_EQ(report.counts.sent, 200U);
  EXPECT_EQ(report.forwarded, report.counts.sent - report.counts.lost + report.counts.duplicated);
  EXPECT_EQ(report.forwarded, rig.machine.heard().size());
  EXPECT_NEAR(static_cast<double>(report.counts.lost), 60, 4 * 6.5);
}

TEST(Relay, FirstOperatorsFatesAreThoseOfTheVirtualLinkWithTheSameSeed) {
  LinkImpairment lossy;
  lossy.loss = 0.3;
  ImpairedLink link(lossy, lossy, 1);
  Rig rig(lossy, lossy);
  SocketAddress operators;
  std::string virtual_fates, real_fates;
  Datagram datagram;
  const std::array<std::uint8_t, 1> byte{1};
  const auto fate = [](bool arrived) { return arrived ? "1" : "0"; };
  for (int i = 0; i < 100; ++i) {
    ASSERT_EQ(rig.person.send("hello", rig.relay.address()), 0);
    rig.run(0ms);
    const auto there = rig.machine.heard();
    if (!there.empty()) operators = there[0].from;
    real_fates += fate(!there.empty());
    link.a().send(byte);
    virtual_fates += fate(link.b().receive(datagram));
  }
  for (int i = 0; i < 100; ++i) {
    ASSERT_EQ(rig.machine.send("hello", operators), 0);
    rig.run(0ms);
    real_fates += fate(!rig.person.heard().empty());
    link.b().send(byte);
    virtual_fates += fate(link.a().receive(datagram));
  }
  EXPECT_EQ(real_fates, virtual_fates);
}

TEST(Relay, GivesEachOperatorAFlowOfItsOwn) {
  Rig rig;
  const Side other;
  ASSERT_EQ(rig.person.send("one", rig.relay.address()), 0);
  ASSERT_EQ(other.send("two", rig.relay.address()), 0);
  rig.run(10ms);
  const auto heard = rig.machine.heard();
  ASSERT_EQ(heard.size(), 2U);
  EXPECT_FALSE(heard[0].from == heard[1].from) << "the machine's side can tell them apart";
  for (const auto& one : heard) ASSERT_EQ(rig.machine.send("to " + one.bytes, one.from), 0);
  EXPECT_EQ(rig.next(rig.person)->bytes, "to one");
  EXPECT_EQ(rig.next(other)->bytes, "to two");
  EXPECT_EQ(rig.relay.active_flows(), 2U);
}

TEST(Relay, HasRoomForABoundedNumberOfOperatorsAndSaysWhoIsTooMany) {
  Rig rig;
  std::vector<std::unique_ptr<Side>> crowd;
  for (std::size_t i = 0; i < Relay::kMostFlows + 2; ++i) {
    crowd.push_back(std::make_unique<Side>());
    ASSERT_EQ(crowd.back()->send("hello", rig.relay.address()), 0);
    rig.run(1ms);
  }
  rig.run(10ms);
  EXPECT_EQ(rig.machine.heard().size(), Relay::kMostFlows);
  EXPECT_EQ(rig.relay.refused_datagrams(), 2U);
  EXPECT_NE(rig.events().find("no room for another operator, such as " + text(crowd[Relay::kMostFlows]->address())),
            std::string::npos);
}

TEST(Relay, AfterAnAddressChangeTheMachineSeesTheOperatorMoveAndAnswersThere) {
  LinkImpairment up;
  up.address_changes = {Time(5s)};
  Rig rig(up);
  ASSERT_EQ(rig.person.send("before", rig.relay.address()), 0);
  const auto before = rig.next(rig.machine);
  ASSERT_TRUE(before);
  rig.skip(8s);
  ASSERT_EQ(rig.person.send("after", rig.relay.address()), 0);
  const auto after = rig.next(rig.machine);
  ASSERT_TRUE(after);
  EXPECT_FALSE(after->from == before->from);
  ASSERT_EQ(rig.machine.send("to the old", before->from), 0);
  ASSERT_EQ(rig.machine.send("to the new", after->from), 0);
  EXPECT_EQ(rig.next(rig.person)->bytes, "to the new") << "the old address is nobody's any more";
  EXPECT_EQ(rig.relay.reports()[0].to_machine.address_changes, 1U);
  EXPECT_NE(rig.events().find("what goes to the machine comes from " + text(after->from) + " now"), std::string::npos);
}

TEST(Relay, AfterAnAddressChangeTheOperatorSeesTheMachineMoveAndReachesItThere) {
  LinkImpairment down;
  down.address_changes = {Time(5s)};
  Rig rig({}, down);
  ASSERT_EQ(rig.person.send("before", rig.relay.address()), 0);
  const auto machines = rig.next(rig.machine);
  ASSERT_TRUE(machines);
  rig.skip(8s);
  ASSERT_EQ(rig.machine.send("news", machines->from), 0);
  const auto news = rig.next(rig.person);
  ASSERT_TRUE(news);
  EXPECT_FALSE(news->from == rig.relay.address());
  ASSERT_EQ(rig.person.send("to the old", rig.relay.address()), 0);
  ASSERT_EQ(rig.person.send("to the new", news->from), 0);
  EXPECT_EQ(rig.next(rig.machine)->bytes, "to the new");
  EXPECT_EQ(rig.relay.reports()[0].to_machine.old_address, 1U);
}

TEST(Relay, TellsWhenOutagesAndChangesBeginCountedFromTheFirstDatagram) {
  LinkImpairment up;
  up.outages = {{.from = Time(5s), .length = 5s}};
  LinkImpairment worse;
  worse.loss = 1;
  up.changes = {{Time(15s), worse}};
  Rig rig(up);
  rig.skip(8s);
  EXPECT_EQ(rig.events(), "") << "nothing has begun";
  EXPECT_EQ(rig.relay.began_at(), kNever);
  ASSERT_EQ(rig.person.send("hello", rig.relay.address()), 0);
  rig.run(0ms);
  for (int i = 0; i < 4; ++i) rig.skip(5s);
  const std::string said = rig.events();
  const auto begins = said.find("outage to the machine begins"), ends = said.find("outage to the machine ends");
  const auto change = said.find("change 1 of to the machine in force");
  EXPECT_TRUE(begins < ends && ends < change && change != std::string::npos) << said;
  EXPECT_EQ(said.find("to the operator"), std::string::npos) << said;
}

TEST(Relay, SaysOnceThatNobodyListensAndFindsTheMachinesSideWhenItComes) {
  std::string address;
  {
    const Side gone;
    address = text(gone.address());
  }
  Relay relay({.listen = kAnyPort, .connect = address});
  const RealtimeClock clock;
  const Side person;
  for (int i = 0; i < 10; ++i) {
    ASSERT_EQ(person.send("anybody?", relay.address()), 0);
    relay.run_until(clock, clock.now() + 2ms);
  }
  std::string said;
  for (const RelayEvent& event : relay.take_events()) said += event.what + "\n";
  const auto first = said.find("nobody listens at " + address);
  EXPECT_NE(first, std::string::npos) << said;
  EXPECT_EQ(said.find("nobody listens", first + 1), std::string::npos) << said;
  const Side machine(address);
  ASSERT_EQ(person.send("and now?", relay.address()), 0);
  std::vector<Side::Heard> heard;
  for (int i = 0; heard.empty() && i < 5000; ++i) {
    relay.run_until(clock, clock.now() + 1ms);
    heard = machine.heard();
  }
  ASSERT_FALSE(heard.empty());
  EXPECT_EQ(heard.back().bytes, "and now?");
}

TEST(Relay, SaysWhyNothingReachesTheMachinesSideAndNotThatThereIsNoRoom) {
  Relay relay({.listen = kAnyPort, .connect = "255.255.255.255:5683"});  // no socket may send there without asking
  const RealtimeClock clock;
  const Side person;
  ASSERT_EQ(person.send("anybody?", relay.address()), 0);
  std::string said;
  for (int i = 0; said.empty() && i < 5000; ++i) {
    relay.run_until(clock, clock.now() + 1ms);
    for (const RelayEvent& event : relay.take_events()) said += event.what + "\n";
  }
  EXPECT_NE(said.find("cannot send to 255.255.255.255:5683"), std::string::npos) << said;
  EXPECT_EQ(said.find("no room"), std::string::npos) << said;
  EXPECT_EQ(relay.refused_datagrams(), 1U);
}

TEST(Relay, SpeaksIPv6WhereTheComputerDoes) {
  try {
    const Side probe("[::1]:0");
  } catch (const InputError&) {
    GTEST_SKIP() << "NOT TESTED: this computer has no IPv6 loopback";
  }
  Rig rig({}, {}, "[::1]:0");
  ASSERT_EQ(rig.person.send("six", rig.relay.address()), 0);
  const auto there = rig.next(rig.machine);
  ASSERT_TRUE(there);
  ASSERT_EQ(rig.machine.send("six too", there->from), 0);
  EXPECT_EQ(rig.next(rig.person)->bytes, "six too");
}

TEST(Relay, RefusesAddressesThatItCannotUseOrThatAreItsOwn) {
  const Side taken;
  struct Case {
    std::string listen, connect, why;
  };
  const Case cases[]{
      {"nonsense", "127.0.0.1:5683", "--listen nonsense: "},
      {kAnyPort, "nonsense", "--connect nonsense: "},
      {text(taken.address()), "127.0.0.1:5683", "another program"},
      {kAnyPort, "127.0.0.1:0", "port 0"},
      {kAnyPort, "0.0.0.0:5683", "single computer"},
      {"127.0.0.1:5683", "localhost:5683", "itself"},
      {"0.0.0.0:5683", "127.0.0.1:5683", "itself"},
  };
  for (const auto& [listen, connect, why] : cases)
    EXPECT_TRUE(test::says(
        test::refusal([&, &l = listen, &c = connect] { const Relay relay({.listen = l, .connect = c}); }), why));
}

}  // namespace
}  // namespace knuckle::relay
