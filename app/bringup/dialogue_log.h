// The recording of a dialogue that moves a machine (commission, recover): every frame of its bus, and what was said and
// answered. On where something real is moved, unless turned off.
#pragma once

#include <functional>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "app/bringup/commission_dialogue.h"
#include "app/cli/interrupt.h"
#include "app/recordings/program_log.h"
#include "machine/description_fwd.h"
#include "recording/events.h"
#include "recording/head.h"
#include "recording/loop_tap.h"
#include "transport/bus_access.h"

namespace knuckle::bringup {

/// @param command the program with what led it. @param simulated on virtual time. @param now of the machine's bus.
[[nodiscard]] recording::Head dialogue_head(std::string command, std::string machine_file, bool simulated, Time now);

/// Where a signal has come, ends what moves a machine. @throws cli::Interrupted
void neutral_where_interrupted(const cli::InterruptGuard& interrupt);

class DialogueLog {
 public:
  /// @param kind of the events of what is said: "commission". @throws InputError as recordings::ProgramLog does.
  DialogueLog(const recordings::LogOptions& options, const recording::Head& head, const MachineDescription& machine,
              std::string kind);
  DialogueLog(const DialogueLog&) = delete;
  DialogueLog& operator=(const DialogueLog&) = delete;

  /// The same bus; a step of the recording ends with each wait. This outlives it.
  [[nodiscard]] BusAccess tapped(const BusAccess& access);
  /// The same person, whose answers, and what is said to them, are events, at the time of the bus tapped; hears what
  /// comes up in the recording, too. This outlives it.
  [[nodiscard]] Partner noted(const Partner& partner);
  /// For the start: where it is recorded to, or that it is not.
  [[nodiscard]] std::vector<std::string> notes() const;
  /// Does the work, and finishes the file then: nothing moves any more. Why it ended before its end is an event.
  /// @param out is told what there is to be said of the file, and where it is. @throws whatever `work` throws.
  void run(std::ostream& out, const std::function<void()>& work);

 private:
  /// nullptr: nothing is kept, so nothing need be written down.
  [[nodiscard]] recording::Recorder* recorder() noexcept;
  void close(std::ostream& out);
  void note(recording::Severity severity, const std::string& kind, const std::string& text);

  bool off_, drains_;
  std::string kind_;
  recordings::ProgramLog log_;
  bool keeps_;
  std::shared_ptr<BusAccess> bus_;  ///< Set by tapped().
  recording::LoopTap tap_;
};

}  // namespace knuckle::bringup
