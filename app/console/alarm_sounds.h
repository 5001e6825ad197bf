// What the operator hears, and when: a danger's two tones, a fault's pulses, a limit's low note, a contact's tick
// (after ISO 11428 and IEC 60073: danger changes fast, a warning is pulsed, information is single).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "app/console/console_view.h"

namespace knuckle::console {

/// In the order of their importance.
enum class AlarmSound : std::uint8_t { kNone, kContact, kLimit, kFault, kLinkLost };

/// One channel. @param rate_Hz of the samples.
[[nodiscard]] std::vector<std::int16_t> samples_of(AlarmSound sound, int rate_Hz);

/// Which sound begins now. Plain state: no clock, no device.
class AlarmWatch {
 public:
  /// @param lost whether the machine was heard before and is not now. @param acknowledged whether the person has seen
  /// all alarms: a fault is silent then. @param now_s of the window's clock.
  [[nodiscard]] AlarmSound step(const ConsoleView& view, bool lost, bool acknowledged, double now_s);

 private:
  static constexpr double kAgain_s = 2.5;  ///< A danger that stands is repeated.
  static constexpr double kRest_s = 1;     ///< At least, between two ticks, or two notes.

  [[nodiscard]] bool due(AlarmSound sound, bool on, bool repeats, double now_s);

  struct Standing {
    bool on = false;
    double last_s = -1e9;
  };
  std::array<Standing, 5> standing_{};
};

}  // namespace knuckle::console
