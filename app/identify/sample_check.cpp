#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "app/identify/data_check.h"
#include "core/quantile.h"
#include "core/units.h"
#include "machine/description.h"
#include "machine/encoder_length.h"
#include "machine/toml_reader.h"

namespace knuckle::identify {
namespace {

using estimation::Recording;
using Flags = std::vector<std::uint8_t>;

constexpr double kMostLeftOut = 0.2;  // of a channel; beyond that the rest cannot be trusted either
constexpr std::size_t kBridged = 4;   // bad samples in a row that a line may cross
constexpr double kStuck_s = 1.0;

class SampleChecker {
 public:
  SampleChecker(const MachineDescription& machine, recordings::RecordedFile& file, bool commands_tell,
                std::vector<DataFinding>& findings)
      : machine_(machine),
        length_step_m_(length_steps_m(machine)),
        file_(file),
        recording_(file.recording),
        good_(recording_.usable),
        commands_tell_(commands_tell),
        findings_(findings) {
    for (Flags& flags : bad_) flags.assign(recording_.samples.size(), 0);
  }

  bool run() {
    for (std::size_t c = 0; c < recordings::kSignalChannels; ++c)
      if (recordings::measures(machine_, c)) check_range(c);
    if (std::any_of(findings_.begin(), findings_.end(), [](const DataFinding& f) { return f.refuses; })) return false;
    for (std::size_t c = 0; c < recordings::kPressureChannels; ++c) check_drop_outs(c);
    for (std::size_t c = 0; c + 1 < recordings::kSignalChannels; ++c) check_spikes(c);
    check_pitch_noise();
    for (std::size_t c = 0; c < recordings::kPressureChannels; ++c)
      if (recordings::measures(machine_, c)) check_stuck_pressure(c);
    for (std::size_t j = 0; j < kJoints; ++j) check_stuck_length(j);
    mend();
    for (std::size_t j = 0; j < kJoints; ++j) check_jumps(j);
    refuse_what_is_mostly_bad();
    return true;
  }

 private:
  [[nodiscard]] std::size_t size() const { return recording_.samples.size(); }
  [[nodiscard]] double at(std::size_t c, std::size_t i) const { return recordings::signal(recording_.samples[i], c); }
  [[nodiscard]] bool is_good(std::size_t c, std::size_t i) const { return good_[i] != 0 && bad_[c][i] == 0; }
  [[nodiscard]] std::size_t steps(double seconds) const {
    return static_cast<std::size_t>(std::max(1.0, std::round(seconds / recording_.step_s)));
  }
  void found(std::size_t c, std::size_t first, std::size_t last, const std::string& what) {
    const auto count =
        static_cast<std::size_t>(std::count(bad_[c].begin() + static_cast<std::ptrdiff_t>(first),
                                            bad_[c].begin() + static_cast<std::ptrdiff_t>(last) + 1, std::uint8_t{1}));
    findings_.push_back({file_.columns[c], file_.rows[first], file_.rows[last], count, what, false});
  }
  void refuse(const std::string& column, const std::string& what) {
    findings_.push_back({column, file_.rows.front(), file_.rows.back(), size(), what, true});
  }

  /// Marks what `is_bad` says of good samples and names every stretch.
  template <typename Judge>
  void mark(std::size_t c, const std::string& what, const Judge& is_bad) {
    Flags now(size(), 0);
    for (std::size_t i = 0; i < size(); ++i) now[i] = is_good(c, i) && is_bad(i) ? 1 : 0;
    for (std::size_t i = 0; i < size(); ++i) {
      if (now[i] == 0) continue;
      const std::size_t first = i;
      while (i + 1 < size() && now[i + 1] != 0) ++i;
      std::fill(bad_[c].begin() + static_cast<std::ptrdiff_t>(first),
                bad_[c].begin() + static_cast<std::ptrdiff_t>(i) + 1, std::uint8_t{1});
      found(c, first, i, what);
    }
  }

  [[nodiscard]] double middle(std::size_t c) const {
    std::vector<double> values;
    for (std::size_t i = 0; i < size(); ++i) {
      if (is_good(c, i)) values.push_back(at(c, i));
    }
    return values.empty() ? 0 : median(values);
  }

  /// What a channel far out of its range might be.
  [[nodiscard]] std::string guess(std::size_t c) const {
    struct Unit {
      double factor;
      const char* what;
    };
    static const std::vector<Unit> kLength{{-1, ": has the wrong sign"},
                                           {1e-3, ": looks like millimetres taken as metres"},
                                           {1e-2, ": looks like centimetres taken as metres"},
                                           {0.0254, ": looks like inches taken as metres"},
                                           {1e3, ": looks like metres taken as millimetres"}};
    static const std::vector<Unit> kPressure{{-1, ": has the wrong sign"}};
    static const std::vector<Unit> kAngle{{kDegree, ": looks like degrees taken as radians"}};
    const auto& units = c < recordings::kPressureChannels      ? kPressure
                        : c == recordings::kSignalChannels - 1 ? kAngle
                                                               : kLength;
    const recordings::SignalRange range = recordings::possible_range(machine_, c);
    const double value = middle(c);
    for (const Unit& unit : units) {
      if (value * unit.factor >= range.low && value * unit.factor <= range.high) return unit.what;
    }
    return "";
  }

  void check_range(std::size_t c) {
    const recordings::SignalRange range = recordings::possible_range(machine_, c);
    const auto outside = [&](std::size_t i) { return at(c, i) < range.low || at(c, i) > range.high; };
    std::size_t usable = 0, beyond = 0, zero = 0;
    for (std::size_t i = 0; i < size(); ++i) {
      if (!is_good(c, i)) continue;
      ++usable;
      beyond += outside(i) ? 1U : 0U;
      zero += at(c, i) == 0 ? 1U : 0U;
    }
    if (usable == 0) return refuse(file_.columns[c], "has no usable value");
    const bool may_be_zero = c == recordings::kSignalChannels - 1;
    if (!may_be_zero && zero == usable) return refuse(file_.columns[c], "is zero throughout");
    if (static_cast<double>(beyond) > kMostLeftOut * static_cast<double>(usable)) {
      const double percent = 100 * static_cast<double>(beyond) / static_cast<double>(usable);
      return refuse(file_.columns[c], fmt::format("has {:.0f} % of its samples outside the possible range, ", percent) +
                                          number_text(range.low) + " to " + number_text(range.high) +
                                          " (SI units); its median is " + number_text(middle(c)) + guess(c));
    }
    if (c >= recordings::kPressureChannels && !may_be_zero)
      mark(c, "drop-out to zero", [&](std::size_t i) { return at(c, i) == 0; });
    mark(c, "outside the range of the machine's sensors and cylinders", outside);
  }

  /// A transmitter that fails reads exactly zero; a chamber that empties does so less abruptly.
  void check_drop_outs(std::size_t c) {
    constexpr double kClearly_Pa = 5 * kBar;
    double before = 0;
    mark(c, "drop-out to zero", [&](std::size_t i) {
      if (at(c, i) != 0) before = at(c, i);
      return at(c, i) == 0 && before > kClearly_Pa;
    });
  }

  /// Speed [m/s] that no cylinder of this machine reaches, lowering included.
  [[nodiscard]] double too_fast(std::size_t joint) const {
    return 2.5 * machine_.hydraulics.pump_flow_m3ps / machine_.cylinders[joint].rod_side_area_m2();
  }
  [[nodiscard]] double largest_step(std::size_t joint) const {
    return too_fast(joint) * recording_.step_s + 10 * length_step_m_[static_cast<Eigen::Index>(joint)];
  }

  /// One or two samples off what both their neighbours say.
  void check_spikes(std::size_t c) {
    const double least = c < recordings::kPressureChannels
                             ? std::max(25 * kBar, 20 * machine_.sensors.pressure_noise_Pa)
                             : 0.5 * largest_step(c - recordings::kPressureChannels) +
                                   20 * length_step_m_[static_cast<Eigen::Index>(c - recordings::kPressureChannels)];
    constexpr double kSpread = 3;
    std::vector<double> off(size(), 0.0);
    for (std::size_t i = 2; i + 2 < size(); ++i) {
      std::array<double, 5> window;
      bool whole = true;
      for (std::size_t k = 0; k < window.size(); ++k) {
        window[k] = at(c, i + k - 2);
        whole = whole && is_good(c, i + k - 2);
      }
      if (!whole) continue;
      std::sort(window.begin(), window.end());
      const double spread = window[3] - window[1];
      const double away = std::abs(at(c, i) - window[2]);
      if (away > least + kSpread * spread) off[i] = away;
    }
    mark(c, "spike", [&](std::size_t i) { return off[i] > 0; });
  }

  /// A tilt sensor's steps and noise are known; many times that is another unit.
  void check_pitch_noise() {
    constexpr std::size_t c = recordings::kSignalChannels - 1;
    double sum2 = 0;
    std::size_t count = 0;
    for (std::size_t i = 1; i < size(); ++i) {
      if (!is_good(c, i) || !is_good(c, i - 1)) continue;
      sum2 += std::pow(at(c, i) - at(c, i - 1), 2);
      ++count;
    }
    const double expected = machine_.sensors.tilt_noise_rad + machine_.sensors.tilt_step_rad;
    constexpr double kTimes = 12;
    const double jitter = count > 0 ? std::sqrt(sum2 / static_cast<double>(count) / 2) : 0;
    if (jitter > kTimes * expected) {
      refuse(file_.columns[c],
             "varies by " + number_text(std::round(1e4 * jitter) / 1e4) + " rad from sample to sample, its sensor by " +
                 number_text(std::round(1e4 * expected) / 1e4) + ": looks like degrees taken as radians");
    }
  }

  /// Calls visit(first, last) for every stretch of at least kStuck_s in which channel c does not change.
  template <typename Visit>
  void for_constant_stretches(std::size_t c, const Visit& visit) {
    for (std::size_t first = 0, last; first < size(); first = last + 1) {
      last = first;
      if (!is_good(c, first)) continue;
      while (last + 1 < size() && is_good(c, last + 1) && at(c, last + 1) == at(c, first)) ++last;
      if (last - first + 1 >= steps(kStuck_s)) visit(first, last);
    }
  }

  [[nodiscard]] double spread(std::size_t c, std::size_t first, std::size_t last) const {
    double low = at(c, first), high = low;
    for (std::size_t i = first; i <= last; ++i) {
      if (!is_good(c, i)) continue;
      low = std::min(low, at(c, i));
      high = std::max(high, at(c, i));
    }
    return high - low;
  }

  void mark_stuck(std::size_t c, std::size_t first, std::size_t last) {
    mark(c, "stuck at " + number_text(at(c, first)) + " while others move",
         [&](std::size_t i) { return i >= first && i <= last; });
  }

  /// Pressures at rest still tremble; one that does not, while its cylinder moves or the other chamber's pressure
  /// changes, is stuck.
  void check_stuck_pressure(std::size_t c) {
    constexpr double kMoves_m = 0.01, kChanges_Pa = 5 * kBar;
    for_constant_stretches(c, [&](std::size_t first, std::size_t last) {
      if (spread(recordings::kPressureChannels + c / 2, first, last) > kMoves_m ||
          spread(c ^ 1U, first, last) > kChanges_Pa)
        mark_stuck(c, first, last);
    });
  }

  /// A length at rest is constant for long. It is stuck where it ends in a jump or its valve was open meanwhile.
  void check_stuck_length(std::size_t joint) {
    const std::size_t c = recordings::kPressureChannels + joint;
    for_constant_stretches(c, [&](std::size_t first, std::size_t last) {
      const bool jumps = last + 1 < size() && is_good(c, last + 1) &&
                         std::abs(at(c, last + 1) - at(c, last)) > 0.5 * largest_step(joint);
      if (jumps || valve_open_s(joint, first, last) > 0.5 * kStuck_s) mark_stuck(c, first, last);
    });
  }

  [[nodiscard]] double valve_open_s(std::size_t joint, std::size_t first, std::size_t last) const {
    if (!commands_tell_ || recording_.valve.empty()) return 0;
    const ValveDescription& valve = machine_.cylinders[joint].valve;
    constexpr double kClearly = 0.08;
    std::size_t open = 0;
    for (std::size_t i = first; i <= last; ++i) {
      const double command = recording_.valve[i][static_cast<Eigen::Index>(joint)];
      open += command > valve.dead_band_extend + kClearly || -command > valve.dead_band_retract + kClearly ? 1U : 0U;
    }
    return static_cast<double>(open) * recording_.step_s;
  }

  /// Bridges short runs of bad samples; longer ones are not usable.
  void mend() {
    for (std::size_t c = 0; c < recordings::kSignalChannels; ++c) {
      for (std::size_t i = 0; i < size(); ++i) {
        if (bad_[c][i] == 0) continue;
        const std::size_t first = i;
        while (i + 1 < size() && bad_[c][i + 1] != 0) ++i;
        const bool ends = first > 0 && i + 1 < size() && good_[first - 1] != 0 && good_[i + 1] != 0;
        const double from = first > 0 ? at(c, first - 1) : 0, to = ends ? at(c, i + 1) : from;
        for (std::size_t k = first; k <= i; ++k) {
          const double share = static_cast<double>(k - first + 1) / static_cast<double>(i - first + 2);
          recordings::signal(recording_.samples[k], c) = from + share * (to - from);
          if (!ends || i - first + 1 > kBridged) recording_.usable[k] = 0;
        }
      }
    }
  }

  void check_jumps(std::size_t joint) {
    const std::size_t c = recordings::kPressureChannels + joint;
    for (std::size_t i = 1; i < size(); ++i) {
      if (recording_.usable[i] == 0 || recording_.usable[i - 1] == 0) continue;
      const double step = at(c, i) - at(c, i - 1);
      if (std::abs(step) <= largest_step(joint)) continue;
      bad_[c][i] = 1;
      recording_.usable[i] = 0;
      found(c, i, i, "jumps farther than its cylinder can move in a step");
    }
  }

  void refuse_what_is_mostly_bad() {
    for (std::size_t c = 0; c < recordings::kSignalChannels; ++c) {
      const auto bad = static_cast<double>(std::count(bad_[c].begin(), bad_[c].end(), std::uint8_t{1}));
      const auto all = static_cast<double>(std::count(good_.begin(), good_.end(), std::uint8_t{1}));
      if (bad > kMostLeftOut * all)
        refuse(file_.columns[c], fmt::format("cannot be used for {:.0f} % of the recording", 100 * bad / all) + "; " +
                                     std::string("at most 20 % may be left out"));
    }
  }

  const MachineDescription& machine_;
  JointVector length_step_m_;
  recordings::RecordedFile& file_;
  Recording& recording_;
  const Flags good_;  // as read
  std::array<Flags, recordings::kSignalChannels> bad_;
  bool commands_tell_;
  std::vector<DataFinding>& findings_;
};

}  // namespace

bool check_samples(const MachineDescription& machine, recordings::RecordedFile& file, bool commands_tell,
                   std::vector<DataFinding>& findings) {
  return SampleChecker(machine, file, commands_tell, findings).run();
}

}  // namespace knuckle::identify
