// What every node of the machine bus must be and is told at start-up, as a list of parts that are asked first and
// written where they are otherwise, and the dialogue that works through such a list without blocking.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/reason.h"
#include "core/time.h"
#include "machine/bus_description.h"
#include "machine/description_fwd.h"
#include "transport/can_bus.h"
#include "transport/canopen.h"

namespace knuckle::slave {

/// A value that an object has or is given.
struct SdoStep {
  enum class Match : std::uint8_t {
    kEqual,
    kAtLeast,  ///< Of a transmit PDO's entries: more than are wanted make its frame longer, which is read as well.
    kCobId,    ///< Whatever bit 30 (no remote requests) says.
    kOff,      ///< Of a PDO's COB-ID: bit 31 is on.
    kPeriod,   ///< Of a timer, in ms: from the value's upper 16 bits, which are what is written, to its lower ones.
  };
  canopen::Object object;
  std::uint32_t value = 0;
  std::uint8_t size = 4;  ///< Bytes.
  Match match = Match::kEqual;
  [[nodiscard]] bool holds(std::uint32_t found) const noexcept;
};
/// What belongs together in a node's set-up. Asked first: where all is as wanted, nothing is written, so that what a
/// device lets nobody write may stay as it is.
struct SetupPart {
  enum class Kind : std::uint8_t {
    kIdentity,  ///< Another value is another device: kNodeIdentity.
    kRequire,   ///< Another value is a set-up nobody may change behind the integrator's back: kNodeSetup.
    kSetting,   ///< Another value is written over, and asked again.
    kGuard,     ///< A setting by which the node stops by itself without its controller. A script that has any needs one
                ///< that the node takes; the others may be refused.
    kOptional,  ///< A setting that the node may refuse.
    kTransmission,  ///< Of a sensor with every n-th SYNC: a setting. Where the node refuses it and sends by a timer of
                    ///< its own, that one, which is the next part, must do.
    kTimer,         ///< Likewise a setting; of such a node alone.
    kProof,         ///< Another value, or none, is another device than the one whose guard was proved.
  } kind = Kind::kSetting;
  std::vector<SdoStep> asked;
  std::vector<SdoStep> written;  ///< In this order. At once where nothing is asked.
};
using SdoScript = std::vector<SetupPart>;

/// Of a transmit PDO's type.
[[nodiscard]] constexpr bool by_own_timer(std::uint32_t type) noexcept {
  return type >= canopen::kEventDriven - 1U;
}
/// "5 ms to 20 ms": what a step of kPeriod takes, and why.
[[nodiscard]] std::string period_text(const SdoStep& step);

/// A node of the machine file with what it must be and is told, by its profile (CiA 408, 404, 406, 410, 401). Encoder
/// and tilt count in the machine file's steps.
struct NodeScript {
  NodeDescription node;
  SdoScript script;
  SdoScript before_rest;  ///< Of a module with outputs: asked and written before it may leave its operational state.
};
/// Of all nodes in their order. @throws InputError where a step cannot be told to its node.
[[nodiscard]] std::vector<NodeScript> node_scripts(const MachineDescription& machine);

/// What a person must know of the guards of nodes that are told what to do, in lines; none where all were proved of
/// these devices.
/// @param same_device whether the node of this id is the device of its proof.
[[nodiscard]] std::vector<std::string> guard_lines(const BusDescription& bus,
                                                   const std::function<bool(std::uint8_t)>& same_device);

/// Makes the encoder of a joint show that its cylinder has this length here and now (CiA 406), and keep it over a
/// reset.
/// @throws InputError where no angle of the joint gives this length.
[[nodiscard]] SdoScript preset_script(const MachineDescription& machine, int joint, double length_m);

/// How often to ask.
inline constexpr int kSdoAttempts = 2;

/// What went wrong in a dialogue, for people: Reason has no room for it.
struct SetupFailure {
  enum class What : std::uint8_t {
    kNone,
    kSilent,
    kAborted,
    kOtherValue,
    kNotKept,    ///< Written without complaint, but not there when asked again.
    kUnguarded,  ///< None of its guards was taken.
  } what = What::kNone;
  std::uint8_t node = 0;
  SdoStep step;
  bool writing = false;
  canopen::SdoAbort abort = canopen::SdoAbort::kNone;
  std::uint32_t seen = 0;  ///< kOtherValue, kNotKept
};
/// "boom_valve (node 0x10): writing 0x1400:05 was refused: object does not exist (SDO abort 0x06020000)". Allocates.
[[nodiscard]] std::string text(const SetupFailure& failure, const BusDescription& bus);

// What a node says in its process data, asked by SDO: one that is not operational sends none, but answers.

/// Of the axis that this joint's valve is. @param object of a driver with one axis.
[[nodiscard]] inline canopen::Object valve_object(const BusDescription& bus, int joint,
                                                  canopen::Object object) noexcept {
  return of_axis(object, bus.valve_channel(joint).number);
}

/// What this object holds, where this is the answer to that question.
[[nodiscard]] inline std::optional<std::uint32_t> answered(const canopen::SdoResponse& answer,
                                                           canopen::Object object) noexcept {
  if (answer.kind != canopen::SdoResponse::Kind::kUploaded || answer.object != object) return std::nullopt;
  return answer.value;
}

/// Works through one node's script: one request outstanding at a time.
class SdoDialogue {
 public:
  /// @param timeout for one answer.
  SdoDialogue(std::uint8_t node, SdoScript script, Duration timeout);
  void restart() noexcept;
  [[nodiscard]] std::uint8_t node() const noexcept { return node_; }
  /// Sends what is due. Call once a step. @returns whether a request went out.
  bool step(CanBus& bus, Time now) noexcept;
  /// An answer of this node.
  void receive(const CanFrame& frame) noexcept;
  [[nodiscard]] bool done() const noexcept { return part_ == script_.size() && !failure_; }
  /// The node has answered: from now on it must not lose what it was told.
  [[nodiscard]] bool begun() const noexcept { return answered_; }
  /// kNodeIdentity (value seen, expected) or kNodeSetup (part that failed, parts there are).
  [[nodiscard]] const Reason& failure() const noexcept { return failure_; }
  [[nodiscard]] const SetupFailure& details() const noexcept { return details_; }
  /// Whether the guard that this object sets is as wanted.
  [[nodiscard]] bool took(canopen::Object guard) const noexcept;
  /// Whether it has the serial number of the device whose guard was proved.
  [[nodiscard]] bool same_device() const noexcept { return same_device_; }
  /// Somebody else has asked this node: it answers once more.
  void others_asked() noexcept { ++requests_; }
  /// Answers beyond one to each request, 2 at most; one with another value than the first counts twice: two devices
  /// have this node id.
  [[nodiscard]] int second_answers() const noexcept { return second_; }

 private:
  enum class Doing : std::uint8_t { kAsking, kWriting, kAskingAgain };
  [[nodiscard]] const SdoStep& current() const noexcept;
  [[nodiscard]] std::uint32_t to_write(const SdoStep& step) const noexcept;
  void next_part() noexcept;
  void go_on() noexcept;
  void on_other_value(std::uint32_t seen) noexcept;
  void refused(SetupFailure::What what) noexcept;
  void fail(SetupFailure::What what) noexcept;
  void count(const canopen::SdoResponse& answer) noexcept;

  std::uint8_t node_;
  Duration timeout_;
  SdoScript script_;
  std::size_t part_ = 0, at_ = 0;  // at_: of what is asked or written in this part
  Doing doing_ = Doing::kAsking;
  bool answered_ = false, same_device_ = true;
  std::vector<bool> taken_;  // parts that are as wanted; sized once, at construction
  int asked_ = 0;            // times the current step was asked
  Time asked_at_ = kNever;
  Reason failure_;
  SetupFailure details_;
  std::int64_t requests_ = 0, answers_ = 0;  // of everybody
  canopen::Object read_;                     // last object read, and its value
  std::uint32_t value_ = 0;
  int second_ = 0;
};

}  // namespace knuckle::slave
