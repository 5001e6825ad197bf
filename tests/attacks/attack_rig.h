// A machine's side as it is shipped, an operator's end in the test's hand, and somebody between the two.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "app/pairing/key_folder.h"
#include "tests/programs/program_rig.h"
#include "tests/support/candump.h"
#include "tests/support/places.h"
#include "tests/support/run_program.h"
#include "tests/support/says.h"
#include "transport/secure/secure_link.h"

namespace knuckle::test {

namespace fs = std::filesystem;
using Bytes = std::vector<std::uint8_t>;

inline UdpSocket any_socket() {
  return UdpSocket(open_udp_socket("", parse_address("127.0.0.1:0"), ::bind, "listen on"));
}

/// The machine follows the hand. A computer too busy to keep a link alive may need more than one try.
inline bool follows(Hand& hand) {
  for (int tries = 5; tries > 0; --tries) {
    hand.lead(kArm, 0);
    if (!engage(hand)) continue;
    const double was_rad = hand.machine()->position_rad[kArm];
    hand.lead(kArm, 0.05);
    const auto moved = [&] { return hand.machine()->position_rad[kArm] > was_rad + 0.02; };
    if (eventually([&] { return moved() || !hand.sees(Mode::kEngaged); }) && moved()) return true;
  }
  return false;
}

inline int lines_of(const std::string& text) {
  return static_cast<int>(std::count(text.begin(), text.end(), '\n'));
}

/// Of /proc/PID/status: "VmRSS" in kB, "Threads".
inline std::size_t status_of(pid_t process, const std::string& key) {
  std::ifstream status("/proc/" + std::to_string(process) + "/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind(key + ":", 0) == 0) return std::stoul(line.substr(key.size() + 1));
  }
  return 0;
}

/// Forwards datagrams between operators and the machine's side; what passes, and as what, a test may say.
class Middle {
 public:
  /// What becomes of a datagram to the machine: itself, changed, several, or nothing.
  using Change = std::function<std::vector<Bytes>(const Bytes&)>;

  explicit Middle(const std::string& machine) : machine_(parse_address(machine)) {
    thread_ = std::thread([this] {
      while (!ending_) step();
    });
  }
  ~Middle() {
    ending_ = true;
    thread_.join();
  }
  Middle(const Middle&) = delete;
  Middle& operator=(const Middle&) = delete;

  [[nodiscard]] std::string address() const { return text(local_address(inner_.descriptor())); }
  void set(Change change) {
    const std::lock_guard lock(mutex_);
    change_ = std::move(change);
  }
  /// All that went to the machine so far, as it was sent.
  [[nodiscard]] std::vector<Bytes> seen() {
    const std::lock_guard lock(mutex_);
    return seen_;
  }

 private:
  void step() {
    std::array<pollfd, 2> both{{{inner_.descriptor(), POLLIN, 0}, {outer_.descriptor(), POLLIN, 0}}};
    (void)::poll(both.data(), both.size(), 20);
    std::array<std::uint8_t, 2048> bytes;
    SocketAddress from;
    while (const auto arrival = inner_.receive(bytes, from)) {
      desk_ = from;
      const Bytes datagram(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(arrival->size));
      const std::lock_guard lock(mutex_);
      seen_.push_back(datagram);
      for (const Bytes& one : change_ ? change_(datagram) : std::vector<Bytes>{datagram})
        (void)outer_.send(one, machine_);
    }
    while (const auto arrival = outer_.receive(bytes, from))
      (void)inner_.send(std::span(bytes).first(arrival->size), desk_);
  }

  UdpSocket inner_ = any_socket(), outer_ = any_socket();
  SocketAddress machine_, desk_;
  std::mutex mutex_;
  Change change_;
  std::vector<Bytes> seen_;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

/// Paired ends in folders of their own, and `knuckle slave --simulate` with the keys of one of them.
class Attacks : public testing::Test {
 protected:
  Attacks() {
    for (const char* who : {"machine", "desk", "foreign", "revoked", "expired"}) fs::create_directories(folder_ / who);
    secure::Identity machine = make("machine", 100), desk = make("desk", 100), revoked = make("revoked", 100),
                     expired = make("expired", 0);
    (void)make("foreign", 100);
    pin("machine", {peer(desk, "desk"), peer(revoked, "revoked", true), peer(expired, "expired")});
    for (const char* who : {"desk", "foreign", "revoked", "expired"}) pin(who, {peer(machine, "machine")});
  }
  ~Attacks() override { fs::remove_all(folder_); }

  [[nodiscard]] std::string path(const std::string& name) const { return folder_ / name; }
  [[nodiscard]] std::string contents(const std::string& name) const {
    std::ifstream in(path(name));
    return {std::istreambuf_iterator<char>(in), {}};
  }
  [[nodiscard]] std::unique_ptr<RunningProgram> slave(const std::string& name, const std::string& address) const {
    return slave_reached(name, {"--listen", address});
  }
  [[nodiscard]] std::unique_ptr<RunningProgram> slave_reached(const std::string& name,
                                                              const std::vector<std::string>& how) const {
    std::vector<std::string> arguments{"slave",     "--simulate",        "--keys", path("machine"),
                                       "--candump", path(name + ".log"), "--json", path(name + ".json")};
    arguments.insert(arguments.end(), how.begin(), how.end());
    return std::make_unique<RunningProgram>(program("knuckle"), arguments);
  }
  [[nodiscard]] std::unique_ptr<Hand> hand(const std::string& address, const std::string& who = "desk") const {
    const pairing::KeyFolder folder(path(who));
    return std::make_unique<Hand>(
        secure::SecureLink::connect(address, secure::load_identity(folder.key_file()), folder.peers()));
  }
  /// Ends a machine's side. @return its result.
  nlohmann::json end(RunningProgram& running, const std::string& name) const {
    running.signal(SIGTERM);
    const ProgramRun run = running.wait();
    EXPECT_EQ(run.exit_code, 0) << run.err;
    said_ = run.err;
    return nlohmann::json::parse(contents(name + ".json"));
  }
  /// Set-points other than zero to valves that are active.
  [[nodiscard]] int driving_frames(const std::string& name) const {
    std::istringstream log(contents(name + ".log"));
    int count = 0;
    for (const WireFrame& frame : read_candump(log)) {
      const bool to_valve = frame.id >= 0x210 && frame.id <= 0x212 && frame.data.size() >= 4;
      if (to_valve && (frame.u16(0) & 7U) == 7U && frame.i16(2) != 0) ++count;
    }
    return count;
  }

  mutable std::string said_;  ///< Standard error of the machine's side that ended last.

 private:
  [[nodiscard]] secure::Identity make(const std::string& who, int days) const {
    secure::Identity identity = secure::make_identity(who, days);
    std::ofstream(path(who + "/key.pem")) << identity.pem();
    fs::permissions(path(who + "/key.pem"), fs::perms::owner_read | fs::perms::owner_write);
    fs::permissions(path(who), fs::perms::owner_all);
    return identity;
  }
  void pin(const std::string& who, const secure::Peers& peers) const {
    pairing::KeyFolder(path(who)).change_peers([&peers](secure::Peers& known) { known = peers; });
  }
  static secure::Peer peer(const secure::Identity& identity, const std::string& name, bool revoked = false) {
    secure::Peer made;
    made.fingerprint = identity.fingerprint();
    made.name = name;
    made.revoked = revoked;
    made.expires_utc = identity.expires_utc();
    return made;
  }

  fs::path folder_ = fs::path(testing::TempDir()) / ("attacks_" + std::to_string(getpid()));
};

}  // namespace knuckle::test
