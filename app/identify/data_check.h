// Whether a recording can come from this machine's sensors. Impossible samples are named and left out; a channel
// that is not what its name says (swapped, wrong unit, wrong sign, stuck) refuses the recording.
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "app/identify/identify_data.h"
#include "app/recordings/recording_reader.h"
#include "core/joints.h"
#include "estimation/identification/recording.h"
#include "estimation/regressor.h"
#include "machine/description.h"
#include "machine/description_fwd.h"
#include "machine/kinematics.h"

namespace knuckle::identify {

// When a recording shows forces that free motion has not: the bucket in soil, on something, or loaded.

/// Of a recording, from its first sample.
struct Seconds {
  double from_s, to_s;
};

/// Where cylinders carry so much more or less than the drawing's weight and friction, averaged over half a second, that
/// something else must push. Wrong labels and units look so nearly all the time.
[[nodiscard]] std::vector<Seconds> contact_seconds(const MachineDescription& machine,
                                                   const estimation::Recording& recording);

/// The same recording with those samples unusable.
[[nodiscard]] estimation::Recording without(const std::vector<Seconds>& stretches, estimation::Recording recording);

/// Of the bucket: "seems to touch or carry something at 12.5 to 15.0 s (14 % of the recording): ..."
[[nodiscard]] std::string contact_text(const std::vector<Seconds>& stretches, const estimation::Recording& recording);

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

// What single samples, stretches and whole channels of a recording cannot be, whatever their labels: out of range,
// dropped out, spikes, stuck, jumping.

/// Marks samples unusable in `file`; of a lone bad sample only its value is replaced, by its neighbours' mean.
/// @param commands_tell whether open valves may show that a length is stuck.
/// @param findings gets what was found.
/// @return false where a channel is out of range or zero throughout: then nothing else has been looked at.
[[nodiscard]] bool check_samples(const MachineDescription& machine, recordings::RecordedFile& file, bool commands_tell,
                                 std::vector<DataFinding>& findings);

// Whether recorded valve commands are what their columns say: fractions, signed as the cylinder moves, of their own
// axis.

/// Single commands beyond [-1, 1] become unknown (NaN), and so does a column that its cylinder does not follow. Refused
/// are columns that are mostly beyond, and, where the cylinders moved enough to judge, a column that runs against its
/// cylinder or commands that move another cylinder than the one they are named for. Lengths are taken as they are.
[[nodiscard]] std::vector<DataFinding> check_valves(recordings::RecordedFile& file);

// Whether pressures and lengths were recorded at the same time: two loggers, or a filter on one of them, part them.

struct TimeSkew {
  std::string what;      ///< "pressures come 100 ms later than lengths: ..."; empty where they are in step.
  bool refuses = false;  ///< Too much to take off, or not the same in all recordings.
};

/// Takes off all recordings what shows in those to identify from, where that is more than what transmitters lag.
/// @param machine as calibrated().
[[nodiscard]] TimeSkew take_off_skew(const MachineDescription& machine, IdentifyData& data);

// Do cylinder forces carry the arm's weight and does friction brake? What a recording's labels are judged by.

/// What the cylinders do at one moment, and what the drawing's weight asks of them.
struct WeightRow {
  JointVector gravity_Nm, torque_Nm, lever_m, speed_mps;  ///< Torque: NaN of a cylinder without transmitters.
};
/// Reads them from a recording.
class WeightRows {
 public:
  WeightRows(const MachineDescription& machine, const estimation::Recording& recording);
  /// nullopt where a sample is missing that is needed, or a length has no angle.
  [[nodiscard]] std::optional<WeightRow> at(std::size_t sample) const;

 private:
  const MachineDescription& machine_;
  const estimation::Recording& recording_;
  Kinematics kinematics_;
  estimation::BaseParameters nominal_;
  std::size_t reach_;  // samples on either side, for speeds
};

/// Fit of joint torque = s * (drawing's gravity torque) + friction to means over a second.
struct WeightFit {
  JointVector ratio = JointVector::Zero();  ///< s: about 1, negative for swapped sides, 1e-5 for bar taken as Pa;
                                            ///< 1 where nobody measures.
  JointVector error = JointVector::Zero();  ///< RMS of what is left, over that of gravity torque.
  std::array<bool, kJoints> decisive{};     ///< Enough data, moved about or with much more weight than friction holds.
  std::size_t samples = 0;

  /// Loads, oil and an inexact drawing leave much room; so does what is not known.
  [[nodiscard]] bool believable(int joint) const;
  /// What all three ratios are off by alike, such as transmitters of another range make them; 1 where they are not.
  [[nodiscard]] double common_scale() const;
  /// 0 is perfect. To compare two readings of one recording.
  [[nodiscard]] double misfit() const;
};
[[nodiscard]] WeightFit weigh(const MachineDescription& machine, const estimation::Recording& recording);

/// Another reading of the same numbers.
struct Relabelling {
  std::vector<std::size_t> channels;  ///< Concerned.
  std::string what;                   ///< "look swapped", "looks like bar"
};
/// The relabelling that turns an unbelievable recording into a believable one; none where no single one does.
[[nodiscard]] std::optional<Relabelling> better_reading(const MachineDescription& machine,
                                                        const estimation::Recording& recording);

}  // namespace knuckle::identify
