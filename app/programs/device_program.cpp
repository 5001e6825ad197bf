#include "app/programs/device_program.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <memory>
#include <utility>

#include "app/cli/command.h"
#include "app/recordings/state_table.h"
#include "app/session/operator_path.h"
#include "core/fields.h"
#include "core/loop_table.h"
#include "core/ring.h"
#include "sim/haptic_device.h"
#include "transport/link_messages.h"

namespace knuckle::programs {
namespace {

struct NamedFault {
  std::string_view name;
  sim::FirmwareFault kind;
};
constexpr std::array<NamedFault, 6> kFaults{{{"silent", sim::FirmwareFault::kSilent},
                                             {"bad_crc", sim::FirmwareFault::kBadCrc},
                                             {"frozen", sim::FirmwareFault::kFrozen},
                                             {"wild_counts", sim::FirmwareFault::kWildCounts},
                                             {"hung", sim::FirmwareFault::kHung},
                                             {"truncated", sim::FirmwareFault::kTruncated}}};

[[noreturn]] void refuse(const std::string& text) {
  std::string kinds;
  for (const NamedFault& fault : kFaults) kinds += (kinds.empty() ? "" : ", ") + std::string(fault.name);
  cli::refuse_option("--fault", text, "must be KIND@S[+D], such as bad_crc@5+0.1, with a KIND of " + kinds);
}

double seconds(const std::string& fault, std::string_view text) {
  double value = 0;
  const auto end = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool number = end.ec == std::errc() && end.ptr == text.data() + text.size();
  if (!number || !(value >= 0 && value < 1e6)) refuse(fault);
  return value;
}

}  // namespace

PlannedDeviceFault parse_device_fault(const std::string& text) {
  const auto at = text.find('@');
  if (at == std::string::npos) refuse(text);
  const auto* const kind = std::ranges::find(kFaults, text.substr(0, at), &NamedFault::name);
  if (kind == kFaults.end()) refuse(text);
  PlannedDeviceFault fault;
  fault.kind = kind->kind;
  fault.text = text;
  const std::string_view times = std::string_view(text).substr(at + 1);
  const auto plus = times.find('+');
  fault.at_s = seconds(text, times.substr(0, plus));
  if (plus != std::string_view::npos) fault.duration_s = seconds(text, times.substr(plus + 1));
  return fault;
}

DeviceFaults::DeviceFaults(std::vector<PlannedDeviceFault> plan) : plan_(std::move(plan)), broken_(plan_.size()) {}

int DeviceFaults::step(Time now, sim::DeviceFirmware& firmware) noexcept {
  for (std::size_t i = 0; i < plan_.size(); ++i) {
    const double since_s = to_seconds(now) - plan_[i].at_s;
    const bool broken = since_s >= 0 && since_s < plan_[i].duration_s;
    if (broken == (broken_[i] != 0)) continue;
    broken_[i] = broken ? 1 : 0;
    firmware.inject(broken ? plan_[i].kind : sim::FirmwareFault::kNone);
    return static_cast<int>(i);
  }
  return -1;
}

namespace {

constexpr Duration kTail = 500ms;  // how long the device stays after the operator has finished
constexpr int kTicksPerRow = 5;

/// The simulation's true state, known to no controller.
struct TruthRow {
  Time at{};
  JointVector joint_rad = JointVector::Zero(), meant_rad = JointVector::Zero();
  PlanarVector tip_m = PlanarVector::Zero(), felt_N = PlanarVector::Zero(), contact_N = PlanarVector::Zero();
  bool presence = false, enable = false, clutch = false, stop = false;
  std::uint8_t phase = 0;

  [[nodiscard]] static bool of_device(std::string_view) noexcept { return true; }
  template <typename Self, typename Visit>
  static void fields(Self& s, Visit&& visit) {
    [[maybe_unused]] const auto& [at, joint_rad, meant_rad, tip_m, felt_N, contact_N, presence, enable, clutch, stop,
                                  phase] = s;
    visit("time_ns", s.at);
    visit("joint_rad", s.joint_rad);
    visit("meant_rad", s.meant_rad);
    visit("tip_m", s.tip_m);
    visit("felt_N", s.felt_N);
    visit("contact_N", s.contact_N);
    visit("presence", s.presence);
    visit("enable", s.enable);
    visit("clutch", s.clutch);
    visit("stop", s.stop);
    visit("phase", s.phase);
  }
};

/// An event: from the loop's thread to the one that tends it.
struct Event {
  enum class Kind : std::uint8_t { kPhase, kLatch, kFault } kind = Kind::kPhase;
  Time at{};
  int value = 0;    ///< Phase begun, or fault of the plan.
  bool is = false;  ///< The phase before timed out; the fault was broken.
  std::uint16_t bits = 0;
};

/// All that the loop's thread works on, and what crosses to the thread that tends it.
class DeviceRunner {
 public:
  DeviceRunner(const DeviceProgramSetup& setup, HidPort& cable, Link* screen, std::ostream* truth_csv)
      : plan_(setup.plan),
        faults_(setup.faults),
        person_(setup.plan.machine, setup.plan.phases, {}, session::kPathPeriod, setup.start_rad, setup.plan.reaction,
                sim::push_stiffness(setup.limb, setup.device.feel),
                sim::Unsteadiness(setup.person, setup.limb, setup.seed)),
        hand_(setup.device, setup.limb, cable, setup.seed, setup.start_rad, setup.serial),
        screen_(screen),
        rows_(truth_csv, kTicksPerRow) {
    seen_.machine_rad = seen_.ghost_rad = still_.joint_rad = setup.start_rad;
    still_.presence = true;
  }

  // The loop's thread.
  void step(Time now) noexcept {
    look();
    if (const int fault = faults_.step(now, hand_.firmware()); fault >= 0)
      events_.push({Event::Kind::kFault, now, fault, faults_.broken(fault), 0});
    hand_.step(now, act(now));
    note_latch(now);
    felt_peak_N_ = std::max(felt_peak_N_, hand_.truth().felt_N.norm());
    if (!rows_.due()) return;
    const sim::HandTruth& truth = hand_.truth();
    rows_.push({now, truth.joint_rad, intent_.joint_rad, truth.tip_m, truth.felt_N, truth.contact_N, intent_.presence,
                intent_.enable, intent_.clutch, intent_.stop, static_cast<std::uint8_t>(phase_)});
  }

  // The tending thread.
  bool next(Event& event) noexcept { return events_.pop(event); }
  void write() { rows_.write(); }
  [[nodiscard]] bool finished() const noexcept { return finished_; }

  // After the loop has ended.
  [[nodiscard]] double felt_peak_N() const noexcept { return felt_peak_N_; }
  [[nodiscard]] double energy_to_hand_J() const noexcept { return hand_.truth().energy_to_hand_J; }
  [[nodiscard]] std::uint64_t lost() const noexcept { return events_.dropped() + rows_.lost(); }

 private:
  /// The newest of what passed over the link, as a screen beside the operator would show it.
  void look() noexcept {
    if (screen_ == nullptr) return;
    while (screen_->receive(datagram_)) {
      if (const auto machine = decode_slave(datagram_.view())) {
        seen_.machine_rad = machine->position_rad;
        seen_.mode = machine->mode;
        seen_.home_offered = machine->home_offered;
        seen_.home_on_two = machine->home_on_two;
      } else if (const auto asked = decode_master(datagram_.view())) {
        seen_.ghost_rad = asked->position_rad;
      }
    }
  }

  const sim::OperatorIntent& act(Time now) noexcept {
    if (plan_.phases.empty()) return intent_ = still_;
    seen_.hand_rad = hand_.truth().joint_rad;
    seen_.felt_N = hand_.truth().felt_N;
    intent_ = person_.step(now, seen_);
    if (person_.phase() != phase_ || !begun_) {
      const bool gave_up = person_.timed_out() == phase_ && begun_;
      begun_ = true;
      phase_ = person_.phase();
      events_.push({Event::Kind::kPhase, now, phase_, gave_up, 0});
    }
    finished_ = person_.finished();
    return intent_;
  }

  void note_latch(Time now) noexcept {
    const bool latched = hand_.firmware().latched();
    if (latched && !latched_) events_.push({Event::Kind::kLatch, now, 0, true, hand_.firmware().fault()});
    latched_ = latched;
  }

  const OperatorPlan& plan_;
  DeviceFaults faults_;
  sim::Operator person_;
  sim::HandAndDevice hand_;
  Link* screen_;
  sim::OperatorView seen_;
  sim::OperatorIntent intent_, still_;
  Datagram datagram_;
  int phase_ = 0;
  bool begun_ = false, latched_ = false;
  double felt_peak_N_ = 0;
  std::atomic<bool> finished_{false};
  Ring<Event, 256> events_;
  RowTable<TruthRow> rows_;
};

template <typename Entry>
void keep(std::vector<Entry>& entries, const Entry& entry, DeviceProgramOutcome& outcome) {
  if (entries.size() == DeviceProgramOutcome::kMost) {
    ++outcome.records_lost;
    return;
  }
  entries.push_back(entry);
}

void tell(const DeviceProgramSetup& setup, DeviceRunner& runner, ProgramConsole& console,
          DeviceProgramOutcome& outcome) {
  for (Event event; runner.next(event);) {
    const double at_s = to_seconds(event.at);
    switch (event.kind) {
      case Event::Kind::kPhase: {
        if (event.is && !outcome.phases.empty()) outcome.phases.back().timed_out = true;
        const auto index = static_cast<std::size_t>(event.value);
        const bool over = index >= setup.plan.phase_names.size();
        if (!over) keep(outcome.phases, {setup.plan.phase_names[index], at_s}, outcome);
        console.event(event.at,
                      (event.is ? "timed out; " : "") + (over ? std::string("the operator has finished")
                                                              : "operator: " + setup.plan.phase_names[index]));
        break;
      }
      case Event::Kind::kLatch:
        keep(outcome.latches, {at_s, event.bits}, outcome);
        console.event(event.at, "the device switched its torque off, fault bits " + std::to_string(event.bits));
        break;
      case Event::Kind::kFault: {
        const std::string& text = setup.faults[static_cast<std::size_t>(event.value)].text;
        keep(outcome.faults, {text, at_s, event.is}, outcome);
        console.event(event.at, (event.is ? "fault injected: " : "fault ended: ") + text);
        break;
      }
    }
  }
}

}  // namespace

DeviceProgramOutcome run_device(const DeviceProgramSetup& setup, HidPort& cable, Link* screen, const ProgramRun& run,
                                std::ostream* truth_csv) {
  const auto runner = std::make_unique<DeviceRunner>(setup, cable, screen, truth_csv);
  DeviceProgramOutcome outcome;
  Time finished_at = kNever;
  bool over = false;
  ProgramRun until = run;
  until.keep_on = [&] { return !over && (!run.keep_on || run.keep_on()); };
  const LoopRun ran =
      run_loop(until, {.thread = {.name = "device", .period = kTick, .fifo_priority = fifo_priority::kHand},
                       .step = [&runner](Time now) { runner->step(now); },
                       .tend =
                           [&](Time now) {
                             tell(setup, *runner, run.console, outcome);
                             runner->write();
                             if (runner->finished() && finished_at == kNever) finished_at = now;
                             over = finished_at != kNever && now - finished_at >= kTail;
                           },
                       .ask_to_stop = {}});
  outcome.loop = ran.report;
  outcome.ran_s = to_seconds(ran.ended_at);
  outcome.finished = runner->finished();
  outcome.felt_peak_N = runner->felt_peak_N();
  outcome.energy_to_hand_J = runner->energy_to_hand_J();
  outcome.records_lost += runner->lost();
  return outcome;
}

}  // namespace knuckle::programs
