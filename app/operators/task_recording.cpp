#include "app/operators/task_recording.h"

#include <fmt/format.h>

#include <filesystem>
#include <optional>

#include "core/error.h"
#include "machine/kinematics.h"
#include "master/device_kinematics.h"
#include "master/master_state.h"
#include "recording/recording.h"
#include "recording/replay.h"
#include "recording/wire_events.h"
#include "slave/slave_state.h"

namespace knuckle::operators {
namespace {

using recording::Topic;

/// The file, and where it is called ..._part001.mcap, those that follow it.
std::vector<std::string> parts_of(const std::string& file) {
  constexpr std::string_view kFirst = "_part001.mcap";
  std::vector<std::string> parts{file};
  if (!file.ends_with(kFirst)) return parts;
  const std::string stem = file.substr(0, file.size() - kFirst.size());
  std::error_code ignored;
  for (int part = 2;; ++part) {
    const std::string next = fmt::format("{}_part{:03}.mcap", stem, part);
    if (!std::filesystem::is_regular_file(next, ignored)) return parts;
    parts.push_back(next);
  }
}

/// @throws InputError unless a person worked in it, from its beginning on.
recording::ReplaySetup task_setup(const recording::Recording& recording) {
  const recording::Head& head = recording.head();
  if (head.imported)
    throw InputError(
        recording.source() +
        ": was imported from a table: it has no modes, no forces and no operator's side to measure a task by");
  if (!head.has_operator && !head.has_machine)
    throw InputError(recording.source() + ": is of " + head.program + ": it has no loop's states");
  if (head.part != 1)
    throw InputError(recording.source() +
                     ": begins in the middle of a session (a flight record, or a later part): name part 1");
  return setup_of(recording);
}

class TaskReader {
 public:
  explicit TaskReader(const std::string& file)
      : recording_(parts_of(file)),
        setup_(task_setup(recording_)),
        machine_(setup_.machine),
        hand_(setup_.device.link_m) {
    task_.source = file;
  }

  TaskRecording read() {
    while (const auto entry = recording_.next()) take(*entry);
    task_.flaws = defects(recording_);
    task_.notes = recording_.order_notes();
    return std::move(task_);
  }

 private:
  void take(const recording::Entry& entry) {
    const recording::Head& head = recording_.head();
    if (entry.topic == Topic::kMachineState && head.has_machine)
      take(entry.at, recording::state_in<slave::SlaveState>(entry, recording_));
    if (entry.topic == Topic::kOperatorState && head.has_operator)
      take(entry.at, recording::state_in<master::MasterState>(entry, recording_));
    if (entry.topic == Topic::kOperatorWires && !head.has_machine) take_told(entry);
    if (entry.topic != Topic::kEvents) return;
    auto event = recording::decode_log(entry.data, head.started_unix_ns);
    if (event && event->kind == "bookmark") task_.bookmarks.push_back(std::move(*event));
  }

  void take(Time at, const slave::SlaveState& state) {
    if (!state.measured) return;
    add({at, state.mode, state.fault.code, state.clutch, state.contact, state.confidence, state.tip_force_N.norm()},
        state.joint_rad, state.joint_radps);
  }
  void take(Time at, const master::MasterState& state) {
    clutch_ = state.clutch;
    if (state.reports == 0) return;
    const master::DevicePosture posture = hand_.posture(state.device_rad);
    task_.hand.push_back({at, posture.tip_m, posture.jacobian * state.device_radps});
  }
  /// The machine's newest message of a step.
  void take_told(const recording::Entry& entry) {
    const auto wires = recording::decode_wires(entry.data, recording_.head().link_version);
    if (!wires) return;
    for (const recording::WireEvent& event : wires->events) {
      if (event.kind != recording::WireEventKind::kLinkReceived) continue;
      const auto told = decode_slave(event.data);
      if (!told) continue;
      const bool same = newest_ && newest_->session == told->stamp.session;
      if (same && !newer(told->stamp.sequence, newest_->sequence)) continue;
      newest_ = told->stamp;
      add({entry.at, told->mode, told->fault.code, clutch_, told->contact, told->confidence, told->tip_force_N.norm()},
          told->position_rad, told->velocity_radps);
    }
  }
  void add(MachineSample sample, const JointVector& joint_rad, const JointVector& joint_radps) {
    sample.tip_m = machine_.tip(joint_rad);
    sample.tip_mps = machine_.tip_jacobian(joint_rad) * joint_radps;
    task_.machine.push_back(sample);
  }

  recording::Recording recording_;
  recording::ReplaySetup setup_;
  Kinematics machine_;
  master::DeviceKinematics hand_;
  TaskRecording task_;
  std::optional<LinkStamp> newest_;
  bool clutch_ = false;
};

}  // namespace

TaskRecording read_task(const std::string& file) {
  return TaskReader(file).read();
}

}  // namespace knuckle::operators
