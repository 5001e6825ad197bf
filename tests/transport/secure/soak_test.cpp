// Ten million messages over a secure link with new keys again and again: nothing grows.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <string>

#include "tests/transport/secure/secure_rig.h"

namespace knuckle::secure {
namespace {

std::size_t resident_kB() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("VmRSS:", 0) == 0) return std::stoul(line.substr(6));
  }
  return 0;
}

TEST(DeepSecureLink, TenMillionMessagesWithNewKeysGrowNothing) {
  const Identity &arm = machine_identity(), &desk = desk_identity();
  SecureLinkTiming often;
  often.renew_keys = 500ms;
  const auto machine = SecureLink::listen("127.0.0.1:0", arm, {peer(desk)});
  const auto console = SecureLink::connect("127.0.0.1:" + std::to_string(machine->port()), desk, {peer(arm)}, often);
  const std::array<std::uint8_t, 300> bytes{};
  constexpr long kMessages = 10'000'000, kWarm = kMessages / 10;
  long received = 0, renewed = 0, sent = 0;
  std::size_t warm_kB = 0;
  Datagram datagram;
  LinkEvent event;
  while (received < kMessages && sent < 3 * kMessages) {
    for (int i = 0; i < 32; ++i, sent += 2) {
      (void)console->send(bytes);
      (void)machine->send(bytes);
    }
    while (machine->receive(datagram)) ++received;
    while (console->receive(datagram)) ++received;
    while (machine->next(event)) renewed += event.kind == LinkEvent::Kind::kRenewed ? 1 : 0;
    while (console->next(event)) {
    }
    if (received >= kWarm && warm_kB == 0) warm_kB = resident_kB();
  }
  RecordProperty("renewed", static_cast<int>(renewed));
  std::printf("received %ld of %ld, new keys %ld times, resident %zu kB after a tenth, %zu kB at the end\n", received,
              sent, renewed, warm_kB, resident_kB());
  EXPECT_GE(received, kMessages);
  EXPECT_GT(renewed, 20);
  EXPECT_LT(resident_kB(), warm_kB + 1024);
}

}  // namespace
}  // namespace knuckle::secure
