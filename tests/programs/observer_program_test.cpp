#include "app/programs/observer_program.h"

#include <gtest/gtest.h>

#include <deque>
#include <sstream>

namespace knuckle::programs {
namespace {

/// What the test puts into it is received.
class PreparedLink final : public Link {
 public:
  bool send(std::span<const std::uint8_t> /*bytes*/) noexcept override { return true; }
  bool receive(Datagram& datagram) noexcept override {
    if (waiting.empty()) return false;
    datagram = waiting.front();
    waiting.pop_front();
    return true;
  }
  std::deque<Datagram> waiting;
};

TEST(Observer, KeepsTheFirstEventOfEachKindAndTheNewestAndCountsTheOthers) {
  constexpr int kEvents = 3000;
  PreparedLink link;
  std::ostringstream told;
  ProgramConsole console("observer", told, false);
  Observer observer(link, console);
  Time now(1s);
  for (int i = 1; i <= kEvents; ++i) {
    SlaveMessage message;
    message.stamp.sequence = static_cast<std::uint32_t>(i);
    message.mode = i % 2 == 0 ? Mode::kReady : Mode::kEngaged;
    if (i == 1) message.mode = Mode::kSelfTest;
    link.waiting.push_back(encode(message));
    observer.tend(now += 20ms);
  }
  const ObserverOutcome outcome = observer.outcome(60);
  EXPECT_EQ(outcome.messages, static_cast<std::uint64_t>(kEvents));
  constexpr std::size_t kKinds = 3;
  ASSERT_EQ(outcome.events.size(), kKinds + RunEvents<ObservedEvent>::kMostOthers);
  EXPECT_EQ(outcome.events.front().mode, Mode::kSelfTest);
  EXPECT_EQ(outcome.events.back().at_s, to_seconds(now));
  EXPECT_EQ(outcome.records_lost, kEvents - outcome.events.size());
}

}  // namespace
}  // namespace knuckle::programs
