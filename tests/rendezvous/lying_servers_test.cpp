// Paths of two ends whose rendezvous or TURN server lies, stalls and repeats: none leads to a stranger, each is found
// as soon as the truth comes through as well, and what is wrong is said. The same against the programs: tests/attacks.
#include <gtest/gtest.h>

#include <filesystem>
#include <mutex>
#include <random>
#include <thread>

#include "tests/rendezvous/lying_rendezvous.h"
#include "tests/rendezvous/lying_turn.h"
#include "tests/rendezvous/two_ends.h"

namespace knuckle::ice {
namespace {

using namespace std::chrono_literals;
using test::of_messages;
using Lines = std::vector<std::string>;

/// Until it is so, or a test's patience is over.
bool eventually(const std::function<bool()>& so) {
  for (int i = 0; i < 6000; ++i) {
    if (so()) return true;
    std::this_thread::sleep_for(10ms);
  }
  return false;
}

std::string room_in(const std::string& line) {
  return line.substr(8, kRoomSize);
}
Bytes bytes_in(const std::string& line) {
  return bytes_of_base64(line.substr(9 + kRoomSize)).value_or(Bytes{});
}
std::string line_of(const std::string& room, const Bytes& bytes) {
  return "message " + room + " " + base64(bytes) + "\n";
}
/// A signed message's first block, which is the signal.
Bytes message_of(const Bytes& signed_bytes) {
  const std::size_t size = signed_bytes[0] | static_cast<std::size_t>(signed_bytes[1]) << 8;
  return {signed_bytes.begin() + 2, signed_bytes.begin() + 2 + static_cast<std::ptrdiff_t>(size)};
}

/// One that makes false signals of true ones, as a rendezvous could.
class Forger {
 public:
  explicit Forger(const SocketAddress& trap) : trap_(trap) {}

  /// Other candidates, with the true signature and with the forger's; a flipped bit; half of it; another room's.
  Lines false_ones(const std::string& line) {
    const std::string room = room_in(line);
    const Bytes true_one = bytes_in(line);
    const Bytes message = message_of(true_one);
    Lines out;
    if (auto signal = decode(message); signal && !signal->candidates.empty()) {
      for (Candidate& one : signal->candidates) one.address = trap_;
      const Bytes own = signer_.sign(encode(*signal));
      Bytes mixed(own.begin(), own.begin() + 2 + static_cast<std::ptrdiff_t>(message_of(own).size()));
      mixed.insert(mixed.end(), true_one.begin() + 2 + static_cast<std::ptrdiff_t>(message.size()), true_one.end());
      out.push_back(line_of(room, mixed));
      out.push_back(line_of(room, own));
    }
    Bytes flipped = true_one;
    flipped[random_() % flipped.size()] ^= static_cast<std::uint8_t>(1U << (random_() % 8));
    out.push_back(line_of(room, flipped));
    out.push_back(line_of(room, {true_one.begin(), true_one.begin() + static_cast<std::ptrdiff_t>(
                                                                          random_() % (true_one.size() - 1) + 1)}));
    out.push_back(line_of(std::string(kRoomSize, 'e'), true_one));
    return out;
  }

 private:
  const SocketAddress trap_;
  const secure::Identity identity_ = secure::make_identity("machine");
  const Signer signer_{identity_};
  std::mt19937_64 random_{7};
};

bool is_hello(const std::string& line) {
  const auto signal = decode(message_of(bytes_in(line)));
  return signal && signal->kind == Signal::Kind::kHello;
}

/// Whether anything has come.
bool hears_nothing(const UdpSocket& socket) {
  std::array<std::uint8_t, 2048> bytes;
  SocketAddress from;
  return !socket.receive(bytes, from).has_value();
}
class RendezvousThatLies : public testing::Test {
 protected:
  test::LyingRendezvous rendezvous_;
  test::TwoEnds ends_;
};

TEST_F(RendezvousThatLies, SignalsThatAreForgedAlteredCutOrOfAnotherRoomLeadNowhere) {
  const UdpSocket trap = test::bound_socket();
  Forger forger(local_address(trap.descriptor()));
  std::atomic<int> lies{0};
  rendezvous_.tell(of_messages([&](const std::string& line) {
    Lines out = forger.false_ones(line);
    lies += static_cast<int>(out.size());
    return out;
  }));
  ends_.begin(rendezvous_.address());
  EXPECT_FALSE(ends_.carries(5));
  EXPECT_GT(lies, 0);
  EXPECT_NE(ends_.desk->problem().find("machine is not at the rendezvous"), std::string::npos) << ends_.desk->problem();

  // Now they know each other: candidates are told, and none of them is true.
  lies = 0;
  rendezvous_.tell(of_messages([&](const std::string& line) {
    if (is_hello(line)) return Lines{line + "\n"};
    ++lies;
    return forger.false_ones(line);
  }));
  EXPECT_TRUE(eventually([&] { return lies > 1; }));
  EXPECT_FALSE(ends_.carries(5));
  EXPECT_NE(ends_.desk->problem().find("no path to machine yet"), std::string::npos) << ends_.desk->problem();

  rendezvous_.tell(of_messages([&](const std::string& line) {
    Lines out = forger.false_ones(line);
    out.push_back(line + "\n");
    out.push_back(line + "\n");
    return out;
  }));
  EXPECT_TRUE(ends_.carries()) << "the truth, between lies and twice";
  EXPECT_TRUE(hears_nothing(trap)) << "nobody sends to an address that the far end has not signed";
}

TEST_F(RendezvousThatLies, SignalsOfAnEarlierSessionLeadNowhereWhoeverRestarts) {
  ends_.begin(rendezvous_.address());
  ASSERT_TRUE(ends_.carries());
  const Lines recorded = rendezvous_.messages();
  ASSERT_GE(recorded.size(), 4U);
  for (const bool both : {false, true}) {
    std::atomic<int> repeated{0};
    rendezvous_.tell(of_messages([&](const std::string&) {
      Lines out;
      for (const std::string& one : recorded) out.push_back(one + "\n");
      repeated += static_cast<int>(out.size());
      return out;
    }));
    if (both) ends_.desk.reset();
    ends_.begin_machine(rendezvous_.address());
    if (both) ends_.begin_desk(rendezvous_.address());
    EXPECT_TRUE(eventually([&] { return repeated > 2 * static_cast<int>(recorded.size()); }));
    EXPECT_FALSE(ends_.carries(3)) << both;
    for (const PathEvent& event : ends_.machine->take_events())
      EXPECT_NE(event.kind, PathEvent::Kind::kSearching) << "nobody has proven that they are there";
    rendezvous_.tell({});
    EXPECT_TRUE(ends_.carries()) << both;
  }
}

TEST_F(RendezvousThatLies, AStallAtAnyPointOfTheMeetingIsLateAndNothingElse) {
  for (const int passes : {1, 3}) {
    ends_.desk.reset();
    std::mutex mutex;
    int passed = 0;
    Lines held;
    rendezvous_.tell(of_messages([&](const std::string& line) {
      const std::lock_guard lock(mutex);
      if (passed++ < passes) return Lines{line + "\n"};
      held.push_back(line + "\n");
      return Lines{};
    }));
    ends_.begin(rendezvous_.address());
    EXPECT_TRUE(eventually([&] {
      const std::lock_guard lock(mutex);
      return held.size() >= 2;
    }));
    EXPECT_FALSE(ends_.carries(2)) << passes;
    EXPECT_NE(ends_.desk->problem(), "") << passes;
    // All that was held comes now, the newest first, and then the truth again.
    bool told = false;
    rendezvous_.tell(of_messages([&](const std::string& line) {
      const std::lock_guard lock(mutex);
      Lines out;
      if (!told) out.assign(held.rbegin(), held.rend());
      told = true;
      out.push_back(line + "\n");
      return out;
    }));
    EXPECT_TRUE(ends_.carries()) << passes;
    rendezvous_.tell({});
  }
}

TEST_F(RendezvousThatLies, OneThatTalksNonsenseWithoutEndOrHangsUpIsSaidAndCostsNoPathThatIsThere) {
  // No path yet: its faults are shown. No answer to a ping either, which would end a line that is never to end.
  rendezvous_.tell([](const std::string& line) {
    const bool joining = line.rfind("joined", 0) == 0 || line.rfind("entered", 0) == 0;
    return joining ? Lines{line + "\n"} : Lines{};
  });
  ends_.begin(rendezvous_.address());
  ASSERT_TRUE(eventually([&] { return rendezvous_.messages().size() > 1; }));
  for (const auto& [bytes, why] : test::rendezvous_misuses()) {
    const int before = rendezvous_.connections();
    rendezvous_.shout(bytes);
    const std::string problem = "rendezvous " + rendezvous_.address() + ": " + why;
    EXPECT_TRUE(eventually([&] { return ends_.desk->problem() == problem && ends_.machine->problem() == problem; }))
        << why;
    EXPECT_TRUE(eventually([&] { return rendezvous_.connections() >= before + 2; })) << why;
  }
  rendezvous_.tell({});
  EXPECT_TRUE(ends_.carries());
  const int before = rendezvous_.connections();
  rendezvous_.shout("");
  EXPECT_TRUE(eventually([&] { return rendezvous_.connections() >= before + 2; }));
  EXPECT_TRUE(ends_.carries(20)) << "each kind: tests/attacks";
  ends_.begin_machine(rendezvous_.address());  // needs signals again
  EXPECT_TRUE(ends_.carries());
}

TEST_F(RendezvousThatLies, OneThatIsSilentIsLeftAndDialledAgain) {
  rendezvous_.tell([](const std::string&) { return Lines{}; });
  ends_.begin(rendezvous_.address());
  EXPECT_TRUE(eventually([&] { return ends_.desk->problem().find("does not answer") != std::string::npos; }));
  rendezvous_.tell({});
  EXPECT_TRUE(ends_.carries());
}

// ------------------------------------------------------------------------------------------------------------- TURN

std::ptrdiff_t threads_here() {
  return std::distance(std::filesystem::directory_iterator("/proc/self/task"), {});
}

class TurnThatLies : public RendezvousThatLies {
 protected:
  [[nodiscard]] Servers servers() const {
    return {.stun = std::nullopt,
            .turn = HostAndPort{"localhost", turn_.address().port()},
            .turn_user = test::LyingTurn::kUser,
            .turn_password = test::LyingTurn::kPassword};
  }
  void begin() { ends_.begin(rendezvous_.address(), servers()); }
  void expect_both_say_once_that_there_is_no_relay() {
    std::array<int, 2> said{};
    EXPECT_TRUE(eventually([&] {
      std::size_t i = 0;
      for (auto* end : {&*ends_.desk, &*ends_.machine}) {
        for (const PathEvent& event : end->take_events())
          said[i] += text(event).find(": no relay: localhost (--turn) gives no address: ") != std::string::npos;
        ++i;
      }
      return said[0] > 0 && said[1] > 0;
    }));
    EXPECT_EQ(said, (std::array<int, 2>{1, 1}));
  }
  test::LyingTurn turn_;
};

TEST_F(TurnThatLies, WhateverItAnswersADirectPathIsFoundNothingPilesUpAndThatItGivesNoAddressIsSaidOnce) {
  const UdpSocket victim = test::bound_socket();
  std::atomic<bool> relayed{false};  // an honest one gives an address, so that the lies mean something
  rendezvous_.tell(of_messages([&](const std::string& line) {
    const auto signal = decode(message_of(bytes_in(line)));
    for (const Candidate& one : signal ? signal->candidates : std::vector<Candidate>{})
      relayed = relayed || one.kind == Candidate::Kind::kRelayed;
    return Lines{line + "\n"};
  }));
  begin();
  ASSERT_TRUE(ends_.carries());
  ASSERT_TRUE(eventually([&] { return relayed.load(); }));
  const std::ptrdiff_t threads = threads_here();
  int without_relay = 0;
  for (const test::NamedTurnLie& one : test::turn_lies(local_address(victim.descriptor()), turn_.address())) {
    SCOPED_TRACE(one.name);
    ends_.desk.reset();
    ends_.machine.reset();
    turn_.tell(one.lie);
    const int before = turn_.asked();
    begin();
    EXPECT_TRUE(ends_.carries());
    EXPECT_TRUE(eventually([&] { return turn_.asked() > before + 1; }));
    EXPECT_TRUE(ends_.carries(20));
    if (one.name != "stalls" && one.name != "refuses for ever") continue;
    ++without_relay;
    expect_both_say_once_that_there_is_no_relay();
  }
  EXPECT_EQ(without_relay, 2) << "lies of these names";
  ends_.desk.reset();
  ends_.machine.reset();
  turn_.tell({});
  begin();
  EXPECT_TRUE(ends_.carries());
  EXPECT_LE(threads_here(), threads + 2);
  std::array<std::uint8_t, 2048> bytes;
  SocketAddress from;
  int checks = 0;
  while (victim.receive(bytes, from)) {
    ++checks;
    EXPECT_LT(bytes[0], 4) << "checks of ICE (STUN) alone";
  }
  EXPECT_GT(checks, 0);
  EXPECT_LT(checks, 200);
}

}  // namespace
}  // namespace knuckle::ice
