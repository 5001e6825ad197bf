// Runs the loops again on the inputs of a recording, and compares their states and outputs with it, bit by bit.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/time.h"
#include "machine/description.h"
#include "machine/device_description.h"
#include "master/master_loop.h"
#include "recording/recording.h"
#include "recording/wire_events.h"
#include "slave/slave_loop.h"
#include "slave/slave_state.h"

namespace knuckle::recording {

enum class Side : std::uint8_t { kOperator, kMachine };
[[nodiscard]] const char* name(Side side) noexcept;

/// The first step in which a loop did otherwise than recorded, with what it had just read.
struct Divergence {
  Side side{};
  Time at{};
  std::uint32_t step = 0;
  std::vector<std::string> what;    ///< A line for each field, frame, report or datagram that differs; the first ones.
  std::vector<std::string> inputs;  ///< Read in this step.
};

/// How much a number of a loop's state differs over the whole recording.
struct FieldDifference {
  double largest = 0;       ///< Of its absolute value; NaN where one of the two is none. Of an enumeration the first.
  Time at{};                ///< Where that is.
  std::string names;        ///< Of an enumeration: "engaged -> hold", recorded and replayed; else empty.
  std::uint64_t steps = 0;  ///< In which it differs at all.
};

/// Something that a person would call an event: a mode, a fault, a contact.
struct Change {
  Side side{};
  Time at{};
  std::string recorded, replayed;  ///< "engaged"; the one that changed differs from the line before.
};

struct SideResult {
  std::uint64_t steps = 0;       ///< Run again.
  std::uint64_t differing = 0;   ///< Of them, with any difference.
  std::uint64_t missing = 0;     ///< Not in the recording.
  std::uint64_t unrun = 0;       ///< Of an orderly end, in which the loop does not step.
  std::uint64_t unreadable = 0;  ///< Messages that are none of this version's.
  bool recorded = false;         ///< The recording says that it has this side.
  std::optional<Divergence> first;
  std::map<std::string, FieldDifference> fields;  ///< By name, those that differ.
};

struct ReplayResult {
  std::array<SideResult, 2> sides;  ///< By Side.
  /// What the loops held of the machine, wherever recorded and replayed differ in it.
  std::vector<Change> changes;
  /// Every side that was recorded did step, and did the same. What the files have lost is told by Recording::damages().
  [[nodiscard]] bool identical() const noexcept;
};

/// What the loops are made of; as recorded, or with something else in its place.
struct ReplaySetup {
  std::string source;          ///< Of the recording.
  MachineDescription machine;  ///< As calibrated.
  DeviceDescription device;
  Head head;
  bool changed = false;  ///< Not as recorded: then 0 and -0 are no difference.
};
/// As recorded. @throws InputError where a file is not attached or cannot be read by this version.
[[nodiscard]] ReplaySetup setup_of(const Recording& recording);

/// Told of the loops that run again, after each of their steps; may be empty.
struct ReplayTaps {
  std::function<void(Time, const master::MasterLoop&)> operator_step;
  std::function<void(Time, const slave::SlaveLoop&)> machine_step;
  std::function<void(const slave::SlaveState& recorded, const slave::SlaveState& replayed)> machine_states{};
};

class Replay {
 public:
  /// @throws InputError where the loops cannot be made of it, as where the law is no more.
  explicit Replay(const ReplaySetup& setup, ReplayTaps taps = {});
  ~Replay();
  Replay(const Replay&) = delete;
  Replay& operator=(const Replay&) = delete;

  /// Every entry of the recording, in its order. @throws InputError where the machine was led by a law that is no more.
  void take(const Entry& entry);
  [[nodiscard]] const ReplayResult& result() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// A whole recording. @throws InputError where it does not begin with the loops' first steps.
[[nodiscard]] ReplayResult replay(Recording& recording, const ReplaySetup& setup, ReplayTaps taps = {});

}  // namespace knuckle::recording
