#include "app/rendezvous/rendezvous_command.h"

#include <iostream>
#include <memory>
#include <string>

#include "app/cli/interrupt.h"
#include "app/rendezvous/rendezvous_server.h"

namespace knuckle::rendezvous {
namespace {

constexpr std::chrono::milliseconds kLongestWait{200};

int run(const std::string& listen) {
  const cli::InterruptGuard interrupt;
  RendezvousServer server(listen);
  std::cerr << "knuckle rendezvous: listening on " << text(server.address()) << std::endl;
  while (!interrupt.pending()) server.step(kLongestWait);
  const Counters& c = server.counters();
  std::cerr << "knuckle rendezvous: stopped: " << c.accepted << " connections, " << c.passed
            << " messages passed on; ended for junk " << c.junk << ", flooding " << c.floods << ", not reading "
            << c.stalled << ", silence " << c.idle << ", a full room " << c.displaced << "; turned away "
            << c.turned_away << '\n';
  return 0;
}

}  // namespace

cli::Command rendezvous_entry() {
  return {
      "rendezvous", "Where two sides behind NAT find each other: passes their signed messages on (docs/network.md)",
      [](const cli::OptionList& command) {
        const auto listen = std::make_shared<std::string>();
        command.add_option("--listen", *listen, "Address and TCP port, such as 0.0.0.0:5684 or [::]:5684").required();
        return [listen] { return run(*listen); };
      }};
}

}  // namespace knuckle::rendezvous
