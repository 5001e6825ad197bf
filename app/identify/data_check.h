// Whether a recording can come from this machine's sensors. Impossible samples are named and left out; a channel
// that is not what its name says (swapped, wrong unit, wrong sign, stuck) refuses the recording.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "app/identify/contact_seconds.h"
#include "app/recordings/recording_reader.h"
#include "core/joints.h"
#include "machine/description_fwd.h"

namespace knuckle::identify {

/// One stretch of one channel, or the whole channel.
struct DataFinding {
  std::string column;  ///< As in the file; two columns as "a and b".
  std::size_t first_row = 0, last_row = 0;
  std::size_t samples = 0;
  std::string what;      ///< "drop-out to zero", "looks like millimetres"
  bool refuses = false;  ///< Otherwise its samples are left out.
};

struct DataCheck {
  std::vector<DataFinding> findings;
  /// How well cylinder torques carry the drawing's weight, as recorded: per joint, 1 is perfect; NaN where unknown.
  JointVector weight_ratio = JointVector::Constant(std::numeric_limits<double>::quiet_NaN());

  /// Where the bucket seems to have touched or carried something; nothing of it is left out.
  std::vector<Seconds> contact;

  [[nodiscard]] bool refused() const;
  /// "boom 1.02, arm 0.98, bucket unknown"
  [[nodiscard]] std::string weights() const;
  /// One line for each kind of finding and column, refusals first: "boom_rod_Pa: stuck, 800 samples (row 12-811)".
  [[nodiscard]] std::vector<std::string> lines() const;
};

/// Marks samples unusable in `file`; of a lone bad sample only its value is replaced, by its neighbours' mean.
[[nodiscard]] DataCheck check_data(const MachineDescription& machine, recordings::RecordedFile& file);

/// The same, throwing what refuses it. @throws InputError "FILE: COLUMN: what ...".
[[nodiscard]] DataCheck require_data(const MachineDescription& machine, recordings::RecordedFile& file);

}  // namespace knuckle::identify
