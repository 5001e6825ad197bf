// What every node of the machine bus must be and is told at start-up, as a list of SDO steps, and the dialogue that
// works through such a list without blocking.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/reason.h"
#include "core/time.h"
#include "machine/description.h"
#include "transport/can_bus.h"
#include "transport/canopen.h"

namespace knuckle::slave {

struct SdoStep {
  enum class Kind : std::uint8_t {
    kIdentity,  ///< Read; another value is another device: kNodeIdentity.
    kRequire,   ///< Read; another value is a set-up nobody may change behind the integrator's back: kNodeSetup.
    kWrite,
  } kind = Kind::kWrite;
  canopen::Object object;
  std::uint32_t value = 0;
  std::uint8_t size = 4;  ///< Bytes.
};
using SdoScript = std::vector<SdoStep>;

// Scripts of the default profiles (CiA 408, 404, 406, 410, 401). Encoder and tilt count in the machine file's steps.
// @throws InputError where a step cannot be told to its node.
[[nodiscard]] SdoScript valve_script(const MachineDescription& machine, const NodeDescription& node);
[[nodiscard]] SdoScript pressure_script(const MachineDescription& machine, const NodeDescription& node);
[[nodiscard]] SdoScript encoder_script(const MachineDescription& machine, const NodeDescription& node);
[[nodiscard]] SdoScript tilt_script(const MachineDescription& machine, const NodeDescription& node);
[[nodiscard]] SdoScript enable_script(const MachineDescription& machine, const NodeDescription& node);

/// How long to wait for an SDO answer, and how often to ask.
inline constexpr Duration kSdoTimeout = 250ms;
inline constexpr int kSdoAttempts = 2;

/// Works through one node's script: one request outstanding at a time.
class SdoDialogue {
 public:
  SdoDialogue(std::uint8_t node, SdoScript script) : node_(node), script_(std::move(script)) {}
  void restart() noexcept;
  /// Sends what is due. Call once a step.
  void step(CanBus& bus, Time now) noexcept;
  /// An answer of this node.
  void receive(const CanFrame& frame) noexcept;
  [[nodiscard]] bool done() const noexcept { return next_ == script_.size(); }
  /// The node has answered: from now on it must not lose what it was told.
  [[nodiscard]] bool begun() const noexcept { return next_ > 0; }
  /// kNodeIdentity (value seen, expected) or kNodeSetup (step that failed, steps there are).
  [[nodiscard]] const Reason& failure() const noexcept { return failure_; }

 private:
  void fail(ReasonCode code, double value, double limit) noexcept;

  std::uint8_t node_;
  SdoScript script_;
  std::size_t next_ = 0;
  int asked_ = 0;  // times the current step was asked
  Time asked_at_ = kNever;
  Reason failure_;
};

}  // namespace knuckle::slave
