#include "app/console/player/load.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "app/session/scenario.h"
#include "core/error.h"
#include "machine/load.h"
#include "master/master_state.h"
#include "recording/events.h"
#include "recording/wire_events.h"
#include "slave/slave_loop.h"
#include "slave/slave_state.h"
#include "transport/link_header.h"
#include "transport/link_session.h"

namespace knuckle::console::player {
namespace {

using recording::Topic;
using recording::WireEventKind;

constexpr Duration kLongest = 72h;  // of times in a session; 35 GB of rows

/// Fills the rows entry by entry. What the operator's loop took of its datagrams it decides as that loop does.
class Reader {
 public:
  Reader(const recording::Recording& recording, const Played& played)
      : recording_(recording), session_(recording.head().operator_start, kRestartSilence) {
    data_.operator_side = recording.head().has_operator;
    data_.machine_side = recording.head().has_machine;
    data_.sensors_alone = recording.head().imported;
    data_.machine_period = from_seconds(1 / played.machine.bus.sync_Hz);
    if (!played.device) return;
    data_.position_scale = played.device->feel.position_scale;
    data_.force_scale = played.device->feel.force_scale;
  }

  void take(const recording::Entry& entry) {
    switch (entry.topic) {
      case Topic::kOperatorWires:
        if (const auto wires = usable_wires(entry); wires && comes_next(operator_steps_, *wires, data_.operator_holes))
          take_operator_wires(*wires);
        break;
      case Topic::kMachineWires:
        if (const auto wires = usable_wires(entry); wires && comes_next(machine_steps_, *wires, data_.machine_holes))
          take_machine_wires(*wires);
        break;
      case Topic::kOperatorState: {
        const auto state = recording::state_in<master::MasterState>(entry, recording_);
        check_time(state.at);
        data_.add(state);
        break;
      }
      case Topic::kMachineState: {
        const auto state = recording::state_in<slave::SlaveState>(entry, recording_);
        const bool told = sent_at_ == state.at;
        check_time(state.at);
        data_.add(state, told ? &sent_ : nullptr);
        break;
      }
      case Topic::kEvents:
        if (auto event = recording::decode_log(entry.data, recording_.head().started_unix_ns))
          events_.push_back(std::move(*event));
        break;
      default:
        break;
    }
  }
  [[nodiscard]] RunData take_data() { return std::move(data_); }
  [[nodiscard]] const std::vector<recording::Event>& events() const noexcept { return events_; }
  /// What of the wires is not shown, or not all there; empty: nothing.
  [[nodiscard]] std::string complaint() const {
    std::string text;
    if (damaged_ > 0)
      text = "steps whose wires were changed after they were recorded, and are left out: " + std::to_string(damaged_);
    if (lost_ > 0)
      text += (text.empty() ? "" : "; ") + std::string("events of the wires that found no room in the recording: ") +
              std::to_string(lost_);
    return text;
  }

 private:
  /// Of a step whose events are those that were recorded.
  [[nodiscard]] std::optional<recording::StepWires> usable_wires(const recording::Entry& entry) {
    auto wires = recording::decode_wires(entry.data, recording_.head().link_version);
    lost_ += wires ? wires->lost : 0;
    if (wires && wires->intact) return wires;
    ++damaged_;
    return std::nullopt;
  }
  /// @throws InputError where it is no time of a session.
  void check_time(Time at) const {
    if (at < Time(-1h) || at > Time(kLongest))
      throw InputError(recording_.source() + ": has a step at " + std::to_string(to_seconds(at)) + " s: at most " +
                       std::to_string(kLongest / 1h) + " h of a session can be played");
  }
  /// Steps of one loop, as far as their wires have been read.
  struct StepsRead {
    Time newest = kNever;
    std::uint32_t next = 0;
    bool whole = true;  ///< Of the newest one no event is missing.
  };
  /// Wires that are in the file twice, or out of order, are left out, as states are.
  [[nodiscard]] bool comes_next(StepsRead& read, const recording::StepWires& wires, std::vector<Gap>& holes) const {
    check_time(wires.at);
    if (wires.at <= read.newest) return false;
    if (read.newest != kNever && (wires.step != read.next || !read.whole)) holes.push_back({read.newest, wires.at});
    read = {wires.at, wires.step + 1, wires.lost == 0};
    return true;
  }

  void take_operator_wires(const recording::StepWires& wires) {
    for (const recording::WireEvent& event : wires.events) {
      if (event.kind != WireEventKind::kLinkReceived) continue;
      const auto kind = link_kind(event.data);
      if (kind == LinkKind::kSlave) {
        if (auto message = decode_slave(event.data)) take_message(*message, wires.at, Duration(event.value));
      } else if (kind == LinkKind::kStatus) {
        if (const auto status = decode_status(event.data)) take_received(*status, wires.at);
      } else if (const auto told = decode_readings(event.data); told && session_.of_far(told->stamp)) {
        readings_ = told->readings();
      }
    }
  }

  void take_message(SlaveMessage message, Time at, Duration waited) {
    const LinkSession::Verdict verdict = session_.take(message.stamp, at - waited);
    if (verdict == LinkSession::Verdict::kForeign) return;
    data_.arrivals.push_back({at, message.stamp.echoed, message.stamp.sequence, message.stamp.session});
    if (verdict == LinkSession::Verdict::kOld) return;
    if (!data_.receipts.empty() && data_.receipts.back().at == at) data_.receipts.pop_back();
    data_.receipts.push_back({at, message.stamp.sequence});
    if (!data_.machine_side) data_.add(at, message);
  }

  void take_received(MachineStatus status, Time at) {
    const bool old =
        !data_.statuses.empty() && !newer(status.stamp.sequence, data_.statuses.back().status.stamp.sequence);
    if (!session_.of_far(status.stamp) || (old && status.stamp.session == data_.statuses.back().status.stamp.session))
      return;
    status.acted_report_at = session_.from_link(status.acted_report_at);
    data_.statuses.push_back({at, status, readings_});
  }

  void take_machine_wires(const recording::StepWires& wires) {
    for (const recording::WireEvent& event : wires.events) {
      if (event.kind != WireEventKind::kLinkSent && event.kind != WireEventKind::kLinkRefused) continue;
      const auto kind = link_kind(event.data);
      if (kind == LinkKind::kSlave) {
        const auto message = decode_slave(event.data);
        if (message) {
          sent_ = *message;
          sent_at_ = wires.at;
        }
      } else if (kind == LinkKind::kStatus && !data_.operator_side) {
        if (const auto status = decode_status(event.data)) data_.statuses.push_back({wires.at, *status, readings_});
      } else if (const auto told = decode_readings(event.data); told && !data_.operator_side) {
        readings_ = told->readings();
      }
    }
  }

  const recording::Recording& recording_;
  std::uint64_t damaged_ = 0, lost_ = 0;
  LinkSession session_;
  RunData data_;
  SlaveMessage sent_;
  MachineReadings readings_;
  Time sent_at_ = kNever;
  StepsRead operator_steps_, machine_steps_;
  std::vector<recording::Event> events_;
};

/// Some programs say behind it of what the event is a repetition.
std::string code_of(const recording::Event& event) {
  return event.kind.substr(0, event.kind.find(' '));
}

Severity severity_of(const recording::Event& event) {
  if (event.severity >= recording::Severity::kError || code_of(event) == "fault") return Severity::kAlarm;
  return event.severity == recording::Severity::kWarning ? Severity::kWarning : Severity::kInfo;
}

/// What the console would have listed of this run.
std::vector<EventRow> watched_events(const Run& run, const BusDescription& bus) {
  const auto ring = std::make_unique<EventRing>();
  EventWatch watch(*ring);
  std::vector<EventRow> rows;
  const MachineStep* machine = nullptr;
  for (const HandStep& step : run.data().hand) {
    if (!run.recorded(step.at)) continue;
    // One that is not recorded is no lost link: the silence alone tells that.
    if (const MachineStep* const newest = run.machine_at(step.at)) machine = newest;
    const HandStanding& standing = run.data().standings[step.standing];
    watch.step(step.at,
               {.machine = machine == nullptr ? nullptr : &machine->told,
                .silence_s = static_cast<double>(step.silence_s),
                .stop = standing.hand.stop,
                .device = standing.hand.device,
                .warning = standing.hand.warning},
               nullptr);
    for (ConsoleEvent event; ring->pop(event);) {
      EventBook text;  // a full book keeps an alarm and drops what comes after it
      text.add(event, bus);
      rows.push_back(text.rows().back());
    }
  }
  return rows;
}

std::vector<EventRow> events_of(const Run& run, const std::vector<recording::Event>& recorded,
                                const BusDescription& bus) {
  std::vector<EventRow> rows;
  bool told = false, contacts = false;
  for (const recording::Event& event : recorded) {
    EventRow row;
    row.at = event.at;
    row.severity = severity_of(event);
    row.code = code_of(event);
    row.text = event.text;
    told |= event.kind != "recorder";
    contacts |= row.code == "contact";
    rows.push_back(std::move(row));
  }
  for (EventRow& row : watched_events(run, bus))
    if (!told || (!contacts && row.code == "contact")) rows.push_back(std::move(row));
  std::stable_sort(rows.begin(), rows.end(), [](const EventRow& a, const EventRow& b) { return a.at < b.at; });
  for (EventRow& row : rows) row.acknowledged = true;  // long ago
  return rows;
}

void read_files(const recording::Recording& recording, Played& played) {
  const recording::Head& head = recording.head();
  const std::string& source = recording.source();
  if (head.machine_file.empty())
    throw InputError(source + ": attachment " + recording::kMachineFile + ": is missing: cannot be played");
  const MachineDescription read = parse_machine(head.machine_file, source + ": " + recording::kMachineFile);
  played.machine = calibrated(read);
  if (!head.device_file.empty()) played.device = parse_device(head.device_file, source + ": " + recording::kDeviceFile);
  if (!head.scenario_file.empty())
    played.world = session::parse_scenario(head.scenario_file, source + ": " + recording::kScenarioFile, read).world;
}

}  // namespace

Played load(const std::vector<std::string>& files) {
  recording::Recording recording(files);
  Played played;
  played.file = recording.source();
  played.head = recording.head();
  read_files(recording, played);
  Reader reader(recording, played);
  while (const auto entry = recording.next()) reader.take(*entry);
  played.run = Run(reader.take_data());
  played.notes = recording::remarks(recording);
  if (const std::string said = reader.complaint(); !said.empty()) played.notes.push_back(played.file + ": " + said);
  if (played.run.empty()) {
    const std::string why = played.notes.empty() ? "" : " (" + played.notes.front() + ")";
    throw InputError(played.file + ": holds no step of a loop: there is nothing to play" + why);
  }
  played.events = events_of(played.run, reader.events(), played.machine.bus);
  return played;
}

Rerun rerun(const std::vector<std::string>& files, const replay::Changes& changes, const Run& recorded) {
  recording::Recording recording(files);
  recording::ReplaySetup setup = recording::setup_of(recording);
  change(setup, changes);
  // What came in is what was recorded.
  const RunData& was = recorded.data();
  RunData data;
  data.operator_side = was.operator_side;
  data.machine_side = was.machine_side;
  data.machine_period = was.machine_period;
  data.position_scale = setup.device.feel.position_scale;
  data.force_scale = setup.device.feel.force_scale;
  data.receipts = was.receipts;
  data.arrivals = was.arrivals;
  data.statuses = was.statuses;
  data.operator_holes = was.operator_holes;
  data.machine_holes = was.machine_holes;
  if (!was.machine_side) data.machine = was.machine;
  recording::ReplayTaps taps;
  taps.operator_step = [&data](Time at, const master::MasterLoop& loop) { data.add(state_of(at, loop)); };
  taps.machine_step = [&data](Time at, const slave::SlaveLoop& loop) {
    const SlaveMessage told = loop.message(at);
    data.add(state_of(at, loop), &told);
  };
  Rerun again;
  again.result = recording::replay(recording, setup, std::move(taps));
  again.run = Run(std::move(data));
  return again;
}

}  // namespace knuckle::console::player
