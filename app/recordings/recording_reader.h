// Recordings of machine signals: as CSV, Knuckle's own or a foreign one through a mapping file
// (app/recordings/csv_mapping.h; docs/identification.md says what the columns are), or as Knuckle records (.mcap).
#pragma once

#include <array>
#include <ostream>
#include <string>
#include <vector>

#include "core/joints.h"
#include "estimation/identification/recording.h"
#include "machine/description_fwd.h"

namespace knuckle::recordings {

/// What a recording is made of, in the order of Measurement; names of the columns of Knuckle's own files.
inline constexpr std::size_t kPressureChannels = 6, kSignalChannels = 10;
inline constexpr std::array<const char*, kSignalChannels> kSignalNames{
    "boom_head_Pa",  "boom_rod_Pa",     "arm_head_Pa",    "arm_rod_Pa",        "bucket_head_Pa",
    "bucket_rod_Pa", "boom_cylinder_m", "arm_cylinder_m", "bucket_cylinder_m", "hull_pitch_rad"};
[[nodiscard]] double& signal(estimation::Measurement& measurement, std::size_t channel);
[[nodiscard]] double signal(const estimation::Measurement& measurement, std::size_t channel);

/// Whether the machine has a sensor for it: false for the pressures of a cylinder without transmitters.
[[nodiscard]] bool measures(const MachineDescription& machine, std::size_t channel);

struct SignalRange {
  double low, high;  ///< In the signal's unit.
};
/// What a machine can measure: pressures of its sensors, lengths of its cylinders with room for the encoders' offsets,
/// ground as steep as is worked on.
[[nodiscard]] SignalRange possible_range(const MachineDescription& machine, std::size_t channel);

/// A recording with where it stands in its file.
struct RecordedFile {
  estimation::Recording recording;
  std::array<std::string, kSignalChannels> columns;  ///< In the file, for messages.
  std::vector<std::size_t> rows;                     ///< One a sample: the row it was read from, or the next one.
  std::size_t rows_read = 0;
  std::vector<std::string> notes;  ///< What was found and what was done about it; one line each.
  PerJoint<std::string> valve_columns{"boom_valve", "arm_valve", "bucket_valve"};  ///< In the file, where there.
};

/// Samples lie on an even grid of the file's usual step. What is missing for at most four steps is interpolated,
/// longer holes are not usable and hold the last value. Pressures that the machine does not measure are not read.
/// A mapping names the channels above; instead of a cylinder's length an angle BOOM_rad (boom, arm, bucket), instead of
/// hull_pitch_rad a boom_tilt_rad (boom against the horizontal); BOOM_valve (commands) is optional;
/// where it is missing for longer, it is NaN and the sample stays usable.
/// @param path .mcap, or else CSV. @param map_path empty for Knuckle's own files.
/// @throws InputError for what read_mapped_csv refuses, missing columns (all named), a step that is none of a
/// recording, angles that no cylinder gives.
[[nodiscard]] RecordedFile read_recording(const std::string& path, const std::string& map_path,
                                          const MachineDescription& machine);

/// Numbers are read again as they were; the cells of unusable samples, unknown commands and pressures that nobody
/// measured stay empty.
void write_recording(const estimation::Recording& recording, std::ostream& out);

/// Samples first ... last - 1.
[[nodiscard]] estimation::Recording part_of(const estimation::Recording& recording, std::size_t first,
                                            std::size_t last);

}  // namespace knuckle::recordings
