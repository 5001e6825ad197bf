#include "recording/replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <type_traits>
#include <utility>

#include "core/error.h"
#include "core/text.h"
#include "machine/device_description.h"
#include "machine/load.h"
#include "machine/reason_text.h"
#include "master/master_state.h"
#include "recording/fields.h"
#include "recording/replayed_wires.h"
#include "recording/sides.h"
#include "slave/slave_state.h"

namespace knuckle::recording {
namespace {

constexpr std::size_t kMostLines = 12;
constexpr std::size_t kMostChanges = 200;
constexpr std::size_t kStateBytes = 4096;

struct Number {
  double value = 0;
  std::uint64_t bits = 0;
  const char* name = nullptr;  ///< Of a value of an enumeration.
  [[nodiscard]] std::string text() const { return name != nullptr ? name : fmt::format("{}", value); }
};

/// Names of the values of its modes and codes, by field.
template <typename State>
std::map<std::string, const char*> value_names(const State& state) {
  std::map<std::string, const char*> names;
  visit_fields(state, [&](const std::string& field, const auto& member) {
    using Member = std::remove_cvref_t<decltype(member)>;
    if constexpr (std::is_enum_v<Member>) names[field] = knuckle::name(member);
    if constexpr (std::is_same_v<Member, Reason>) names[field + ".code"] = knuckle::name(member.code);
  });
  return names;
}

template <typename State>
std::vector<std::pair<std::string, Number>> numbers_in(const State& state) {
  std::vector<std::pair<std::string, Number>> numbers;
  const auto names = value_names(state);
  for_each_number("", state, [&](const std::string& field, auto number) {
    const auto found = names.find(field);
    const char* const value_name = found != names.end() ? found->second : nullptr;
    std::uint64_t bits = 0;
    if constexpr (std::is_same_v<decltype(number), double>) {
      bits = std::bit_cast<std::uint64_t>(number);
    } else if constexpr (std::is_same_v<decltype(number), float>) {
      bits = std::bit_cast<std::uint32_t>(number);
    } else {
      bits = static_cast<std::uint64_t>(number);
    }
    numbers.push_back({field, {static_cast<double>(number), bits, value_name}});
  });
  return numbers;
}

/// Whether a number such as "joint_rad[0]" is one of these fields, or in one.
bool is_of(const std::string& number, std::span<const std::string> fields) {
  return !fields.empty() && std::ranges::any_of(fields, [name = schema_name(number)](const std::string& field) {
    return name.starts_with(field) && (name.size() == field.size() || name[field.size()] == '[');
  });
}

std::string input_text(const WireEvent& event) {
  switch (event.kind) {
    case WireEventKind::kCanReceived:
      return fmt::format("CAN frame {}: {:02X}", id_text(static_cast<std::uint32_t>(event.value)),
                         fmt::join(event.data, " "));
    case WireEventKind::kHidReceived:
      return "HID report";
    case WireEventKind::kLinkReceived:
      return fmt::format("datagram of {} bytes that had waited {:.3f} ms", event.data.size(), 1e-6 * event.value);
    default:
      return fmt::format("{} {}", name(event.kind), event.value);
  }
}

/// @throws InputError where this version does not have it.
ControlLaw law_of(const std::string& law, const std::string& source) {
  if (const auto known = control_law_named(law)) return *known;
  throw InputError(source + ": law = " + shortened(law) +
                   ": cannot be run again by this version: " + kControlLawChoice);
}

/// What a person would call the state of the machine.
std::string gist(const slave::SlaveState& state) {
  std::string text = name(state.mode);
  if (state.fault) text += std::string(", ") + knuckle::name(state.fault.code);
  if (state.contact) text += ", contact";
  return text;
}
std::string gist(const master::MasterState& state) {
  std::string text = state.device_ok ? "device is ready" : knuckle::name(state.device.code);
  if (state.warning) text += std::string(", ") + knuckle::name(state.warning.code);
  return text;
}

const master::MasterLoop& loop_of(const OperatorSide& side) noexcept {
  return side.master;
}
const slave::SlaveLoop& loop_of(const MachineSide& side) noexcept {
  return side.slave;
}

/// One side on its recorded wires.
template <typename Whole, typename State>
class SideReplay {
 public:
  using Loop = std::remove_cvref_t<decltype(loop_of(std::declval<Whole>()))>;
  using Tap = std::function<void(Time, const Loop&)>;
  using StatesTap = std::function<void(const State&, const State&)>;
  SideReplay(Side side, bool changed, ReplayResult& result, Tap tap, StatesTap states_tap = {})
      : side_(side), changed_(changed), result_(result), tap_(std::move(tap)), states_tap_(std::move(states_tap)) {}

  [[nodiscard]] ReplayedWires& wires() noexcept { return wires_; }
  void make(std::unique_ptr<Whole> whole) { whole_ = std::move(whole); }

  /// A message of this side that is none of this version's.
  void unreadable() { ++result_.sides[static_cast<std::size_t>(side_)].unreadable; }

  void step(const StepWires& recorded) {
    SideResult& own = result_.sides[static_cast<std::size_t>(side_)];
    finish();
    if (recorded.step > next_step_) own.missing += recorded.step - next_step_;
    at_ = recorded.at;
    lines_.clear();
    if (recorded.step < next_step_) lines_.emplace_back("a step is in the recording twice, or out of order");
    if (recorded.step > next_step_)
      lines_.push_back(fmt::format("steps {} to {} are missing in the recording", next_step_, recorded.step - 1));
    if (!recorded.intact) lines_.emplace_back("the recording was altered: its events do not fit their check sum");
    if (recorded.lost > 0) lines_.push_back(fmt::format("{} events were not recorded: too many", recorded.lost));
    step_ = recorded.step;
    next_step_ = recorded.step + 1;
    inputs_.clear();
    for (const WireEvent& event : recorded.events) {
      if (is_input(event.kind) && !own.first) inputs_.push_back(input_text(event));
    }
    pending_ = recorded;
    waiting_ = true;
  }

  /// The recorded state of that step. @param lacks what of it was not recorded, which is not compared.
  void compare(const State& recorded, std::span<const std::string> lacks) {
    run(&recorded);
    const State replayed = state_of(at_, loop_of(*whole_));
    if (states_tap_) states_tap_(recorded, replayed);
    const std::string was = gist(recorded), is = gist(replayed);
    if (was != is && (was != told_recorded_ || is != told_replayed_) && result_.changes.size() < kMostChanges) {
      result_.changes.push_back({side_, at_, was, is});
    }
    told_recorded_ = was;
    told_replayed_ = is;
    if (same_bytes(recorded, replayed)) return;
    const auto a = numbers_in(recorded), b = numbers_in(replayed);
    SideResult& own = result_.sides[static_cast<std::size_t>(side_)];
    for (std::size_t i = 0; i < a.size(); ++i) {
      const Number was_number = a[i].second, is_number = b[i].second;
      if (was_number.bits == is_number.bits || is_of(a[i].first, lacks)) continue;
      if (changed_ && was_number.value == is_number.value) continue;  // 0 and -0: nobody's change
      FieldDifference& field = own.fields[a[i].first];
      const double size = std::abs(is_number.value - was_number.value);
      if (field.steps++ == 0 || (was_number.name == nullptr && (size > field.largest || std::isnan(size)))) {
        field.largest = size;
        field.at = at_;
        if (was_number.name != nullptr) field.names = was_number.text() + " -> " + is_number.text();
      }
      fields_.push_back(fmt::format("{}: recorded {}, replayed {}", a[i].first, was_number.text(), is_number.text()));
    }
  }

  /// The step is complete: whether it had a state or not.
  void finish() {
    if (waiting_) run(nullptr);
    SideResult& own = result_.sides[static_cast<std::size_t>(side_)];
    lines_.insert(lines_.end(), fields_.begin(), fields_.end());
    lines_.insert(lines_.end(), wire_lines_.begin(), wire_lines_.end());
    if (!lines_.empty()) {
      ++own.differing;
      if (!own.first) {
        const std::size_t shown = std::min(lines_.size(), kMostLines);
        own.first = Divergence{side_, at_, step_, {lines_.begin(), lines_.begin() + std::ptrdiff_t(shown)}, inputs_};
        if (lines_.size() > shown) own.first->what.push_back(fmt::format("and {} more", lines_.size() - shown));
      }
    }
    lines_.clear();
    fields_.clear();
    wire_lines_.clear();
  }

 private:
  [[nodiscard]] static bool same_bytes(const State& a, const State& b) {
    std::array<std::uint8_t, kStateBytes> first, second;
    CdrWriter one(first), two(second);
    put(one, a);
    put(two, b);
    return std::ranges::equal(one.written(), two.written());
  }
  void run(const State* recorded) {
    if (!std::exchange(waiting_, false)) return;
    wires_.begin(pending_);
    if (recorded != nullptr) set_up(*recorded);
    if (recorded != nullptr) whole_->step(at_);
    if (recorded != nullptr && tap_) tap_(at_, loop_of(*whole_));
    wire_lines_ = recorded != nullptr ? wires_.end() : std::vector<std::string>();
    SideResult& own = result_.sides[static_cast<std::size_t>(side_)];
    ++(recorded != nullptr ? own.steps : own.unrun);
  }
  void set_up(const State& recorded) {
    if constexpr (std::is_same_v<State, master::MasterState>) {
      const master::MasterSettings& set = recorded.settings;
      master::MasterLoop& loop = whole_->master;
      const master::MasterSettings& now = loop.settings();
      loop.set_stop(set.stop);
      loop.set_nobody(set.nobody);
      loop.set_home(set.home);
      loop.set_assist(set.assist);
      if (set.position_scale != now.position_scale || set.force_scale != now.force_scale)
        (void)loop.set_scales(set.position_scale, set.force_scale);
      if (set.let_go && !now.let_go) loop.let_go();
    }
  }

  Side side_;
  bool changed_;
  ReplayResult& result_;
  Tap tap_;
  StatesTap states_tap_;
  ReplayedWires wires_;
  std::unique_ptr<Whole> whole_;
  StepWires pending_;
  bool waiting_ = false;
  Time at_{};
  std::uint32_t step_ = 0, next_step_ = 0;
  std::vector<std::string> lines_, fields_, wire_lines_, inputs_;
  std::string told_recorded_, told_replayed_;
};

}  // namespace

const char* name(Side side) noexcept {
  return side == Side::kOperator ? "operator" : "machine";
}

bool ReplayResult::identical() const noexcept {
  return std::all_of(sides.begin(), sides.end(), [](const SideResult& side) {
    return side.differing == 0 && side.missing == 0 && side.unreadable == 0 && (side.steps > 0 || !side.recorded);
  });
}

ReplaySetup setup_of(const Recording& recording) {
  const Head& head = recording.head();
  const auto attached = [&](const std::string& text, const char* file) -> const std::string& {
    if (text.empty())
      throw InputError(recording.source() + ": attachment " + file + ": is missing: cannot be replayed");
    return text;
  };
  ReplaySetup setup;
  setup.source = recording.source();
  setup.head = head;
  setup.machine =
      calibrated(parse_machine(attached(head.machine_file, kMachineFile), recording.source() + ": " + kMachineFile));
  if (head.has_operator)
    setup.device = parse_device(attached(head.device_file, kDeviceFile), recording.source() + ": " + kDeviceFile);
  return setup;
}

struct Replay::Impl {
  Impl(const ReplaySetup& setup, ReplayTaps taps)
      : setup_(setup),
        operator_(Side::kOperator, setup.changed, result_, std::move(taps.operator_step)),
        machine_(Side::kMachine, setup.changed, result_, std::move(taps.machine_step), std::move(taps.machine_states)) {
    const Head& head = setup_.head;
    result_.sides[0].recorded = head.has_operator;
    result_.sides[1].recorded = head.has_machine;
    if (head.has_operator) {
      const OperatorSetup side{
          .device = setup_.device,
          .machine = setup_.machine,
          .law = law_of(head.law, setup_.source),
          .start = head.operator_start,
          .assist = {},
          .far_end = head.far_end_is_this_machine ? master::FarEnd::kIsThisMachine : master::FarEnd::kTellsItsMachine};
      operator_.make(std::make_unique<OperatorSide>(side, operator_.wires().hid(), operator_.wires().link()));
    }
    if (head.has_machine) {
      machine_.make(std::make_unique<MachineSide>(setup_.machine, machine_.wires().can(), machine_.wires().link(),
                                                  head.machine_start));
    }
  }

  ReplaySetup setup_;
  ReplayResult result_;
  SideReplay<OperatorSide, master::MasterState> operator_;
  SideReplay<MachineSide, slave::SlaveState> machine_;
  std::array<std::vector<std::uint8_t>, 2> messages_;  // the wires' events point into them
};

Replay::Replay(const ReplaySetup& setup, ReplayTaps taps) : impl_(std::make_unique<Impl>(setup, std::move(taps))) {}
Replay::~Replay() = default;

void Replay::take(const Entry& entry) {
  Impl& i = *impl_;
  const auto wires_of = [&](Side side) {
    auto& message = i.messages_[static_cast<std::size_t>(side)];
    message.assign(entry.data.begin(), entry.data.end());
    auto wires = decode_wires(message, i.setup_.head.link_version);
    if (wires && wires->led_by_waves && side == Side::kMachine) (void)law_of("wave", i.setup_.source);
    return wires;
  };
  const auto step = [&](auto& loop, Side side) {
    loop.finish();
    if (const auto wires = wires_of(side)) {
      loop.step(*wires);
    } else {
      loop.unreadable();
    }
  };
  const auto compare = [&](auto& loop, auto state) {
    if (decode(entry.data, state)) {
      loop.compare(state, entry.lacks);
    } else {
      loop.unreadable();
    }
  };
  const Head& head = i.setup_.head;
  switch (entry.topic) {
    case Topic::kOperatorWires:
      if (head.has_operator) step(i.operator_, Side::kOperator);
      break;
    case Topic::kMachineWires:
      if (head.has_machine) step(i.machine_, Side::kMachine);
      break;
    case Topic::kOperatorState:
      if (head.has_operator) compare(i.operator_, master::MasterState());
      break;
    case Topic::kMachineState:
      if (head.has_machine) compare(i.machine_, slave::SlaveState());
      break;
    default:
      break;
  }
}

const ReplayResult& Replay::result() const noexcept {
  impl_->operator_.finish();
  impl_->machine_.finish();
  return impl_->result_;
}

ReplayResult replay(Recording& recording, const ReplaySetup& setup, ReplayTaps taps) {
  if (recording.head().imported)
    throw InputError(recording.source() +
                     ": was imported from a table: no loop received anything, there is nothing to run again");
  if (!recording.head().has_operator && !recording.head().has_machine)
    throw InputError(recording.source() + ": is of " + recording.head().program +
                     ": it holds what crossed the machine's bus, and no loop's steps to run again");
  if (recording.head().part != 1) {
    throw InputError(
        recording.source() + ": begins in the middle of a session (" +
        (recording.head().part == 0
             ? "a flight record): its loops can be run again from their first step only; `knuckle explain` reads it"
             : "part " + std::to_string(recording.head().part) +
                   "): its loops can be run again from their first step only; name part 1 first"));
  }
  Replay run(setup, std::move(taps));
  while (const auto entry = recording.next()) run.take(*entry);
  return run.result();
}

}  // namespace knuckle::recording
