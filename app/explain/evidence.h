// What the wires say about one stop: who still sent, who fell silent and when, what changed first.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "app/explain/window.h"
#include "core/joints.h"
#include "machine/bus_description.h"
#include "machine/bus_frames.h"
#include "machine/description.h"
#include "transport/canopen.h"

namespace knuckle::explain {

/// Something that comes again and again, around the moment of the stop.
struct Stream {
  std::optional<Time> last, next;  ///< Newest until the moment, first after it.
  Duration usual{};                ///< Median distance before the moment; 0: came too seldom to say.
  Time known_until{};              ///< Of the window: until then a `next` would be known.
  [[nodiscard]] Duration gap() const { return last ? next.value_or(known_until) - *last : Duration::zero(); }
  /// It missed its turn, at the moment or right behind it.
  [[nodiscard]] bool silent() const { return usual > Duration::zero() && gap() > usual + usual / 2 + 8ms; }
};

struct EmergencySeen {
  Time at{};
  canopen::Emergency emergency;
};

/// A process data object of a node.
struct PdoSeen {
  std::string name;  ///< "TPDO1"
  std::uint32_t id = 0;
  Stream frames;
};

/// A channel of a node, as its frames have it.
struct ChannelSeen {
  NodeChannel channel;
  std::uint32_t id = 0;  ///< Of its frames.
  std::vector<FrameField> fields;
  std::optional<CanFrame> newest;  ///< At the stop.
  std::optional<Time> same_since;  ///< It had the same bits ever since, until the stop.
  int same_times = 0;              ///< So often.
  Duration longest_same{};         ///< Before that, it had the same bits for at most so long.
  /// At the stop; nullopt where it has no such part, or has not come.
  [[nodiscard]] std::optional<double> read(FrameField::Part part) const;
};

/// A node of the machine file on the bus.
struct NodeSeen {
  NodeDescription node;
  std::vector<PdoSeen> pdos;
  std::vector<ChannelSeen> channels;
  Stream data;  ///< Process data: of several PDOs the one that has been missing longest, else the first.
  Stream heartbeat;
  std::vector<EmergencySeen> emergencies;  ///< From kBefore ahead of the stop to kAfter behind it; no resets.
  std::optional<Time> left;                ///< First heartbeat of those that tell another state than operational, ...
  canopen::NmtState left_to{};             ///< ... which is this; within the same time, unless it was told to.
  std::optional<Time> booted;              ///< Said so without having been told to, within kBefore ahead of the stop.
  /// All its process data have missed their turn.
  [[nodiscard]] bool sends_none() const;
  /// It is gone: no process data, and no heartbeat says that it lives.
  [[nodiscard]] bool silent() const;
};

/// A frame that the machine sends by itself.
struct FrameSeen {
  const BroadcastFrame* frame = nullptr;  ///< Of the machine that the evidence is of.
  std::string name;                       ///< frame_text()
  Stream stream;
  std::optional<Time> counted;  ///< When its counter last went on, until the stop; nullopt where it has none.
};

/// A valve at the stop, and since when its spool was apart from what it was told.
struct ValveSeen {
  double told = 0, spool = 0;       ///< Of stroke; told: as on the wire when it was apart most.
  std::optional<Time> apart_since;  ///< Beyond what a spool lags; until the stop.
  double most_apart = 0;            ///< Of stroke, meanwhile.
  Time still_since{};               ///< The spool was reported where it is at the stop ever since.
};

/// A loop that did not step for longer than it may.
struct Pause {
  Time from{}, to{};
};

struct Evidence {
  static constexpr Duration kBefore = 1500ms, kAfter = 500ms;

  std::vector<NodeSeen> nodes;
  std::vector<FrameSeen> frames;  ///< Those that come by themselves, each in one piece.
  std::array<ValveSeen, kJoints> valves;
  // The CAN controller.
  std::array<CanState, 2> can_states{};  ///< Of each bus at the stop.
  bool both_told = false;                ///< Else the recording has that of the worse one alone.
  std::optional<Time> can_changed;       ///< Since when the worse one is as it is; none where both are sound.
  std::uint8_t can_bus = 0;              ///< Which of two is the worse one; the next are its, too.
  std::string bus;                       ///< Its name in words: "bus machine"; empty where there is one.
  Stream can_received;                   ///< Any frame.
  int can_sent_after = 0, can_refused_after = 0, can_received_after = 0;  ///< In 0.2 s from the change or the stop on.
  std::map<std::uint32_t, int> foreign;  ///< Frames of the window by identifier that belong to nobody known.
  std::optional<Time> e_stop_opened,
      pilot_lost;  ///< Last time that the enable node's inputs changed so; until the stop.
  std::optional<canopen::SdoResponse> other_identity;  ///< An answer that differs from the machine file.
  std::uint8_t other_node = 0;                         ///< Whose.
  std::uint32_t expected_identity = 0;
  [[nodiscard]] std::string of_bus() const { return bus.empty() ? "" : " of " + bus; }
  // The link.
  Stream to_machine;       ///< Messages that the machine's side received and understood.
  Stream from_machine;     ///< Datagrams that it sent.
  Stream from_operator;    ///< Datagrams that the operator's side sent; empty where it is not in the recording.
  Stream to_operator;      ///< Those that it received and understood.
  int not_understood = 0;  ///< Received by the machine's side since its last good one.
  // The device.
  std::optional<Time> unplugged;
  Stream reports;           ///< Sound ones.
  int damaged_reports = 0;  ///< Since the last sound one.
  int zeros = 0;            ///< Bytes at the end of the last damaged one that are zero.
  // The loops.
  std::optional<Pause> machine_pause, operator_pause;
};

/// @param window reaches from some seconds ahead of the stop to some behind it: what is usual is learned from it.
[[nodiscard]] Evidence evidence_of(const Stop& stop, const Window& window, const MachineDescription& machine);

}  // namespace knuckle::explain
