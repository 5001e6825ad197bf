// Metrics of tasks whose answers are known: made up, and recorded of simulated operators.
#include "app/operators/task_metrics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "core/error.h"
#include "tests/operators/recorded_sessions.h"
#include "tests/recording/rewrite.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::operators {
namespace {

constexpr int kSamples_Hz = 200;

Time at_s(double s) {
  return Time(std::chrono::duration_cast<Duration>(std::chrono::duration<double>(s)));
}

/// The fastest noise: 1 and -1 in turn.
double every_other(double t_s) {
  return std::lround(t_s * kSamples_Hz) % 2 == 0 ? 1 : -1;
}

/// Engaged all the time, the force known, at rest in free air; then as `change` says.
TaskRecording made_up(double seconds, const std::function<void(double t_s, MachineSample&)>& change) {
  TaskRecording task;
  task.source = "made_up.mcap";
  for (int i = 0; i <= seconds * kSamples_Hz; ++i) {
    MachineSample sample;
    const double t_s = double(i) / kSamples_Hz;
    sample.at = at_s(t_s);
    sample.mode = Mode::kEngaged;
    sample.confidence = 0.9;
    change(t_s, sample);
    task.machine.push_back(sample);
  }
  return task;
}

TEST(TaskMetrics, CountTimeFromFirstToLastEngaged) {
  const TaskMetrics metrics = measure(made_up(20, [](double t_s, MachineSample& s) {
    if (t_s < 2 || t_s > 18) s.mode = Mode::kReady;
    if (t_s > 8 && t_s < 9) {
      s.mode = Mode::kHold;
      s.clutch = true;
    }
    if (t_s > 12 && t_s < 12.5) {
      s.mode = Mode::kFault;
      s.fault = ReasonCode::kLinkLost;
    }
    if (t_s > 14 && t_s < 14.5) {
      s.mode = Mode::kFault;
      s.fault = ReasonCode::kOperatorStop;
    }
    if (t_s > 15 && t_s < 15.5) s.mode = Mode::kEStop;
  }));
  EXPECT_NEAR(metrics.task_time_s.value(), 16, 0.01);
  EXPECT_NEAR(metrics.engaged_time_s.value(), 13.5, 0.05);
  EXPECT_NEAR(metrics.idle_time_s.value(), 16, 0.01);
  EXPECT_EQ(metrics.engagements, 5);
  EXPECT_EQ(metrics.clutches, 1);
  EXPECT_EQ(metrics.faults, 1);
  EXPECT_EQ(metrics.stops, 2);
  EXPECT_FALSE(metrics.bookmarked_time_s);
}

TEST(TaskMetrics, AreNoneWhereThereWasNoContactOrNobodyEngaged) {
  const TaskMetrics free = measure(made_up(3, [](double, MachineSample&) {}));
  EXPECT_EQ(free.contacts, 0);
  EXPECT_EQ(free.contact_time_s, 0);
  EXPECT_FALSE(free.peak_contact_force_N);
  EXPECT_FALSE(free.mean_contact_force_N);
  EXPECT_FALSE(free.contact_overshoot);
  EXPECT_FALSE(free.hand_path_m) << "no hand was recorded";
  const TaskMetrics idle = measure(made_up(3, [](double, MachineSample& s) { s.mode = Mode::kReady; }));
  for (const MetricInfo& info : kMetrics) EXPECT_FALSE(idle.*info.value) << info.name;
}

/// 3000 N for a moment, then 1500 N; what is not known does not count.
TEST(TaskMetrics, TakeTheForceOfContactsWhereItIsKnown) {
  const TaskMetrics metrics = measure(made_up(10, [](double t_s, MachineSample& s) {
    s.tip_force_N = 7000;  // said of free air
    s.contact = t_s >= 2 && t_s <= 6;
    if (t_s > 4.5 && t_s < 4.6) s.contact = false;  // chatter
    if (s.contact) s.tip_force_N = t_s < 2.2 ? 3000 : 1500;
    if (t_s > 5) {
      s.confidence = 0.5;
      s.tip_force_N = 9000;
    }
  }));
  EXPECT_EQ(metrics.contacts, 1);
  EXPECT_NEAR(metrics.contact_time_s.value(), 3.9, 0.03);
  EXPECT_EQ(metrics.peak_contact_force_N, 3000);
  EXPECT_NEAR(metrics.mean_contact_force_N.value(), (0.2 * 3000 + 2.7 * 1500) / 2.9, 10);
  EXPECT_DOUBLE_EQ(metrics.contact_overshoot.value(), 2);
  EXPECT_NEAR(metrics.force_unknown_share.value(), 0.5, 0.005);
}

TEST(TaskMetrics, HaveNoOvershootWhereAContactIsShort) {
  const TaskMetrics metrics = measure(made_up(10, [](double t_s, MachineSample& s) {
    s.contact = t_s >= 2 && t_s <= 3.4;
    s.tip_force_N = 1000;
  }));
  EXPECT_EQ(metrics.peak_contact_force_N, 1000);
  EXPECT_FALSE(metrics.contact_overshoot);
}

/// A circle, faster in one half, with noise on place and speed.
TEST(TaskMetrics, MeasureWayAndSpeedWithoutTheNoiseOnThem) {
  const TaskMetrics metrics = measure(made_up(10, [](double t_s, MachineSample& s) {
    const double angle = 2 * std::numbers::pi * t_s / 10;
    s.tip_m = {std::cos(angle) + 1e-3 * every_other(t_s), std::sin(angle)};
    s.tip_mps = 2 * std::numbers::pi / 10 * PlanarVector(-std::sin(angle), std::cos(angle));
    s.tip_mps *= 1 - 0.5 * std::cos(angle);
    s.tip_mps.x() += 0.05 * every_other(t_s);
  }));
  EXPECT_NEAR(metrics.tip_path_m.value(), 2 * std::numbers::pi, 0.1);
  EXPECT_EQ(metrics.idle_time_s, 0);
  EXPECT_EQ(metrics.tip_velocity_peaks, 1);
}

TEST(TaskMetrics, TakeNoiseAtRestForIdleness) {
  const TaskMetrics metrics =
      measure(made_up(10, [](double t_s, MachineSample& s) { s.tip_mps.x() = 0.05 * every_other(t_s); }));
  EXPECT_NEAR(metrics.idle_time_s.value(), 10, 0.1);
  EXPECT_EQ(metrics.tip_velocity_peaks, 0);
}

/// Three strokes of 1 cm, 1 s each, with halts of 1 s between them.
TEST(TaskMetrics, MeasureTheHandByItself) {
  TaskRecording task = made_up(6, [](double, MachineSample&) {});
  for (const MachineSample& machine : task.machine) {
    const double t_s = to_seconds(machine.at - Time{}), phase = std::fmod(t_s, 2);
    const double stroke = std::floor(t_s / 2) + std::min(phase, 1.0);
    const double speed = phase < 1 ? 0.5 * std::numbers::pi * std::sin(std::numbers::pi * phase) : 0;
    task.hand.push_back({machine.at, {0.01 * stroke, 0}, {0.01 * speed, 0}});
  }
  const TaskMetrics metrics = measure(task);
  EXPECT_NEAR(metrics.hand_path_m.value(), 0.03, 5e-4);
  EXPECT_EQ(metrics.hand_velocity_peaks, 3);
  EXPECT_LT(metrics.hand_smoothness.value(), -2);
  EXPECT_EQ(metrics.tip_velocity_peaks, 0);
}

TEST(TaskMetrics, AreThoseBetweenBookmarksWhereThereAreSome) {
  TaskRecording task = made_up(10, [](double t_s, MachineSample& s) { s.tip_m = {0.1 * t_s, 0}; });
  const auto mark = [&](double t_s, const char* text) {
    task.bookmarks.push_back({at_s(t_s), recording::Severity::kInfo, "bookmark", text});
  };
  mark(1, "interesting");
  mark(3, "task start");
  EXPECT_THROW((void)measure(task), InputError);
  mark(7, "task end");
  mark(8, "task end");
  const TaskMetrics metrics = measure(task);
  EXPECT_NEAR(metrics.bookmarked_time_s.value(), 4, 1e-9);
  EXPECT_NEAR(metrics.task_time_s.value(), 10, 1e-9);
  EXPECT_NEAR(metrics.tip_path_m.value(), 0.4, 1e-3);
  EXPECT_NEAR(metrics.engaged_time_s.value(), 4, 1e-9);
}

const std::string kBegin =
    "description = \"Of a test\"\nreference_reach_m = 3.2\nreference_payload_kg = 150\n"
    "start_deg = [42.7, -99, 14.2]\nhand_deg = [43.7, -100, 15.2]\n";
const std::string kOperator =
    "[link]\ndelay_ms = 10\n[operator]\nlimb = \"normal\"\nreaction_ms = 200\n"
    "[[phase]]\nname = \"engage\"\nkind = \"engage\"\n";

/// The tip is at (2.18, 0.09) and goes 0.6 m back, along a straight line.
TEST(TaskMetrics, OfARecordedStraightMotionAreItsLength) {
  const test::TemporaryFolder folder;
  test::record(
      "name = \"straight\"\nduration_s = 30\n" + kBegin + kOperator +
          "[[phase]]\nname = \"back\"\nkind = \"move\"\ntip_m = [1.58, 0.09]\nbucket_deg = -42.1\nspeed_mps = 0.3\n",
      folder.file("a.mcap"));
  const TaskMetrics metrics = measure(read_task(folder.file("a.mcap")));
  EXPECT_NEAR(metrics.tip_path_m.value(), 0.6, 0.06);
  EXPECT_NEAR(metrics.hand_path_m.value(), 0.06, 0.006);
  EXPECT_EQ(metrics.engagements, 1);
  EXPECT_EQ(metrics.faults, 0);
  EXPECT_EQ(metrics.contacts, 0);
  EXPECT_FALSE(metrics.peak_contact_force_N);
}

const std::string kPress =
    "[[phase]]\nname = \"press\"\nkind = \"press\"\ndirection = [1, 0]\nspeed_mps = 0.1\nfelt_N = 2\nhold_s = 4\n"
    "[[wall]]\npoint_m = [2.25, 0]\nnormal = [-1, 0]\nstiffness_N_per_m = 1e6\ndamping_ratio = 0.3\nfriction = 0.4\n";

/// 2 N are asked for in the hand, which is 2 kN at the tip; seen from both sides alike.
TEST(TaskMetrics, OfARecordedPressAreItsForceWhicheverSideRecordedIt) {
  const test::TemporaryFolder folder;
  const std::string scenario = "name = \"press\"\nduration_s = 30\n" + kBegin + kOperator + kPress;
  const std::vector<recording::Event> marks{{at_s(4), recording::Severity::kInfo, "bookmark", "task start"},
                                            {at_s(6), recording::Severity::kInfo, "bookmark", "task end"}};
  test::record(scenario, folder.file("both.mcap"), marks);
  const auto all = [](const std::string&, auto&) { return true; };
  recording::Head operators = recording::Recording({folder.file("both.mcap")}).head(), machines = operators;
  operators.has_machine = machines.has_operator = false;
  test::rewrite(folder.file("both.mcap"), folder.file("operator.mcap"), operators, {1}, all);
  test::rewrite(folder.file("both.mcap"), folder.file("machine.mcap"), machines, {1}, all);
  const TaskMetrics both = measure(read_task(folder.file("both.mcap")));
  EXPECT_NEAR(both.mean_contact_force_N.value(), 2000, 200);
  EXPECT_NEAR(both.bookmarked_time_s.value(), 2, 1e-9);
  EXPECT_EQ(both.contacts, 1);
  const TaskMetrics told = measure(read_task(folder.file("operator.mcap")));
  EXPECT_EQ(told.hand_path_m, both.hand_path_m);
  EXPECT_EQ(told.contacts, both.contacts);
  EXPECT_NEAR(told.mean_contact_force_N.value(), both.mean_contact_force_N.value(), 2);
  EXPECT_NEAR(told.task_time_s.value(), both.task_time_s.value(), 0.02);
  const TaskMetrics own = measure(read_task(folder.file("machine.mcap")));
  EXPECT_FALSE(own.hand_path_m);
  EXPECT_EQ(own.mean_contact_force_N, both.mean_contact_force_N);
  EXPECT_EQ(own.tip_path_m, both.tip_path_m);
}

TEST(TaskRecording, OfSeveralPartsIsReadAsOne) {
  const test::TemporaryFolder folder;
  test::record("name = \"press\"\nduration_s = 4\n" + kBegin + kOperator + kPress, folder.file("whole.mcap"));
  const TaskRecording whole = read_task(folder.file("whole.mcap"));
  recording::Head head = recording::Recording({folder.file("whole.mcap")}).head();
  for (int part = 1; part <= 2; ++part) {
    head.part = part;
    const std::string name = folder.file("whole_part00" + std::to_string(part) + ".mcap");
    int count = 0;
    test::rewrite(folder.file("whole.mcap"), name, head, {1},
                  [&](const std::string&, auto&) { return (++count <= 6000) == (part == 1); });
  }
  const TaskRecording parts = read_task(folder.file("whole_part001.mcap"));
  EXPECT_EQ(parts.machine.size(), whole.machine.size());
  EXPECT_EQ(parts.hand.size(), whole.hand.size());
  EXPECT_THROW((void)read_task(folder.file("whole_part002.mcap")), InputError);
}

constexpr double kStep_s = 5e-3;

/// A bell of this width, cut off where it is nothing, `size` high.
std::vector<double> bell(double sigma_s, double size) {
  std::vector<double> speed;
  for (double t = -6 * sigma_s; t <= 6 * sigma_s; t += kStep_s)
    speed.push_back(size * std::exp(-t * t / (2 * sigma_s * sigma_s)));
  return speed;
}

/// Of any bell: its spectrum is exp(-w^2 sigma^2 / 2), 0.05 at w_c; with u = w / w_c the arc is that of exp(-u^2 ln 20)
/// over [0, 1], whatever sigma is. Simpson's rule.
double bell_arc_length() {
  constexpr int kSteps = 2000;
  const double k = std::log(20.0);
  double sum = 0;
  for (int i = 0; i <= kSteps; ++i) {
    const double u = double(i) / kSteps;
    const int weight = i == 0 || i == kSteps ? 1 : i % 2 == 1 ? 4 : 2;
    sum += weight * std::hypot(1, 2 * k * u * std::exp(-k * u * u));
  }
  return -sum / (3 * kSteps);
}

TEST(SpectralArcLength, OfABellIsThatOfItsKnownSpectrumWhateverItsSizeAndDuration) {
  for (const double sigma_s : {0.1, 0.3, 1.0}) {
    for (const double size : {0.1, 5.0})
      EXPECT_NEAR(spectral_arc_length(bell(sigma_s, size), kStep_s).value(), bell_arc_length(), 0.02) << sigma_s;
  }
}

TEST(SpectralArcLength, SeesThatAMotionInTwoHalvesIsLessSmooth) {
  const std::vector<double> one = bell(0.3, 1);
  std::vector<double> two = one;
  two.insert(two.end(), one.begin(), one.end());
  EXPECT_LT(spectral_arc_length(two, kStep_s).value(), 1.2 * spectral_arc_length(one, kStep_s).value());
}

TEST(SpectralArcLength, IsNoneWhereNothingMoves) {
  EXPECT_FALSE(spectral_arc_length({}, kStep_s));
  EXPECT_FALSE(spectral_arc_length({1, 2, 1}, kStep_s));
  EXPECT_FALSE(spectral_arc_length(std::vector<double>(100, 0.0), kStep_s));
}

TEST(VelocityPeaks, AreCountedWhereTheyRiseAndFallByWhatIsAsked) {
  EXPECT_EQ(velocity_peaks({}, 0.02), 0);
  EXPECT_EQ(velocity_peaks({0, 0.1, 0.2, 0.1, 0}, 0.02), 1);
  EXPECT_EQ(velocity_peaks({0, 0.2, 0.19, 0.2, 0}, 0.02), 1);
  EXPECT_EQ(velocity_peaks({0, 0.2, 0.1, 0.2, 0}, 0.02), 2);
  EXPECT_EQ(velocity_peaks({0, 0.01, 0, 0.01, 0}, 0.02), 0);
  EXPECT_EQ(velocity_peaks({0.3, 0.2, 0.1}, 0.02), 1) << "one that had begun before";
  EXPECT_EQ(velocity_peaks({0, 0.1, 0.2}, 0.02), 0) << "one that has not ended";
}

}  // namespace
}  // namespace knuckle::operators
