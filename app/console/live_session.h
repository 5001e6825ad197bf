// A simulated session that a person leads: the loops and the plant of app/session/session.h in lock-step on virtual
// time, for as long as anybody likes. A scenario gives the world and the start; what it breaks on a schedule stays
// whole.
#pragma once

#include <cstdint>
#include <optional>

#include "app/console/console_input.h"
#include "app/console/console_view.h"
#include "app/console/operator_station.h"
#include "app/session/session.h"
#include "app/session/session_sides.h"
#include "core/time.h"
#include "machine/description.h"
#include "recording/recorder.h"
#include "sim/operator.h"
#include "transport/hid_port.h"
#include "transport/impaired_link.h"
#include "transport/virtual_can.h"

namespace knuckle::console {

class LiveSession {
 public:
  enum class Led : std::uint8_t {
    kByPerson,    ///< keyboard, mouse, gamepad, or the haptic device
    kByScenario,  ///< by the operator of the scenario: the session repeats bit for bit
  };

  /// @param device a haptic device, which outlives this; nullptr: a simulated one.
  /// @throws InputError where the setup does not fit together. Allocates all that steps need.
  LiveSession(const session::SessionSetup& setup, Led led, HidPort* device);
  LiveSession(const LiveSession&) = delete;
  LiveSession& operator=(const LiveSession&) = delete;

  /// Told of every frame on the bus, in step().
  void set_tap(CanTap tap) noexcept { far_.simulated.bus().set_tap(tap); }
  /// Before the first step: all that both loops read, do and know goes there. @param recorder outlives the last step.
  void record_to(recording::Recorder& recorder);
  /// One millisecond. Allocates nothing.
  void step(const HandInput& held) noexcept;

  [[nodiscard]] Time now() const noexcept { return now_; }
  [[nodiscard]] bool led_by_scenario() const noexcept { return scripted_.has_value(); }
  [[nodiscard]] OperatorStation& station() noexcept { return station_; }
  [[nodiscard]] const sim::PlantState& plant() const noexcept { return far_.simulated.plant(); }
  /// Puts in all but what the loop around this knows.
  void show(ConsoleView& view) noexcept;

 private:
  [[nodiscard]] sim::OperatorView seen_by_operator() const noexcept;
  void count_breaks() noexcept;

  Time now_{};
  ImpairedLink network_;
  OperatorStation station_;
  MachineDescription machine_;
  session::SimulatedMachineSide far_;
  std::optional<sim::Operator> scripted_;
  std::uint64_t events_read_ = 0;
  int breaks_ = 0;
};

}  // namespace knuckle::console
