// The machine's sensors as the slave knows them: newest value and age of each, what is wrong with it, and the
// synchronous measurement made of all of them, less the offsets that calibration found. Values that cannot be are not
// used; they only let the last good one age.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "core/joints.h"
#include "core/reason.h"
#include "core/time.h"
#include "estimation/joint_state.h"
#include "machine/bus_frames.h"
#include "machine/description_fwd.h"
#include "machine/encoder_length.h"
#include "machine/kinematics.h"
#include "slave/closed_frames.h"
#include "transport/can_bus.h"
#include "transport/machine_readings.h"

namespace knuckle::slave {

/// What a single value may be.
struct ValidityLimits {
  double pressure_floor_Pa = -3e5;    ///< Vacuum (-1 bar gauge) and an offset of 1 bar, with room.
  double pressure_over_range = 1.05;  ///< Of the transmitter's range.
  double pilot_over_full = 1.25;   ///< Of a pilot pressure at which the spool is at full stroke: lost supply says more.
  double length_margin_m = 0.010;  ///< Beyond the cylinder's stroke: pin tolerances and encoder offset.
  double cylinder_mps = 0.8;       ///< Twice what the pump can do; a snapped wire winds back at more.
  double jump_m = 0.001;           ///< Jump allowed on top: ten steps of 0.1 mm ...
  double jump_steps = 2;           ///< ... or two of a coarse encoder.
  double hull_tilt_rad = 0.8;      ///< A machine that leans further lies on its side.
  double hull_turn_radps = 0.1;    ///< A slope sensor on the boom feels its jerks, which are quicker than this ...
  int shaken_in_a_row = 60;        ///< ... and over sooner (0.3 s).
  int settled_in_a_row = 200;      ///< A length that jumped and stood still for so long (1 s) may be told to count.
  int bad_in_a_row = 3;            ///< A single damaged value is left out; so many are a fault (15 ms).
};
inline constexpr ValidityLimits kValidity{};
inline constexpr double kStatusPeriods = 3.5;  ///< Age limit of a status by its frame's period: three may be lost.
/// Whether a sensor that works can say so of the pressure that moves a spool.
[[nodiscard]] constexpr bool possible_pilot(const BroadcastField& field, double value_Pa) noexcept {
  return value_Pa >= kValidity.pressure_floor_Pa && value_Pa <= kValidity.pilot_over_full * field.full_Pa;
}

inline constexpr std::size_t kSensorPressures = 6, kStatusPlace = kSensorPressures + kJoints + 1,
                             kReadingsPlace = kStatusPlace + 2, kPilotsPlace = kReadingsPlace + MachineReadings::kCount,
                             kSensorPlaces = kPilotsPlace + 2 * kJoints;
/// Place of what a channel measures among pressures, lengths, slope, E-stop and pilot pressure as the machine sends
/// them, its readings, and the pilot pressures of its spools; kSensorPlaces where it measures nothing.
[[nodiscard]] std::size_t sensor_place(const NodeChannel& channel) noexcept;

/// How much older than other values a slope may be: it does not come with every SYNC.
[[nodiscard]] Duration tilt_extra_age(const MachineDescription& machine) noexcept;

class SensorSet {
 public:
  explicit SensorSet(const MachineDescription& machine);

  /// A received frame, or a message of several packets; what is no sensor's is ignored.
  void receive(std::uint32_t id, std::span<const std::uint8_t> data, Time now) noexcept;
  void receive(const CanFrame& frame, Time now) noexcept {
    receive(frame.id, std::span(frame.data).first(std::min<std::size_t>(frame.size, frame.data.size())), now);
  }
  /// The nodes start anew: all values are forgotten but the lengths, which stay what later ones are held against.
  void restart() noexcept;
  /// A length further from the last good one than the cylinder goes while that one may be used is not believed by
  /// waiting, nor by a restart: only by this call, where it has stood still there for a while (a slipped drum looks the
  /// same, so this is for the operator to ask for). @param asked kLengthElsewhere, as fault() said it
  void believe_settled_length(const Reason& asked, Time now) noexcept;

  /// From now on the pressures of this joint's cylinder count as measured by nobody, or again as measured.
  void count_pressures(int joint, bool on) noexcept { pressures_count_[static_cast<std::size_t>(joint)] = on; }

  // What the machine says by itself; nullopt where no frame has it, or none has come.
  [[nodiscard]] std::optional<bool> e_stop_closed() const noexcept { return yes(kStatusPlace); }
  [[nodiscard]] std::optional<bool> pilot_on() const noexcept { return yes(kStatusPlace + 1); }
  [[nodiscard]] bool tells_pilot() const noexcept { return counts(kStatusPlace + 1); }
  /// The pressure that moves a spool [Pa], of SignalInfo::index; likewise.
  [[nodiscard]] std::optional<double> pilot_Pa(std::size_t index) const noexcept {
    const Channel& channel = channels_[kPilotsPlace + index];
    return channel.at == kNever ? std::nullopt : std::optional(channel.value);
  }
  /// Likewise what people are told; unknown as soon as the machine says that there is none, or after three periods.
  [[nodiscard]] MachineReadings readings(Time now) const noexcept;

  /// First sensor that is stale (kSensorStale, ms), sends frames shorter than mapped (kFrameShort, bytes), impossible
  /// values (kSensorInvalid, raw) or a length that waits for the operator to believe it (kLengthElsewhere, mm); kNone
  /// while all are fresh and valid. Of a node with several signals it names the first that is so, or the node where all
  /// are.
  [[nodiscard]] Reason fault(Time now) const noexcept;
  /// The first length that no angle of its joint gives (kSensorInvalid, m); kNone where all have one.
  [[nodiscard]] Reason unreachable() const noexcept;
  /// nullopt until every sensor has been heard once. Ages are not looked at here.
  [[nodiscard]] std::optional<estimation::Measurement> measurement() const noexcept;
  /// Arrival of the oldest pressure or length in the measurement, its node, and what a reason about it names. The slope
  /// has a limit of its own in fault().
  [[nodiscard]] Time oldest_at() const noexcept;
  [[nodiscard]] std::uint8_t oldest_node() const noexcept;
  [[nodiscard]] std::uint8_t oldest_subject() const noexcept;
  /// Arrival of the newest value.
  [[nodiscard]] Time newest_at() const noexcept;

 private:
  static constexpr std::size_t kPressures = kSensorPressures, kTilt = kPressures + kJoints, kChannels = kSensorPlaces;
  struct Channel {
    std::uint8_t node = 0;     ///< 0: the machine sends it by itself.
    std::uint8_t subject = 0;  ///< Of a reason about it alone: subject_of().
    std::uint32_t frame_id = 0;
    std::optional<Multiplexer> multiplexer{};  ///< BroadcastFrame::multiplexer
    std::uint8_t mapped = 0;                   ///< Bytes of its frame.
    BroadcastField field{};                    ///< Of a node's frame signal and bits alone.
    std::optional<BitField> status{};          ///< Of a pressure, where it is sent.
    Duration age_limit{};
    double value = 0;                           ///< Last good one, SI.
    Time at = kNever;                           ///< Its arrival.
    int bad = 0;                                ///< Impossible values since.
    double worst = 0;                           ///< The last impossible one: raw status or SI value.
    std::optional<std::uint8_t> short_bytes{};  ///< Of the last frame, where that was too short to have a value.
    float void_by = 0;                          ///< Of a frame that did not count: the limit of its reason.
    double elsewhere = 0;                       ///< Where a length that jumped stands now, ...
    int settled = 0;                            ///< ... for so many values.
  };
  [[nodiscard]] bool counts(std::size_t which) const noexcept {
    if (which >= kStatusPlace) return channels_[which].frame_id != 0;
    return which >= kPressures || pressures_count_[which / 2];
  }
  /// Whether people alone are told it.
  [[nodiscard]] static constexpr bool is_reading(std::size_t which) noexcept {
    return which >= kReadingsPlace && which < kPilotsPlace;
  }
  [[nodiscard]] std::optional<bool> yes(std::size_t which) const noexcept {
    const Channel& channel = channels_[which];
    return channel.at == kNever ? std::nullopt : std::optional(channel.value != 0);
  }
  void add_broadcasts(const BusDescription& bus);
  [[nodiscard]] const Channel& oldest() const noexcept;
  [[nodiscard]] Reason impossible(std::size_t which) const noexcept;
  [[nodiscard]] std::uint8_t silent_subject(const Channel& channel) const noexcept;
  void accept(Channel& channel, double value, bool possible, double shown, Time now) noexcept;
  void refuse_void(Channel& channel, float why) noexcept;
  void refuse_short(Channel& channel, std::size_t bytes) noexcept;
  void take(std::size_t which, const CanFrame& frame, Time now) noexcept;
  void on_pressure(Channel& channel, double pressure_Pa, unsigned status, Time now) noexcept;
  void on_length(std::size_t joint, double reading, Time now) noexcept;
  void settle(std::size_t joint, double length_m, bool in_range) noexcept;
  void on_boom_tilt(Channel& channel, double slope_rad, Time now) noexcept;

  std::array<Channel, kChannels> channels_{}, unheard_{};  // as they are, and before anything came
  ClosedFrames closed_;
  PerJoint<bool> pressures_count_{true, true, true};
  PerJoint<double> shortest_m_{}, longest_m_{};
  JointVector encoder_offset_m_;
  JointVector jump_m_;
  double pressure_ceiling_Pa_;
  bool tilt_on_boom_;
  int shaken_ = 0;  // slopes in a row that no hull can have
  Duration age_limit_, tilt_age_limit_;
  Kinematics kinematics_;
  EncoderLengths lengths_;
};

}  // namespace knuckle::slave
