// What scripts/paths measures with: datagrams that go there and back, by a bare socket or over a path that was dialled,
// an operator's hand that engages the machine, keeps enable pressed through whatever happens to the path, and says what
// it saw, and a TURN server that changes, repeats and drops what it relays.
#include <poll.h>

#include <array>
#include <csignal>
#include <cstring>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "app/cli/command.h"
#include "app/pairing/chosen_link.h"
#include "app/programs/program_options.h"
#include "core/error.h"
#include "tests/paths/felt_session.h"
#include "tests/paths/lying_relay.h"
#include "tests/programs/program_rig.h"

namespace knuckle::test {
namespace {

using Clock = std::chrono::steady_clock;
using Json = nlohmann::ordered_json;

constexpr std::size_t kPingSize = 194;  // a sealed MasterMessage
constexpr auto kPingEvery = 5ms;
constexpr int kPatience_ms = 500, kTries = 30;  // until the far end is there

struct Options {
  std::string address, keys, turn;
  pairing::DialOptions dial;
  int count = 1000;
  double watch_s = 5;
  std::string scenario;
};

volatile std::sig_atomic_t ended = 0, steps = 0;

double since_s(Clock::time_point then) {
  return std::chrono::duration<double>(Clock::now() - then).count();
}

void echo(const UdpSocket& socket) {
  std::array<std::uint8_t, 2048> bytes;
  SocketAddress from;
  while (ended == 0) {
    pollfd waiting{socket.descriptor(), POLLIN, 0};
    (void)::poll(&waiting, 1, 100);
    while (const auto arrival = socket.receive(bytes, from))
      (void)socket.send(std::span(bytes).first(arrival->size), from);
  }
}

/// nullopt where nothing comes back in time.
std::optional<Duration> ping(const UdpSocket& socket, std::uint64_t number) {
  std::array<std::uint8_t, kPingSize> bytes{0xFF};  // taken for a sealed message on the way
  std::memcpy(bytes.data() + 8, &number, sizeof number);
  const auto sent_at = Clock::now();
  (void)socket.send(bytes, {});
  const auto give_up = sent_at + std::chrono::milliseconds(kPatience_ms);
  while (Clock::now() < give_up) {
    pollfd waiting{socket.descriptor(), POLLIN, 0};
    if (::poll(&waiting, 1, kPatience_ms) <= 0) return std::nullopt;
    std::array<std::uint8_t, kPingSize> back{};
    SocketAddress from;
    if (socket.receive(back, from) && back == bytes) return Clock::now() - sent_at;
  }
  return std::nullopt;
}

Json ping_many(const UdpSocket& socket, int count) {
  int tries = 0;
  while (!ping(socket, 0) && ++tries < kTries) {
  }
  if (tries == kTries) throw InputError("nothing comes back");
  std::vector<Duration> took;
  int lost = 0;
  for (int i = 1; i <= count; ++i) {
    const auto next = Clock::now() + kPingEvery;
    const auto one = ping(socket, static_cast<std::uint64_t>(i));
    if (one)
      took.push_back(*one);
    else
      ++lost;
    std::this_thread::sleep_until(next);
  }
  if (took.empty()) throw InputError("nothing comes back");
  std::sort(took.begin(), took.end());
  const auto at = [&took](double q) {
    return 1e3 * to_seconds(took[static_cast<std::size_t>(q * static_cast<double>(took.size() - 1))]);
  };
  return {{"p50_ms", at(0.5)}, {"p99_ms", at(0.99)}, {"lost", lost}};
}

UdpSocket bound() {
  return UdpSocket(open_udp_socket("echo", parse_address("127.0.0.1:0"), ::bind, "listen on"));
}
UdpSocket connected(const std::string& address) {
  return UdpSocket(open_udp_socket(address, parse_address(address), ::connect, "reach"));
}

std::unique_ptr<ice::Dialler> dialler_of(const Options& o, secure::Role role) {
  const pairing::KeyFolder folder(o.keys);
  secure::Peers peers = folder.peers();
  if (role == secure::Role::kOperator) peers = {pairing::chosen_peer(o.dial, peers, folder)};
  return pairing::make_dialler(o.dial, role, folder, folder.identity(), peers);
}

int run_dial_echo(const Options& o) {
  const UdpSocket socket = bound();
  const auto dialler = dialler_of(o, secure::Role::kMachine);
  dialler->start(local_address(socket.descriptor()));
  echo(socket);
  return 0;
}

int run_dial_ping(const Options& o) {
  const auto dialler = dialler_of(o, secure::Role::kOperator);
  const UdpSocket socket = connected(dialler->address());
  dialler->start(local_address(socket.descriptor()));
  Json json = ping_many(socket, o.count);
  json["kind"] = dialler->pairs().empty() ? Json() : Json(ice::name(dialler->pairs().back().pair.kind));
  std::cout << json.dump() << std::endl;
  return 0;
}

/// What the hand sees of the machine while it looks.
class Watch {
 public:
  Watch(Hand& hand, Clock::time_point started) : hand_(hand), started_(started) {}
  void look() {
    const auto told = hand_.machine();
    if (!told) return;
    if (told->stamp.sequence != sequence_) {
      if (heard_at_) longest_gap_s_ = std::max(longest_gap_s_, since_s(*heard_at_));
      sequence_ = told->stamp.sequence;
      heard_at_ = Clock::now();
    }
    if (modes_.empty() || modes_.back()["mode"] != name(told->mode))
      modes_.push_back({{"at_s", since_s(started_)}, {"mode", name(told->mode)}});
  }
  void look_until(const std::function<bool()>& enough, double longest_s) {
    const auto from = Clock::now();
    while (ended == 0 && !enough() && since_s(from) < longest_s) {
      look();
      std::this_thread::sleep_for(1ms);
    }
  }
  [[nodiscard]] const Json& modes() const { return modes_; }
  [[nodiscard]] double longest_gap_s() const { return longest_gap_s_; }

 private:
  Hand& hand_;
  Clock::time_point started_;
  std::uint32_t sequence_ = 0;
  std::optional<Clock::time_point> heard_at_;
  Json modes_ = Json::array();
  double longest_gap_s_ = 0;
};

/// Engages, leads a little, keeps enable pressed and looks on, SIGUSR1 ends it early; then lets go and engages anew.
int run_hand(const Options& o) {
  const auto started = Clock::now();
  pairing::LinkOptions options;
  options.keys = o.keys;
  options.dial = o.dial;
  pairing::ChosenLink link = pairing::ChosenLink::connect(options);
  Json json;
  {
    Hand hand(link.link());
    const bool heard = eventually([&] { return hand.machine().has_value() || ended != 0; });
    json["first_message_s"] = heard ? Json(since_s(started)) : Json();
    const bool engaged = heard && engage(hand);
    json["engaged_s"] = engaged ? Json(since_s(started)) : Json();
    std::cout << json.dump() << std::endl;
    hand.lead(0, 0.05);
    Watch watch(hand, started);
    watch.look_until([] { return steps != 0; }, o.watch_s);
    json["modes"] = watch.modes();
    json["longest_gap_ms"] = 1e3 * watch.longest_gap_s();
    json["engages_again"] = engaged && engage(hand);
  }
  json["path"] = Json::parse(programs::path_json(link, started).dump());
  json["events"] = Json::array();
  for (const cli::News& news : link.news()) json["events"].push_back(news.what);
  json["problem"] = link.problem();
  link.close();
  std::cout << json.dump() << std::endl;
  return 0;
}

/// A person presses a wall meanwhile; each SIGUSR1 says that something is done to the path.
int run_feel(const Options& o) {
  pairing::LinkOptions options;
  options.keys = o.keys;
  options.dial = o.dial;
  pairing::ChosenLink link = pairing::ChosenLink::connect(options);
  const auto started = Clock::now();
  Json json = feel_session(link.link(), o.scenario, steps, ended);
  json["path"] = Json::parse(programs::path_json(link, started).dump());
  link.close();
  std::cout << json.dump() << std::endl;
  return 0;
}

/// A command whose options are declared, and which then runs.
cli::Command command(const char* name, const char* about, Options& o,
                     const std::function<void(const cli::OptionList&, Options&)>& add_options,
                     std::function<int(const Options&)> run) {
  return {name, about, [&o, add_options, run = std::move(run)](const cli::OptionList& options) {
            add_options(options, o);
            return [&o, run] { return run(o); };
          }};
}

cli::Program path_tool(Options& o) {
  const auto address = [](const cli::OptionList& c, Options& to) {
    c.add_option("address", to.address, "HOST:PORT").required();
  };
  const auto dialled = [](secure::Role role) {
    return [role](const cli::OptionList& c, Options& to) {
      c.add_option("--keys", to.keys, "Folder").required();
      pairing::add_dial_options(c, to.dial, role);
      c.add_option("--count", to.count, "Pings");
      c.add_option("--watch", to.watch_s, "Seconds that a hand looks on");
      c.add_option("--scenario", to.scenario, "What a person who feels does");
    };
  };
  const auto operates = dialled(secure::Role::kOperator);
  return {"path_tool",
          "Measures paths, for scripts/paths\n",
          "",
          {command("echo", "bare", o, address,
                   [](const Options& given) {
                     echo(UdpSocket(open_udp_socket(given.address, parse_address(given.address), ::bind, "listen on")));
                     return 0;
                   }),
           command(
               "ping", "bare", o,
               [address](const cli::OptionList& c, Options& to) {
                 address(c, to);
                 c.add_option("--count", to.count, "Pings");
               },
               [](const Options& given) {
                 std::cout << ping_many(connected(given.address), given.count).dump() << std::endl;
                 return 0;
               }),
           command(
               "lying-relay", "in front of a TURN server", o,
               [address](const cli::OptionList& c, Options& to) {
                 address(c, to);
                 c.add_option("turn", to.turn, "HOST:PORT").required();
               },
               [](const Options& given) {
                 run_lying_relay(given.address, given.turn, steps, ended);
                 return 0;
               }),
           command("dial-echo", "over a path", o, dialled(secure::Role::kMachine), run_dial_echo),
           command("dial-ping", "over a path", o, operates, run_dial_ping),
           command("hand", "a session", o, operates, run_hand),
           command("feel", "a person who presses a wall", o, operates, run_feel)}};
}

}  // namespace
}  // namespace knuckle::test

int main(int argc, char** argv) {
  using namespace knuckle;
  using namespace knuckle::test;
  const auto end = [](int) { ended = 1; };
  std::signal(SIGTERM, end);
  std::signal(SIGINT, end);
  std::signal(SIGUSR1, [](int) { steps = steps + 1; });
  Options o;
  return cli::run_program(path_tool(o), {argv + 1, argv + argc});
}
