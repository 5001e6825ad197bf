// New keys while messages flow: none is lost, however late a handshake's thread is and whatever of a handshake is lost.
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <limits>
#include <span>

#include "tests/transport/secure/secure_rig.h"
#include "transport/socket_address.h"

namespace {

// Of what the machine of this port ends a handshake with:
std::atomic<std::uint16_t> port{0};
std::atomic<int> to_lose{0};  // so many of these
std::atomic<bool> waits{false};
std::atomic<int> turns{0};  // of the test's loop
constexpr int kTurnsToWait = 20;

/// ChangeCipherSpec, or what comes behind it: a handshake's record of epoch 1 (RFC 6347, 4.1).
bool ends_handshake(int socket, std::span<const std::uint8_t> bytes) {
  constexpr std::uint8_t kChangeCipherSpec = 20, kHandshake = 22;
  const bool last = bytes.size() > 4 && (bytes[0] == kChangeCipherSpec || (bytes[0] == kHandshake && bytes[4] == 1));
  return last && knuckle::local_address(socket).port() == port;
}

}  // namespace

/// In place of the C library's: the machine may wait once it has ended a handshake, while the test's loop goes on.
extern "C" ssize_t sendto(int socket, const void* bytes, std::size_t size, int flags, const sockaddr* to,
                          socklen_t to_size) {
  const bool ends = ends_handshake(socket, {static_cast<const std::uint8_t*>(bytes), size});
  if (ends && to_lose > 0) {
    --to_lose;
    return static_cast<ssize_t>(size);
  }
  const auto sent = static_cast<ssize_t>(::syscall(SYS_sendto, socket, bytes, size, flags, to, to_size));
  const int error = errno, begun = turns;
  while (ends && waits && turns - begun < kTurnsToWait) ::poll(nullptr, 0, 1);
  errno = error;
  return sent;
}

namespace knuckle::secure {
namespace {

class SecureLinkKeysThreads : public SecureLinkThreads {
 protected:
  SecureLinkKeysThreads() { port = machine.link->port(); }
  ~SecureLinkKeysThreads() override {
    waits = false;
    to_lose = 0;
    port = 0;
  }
  /// Talks until it is so, ...
  bool talk_all_until(End& end, const std::function<bool()>& so) {
    const int before = machine.messages;
    int sent = 0;
    const bool came = until([&] {
      end.step(1);
      ++sent;
      machine.step(2);
      ++turns;
      return so();
    });
    // ... and hears what is still under way.
    (void)until([&] {
      machine.step(2);
      ++turns;
      return machine.messages - before >= sent;
    });
    EXPECT_GE(machine.messages - before, sent) << "lost " << sent - (machine.messages - before);
    return came;
  }
  bool talk_until_renewed(End& end, int times) {
    return talk_all_until(end, [&] {
      return machine.count(LinkEvent::Kind::kRenewed) >= times && end.count(LinkEvent::Kind::kRenewed) >= times;
    });
  }
  static SecureLinkTiming often() {
    SecureLinkTiming often;
    often.renew_keys = 200ms;
    return often;
  }
};

TEST_F(SecureLinkKeysThreads, NewKeysCostNoMessageWhereTheMachineIsHeldUpOnceItsLastWordsHaveLeftOrAreSaidAgain) {
  End op = desk(desk_identity(), often());
  ASSERT_TRUE(talk(op));
  waits = true;
  EXPECT_TRUE(talk_until_renewed(op, 2));
  to_lose = 1;
  EXPECT_TRUE(talk_until_renewed(op, op.count(LinkEvent::Kind::kRenewed) + 2));
  EXPECT_EQ(to_lose, 0);
  EXPECT_EQ(op.count(LinkEvent::Kind::kRefused), 0) << "they were said again";
}

TEST_F(SecureLinkKeysThreads, KeysThatTheOperatorNeverGetCostNoMessage) {
  SecureLinkTiming hasty = often();
  hasty.answer = 500ms;
  End op = desk(desk_identity(), hasty);
  ASSERT_TRUE(talk(op));
  to_lose = std::numeric_limits<int>::max();
  EXPECT_TRUE(talk_all_until(op, [&] { return op.count(LinkEvent::Kind::kRefused) >= 2; }));
  to_lose = 0;
  EXPECT_TRUE(talk_until_renewed(op, 1));
}

}  // namespace
}  // namespace knuckle::secure
