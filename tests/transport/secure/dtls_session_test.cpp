// DTLS sessions without a network: who is let in, what is sealed and opened, what a network may do to it.
#include "transport/secure/dtls_session.h"

#include <gtest/gtest.h>

#include <deque>
#include <random>
#include <vector>

#include "tests/support/no_alloc.h"
#include "tests/transport/secure/secure_rig.h"

namespace knuckle::secure {
namespace {

struct Queue final : DtlsSession::Out {
  void put(std::span<const std::uint8_t> bytes) override { sent.emplace_back(bytes.begin(), bytes.end()); }
  std::deque<Bytes> sent;
  Bytes next() {
    Bytes first = std::move(sent.front());
    sent.pop_front();
    return first;
  }
};

/// Both ends, and their handshake over a wire that may lose every n-th datagram.
struct Ends {
  Ends(Peers machine_knows, Peers operator_knows, const Identity& machine_is, const Identity& operator_is,
       Purpose machine_does = Purpose::kControl, Purpose operator_wants = Purpose::kControl)
      : machine_context(machine_is, std::move(machine_knows), Role::kMachine, machine_does),
        operator_context(operator_is, std::move(operator_knows), Role::kOperator, operator_wants) {}

  void shake_hands() {
    std::optional<DtlsSession> machine_listening(std::in_place, machine_context);
    auto sent = op.start(to_machine);
    bool verified = false;
    DtlsSession::Progress answered = DtlsSession::Progress::kUnderWay;
    for (int i = 0; i < 60 && !(sent != DtlsSession::Progress::kUnderWay && to_machine.sent.empty()); ++i) {
      while (!to_machine.sent.empty()) {
        const Bytes datagram = to_machine.next();
        if (!verified) {
          verified = machine.hear_hello(datagram, parse_address("192.0.2.7:5683"), to_operator);
          if (verified) answered = machine.start(to_operator);
        } else {
          answered = machine.hear(datagram, to_operator);
        }
      }
      while (!to_operator.sent.empty()) sent = op.hear(to_operator.next(), to_machine);
    }
    operator_done = sent;
    machine_done = answered;
  }

  DtlsContext machine_context, operator_context;
  DtlsSession machine{machine_context}, op{operator_context};
  Queue to_machine, to_operator;
  DtlsSession::Progress operator_done{}, machine_done{};
};

struct DtlsPair : ::testing::Test {
  Ends ends{{peer(desk_identity())}, {peer(machine_identity())}, machine_identity(), desk_identity()};
  void SetUp() override {
    ends.shake_hands();
    ASSERT_EQ(ends.operator_done, DtlsSession::Progress::kDone);
    ASSERT_EQ(ends.machine_done, DtlsSession::Progress::kDone);
  }
  Sealed seal(const Bytes& plain) {
    Sealed sealed;
    EXPECT_TRUE(ends.op.seal(Inner::kMessage, plain, sealed));
    return sealed;
  }
};

TEST_F(DtlsPair, KnowsEachOtherAndCarriesMessagesBothWays) {
  EXPECT_EQ(ends.machine.peer(), desk_identity().fingerprint());
  EXPECT_EQ(ends.op.peer(), machine_identity().fingerprint());
  Datagram plain;
  const Sealed there = seal({1, 2, 3});
  EXPECT_TRUE(ends.machine.mine(there.view()));
  EXPECT_GE(there.bytes[0], kTagMark);
  const auto opened = ends.machine.open(there.view(), plain);
  ASSERT_TRUE(opened);
  EXPECT_EQ(opened->kind, Inner::kMessage);
  EXPECT_TRUE(opened->newest);
  EXPECT_EQ(Bytes(plain.view().begin(), plain.view().end()), (Bytes{1, 2, 3}));
  Sealed back;
  const Bytes large(kMaxDatagram, 7);
  ASSERT_TRUE(ends.machine.seal(Inner::kResponse, large, back));
  EXPECT_EQ(back.size, large.size() + kSealOverhead);
  EXPECT_TRUE(ends.op.mine(back.view()));
  ASSERT_TRUE(ends.op.open(back.view(), plain));
  EXPECT_EQ(plain.size, kMaxDatagram);
  EXPECT_FALSE(ends.op.seal(Inner::kMessage, Bytes(kMaxDatagram + 1), back));
}

TEST_F(DtlsPair, OpensNothingTwiceAndTellsWhatIsLate) {
  Datagram plain;
  const Sealed first = seal({1}), second = seal({2}), third = seal({3});
  EXPECT_TRUE(ends.machine.open(second.view(), plain)->newest);
  EXPECT_FALSE(ends.machine.open(second.view(), plain)) << "replayed";
  EXPECT_FALSE(ends.machine.open(first.view(), plain)->newest) << "late";
  EXPECT_TRUE(ends.machine.open(third.view(), plain)->newest);
}

TEST_F(DtlsPair, OpensNothingThatWasChanged) {
  Datagram plain;
  std::mt19937 random(1);
  for (int i = 0; i < 400; ++i) {
    Sealed sealed = seal({1, 2, 3, 4});
    if (i % 4 == 0) {
      sealed.size = std::uniform_int_distribution<std::size_t>(0, sealed.size - 1)(random);
    } else {
      const auto bit = std::uniform_int_distribution<std::size_t>(8 * kTagSize, 8 * sealed.size - 1)(random);
      sealed.bytes[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
    }
    EXPECT_FALSE(ends.machine.open(sealed.view(), plain)) << i;
  }
  EXPECT_TRUE(ends.machine.open(seal({5}).view(), plain)) << "and goes on";
}

/// Anybody who has seen a tag can make these; OpenSSL takes one that is too short for its authentication tag as the
/// end.
TEST_F(DtlsPair, NoForgedRecordEndsIt) {
  Datagram plain;
  for (const std::uint8_t type : Bytes{20, 21, 22, 23}) {
    for (const std::uint8_t epoch : Bytes{0, 1, 2}) {
      for (std::uint8_t length = 0; length < 40; ++length) {
        Bytes record{type, 0xFE, 0xFD, 0, epoch, 3, 0, 0, 0, 0, 9, 0, length};
        record.resize(record.size() + length, 2);
        (void)ends.machine.hear(record, ends.to_operator);
        Bytes inside{22, 0xFE, 0xFF, 0, 0, 0, 0, 0, 0, 0, 9, 0, static_cast<std::uint8_t>(record.size())};
        inside.insert(inside.end(), record.begin(), record.end());
        (void)ends.machine.hear(inside, ends.to_operator);
        const Tag& tag = ends.machine.receive_tag();
        record.insert(record.begin(), tag.begin(), tag.end());
        EXPECT_FALSE(ends.machine.open(record, plain));
        ASSERT_TRUE(ends.machine.open(seal({1}).view(), plain)) << int(type) << ' ' << int(epoch) << ' ' << int(length);
        Sealed sealed;
        ASSERT_TRUE(ends.machine.seal(Inner::kMessage, Bytes{1}, sealed));
      }
    }
  }
}

/// Somebody between the ends strips a sealed message of its tag: then it looks like a datagram of the handshake.
TEST_F(DtlsPair, GivesOutNothingThatCameAmongTheHandshakesDatagrams) {
  const Sealed first = seal({9, 8, 7}), second = seal({1, 2});
  const auto bare = first.view().subspan(kTagSize);
  EXPECT_EQ(ends.machine.hear(bare, ends.to_operator), DtlsSession::Progress::kDone);
  Datagram plain;
  const auto opened = ends.machine.open(second.view(), plain);
  ASSERT_TRUE(opened);
  EXPECT_EQ(opened->kind, Inner::kMessage);
  EXPECT_EQ(Bytes(plain.view().begin(), plain.view().end()), (Bytes{1, 2}));
  EXPECT_FALSE(ends.machine.open(first.view(), plain)) << "it has been read";
}

/// The same behind the last datagram of the handshake.
TEST(DtlsSession, GivesOutNothingThatCameBehindTheHandshakesLastDatagram) {
  Ends ends{{peer(desk_identity())}, {peer(machine_identity())}, machine_identity(), desk_identity()};
  const auto deliver = [&] {
    while (!ends.to_machine.sent.empty())
      ends.machine_done = ends.machine.hear(ends.to_machine.next(), ends.to_operator);
  };
  const SocketAddress here = parse_address("192.0.2.7:5683");
  (void)ends.op.start(ends.to_machine);
  EXPECT_FALSE(ends.machine.hear_hello(ends.to_machine.next(), here, ends.to_operator));
  (void)ends.op.hear(ends.to_operator.next(), ends.to_machine);
  ASSERT_TRUE(ends.machine.hear_hello(ends.to_machine.next(), here, ends.to_operator));
  (void)ends.machine.start(ends.to_operator);
  while (!ends.to_operator.sent.empty()) (void)ends.op.hear(ends.to_operator.next(), ends.to_machine);
  deliver();
  ASSERT_EQ(ends.machine_done, DtlsSession::Progress::kDone);
  Sealed first, second;
  ASSERT_TRUE(ends.machine.seal(Inner::kMessage, Bytes{9, 8, 7}, first));
  ASSERT_TRUE(ends.machine.seal(Inner::kMessage, Bytes{1, 2}, second));
  Bytes& last = ends.to_operator.sent.back();
  last.insert(last.end(), first.view().begin() + kTagSize, first.view().end());
  auto progress = DtlsSession::Progress::kUnderWay;
  while (!ends.to_operator.sent.empty()) progress = ends.op.hear(ends.to_operator.next(), ends.to_machine);
  ASSERT_EQ(progress, DtlsSession::Progress::kDone);
  Datagram plain;
  const auto opened = ends.op.open(second.view(), plain);
  ASSERT_TRUE(opened);
  EXPECT_EQ(Bytes(plain.view().begin(), plain.view().end()), (Bytes{1, 2}));
}

TEST_F(DtlsPair, AllocatesNothingOnceItIsThere) {
  Sealed sealed;
  Datagram plain;
  const Bytes message(300, 5);
  int opened = 0;
  const test::NoAllocScope scope;
  for (int i = 0; i < 1000; ++i) {
    (void)ends.op.seal(Inner::kMessage, message, sealed);
    opened += ends.machine.open(sealed.view(), plain) ? 1 : 0;
    opened += ends.machine.open(sealed.view(), plain) ? 100'000 : 0;  // a copy
    (void)ends.machine.seal(Inner::kMessage, message, sealed);
    opened += ends.op.open(sealed.view(), plain) ? 1 : 0;
  }
  const auto allocations = scope.allocations();
  EXPECT_EQ(allocations, 0U);
  EXPECT_EQ(opened, 2000);
}

/// OpenSSL notes where each failure was, in two short texts that the next one frees.
TEST_F(DtlsPair, ForgedDatagramsDoNotPileUp) {
  Datagram plain;
  std::uint64_t first = 0;
  const test::NoAllocScope scope;
  for (int i = 0; i < 1000; ++i) {
    Sealed sealed = seal({1, 2, 3});
    sealed.bytes[40] ^= 1;
    const auto before = scope.allocations();
    (void)ends.machine.open(sealed.view(), plain);
    first = std::max(first, scope.allocations() - before);
  }
  EXPECT_LE(first, 2U);
}

TEST_F(DtlsPair, SaysFarewell) {
  Sealed sealed;
  Datagram plain;
  ASSERT_TRUE(ends.op.seal_farewell(sealed));
  EXPECT_FALSE(ends.machine.open(sealed.view(), plain));
  EXPECT_TRUE(ends.machine.closed());
}

TEST(DtlsSession, LetsInWhoIsPairedAndNobodyElse) {
  const Identity stranger = make_identity("stranger"), expired = make_identity("old desk", -2);
  const Peers knows_machine{peer(machine_identity())}, knows_desk{peer(desk_identity())};
  struct Case {
    const char* name;
    Ends ends;
    Refusal machine_says, operator_says;
  };
  // What the operator's side is told comes after it has finished its own part, or not at all.
  Case cases[]{
      {"unknown desk",
       {knows_desk, knows_machine, machine_identity(), stranger},
       Refusal::kUnknownPeer,
       Refusal::kNotKnownThere},
      {"revoked desk",
       {{peer(desk_identity(), true)}, knows_machine, machine_identity(), desk_identity()},
       Refusal::kRevokedPeer,
       Refusal::kRevokedThere},
      {"expired desk",
       {{peer(expired)}, knows_machine, machine_identity(), expired},
       Refusal::kExpiredPeer,
       Refusal::kExpiredThere},
      {"unknown machine",
       {knows_desk, knows_machine, stranger, desk_identity()},
       Refusal::kNotKnownThere,
       Refusal::kUnknownPeer},
      {"no pairing at all",
       {{}, {}, machine_identity(), desk_identity()},
       Refusal::kNotKnownThere,
       Refusal::kUnknownPeer},
  };
  for (auto& [name, ends, machine_says, operator_says] : cases) {
    ends.shake_hands();
    EXPECT_NE(ends.machine_done, DtlsSession::Progress::kDone) << name;
    EXPECT_NE(ends.operator_done, DtlsSession::Progress::kDone) << name;
    EXPECT_EQ(ends.machine.refusal(), machine_says) << name << ": " << text(ends.machine.refusal());
    EXPECT_EQ(ends.op.refusal(), operator_says) << name << ": " << text(ends.op.refusal());
  }
}

/// Also where the two are paired already: who pairs anew is asked for the code, and a machine's program shows none.
TEST(DtlsSession, OnlyPairMeetsPair) {
  const Peers knows_machine{peer(machine_identity())}, knows_desk{peer(desk_identity())};
  for (const Purpose wanted : {Purpose::kControl, Purpose::kObserve, Purpose::kTry}) {
    Ends to_pair{knows_desk, knows_machine, machine_identity(), desk_identity(), Purpose::kPair, wanted};
    to_pair.shake_hands();
    EXPECT_EQ(to_pair.machine_done, DtlsSession::Progress::kFailed);
    EXPECT_EQ(to_pair.machine.refusal(), Refusal::kWantsNoPairing);
    EXPECT_EQ(to_pair.op.refusal(), Refusal::kPairsThere);
  }
  Ends to_slave{knows_desk, knows_machine, machine_identity(), desk_identity(), Purpose::kControl, Purpose::kPair};
  to_slave.shake_hands();
  EXPECT_EQ(to_slave.machine_done, DtlsSession::Progress::kFailed);
  EXPECT_EQ(to_slave.machine.refusal(), Refusal::kWantsToPair);
  EXPECT_EQ(to_slave.op.refusal(), Refusal::kNoPairThere);
  Ends strangers{{}, {}, machine_identity(), desk_identity(), Purpose::kPair, Purpose::kPair};
  strangers.shake_hands();
  EXPECT_EQ(strangers.machine_done, DtlsSession::Progress::kDone);
  EXPECT_EQ(strangers.operator_done, DtlsSession::Progress::kDone);
}

TEST(DtlsSession, KeepsNothingOfAHelloWithoutItsCookie) {
  const DtlsContext machine(machine_identity(), {peer(desk_identity())}, Role::kMachine);
  const DtlsContext desk(desk_identity(), {peer(machine_identity())}, Role::kOperator);
  DtlsSession listening(machine), op(desk);
  Queue to_machine, to_operator;
  (void)op.start(to_machine);
  const Bytes hello = to_machine.next();
  const SocketAddress here = parse_address("192.0.2.7:5683"), there = parse_address("192.0.2.8:5683");
  EXPECT_FALSE(listening.hear_hello(hello, here, to_operator));
  ASSERT_EQ(to_operator.sent.size(), 1U) << "the cookie";
  EXPECT_LE(to_operator.sent.front().size(), hello.size()) << "no use for amplification";
  (void)op.hear(to_operator.next(), to_machine);
  const Bytes second = to_machine.next();
  EXPECT_FALSE(listening.hear_hello(second, there, to_operator)) << "the cookie of another address";
  EXPECT_TRUE(listening.hear_hello(second, here, to_operator));
}

}  // namespace
}  // namespace knuckle::secure
