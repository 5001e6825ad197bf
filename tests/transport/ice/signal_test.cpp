#include "transport/ice/signal.h"

#include <gtest/gtest.h>

namespace knuckle::ice {
namespace {

Candidate candidate(const std::string& address, Candidate::Kind kind = Candidate::Kind::kHost) {
  return {kind, "1", 2015363327, parse_address(address)};
}

Signal offer() {
  Signal signal;
  signal.kind = Signal::Kind::kOffer;
  signal.session = random_nonce();
  signal.challenge = random_nonce();
  signal.counter = 7;
  signal.attempt = 3;
  signal.complete = true;
  signal.user = "abcd";
  signal.password = std::string(22, 'p');
  signal.candidates = {candidate("192.0.2.7:40001"),
                       candidate("[2001:db8::7]:40002", Candidate::Kind::kServerReflexive),
                       candidate("198.51.100.10:50000", Candidate::Kind::kRelayed)};
  return signal;
}

TEST(IceSignal, IsReadAsItWasWritten) {
  const Signal written = offer();
  const auto read = decode(encode(written));
  ASSERT_TRUE(read);
  EXPECT_EQ(read->kind, written.kind);
  EXPECT_EQ(read->session, written.session);
  EXPECT_EQ(read->challenge, written.challenge);
  EXPECT_EQ(read->echo, written.echo);
  EXPECT_EQ(read->counter, 7u);
  EXPECT_EQ(read->attempt, 3u);
  EXPECT_FALSE(read->direct_only);
  EXPECT_TRUE(read->complete);
  EXPECT_EQ(read->user, "abcd");
  EXPECT_EQ(read->password, written.password);
  ASSERT_EQ(read->candidates.size(), 3u);
  EXPECT_EQ(text(read->candidates[1].address), "[2001:db8::7]:40002");
  EXPECT_EQ(read->candidates[2].kind, Candidate::Kind::kRelayed);
  EXPECT_EQ(read->candidates[0].priority, 2015363327u);
}

TEST(IceSignal, IsRefusedWhereItIsCutOrLongerThanItSays) {
  const Bytes whole = encode(offer());
  for (std::size_t size = 0; size < whole.size(); ++size) EXPECT_FALSE(decode(std::span(whole).first(size))) << size;
  Bytes longer = whole;
  longer.push_back(0);
  EXPECT_FALSE(decode(longer));
}

TEST(IceSignal, IsRefusedWithAnAddressThatReachesManyOrNobody) {
  for (const char* address : {"224.0.0.1:5", "255.255.255.255:5", "0.0.0.0:5", "192.0.2.7:0", "[ff02::1]:5", "[::]:5",
                              "[fe80::1]:5", "[::ffff:192.0.2.7]:5"}) {
    Signal signal = offer();
    signal.candidates = {candidate(address)};
    EXPECT_EQ(decode(encode(signal))->candidates.size(), 0u) << address;  // not even written
  }
  Signal signal = offer();
  signal.candidates = {candidate("192.0.2.7:40001")};
  Bytes bytes = encode(signal);
  bytes[bytes.size() - 4] = 239;  // first byte of the address
  EXPECT_FALSE(decode(bytes));
}

TEST(IceSignal, FitsItsBoundWithMoreCandidatesThanItMayHave) {
  Signal signal = offer();
  for (int i = 0; i < 100; ++i) {
    signal.candidates.push_back(candidate("[2001:db8:1111:2222:3333:4444:5555:6666]:40002"));
    signal.candidates.back().foundation = std::string(32, 'f');
  }
  const secure::Identity identity = secure::make_identity(std::string(secure::kMostNameLength, 'n'));
  const Bytes bytes = Signer(identity).sign(encode(signal));
  EXPECT_LE(bytes.size(), kMostSignal);
  const auto message = verified(bytes, identity.fingerprint());
  ASSERT_TRUE(message);
  EXPECT_EQ(decode(*message)->candidates.size(), kMostCandidates);
}

TEST(IceSignal, OfAnotherKeyOrWithAnyByteChangedIsNotVerified) {
  const secure::Identity identity = secure::make_identity("desk"), stranger = secure::make_identity("desk");
  const Bytes bytes = Signer(identity).sign(encode(offer()));
  ASSERT_TRUE(verified(bytes, identity.fingerprint()));
  EXPECT_FALSE(verified(bytes, stranger.fingerprint()));
  EXPECT_FALSE(verified(Signer(stranger).sign(encode(offer())), identity.fingerprint()));
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    Bytes changed = bytes;
    changed[i] ^= 0x10;
    EXPECT_FALSE(verified(changed, identity.fingerprint())) << "byte " << i;
  }
  // The right certificate before a stranger's signature.
  Bytes mixed = Signer(stranger).sign(encode(offer()));
  const std::size_t message = 2 + encode(offer()).size();
  const Bytes own = Signer(identity).sign(encode(offer()));
  std::copy(own.begin() + static_cast<std::ptrdiff_t>(message),
            own.begin() + static_cast<std::ptrdiff_t>(std::min(own.size(), mixed.size()) - 80),
            mixed.begin() + static_cast<std::ptrdiff_t>(message));
  EXPECT_FALSE(verified(mixed, identity.fingerprint()));
}

/// Two ends of a conversation, and whoever carries their signals between them.
class IceConversation : public testing::Test {
 protected:
  using Verdict = Conversation::Verdict;
  static Signal kind(Signal::Kind kind) {
    Signal signal = offer();
    signal.kind = kind;
    return signal;
  }
  /// As they meet: hello, answer, offer.
  void meet() {
    const auto hello = machine_.hear(desk_.say({}));
    ASSERT_EQ(hello.verdict, Verdict::kUnproven);
    ASSERT_EQ(desk_.hear(machine_.answer(hello.signal)).verdict, Verdict::kFresh);
    ASSERT_EQ(machine_.hear(desk_.say(offer())).verdict, Verdict::kFresh);
  }
  const secure::Identity desk_identity_ = secure::make_identity("desk"),
                         machine_identity_ = secure::make_identity("machine");
  const Signer desk_signer_{desk_identity_}, machine_signer_{machine_identity_};
  Conversation desk_{desk_signer_, machine_identity_.fingerprint()},
      machine_{machine_signer_, desk_identity_.fingerprint()};
};

TEST_F(IceConversation, NothingCountsBeforeTheFarEndHasProvenThatItIsThere) {
  const auto first = machine_.hear(desk_.say(offer()));
  EXPECT_EQ(first.verdict, Verdict::kUnproven);
  EXPECT_FALSE(machine_.knows_far_end());
  meet();
  EXPECT_TRUE(machine_.knows_far_end());
  EXPECT_TRUE(desk_.knows_far_end());
  EXPECT_EQ(desk_.hear(machine_.say(kind(Signal::Kind::kAnswer))).verdict, Verdict::kFresh);
}

TEST_F(IceConversation, ASignalCountsOnceAndNoneThatIsOlderThanAnother) {
  meet();
  const Bytes one = desk_.say(offer()), two = desk_.say(offer());
  EXPECT_EQ(machine_.hear(two).verdict, Verdict::kFresh);
  EXPECT_EQ(machine_.hear(two).verdict, Verdict::kRefused);
  EXPECT_EQ(machine_.hear(one).verdict, Verdict::kRefused);
}

TEST_F(IceConversation, WhatAnEarlierProcessSaidDoesNotCountAfterARestart) {
  meet();
  const Bytes kept = desk_.say(offer());
  Conversation desk_again(desk_signer_, machine_identity_.fingerprint());
  const auto hello = machine_.hear(desk_again.say({}));
  ASSERT_EQ(hello.verdict, Verdict::kUnproven);
  ASSERT_EQ(desk_again.hear(machine_.answer(hello.signal)).verdict, Verdict::kFresh);
  const auto heard = machine_.hear(desk_again.say(offer()));
  EXPECT_EQ(heard.verdict, Verdict::kFresh);
  EXPECT_TRUE(heard.new_session);
  EXPECT_EQ(machine_.hear(kept).verdict, Verdict::kUnproven);
  EXPECT_EQ(machine_.hear(desk_again.say(offer())).verdict, Verdict::kFresh);
}

TEST_F(IceConversation, ARestartedReceiverTakesNothingThatWasMeantForItsPredecessor) {
  meet();
  const Bytes kept = desk_.say(offer());
  Conversation machine_again(machine_signer_, desk_identity_.fingerprint());
  EXPECT_EQ(machine_again.hear(kept).verdict, Verdict::kUnproven);
}

TEST_F(IceConversation, AnotherProcessOfTheFarEndWaitsWhereTheFirstIsWanted) {
  meet();
  Conversation second(desk_signer_, machine_identity_.fingerprint());
  const auto hello = machine_.hear(second.say({}), false);
  ASSERT_EQ(second.hear(machine_.answer(hello.signal)).verdict, Verdict::kFresh);
  EXPECT_EQ(machine_.hear(second.say(offer()), false).verdict, Verdict::kOther);
  EXPECT_EQ(machine_.hear(desk_.say(offer()), false).verdict, Verdict::kFresh);
}

TEST_F(IceConversation, ASignalForSomebodyElseOrBackToItsSenderIsRefused) {
  meet();
  const secure::Identity third = secure::make_identity("third");
  Conversation elsewhere(desk_signer_, third.fingerprint());
  EXPECT_EQ(machine_.hear(elsewhere.say(offer())).verdict, Verdict::kRefused);
  EXPECT_EQ(desk_.hear(desk_.say(offer())).verdict, Verdict::kRefused);
}

}  // namespace
}  // namespace knuckle::ice
