// Commissioning's trials of what ends the machine's motion when this computer falls silent, and what was seen of them.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "app/bringup/commission_jog.h"
#include "app/bringup/doctor_finding.h"
#include "machine/bus_description.h"
#include "slave/jog.h"

namespace knuckle::bringup {

/// A guard that acts by itself, and tells it; or what was seen instead.
struct GuardJudged {
  bool proved = false;
  Finding finding;
};
[[nodiscard]] GuardJudged judge_guard(const NodeDescription& node, const slave::GuardSeen& seen);
/// Likewise of the machine's own controller, by the cylinder that it moved until command frames ended.
[[nodiscard]] GuardJudged judge_silence(const JogRun& run, const BusDescription& bus);
/// Likewise of a module's outputs, which must end the motion whether they tell it or not.
[[nodiscard]] GuardJudged judge_outputs(const NodeDescription& module, const OutputsTried& tried);

/// For the record.
struct GuardResult {
  std::string node;  ///< Empty: the machine's own controller, which waits for command frames.
  std::uint32_t vendor = 0, product = 0;
  std::optional<std::uint32_t> serial;  ///< Of the device that was tried, where it has one.
  bool proved = false;
  std::string seen, channels;
};

class GuardTrials {
 public:
  /// All outlive this. @param serials of nodes that have one, by id. @param keep reports a finding; may throw.
  GuardTrials(const BusDescription& bus, JogBench& bench, const std::map<std::uint8_t, std::uint32_t>& serials,
              const std::function<void(const Finding&)>& keep)
      : bus_(bus), bench_(bench), serials_(serials), keep_(keep) {}

  /// What is asked for before the trials in motion: what happens then.
  [[nodiscard]] static std::string motions_text(const BusDescription& bus);
  /// Valves inside their dead bands, and the enable node.
  void nodes(std::vector<GuardResult>& results);
  /// While cylinders move: command frames to the machine's own controller, and what modules wait for; the enable node.
  void in_motion(std::vector<GuardResult>& results);

 private:
  void own_controller(GuardResult& result);
  void outputs_of(const NodeDescription& module, GuardResult& result);
  void at_rest(const NodeDescription& node, GuardResult& result);
  [[nodiscard]] GuardResult result_of(const NodeDescription& node) const;
  void note(GuardResult& result, const GuardJudged& judged, const std::string& about = "");
  void tell_emergencies(const NodeDescription& node, const slave::GuardSeen& seen);

  const BusDescription& bus_;
  JogBench& bench_;
  const std::map<std::uint8_t, std::uint32_t>& serials_;
  const std::function<void(const Finding&)>& keep_;
};

}  // namespace knuckle::bringup
