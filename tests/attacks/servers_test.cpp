// The machine's side as it is shipped, with a rendezvous and a TURN server that lie, stall and repeat: the machine
// moves for its paired operator alone, nothing grows, and a session that has a path goes on. Single lies:
// tests/rendezvous; relayed datagrams that are changed and repeated: scripts/paths.
#include <gtest/gtest.h>

#include <random>

#include "app/pairing/chosen_link.h"
#include "tests/attacks/attack_rig.h"
#include "tests/rendezvous/lying_rendezvous.h"
#include "tests/rendezvous/lying_turn.h"

namespace knuckle::test {
namespace {

using namespace std::chrono_literals;
using Lines = std::vector<std::string>;

/// An operator's side that dials out.
struct DialledHand {
  explicit DialledHand(const pairing::LinkOptions& options)
      : link(pairing::ChosenLink::connect(options)), hand(link.link()) {}
  ~DialledHand() { link.close(); }
  DialledHand(const DialledHand&) = delete;
  DialledHand& operator=(const DialledHand&) = delete;
  pairing::ChosenLink link;
  Hand hand;
};

class LyingServers : public Attacks {
 protected:
  [[nodiscard]] std::unique_ptr<DialledHand> dialling_hand(const std::string& turn) const {
    pairing::LinkOptions options;
    options.keys = path("desk");
    options.dial = {rendezvous_.address(), "machine", "", turn};
    return std::make_unique<DialledHand>(options);
  }
  LyingRendezvous rendezvous_;
};

TEST_F(LyingServers, BothMoveNothingByThemselvesAndCostNoSessionNoMemoryAndFewLines) {
  LyingTurn turn;
  for (const char* who : {"machine", "desk"}) {
    std::ofstream(path(std::string(who) + "/turn.toml"))
        << "user = \"" << LyingTurn::kUser << "\"\npassword = \"" << LyingTurn::kPassword << "\"\n";
    fs::permissions(path(std::string(who) + "/turn.toml"), fs::perms::owner_read | fs::perms::owner_write);
  }
  const UdpSocket victim = any_socket();
  const auto turn_tells = turn_lies(local_address(victim.descriptor()), turn.address());
  std::mt19937_64 random(7);
  turn.tell(turn_tells[4].lie);
  std::atomic<int> lies{0};
  const auto false_ones = [&](const std::string& line) {
    const std::string begin = line.substr(0, 9 + ice::kRoomSize);
    const auto bytes = ice::bytes_of_base64(line.substr(begin.size())).value_or(Bytes{});
    Bytes flipped = bytes, cut = bytes;
    flipped[random() % flipped.size()] ^= static_cast<std::uint8_t>(1U << (random() % 8));
    cut.resize(1 + random() % (cut.size() - 1));
    lies += 2;
    return Lines{begin + ice::base64(flipped) + "\n", begin + ice::base64(cut) + "\n"};
  };
  rendezvous_.tell([](const std::string&) { return Lines{""}; });
  const std::string address = text(turn.address());
  const auto machine = slave_reached("run", {"--dial", rendezvous_.address(), "--turn", address});
  ASSERT_TRUE(eventually([&] { return rendezvous_.connections() > 1; })) << "dials again where it is hung up on";
  rendezvous_.tell(of_messages(false_ones));
  {
    const auto op = dialling_hand(address);
    EXPECT_TRUE(eventually([&] { return lies > 2; }));
    EXPECT_FALSE(eventually([&] { return op->hand.machine().has_value(); }, 1s));
    EXPECT_NE(op->link.problem(), "");
  }
  rendezvous_.tell(of_messages([&](const std::string& line) {
    Lines out = false_ones(line);
    out.push_back(line + "\n");
    out.push_back(line + "\n");
    return out;
  }));
  std::size_t before_kB = 0, threads = 0;
  std::mt19937_64 turn_random(7);  // of the TURN server's thread
  for (int session = 0; session < 4; ++session) {
    const auto op = dialling_hand(address);
    ASSERT_TRUE(follows(op->hand)) << "the truth, between lies and twice: session " << session;
    if (session > 0) continue;
    before_kB = status_of(machine->pid(), "VmRSS");
    threads = status_of(machine->pid(), "Threads");
    for (const auto& [bytes, why] : rendezvous_misuses()) {
      const int before = rendezvous_.connections();
      rendezvous_.shout(bytes);
      EXPECT_TRUE(eventually([&] { return rendezvous_.connections() >= before + 2; })) << why;
    }
    EXPECT_TRUE(op->hand.sees(Mode::kEngaged) || follows(op->hand));
    EXPECT_LT(status_of(machine->pid(), "VmRSS"), before_kB + 4096);
    // Another one at each request from now on.
    turn.tell([&](const StunMessage& request, const StunBytes& truth) {
      return turn_tells[turn_random() % turn_tells.size()].lie(request, truth);
    });
  }
  EXPECT_LT(status_of(machine->pid(), "VmRSS"), before_kB + 8192);
  EXPECT_LE(status_of(machine->pid(), "Threads"), threads);
  const auto json = end(*machine, "run");
  EXPECT_EQ(json.at("malformed_datagrams"), 0);
  EXPECT_EQ(json.at("path").at("pairs").at(0).at("kind"), "host");
  EXPECT_TRUE(says(said_, "link: rendezvous " + rendezvous_.address() + ": has closed the connection"));
  EXPECT_TRUE(says(said_, "path to desk: no relay: 127.0.0.1 (--turn) gives no address"));
  EXPECT_LT(lines_of(said_), 100) << said_;
  std::array<std::uint8_t, 2048> bytes;
  SocketAddress from;
  while (victim.receive(bytes, from)) EXPECT_LT(bytes[0], 4) << "checks of ICE (STUN) alone";
}

}  // namespace
}  // namespace knuckle::test
