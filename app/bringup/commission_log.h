// The recording of a commissioning: every frame of the machine's bus, and what was said and answered. On where
// something real is moved, unless turned off.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "app/bringup/commission_dialogue.h"
#include "app/recordings/program_log.h"
#include "machine/description_fwd.h"
#include "recording/events.h"
#include "recording/head.h"
#include "recording/loop_tape.h"
#include "transport/bus_access.h"

namespace knuckle::bringup {

class CommissionLog {
 public:
  /// @throws InputError as recordings::ProgramLog does.
  CommissionLog(const recordings::LogOptions& options, const recording::Head& head, const MachineDescription& machine);
  CommissionLog(const CommissionLog&) = delete;
  CommissionLog& operator=(const CommissionLog&) = delete;

  /// The same bus; a step of the recording ends with each wait. This outlives it.
  [[nodiscard]] BusAccess taped(const BusAccess& access);
  /// The same person, whose answers, and what is said to them, are events, at the time of the bus taped; hears what
  /// comes up in the recording, too. This outlives it.
  [[nodiscard]] Partner noted(const Partner& partner);
  /// For the start: where it is recorded to, or that it is not.
  [[nodiscard]] std::vector<std::string> notes() const;
  /// Why it ended before its end, as an event.
  void ended(const std::string& why);
  /// Nothing moves any more: finishes the file. @return what there is to be said of it, and where it is.
  [[nodiscard]] std::vector<std::string> close();

 private:
  /// nullptr: nothing is kept, so nothing need be written down.
  [[nodiscard]] recording::Recorder* recorder() noexcept;
  void note(recording::Severity severity, const std::string& kind, const std::string& text);

  bool off_, drains_;
  recordings::ProgramLog log_;
  bool keeps_;
  std::shared_ptr<BusAccess> bus_;  ///< Set by taped().
  recording::LoopTape tape_;
};

}  // namespace knuckle::bringup
