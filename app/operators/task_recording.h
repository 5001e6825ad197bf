// What of a recording the metrics of a task are made of: the same whichever side recorded it.
#pragma once

#include <string>
#include <vector>

#include "core/joints.h"
#include "core/reason.h"
#include "core/time.h"
#include "recording/events.h"
#include "transport/link_messages.h"

namespace knuckle::operators {

/// The machine at one time, as its own loop knew it, or as the operator's side was told.
struct MachineSample {
  Time at{};
  Mode mode = Mode::kOff;
  ReasonCode fault = ReasonCode::kNone;
  bool clutch = false;
  bool contact = false;
  double confidence = 0;                        ///< In the force, [0, 1].
  double tip_force_N = 0;                       ///< Its size, without the load's.
  PlanarVector tip_m = PlanarVector::Zero();    ///< Frame M.
  PlanarVector tip_mps = PlanarVector::Zero();  ///< As noisy as the encoders make it.
};

/// The hand at one time, frame D.
struct HandSample {
  Time at{};
  PlanarVector hand_m = PlanarVector::Zero();
  PlanarVector hand_mps = PlanarVector::Zero();
};

struct TaskRecording {
  std::string source;
  std::vector<MachineSample> machine;
  std::vector<HandSample> hand;  ///< Empty where the operator's side was not recorded.
  std::vector<recording::Event> bookmarks;
  std::vector<std::string> flaws;  ///< Why it is not all of the trial, a line each; empty: it is whole.
  std::vector<std::string> notes;  ///< What is unusual in its order, likewise.
};

/// @param file a recording; of one in parts, the first, which those beside it follow.
/// @throws InputError where it cannot be opened, holds no loop's states (an imported table, a bus by itself), begins in
/// the middle of a session, or has states that this version does not know.
[[nodiscard]] TaskRecording read_task(const std::string& file);

}  // namespace knuckle::operators
