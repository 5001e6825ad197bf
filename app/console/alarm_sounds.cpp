#include "app/console/alarm_sounds.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "app/console/machine_text.h"

namespace knuckle::console {
namespace {

struct Tone {
  double Hz, s;  ///< 0 Hz: silence.
};
constexpr std::array kLinkLostTones{Tone{988, 0.12}, Tone{740, 0.12}, Tone{988, 0.12},
                                    Tone{740, 0.12}, Tone{988, 0.12}, Tone{740, 0.12}};
constexpr std::array kFaultTones{Tone{784, 0.15}, Tone{0, 0.1}, Tone{784, 0.15}, Tone{0, 0.1}, Tone{784, 0.15}};
constexpr std::array kLimitTones{Tone{330, 0.12}};
constexpr std::array kContactTones{Tone{1480, 0.03}};

std::span<const Tone> tones_of(AlarmSound sound) {
  static constexpr std::array<std::span<const Tone>, 5> kTones{std::span<const Tone>(), kContactTones, kLimitTones,
                                                               kFaultTones, kLinkLostTones};
  static_assert(kTones.size() == static_cast<std::size_t>(AlarmSound::kLinkLost) + 1);
  return kTones[static_cast<std::size_t>(sound)];
}

/// Worth a note: the machine does less than it is asked for because of where it is or how hard it presses.
constexpr std::uint16_t kHeardLimits =
    kLimitJointRange | kLimitVirtualWall | kLimitPressure | kLimitAssistForce | kLimitForceCeiling;

}  // namespace

std::vector<std::int16_t> samples_of(AlarmSound sound, int rate_Hz) {
  constexpr double kLoud = 0.5 * 32767, kRamp_s = 0.005;  // no click at either end
  std::vector<std::int16_t> samples;
  for (const Tone& tone : tones_of(sound)) {
    const auto count = static_cast<int>(std::lround(tone.s * rate_Hz));
    for (int i = 0; i < count; ++i) {
      const double t_s = double(i) / rate_Hz, left_s = tone.s - t_s;
      const double ramp = std::clamp(std::min(t_s, left_s) / kRamp_s, 0.0, 1.0);
      samples.push_back(
          static_cast<std::int16_t>(std::lround(ramp * kLoud * std::sin(2 * std::numbers::pi * tone.Hz * t_s))));
    }
  }
  return samples;
}

bool AlarmWatch::due(AlarmSound sound, bool on, bool repeats, double now_s) {
  Standing& s = standing_[static_cast<std::size_t>(sound)];
  const bool begins = on && !s.on && now_s - s.last_s >= kRest_s;
  const bool again = on && s.on && repeats && now_s - s.last_s >= kAgain_s;
  if (!on || begins) s.on = on;
  if (begins || again) s.last_s = now_s;
  return begins || again;
}

AlarmSound AlarmWatch::step(const ConsoleView& view, bool lost, bool acknowledged, double now_s) {
  const SlaveMessage& m = view.machine;
  const bool stopped_by_hand = m.fault.code == ReasonCode::kOperatorStop;
  const bool fault = !lost && (m.mode == Mode::kEStop || (m.mode == Mode::kFault && !stopped_by_hand));
  const bool led_now = !lost && m.mode == Mode::kEngaged;
  AlarmSound loudest = AlarmSound::kNone;
  const auto consider = [&](AlarmSound sound, bool on, bool repeats) {
    if (due(sound, on, repeats, now_s)) loudest = std::max(loudest, sound);
  };
  // It ended in order where it said OFF last.
  consider(AlarmSound::kLinkLost, lost && m.mode != Mode::kOff, true);
  consider(AlarmSound::kFault, fault, !acknowledged);
  consider(AlarmSound::kLimit, led_now && (m.limits & kHeardLimits) != 0, false);
  consider(AlarmSound::kContact, led_now && force_text(view).contact, false);
  return loudest;
}

}  // namespace knuckle::console
