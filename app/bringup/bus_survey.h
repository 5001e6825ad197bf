// Lists the nodes of a machine bus by listening, by reading objects over SDO, and by asking over LSS for devices
// without a node id: nothing is started, configured or moved.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/time.h"
#include "machine/bus_description.h"
#include "machine/description_fwd.h"
#include "slave/node_setup.h"
#include "transport/bus_access.h"
#include "transport/canopen.h"

namespace knuckle::bringup {

/// How one object was answered.
struct ObjectRead {
  canopen::Object object;
  enum class Answer : std::uint8_t { kSilent, kAborted, kValue } answer = Answer::kSilent;
  std::uint32_t value = 0;
  canopen::SdoAbort abort = canopen::SdoAbort::kNone;
};

/// One identifier seen while listening.
struct HeardFrames {
  std::uint64_t count = 0;
  std::uint64_t bits = 0;      ///< With worst-case stuffing.
  std::uint64_t repeated = 0;  ///< Those of them that are as the one before.
  CanFrame newest{};
  Time first_at{}, newest_at{};
  /// From one to the next, on average; nullopt of fewer than two.
  [[nodiscard]] std::optional<double> period_s() const noexcept;
};

/// One node: what it sent by itself and what it answered.
struct SurveyedNode {
  std::uint8_t id = 0;
  std::optional<canopen::NmtState> state;       ///< Of its newest heartbeat; nullopt where it sends none.
  bool booted = false;                          ///< It started while being listened to.
  std::optional<canopen::Emergency> emergency;  ///< Newest received.
  std::uint64_t emergencies = 0;
  std::vector<ObjectRead> objects;
  int second_answers = 0;  ///< Beyond one to each request, while nobody else asked.

  /// nullptr where it was not asked.
  [[nodiscard]] const ObjectRead* read(canopen::Object object) const noexcept;
  /// nullopt where there is no answer with a value.
  [[nodiscard]] std::optional<std::uint32_t> value(canopen::Object object) const noexcept;
  /// It has answered anything at all, be it with an abort.
  [[nodiscard]] bool answers() const noexcept;
  /// An object that was read twice had two values.
  [[nodiscard]] bool contradicts_itself() const noexcept;
};

struct BusSurvey {
  std::string name;  ///< Of the interface.
  CanState state = CanState::kActive;
  double listened_s = 0;
  double load = 0;                             ///< Share of the bit rate, without what the survey sent itself.
  std::map<std::uint32_t, HeardFrames> heard;  ///< By identifier.
  /// Likewise of SurveyOptions::multiplexed, by identifier and BroadcastFrame::name.
  std::map<std::pair<std::uint32_t, std::string>, HeardFrames> multiplexed;
  std::map<std::uint8_t, SurveyedNode> nodes;  ///< By id; every node that sent a frame or got a request.
  bool others_ask = false;       ///< Another program uses SDO: no request was sent, as responses could be mixed up.
  bool sync = false;             ///< A controller is active.
  std::uint64_t without_id = 0;  ///< Devices without a node id that answered LSS: on a real bus their answers are one.
  std::uint64_t errors = 0;      ///< Error frames, and frames lost on the way, meanwhile.
};

struct SurveyOptions {
  double listen_s = 2;
  double answer_s = 0.25;                     ///< Patience for one SDO answer.
  std::vector<BroadcastFrame> multiplexed{};  ///< Those of one identifier that are told apart.
};
[[nodiscard]] std::vector<BroadcastFrame> multiplexed_frames(const BusDescription& bus);

/// @param wanted objects to read of nodes by their id; every other id is read for its device type and, where it
/// answers, for its identity. @param check called every millisecond; may throw to end it.
[[nodiscard]] BusSurvey survey_bus(BusAccess& access, std::uint32_t bit_rate,
                                   const std::map<std::uint8_t, std::vector<canopen::Object>>& wanted,
                                   const SurveyOptions& options = {}, const std::function<void()>& check = {});

// What a node measures or does at the moment, as read over SDO, as text with units.

struct NodeReading {
  std::string text;       ///< "60.21 bar", "INIT, spool 0.0 %"; empty where it could not be read.
  std::string complaint;  ///< The defect and what to do; empty where there is none.
  bool fault = false;     ///< The machine cannot be run with this defect.
};
[[nodiscard]] std::vector<canopen::Object> reading_objects(const NodeDescription& node,
                                                           const MachineDescription& machine);
[[nodiscard]] NodeReading reading_of(const SurveyedNode& node, const NodeDescription& expected,
                                     const MachineDescription& machine);

}  // namespace knuckle::bringup
