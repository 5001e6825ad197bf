// The programs of both sides in one process: the slave's bus and the nodes' bus joined by a thread that plays the
// wire, the link over the loopback interface. No thread of a loop waits for one of the test. What they say is read as
// it is said; nobody asks how long it took.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <ostream>
#include <streambuf>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "app/programs/node_program.h"
#include "app/programs/program_options.h"
#include "app/programs/slave_program.h"
#include "app/session/frame_log.h"
#include "core/mailbox.h"
#include "core/realtime_thread.h"
#include "machine/load.h"
#include "sim/truth.h"
#include "tests/support/bus_nodes.h"
#include "tests/support/free_address.h"
#include "transport/canopen.h"
#include "transport/link_messages.h"
#include "transport/link_session.h"
#include "transport/machine_status.h"
#include "transport/thread_wires.h"
#include "transport/udp_link.h"
#include "transport/virtual_can.h"

namespace knuckle::test {

/// Patience of a test: reached only where something does not come at all.
inline constexpr std::chrono::seconds kPatience{60};

/// Lines that one thread writes and another waits for.
class Heard : public std::streambuf {
 public:
  Heard() : stream(this) {}
  [[nodiscard]] std::string text() const {
    const std::lock_guard lock(mutex_);
    return text_;
  }
  [[nodiscard]] bool says(const std::string& what) const { return text().find(what) != std::string::npos; }
  /// Forgets what was said so far.
  void forget() {
    const std::lock_guard lock(mutex_);
    text_.clear();
  }

  std::ostream stream;

 protected:
  int_type overflow(int_type c) override {
    const std::lock_guard lock(mutex_);
    text_ += static_cast<char>(c);
    return c;
  }
  std::streamsize xsputn(const char* data, std::streamsize size) override {
    const std::lock_guard lock(mutex_);
    text_.append(data, static_cast<std::size_t>(size));
    return size;
  }

 private:
  mutable std::mutex mutex_;
  std::string text_;
};

/// Waits until it is so. @return false where it never was.
inline bool eventually(const std::function<bool()>& so, std::chrono::milliseconds patience = kPatience) {
  const auto give_up = std::chrono::steady_clock::now() + patience;
  while (!so()) {
    if (std::chrono::steady_clock::now() > give_up) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

/// Two controllers on one bus, each for a thread of its own, and a log of every frame in the order of the wire.
class Wire {
 public:
  explicit Wire(std::uint32_t bit_rate) : bus_(2, bit_rate), frames_(kMostFrames) {
    bus_.set_tap({[](void* self, Time at, const CanFrame& frame) {
                    static_cast<Wire*>(self)->keep({at, frame});
                  },
                  this});
    thread_.emplace(RealtimeOptions{.name = "wire", .period = std::chrono::microseconds(500), .fifo_priority = 85},
                    RealtimeClock(), [this](Time now) {
                      exchange();
                      bus_.advance(now);
                      exchange();
                    });
  }
  Wire(const Wire&) = delete;
  Wire& operator=(const Wire&) = delete;

  [[nodiscard]] CanBus& slave() noexcept { return slave_.controller(); }
  [[nodiscard]] CanBus& nodes() noexcept { return nodes_.controller(); }
  [[nodiscard]] session::FrameLog frames() const {
    const auto kept = static_cast<std::ptrdiff_t>(kept_.load(std::memory_order_acquire));
    return {frames_.begin(), frames_.begin() + kept};
  }

 private:
  static constexpr std::size_t kMostFrames = 1 << 19;  // a test's patience on a full bus
  void exchange() noexcept {
    slave_.exchange(bus_.port(0));
    nodes_.exchange(bus_.port(1));
  }
  void keep(const TimedFrame& frame) noexcept {
    const std::size_t kept = kept_.load(std::memory_order_relaxed);
    if (kept == frames_.size()) return;
    frames_[kept] = frame;
    kept_.store(kept + 1, std::memory_order_release);
  }
  ThreadCan slave_, nodes_;
  VirtualCanBus bus_;
  session::FrameLog frames_;
  std::atomic<std::size_t> kept_{0};
  std::optional<RealtimeThread> thread_;
};

inline const JointVector kStart(0.7, -1.3, -0.7);

inline MachineDescription machine() {
  return load_machine(find_config("machine", "solar015"));
}

/// A machine's nodes and its machine side, each as its program runs it.
class Site {
 public:
  explicit Site(std::vector<std::string> faults = {}, MachineDescription machine = knuckle::test::machine())
      : machine_(std::move(machine)), wire_(machine_.bus.bit_rate) {
    setup_.truth = sim::nominal_truth(machine_);
    setup_.start_rad = kStart;
    for (const std::string& fault : faults) setup_.faults.push_back(bringup::parse_fault(fault, machine_.bus));
    node_thread_ = std::thread([this] {
      programs::ProgramConsole console("node", node_said.stream, false);
      node =
          programs::run_node(setup_, wire_.nodes(), {[this] { return !end_node_; }, console}, signals, &truth.stream);
    });
    slave_thread_ = std::thread([this] {
      programs::ProgramConsole console("slave", slave_said.stream, false);
      slave =
          programs::run_slave(machine_, wire_.slave(), link_, random_start(), {[this] { return !end_slave_; }, console},
                              {&candump.stream, "can7", "", &csv.stream});
    });
  }
  ~Site() {
    end_slave();
    end_node();
  }
  Site(const Site&) = delete;
  Site& operator=(const Site&) = delete;

  /// As SIGTERM does.
  void end_slave() {
    end_slave_ = true;
    if (slave_thread_.joinable()) slave_thread_.join();
  }
  void end_node() {
    end_node_ = true;
    if (node_thread_.joinable()) node_thread_.join();
  }
  [[nodiscard]] std::string address() const { return "127.0.0.1:" + std::to_string(link_.port()); }
  [[nodiscard]] session::FrameLog frames() const { return wire_.frames(); }
  [[nodiscard]] const MachineDescription& description() const { return machine_; }

  Heard node_said, slave_said, candump, csv, truth;
  programs::NodeOutcome node;    // after end_node()
  programs::SlaveOutcome slave;  // after end_slave()
  std::atomic<std::uint32_t> signals{0};

 private:
  MachineDescription machine_;
  programs::NodeSetup setup_;
  Wire wire_;
  UdpLink link_ = UdpLink::listen("127.0.0.1:0");
  std::atomic<bool> end_slave_{false}, end_node_{false};
  std::thread node_thread_, slave_thread_;
};

/// An operator's side in the test's hand: says 500 times a second what the test wants it to. Until the machine is led
/// it asks for the pose that the machine has.
class Hand {
 public:
  explicit Hand(const std::string& address) : Hand(std::make_unique<UdpLink>(UdpLink::connect(address))) {}
  explicit Hand(std::unique_ptr<Link> link) : Hand(*link) { own_ = std::move(link); }
  /// @param link outlives it.
  explicit Hand(Link& link) : link_(link) {
    say([](MasterMessage& m) { m.device_ok = m.presence = true; });
    thread_.emplace(RealtimeOptions{.name = "hand", .period = 2ms, .fifo_priority = 60}, RealtimeClock(),
                    [this](Time now) { step(now); });
  }
  void say(const std::function<void(MasterMessage&)>& change) {
    change(meant_);
    to_say_.put(meant_);
  }
  /// Asks the machine to go this far from where it is led from, at a hand's pace.
  void lead(int joint, double by_rad) {
    say([&](MasterMessage& m) { m.position_rad[joint] = by_rad; });
  }
  [[nodiscard]] std::optional<SlaveMessage> machine() {
    SlaveMessage told;
    if (heard_.take(told)) seen_ = told;
    return seen_;
  }
  [[nodiscard]] std::optional<MachineStatus> status() {
    MachineStatus told;
    if (statuses_.take(told)) status_ = told;
    return status_;
  }
  [[nodiscard]] bool sees(Mode mode) {
    const auto told = machine();
    return told && told->mode == mode;
  }

 private:
  void step(Time now) noexcept {
    while (link_.receive(datagram_)) {
      if (const auto status = decode_status(datagram_.view())) statuses_.put(*status);
      auto told = decode_slave(datagram_.view());
      if (!told) continue;
      const LinkSession::Verdict verdict = session_.take(told->stamp, now);
      if (verdict == LinkSession::Verdict::kForeign || verdict == LinkSession::Verdict::kOld) continue;
      heard_.put(*told);
      if (told->mode != Mode::kEngaged) from_rad_ = told->position_rad;
    }
    to_say_.take(said_);
    const double since_s = stepped_at_ == kNever ? 0 : to_seconds(now - stepped_at_), most_rad = kPace_radps * since_s;
    stepped_at_ = now;
    const JointVector way_rad = (said_.position_rad - away_rad_).cwiseMax(-most_rad).cwiseMin(most_rad);
    away_rad_ += way_rad;
    MasterMessage message = said_;
    message.position_rad = from_rad_ + away_rad_;
    if (since_s > 0) message.velocity_radps = way_rad / since_s;
    message.stamp = session_.stamp(++sequence_, now);
    message.device_report_at = session_.to_link(now);
    link_.send(encode(message).view());
  }
  // the test's thread
  MasterMessage meant_;
  std::optional<SlaveMessage> seen_;
  std::optional<MachineStatus> status_;
  // between the two
  Mailbox<MasterMessage> to_say_;
  Mailbox<SlaveMessage> heard_;
  Mailbox<MachineStatus> statuses_;
  // the hand's thread
  Link& link_;
  static constexpr double kPace_radps = 0.5;
  MasterMessage said_;  // position: away from from_rad_, where the hand goes to
  JointVector from_rad_ = JointVector::Zero(), away_rad_ = JointVector::Zero();
  Time stepped_at_ = kNever;
  LinkSession session_{random_start(), kRestartSilence};
  std::uint32_t sequence_ = 0;
  Datagram datagram_;
  std::unique_ptr<Link> own_;
  std::optional<RealtimeThread> thread_;
};

/// Lets go of enable, presses it once that is all that is missing, and waits until the machine is led. A computer too
/// busy to keep a link alive may need more than one try: the machine then stops, as it should.
inline bool engage(Hand& hand) {
  for (int attempt = 0; attempt < 10; ++attempt) {
    hand.say([](MasterMessage& m) { m.enable = false; });
    const bool only_enable_missing = eventually([&] {
      const auto told = hand.machine();
      return told && told->blocking.code == ReasonCode::kEnableNotPressed;
    });
    if (!only_enable_missing) return false;
    hand.say([](MasterMessage& m) { m.enable = true; });
    if (!eventually([&] { return hand.sees(Mode::kAligning) || hand.sees(Mode::kEngaged); }, std::chrono::seconds(3)))
      continue;
    if (!eventually([&] { return !hand.sees(Mode::kAligning); })) return false;
    if (hand.sees(Mode::kEngaged)) return true;
  }
  return false;
}

/// Set-points with the valves ACTIVE and not at zero.
inline int driving_frames(const Site& site) {
  const session::FrameLog log = site.frames();
  int count = 0;
  for (std::size_t i = 0; i < log.size(); ++i) {
    for (const NodeDescription& valve : test::nodes_with(site.description().bus, NodeRole::kValve)) {
      if (log[i].frame.id != canopen::rpdo1_id(valve.id)) continue;
      const auto told = canopen::parse_valve_command(log[i].frame);
      if (told && told->set_point != 0 && (told->control_word & 7) == canopen::kControlActive) ++count;
    }
  }
  return count;
}

}  // namespace knuckle::test
