#include "transport/link_inbox.h"

#include <gtest/gtest.h>

namespace knuckle {
namespace {

/// Datagrams that say how long they have waited.
class Waiting : public Link {
 public:
  explicit Waiting(int datagrams) : left_(datagrams) {}
  bool send(std::span<const std::uint8_t>) noexcept override { return true; }
  bool receive(Datagram& datagram) noexcept override {
    datagram.waited = waited;
    return left_-- > 0;
  }
  Duration waited{};

 private:
  int left_;
};

TEST(LinkInbox, TakesWhatWasNotThereWhenAllHadBeenReadForComeSince) {
  Waiting link(0);
  LinkInbox inbox(link);
  Datagram datagram;
  inbox.begin_step(Time(10s));
  EXPECT_FALSE(inbox.next(datagram));
  inbox.begin_step(Time(10s + 5ms));
  datagram.waited = 2ms;
  EXPECT_EQ(inbox.arrival(datagram), Time(10s + 3ms));
  datagram.waited = 1h;
  EXPECT_EQ(inbox.arrival(datagram), Time(10s));
  datagram.waited = -1h;
  EXPECT_EQ(inbox.arrival(datagram), Time(10s + 5ms));
}

TEST(LinkInbox, NothingComesAfterNowThoughTheReadersClockIsSetBack) {
  Waiting link(0);
  LinkInbox inbox(link);
  Datagram datagram;
  inbox.begin_step(Time(10s));
  EXPECT_FALSE(inbox.next(datagram));
  inbox.begin_step(Time(4s));
  for (const Duration waited : {Duration(-1s), Duration(0s), Duration(2ms), Duration(1h)}) {
    datagram.waited = waited;
    EXPECT_EQ(inbox.arrival(datagram), Time(4s));
  }
}

TEST(LinkInbox, CutsAFloodOff) {
  Waiting link(1000);
  LinkInbox inbox(link);
  Datagram datagram;
  inbox.begin_step(Time(1s));
  int taken = 0;
  while (inbox.next(datagram)) ++taken;
  EXPECT_EQ(taken, LinkInbox::kMostDatagrams);
  inbox.begin_step(Time(2s));
  EXPECT_TRUE(inbox.next(datagram)) << "the rest comes with the next steps";
}

}  // namespace
}  // namespace knuckle
