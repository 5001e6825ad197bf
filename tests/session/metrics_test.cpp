// Metrics on records whose answers are known beforehand.
#include "app/session/metrics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "app/session/record_windows.h"
#include "estimation/force_estimator.h"
#include "estimation/observer.h"
#include "tests/session/synthetic_session.h"

namespace knuckle::session {
namespace {

/// Rows in [from, to) seconds.
template <typename Change>
void during(SessionRecord& record, double from_s, double to_s, Change change) {
  for (Sample& s : record.samples)
    if (s.t_s >= from_s - 1e-9 && s.t_s < to_s - 1e-9) change(s);
}

/// 2 s approach, 1 s press, 7 s hold with 2 kN true force and 1.8 N felt, then release.
SessionRecord pressed_record() {
  SessionRecord record = engaged_record(12);
  during(record, 2, 3, [](Sample& s) { s.phase = 1; });
  during(record, 3, 10, [](Sample& s) { s.phase = 2; });
  during(record, 10, 12, [](Sample& s) { s.phase = 3; });
  during(record, 2, 10, [](Sample& s) {
    s.truth.tip_force_N = {-2000, 0};
    s.machine.tip_force_N = {-2000, 0};
    s.hand.felt_N = {-1.8, 0};
  });
  return record;
}

TEST(Metrics, TipErrorIsTakenAgainstTheHandOneLinkDelayAgo) {
  SessionRecord record = engaged_record(5);
  record.link_delay_s = 0.0525;  // between two rows
  during(record, 0, 5, [](Sample& s) {
    s.hand_setpoint_tip_m = {0.2 * s.t_s, 0};
    s.truth.tip_m = {0.2 * (s.t_s - 0.0525), 0.03};  // exactly the delay behind, and 3 cm high
  });
  const Metrics metrics = compute_metrics(record);
  EXPECT_NEAR(metrics.tip_rms_m.value(), 0.03, 1e-9);
  EXPECT_NEAR(metrics.tip_max_m.value(), 0.03, 1e-9);
}

TEST(Metrics, TrackingLeavesOutContactAndTheSecondAfterIt) {
  SessionRecord record = engaged_record(6);
  during(record, 2, 3.9, [](Sample& s) { s.truth.tip_m = {1, 0}; });
  during(record, 2, 3, [](Sample& s) { s.truth.tip_force_N = {-100, 0}; });
  EXPECT_EQ(compute_metrics(record).tip_rms_m, 0.0);
}

TEST(Metrics, DriftIsTheMeanErrorWhileTheHandStandsStill) {
  SessionRecord record = engaged_record(8);
  during(record, 0, 8, [](Sample& s) { s.tip_m = {0.02 * (s.t_s < 4 ? 0 : 1), 0.001 * std::sin(40 * s.t_s)}; });
  EXPECT_NEAR(compute_metrics(record).steady_drift_m.value(), 0.02, 1e-3);
  during(record, 0, 8, [](Sample& s) { s.hand_setpoint_tip_m = {s.t_s, 0}; });
  EXPECT_FALSE(compute_metrics(record).steady_drift_m.has_value());
}

TEST(Metrics, NoLoadForceCountsOnlyLearnedUnloadedFreeRows) {
  SessionRecord record = engaged_record(10);
  during(record, 0, 10, [](Sample& s) { s.machine.tip_force_N = {60, 80}; });
  during(record, 0, 2, [](Sample& s) {
    s.machine.tip_force_N = {9000, 0};
    s.machine.confidence_reasons = estimation::kBiasNotLearned;
  });
  during(record, 5, 6, [](Sample& s) {
    s.machine.tip_force_N = {9000, 0};
    s.truth.payload_kg = 50;
  });
  EXPECT_NEAR(compute_metrics(record).no_load_rms_N.value(), 100, 1e-9);
}

/// What an estimator reports that has the lag it is built with and no other fault, times `gain` and turned.
void report_force(SessionRecord& record, double gain, double turned_rad, double observer_Hz = 3) {
  estimation::FohFilter<PlanarVector> first(8, kRow_s), second(8, kRow_s), observer(observer_Hz, kRow_s);
  const Eigen::Rotation2Dd turn(turned_rad);
  for (Sample& s : record.samples) {
    s.machine.tip_force_N = gain * (turn * observer.step(second.step(first.step(s.truth.tip_force_N))));
  }
}

/// The force along the wall swings while the one into it stays: what a hand does that wanders on a wall which holds the
/// bucket by friction. Nowhere does it stay within 20 % for half a second.
SessionRecord swinging_press() {
  SessionRecord record = pressed_record();
  during(record, 2, 10, [](Sample& s) { s.truth.tip_force_N = {-1500, 1500 * std::sin(2 * M_PI * 0.7 * s.t_s)}; });
  return record;
}

TEST(Metrics, ContactErrorIsMeasuredWhereTheForceNeverRests) {
  SessionRecord record = swinging_press();
  report_force(record, 0.92, -5 * M_PI / 180);
  const Metrics metrics = compute_metrics(record);
  ASSERT_TRUE(metrics.contact_error_rel.has_value());
  EXPECT_NEAR(*metrics.contact_error_rel, 0.08, 1e-9);
  EXPECT_NEAR(metrics.direction_error_deg.value(), 5, 1e-9);
}

TEST(Metrics, ContactErrorCountsLagBeyondTheOneOfTheReportedForce) {
  SessionRecord record = swinging_press();
  report_force(record, 1, 0, 0.5);
  EXPECT_GT(compute_metrics(record).contact_error_rel.value(), 0.1);
  EXPECT_GT(compute_metrics(record).direction_error_deg.value(), 8);
}

TEST(Metrics, ALightPressGivesNoContactErrorAndAShortHardOneDoes) {
  SessionRecord record = pressed_record();
  during(record, 2, 10, [](Sample& s) { s.truth.tip_force_N = {-490, 0}; });
  report_force(record, 0.92, 0);
  EXPECT_FALSE(compute_metrics(record).contact_error_rel.has_value());
  EXPECT_FALSE(compute_metrics(record).direction_error_deg.has_value());
  during(record, 3, 3.3, [](Sample& s) { s.truth.tip_force_N = {-1500, 0}; });
  report_force(record, 0.92, 0);
  EXPECT_NEAR(compute_metrics(record).contact_error_rel.value(), 0.08, 1e-9);
}

TEST(Metrics, ContactErrorLeavesOutWhatIsNotEngaged) {
  SessionRecord record = pressed_record();
  report_force(record, 0.92, 0);
  during(record, 5, 6, [](Sample& s) {
    s.machine.mode = Mode::kHold;
    s.machine.tip_force_N = {9000, 0};
  });
  EXPECT_NEAR(compute_metrics(record).contact_error_rel.value(), 0.08, 1e-9);
}

TEST(Metrics, DetectionRunsFromTrueOnsetToTheContactEvent) {
  SessionRecord record = pressed_record();
  during(record, 2.04, 10, [](Sample& s) { s.machine.contact = true; });
  EXPECT_NEAR(compute_metrics(record).detection_ms.value(), 40, 1e-6);
}

TEST(Metrics, AContactNeverNoticedCountsWithItsWholeLength) {
  EXPECT_NEAR(compute_metrics(pressed_record()).detection_ms.value(), 7995, 1e-6);
}

TEST(Metrics, PayloadIsReadAtTheEndOfWeighing) {
  SessionRecord record = engaged_record(5);
  during(record, 3, 4, [](Sample& s) {
    s.phase = 5;
    s.truth.payload_kg = 50;
    s.machine.payload_kg = s.t_s < 3.9 ? 10 : 47;
    s.machine.payload_sigma_kg = 1;
  });
  const Metrics metrics = compute_metrics(record);
  EXPECT_EQ(metrics.payload_truth_kg, 50);
  EXPECT_EQ(metrics.payload_estimate_kg, 47);
  EXPECT_EQ(metrics.payload_error_kg, 3);
}

TEST(Metrics, APayloadThatIsTakenForContactIsAnError) {
  SessionRecord record = pressed_record();
  during(record, 0, 20, [](Sample& s) {
    s.truth.payload_kg = 50;
    s.machine.payload_sigma_kg = s.t_s < 1 ? 40 : 1;
    s.machine.payload_kg = s.t_s < 1 ? 0 : 49;  // unsure at first, in free air
  });
  EXPECT_EQ(compute_metrics(record).payload_contact_error_kg, 1);
  during(record, 4, 4.1, [](Sample& s) { s.machine.payload_kg = 30; });
  EXPECT_EQ(compute_metrics(record).payload_contact_error_kg, 20);
  EXPECT_FALSE(compute_metrics(pressed_record()).payload_contact_error_kg) << "no load";
  EXPECT_FALSE(compute_metrics(engaged_record(5)).payload_contact_error_kg);
}

TEST(Metrics, ContactLossesAreGapsOverFiftyMilliseconds) {
  SessionRecord record = pressed_record();
  const auto lift = [](Sample& s) { s.truth.tip_force_N.setZero(); };
  during(record, 4, 4.04, lift);  // bounce
  during(record, 5, 5.06, lift);
  during(record, 6, 6.5, lift);
  EXPECT_EQ(compute_metrics(record).contact_losses, 2);
}

TEST(Metrics, AWallThatBreaksIsNoContactLoss) {
  SessionRecord record = pressed_record();
  during(record, 8, 10, [](Sample& s) { s.truth.tip_force_N.setZero(); });
  EXPECT_EQ(compute_metrics(record).contact_losses, 1);
  record.events.push_back({8.0, "piece broke"});
  EXPECT_EQ(compute_metrics(record).contact_losses, 0);
  EXPECT_EQ(compute_metrics(record).pieces_broken, 1);
}

TEST(Metrics, RiseAndSettlingRunFromTrueForceToFeltForce) {
  SessionRecord record = pressed_record();
  during(record, 2, 2.2, [](Sample& s) { s.hand.felt_N.setZero(); });
  during(record, 2.3, 2.6, [](Sample& s) { s.hand.felt_N = {-2.4, 0}; });  // overshoot
  const Metrics metrics = compute_metrics(record);
  EXPECT_NEAR(metrics.rise_t90_s.value(), 0.2, 1e-9);
  EXPECT_NEAR(metrics.settle_s.value(), 0.6, 1e-9);
}

TEST(Metrics, APressThatIsNeverFeltOrNeverSettlesMeetsNoBound) {
  SessionRecord record = pressed_record();
  during(record, 2, 10, [](Sample& s) { s.hand.felt_N = {-0.05, 0}; });
  EXPECT_FALSE(all_passed(evaluate({{"rise_t90_s", {}, 1e9}}, compute_metrics(record))));
  EXPECT_FALSE(all_passed(evaluate({{"settle_s", {}, 1e9}}, compute_metrics(record))));
  record = pressed_record();
  during(record, 9.9, 10, [](Sample& s) { s.hand.felt_N = {-2.4, 0}; });  // limit cycle to the end
  EXPECT_TRUE(all_passed(evaluate({{"rise_t90_s", {}, 1}}, compute_metrics(record))));
  EXPECT_FALSE(all_passed(evaluate({{"settle_s", {}, 1e9}}, compute_metrics(record))));
}

TEST(Metrics, TheLargestEstimateInFreeMotionCountsOnlyWhereItIsBelieved) {
  SessionRecord record = pressed_record();
  during(record, 0, 12, [](Sample& s) { s.machine.confidence = 1; });
  during(record, 1, 1.3, [](Sample& s) { s.machine.tip_force_N = {300, -400}; });
  EXPECT_NEAR(compute_metrics(record).free_estimate_peak_N.value(), 500, 1e-9);
  during(record, 1, 1.3, [](Sample& s) { s.machine.confidence = 0.5; });
  EXPECT_LT(compute_metrics(record).free_estimate_peak_N.value(), 300) << "of low confidence, and of a true press";
}

TEST(Metrics, FalseContactIsAShareOfFreeMotion) {
  SessionRecord record = pressed_record();  // free: 2 s before it and the last second
  EXPECT_EQ(compute_metrics(record).false_contact_share, 0);
  during(record, 1, 1.3, [](Sample& s) { s.machine.contact = true; });
  during(record, 2, 10.9, [](Sample& s) { s.machine.contact = true; });  // true, and just after
  EXPECT_NEAR(compute_metrics(record).false_contact_share.value(), 0.1, 1e-3);
}

TEST(Metrics, HoldIsJudgedByErrorAndPeakToPeak) {
  SessionRecord record = pressed_record();
  during(record, 8, 10, [](Sample& s) { s.hand.felt_N.x() += 0.1 * (static_cast<int>(s.t_s * 20) % 2 == 0 ? 1 : -1); });
  const Metrics metrics = compute_metrics(record);
  EXPECT_NEAR(metrics.hold_error_N.value(), 0.2, 1e-3);
  EXPECT_NEAR(metrics.hold_peak_to_peak_N.value(), 0.2, 1e-9);
}

TEST(Metrics, AHoldsErrorAndTrueSwingAreAllowedATenthOfTheForceAndALeastValue) {
  // Error of the felt force: 0.3 N are allowed to 3 N, a tenth above. Swing of the true one: 150 N to 1.5 kN.
  for (const auto& [true_N, error_share, swing_share] : {std::tuple{1000.0, 0.15 / 0.3, 240 / 150.0},
                                                         {2000.0, 0.15 / 0.3, 240 / 200.0},
                                                         {6000.0, 0.15 / 0.6, 240 / 600.0}}) {
    SessionRecord record = pressed_record();
    during(record, 2, 10, [&](Sample& s) {
      const double swing_N = static_cast<int>(s.t_s * 20) % 2 == 0 ? 120 : -120;
      s.truth.tip_force_N = {-true_N + swing_N, 0};
      s.hand.felt_N = {record.force_scale * (-true_N + swing_N) + 0.15, 0};
    });
    const Metrics metrics = compute_metrics(record);
    EXPECT_NEAR(metrics.hold_error_share.value(), error_share, 1e-3) << true_N;
    EXPECT_NEAR(metrics.hold_true_swing_share.value(), swing_share, 1e-3) << true_N;
  }
  EXPECT_FALSE(compute_metrics(SessionRecord{}).hold_true_swing_share);
}

TEST(Metrics, DragIsFeltForceInFreeMotion) {
  SessionRecord record = pressed_record();
  during(record, 0, 2, [](Sample& s) { s.hand.felt_N = {0, 0.1}; });
  during(record, 10, 12, [](Sample& s) { s.hand.felt_N = {s.t_s < 10.9 ? 5.0 : 0.1, 0}; });
  EXPECT_NEAR(compute_metrics(record).drag_rms_N.value(), 0.1, 1e-6);
  // The weight of a load is no drag.
  for (std::size_t i = record.samples.size() / 2; i < record.samples.size(); ++i) {
    record.samples[i].truth.payload_kg = 50;
    record.samples[i].hand.felt_N = {0, -0.5};
  }
  EXPECT_NEAR(compute_metrics(record).drag_rms_N.value(), 0.1, 1e-6);
}

TEST(Metrics, SlewIsThePeakBetweenRowsAndNeverLessThanTheRowsShow) {
  SessionRecord record = engaged_record(2);
  record.samples[50].felt_slew_N_per_ms = 0.3;
  EXPECT_EQ(compute_metrics(record).max_slew_N_per_ms, 0.3);
  during(record, 1, 2, [](Sample& s) { s.hand.felt_N = {2.5, 0}; });  // 2.5 N in one row of 5 ms
  EXPECT_NEAR(compute_metrics(record).max_slew_N_per_ms.value(), 0.5, 1e-9);
}

TEST(Metrics, NetEnergyIsTheMostEverGivenToTheHand) {
  SessionRecord record = engaged_record(3);
  during(record, 1, 2, [](Sample& s) { s.hand.energy_J = 0.02; });
  during(record, 2, 3, [](Sample& s) { s.hand.energy_J = -1; });
  EXPECT_EQ(compute_metrics(record).net_energy_J, 0.02);
  const PortEnergies ports = port_energies(record);
  EXPECT_NEAR(ports.hand_in_J, 0.02, 1e-12);
  EXPECT_NEAR(ports.hand_out_J, 1.02, 1e-12);
}

TEST(Metrics, PumpShortageIsAShareOfEngagedTime) {
  SessionRecord record = engaged_record(10);
  during(record, 4, 5, [](Sample& s) { s.truth.pump_flow_share = 0.5; });
  EXPECT_NEAR(compute_metrics(record).pump_short_share.value(), 0.1, 1e-3);
}

TEST(Metrics, ModesAreListedInOrderWithTheirLengths) {
  SessionRecord record = engaged_record(4);
  during(record, 0, 1, [](Sample& s) { s.machine.mode = Mode::kReady; });
  const auto visits = modes_visited(record);
  ASSERT_EQ(visits.size(), 2u);
  EXPECT_EQ(visits[0].mode, Mode::kReady);
  EXPECT_NEAR(visits[1].at_s, 1, 1e-9);
}

TEST(Metrics, TimesToNeutralAreThoseOfTheWorstFault) {
  SessionRecord record = engaged_record(3);
  record.faults = {{{ReasonCode::kLinkLost, 0, 200, 150}, 1.2, 1.0, 1.15, 1.25},
                   {{ReasonCode::kNodeSilent, 0, 1, 1}, 2.1, 2.0, 2.19, 2.20}};
  const Metrics metrics = compute_metrics(record);
  EXPECT_EQ(metrics.faults, 2);
  EXPECT_NEAR(metrics.command_neutral_ms.value(), 190, 1e-6);
  EXPECT_NEAR(metrics.spool_neutral_ms.value(), 250, 1e-6);
}

TEST(Metrics, AFaultThatNeverBecameNeutralMeetsNoBound) {
  SessionRecord record = engaged_record(3);
  record.faults = {{{ReasonCode::kLinkLost, 0, 200, 150}, 1.2, 1.0, 1.15, 1.25},
                   {{ReasonCode::kNodeSilent, 0, 1, 1}, 2.1, 2.0, 0, 0}};
  EXPECT_FALSE(all_passed(evaluate({{"command_neutral_ms", {}, 1e9}}, compute_metrics(record))));
  EXPECT_FALSE(all_passed(evaluate({{"spool_neutral_ms", {}, 1e9}}, compute_metrics(record))));
  record.faults.back() = {{ReasonCode::kLoopOverrun, 0, 600, 50}, 2.1, 2.0, 0, 2.2, true};
  EXPECT_NEAR(compute_metrics(record).command_neutral_ms.value(), 150, 1e-6)
      << "a controller that hangs commands nothing";
}

TEST(Metrics, NothingToMeasureOnIsNullAndNotZero) {
  const Metrics metrics = compute_metrics(SessionRecord{});
  for (const MetricEntry& entry : metric_table()) {
    if (entry.group == "session") continue;
    EXPECT_FALSE((metrics.*entry.member).has_value()) << entry.name;
  }
}

TEST(MetricsOfTruth, FeelingNothingIsAnErrorOfOne) {
  SessionRecord record = engaged_record(6);
  during(record, 2, 4, [](Sample& s) { s.truth.tip_force_N = {-2000, 0}; });
  const Metrics metrics = compute_metrics(record);
  EXPECT_NEAR(metrics.felt_error_rel.value(), 1, 1e-9);
  EXPECT_NEAR(metrics.felt_error_rms_N.value(), 2 / std::sqrt(3), 1e-2);
  EXPECT_NEAR(metrics.felt_error_worst_N.value(), 2, 1e-9);
  EXPECT_NEAR(metrics.felt_onset_ms.value(), 2000, 10);
}

TEST(MetricsOfTruth, FeelingTheScaledForceOneLinkDelayLateIsNoError) {
  SessionRecord record = engaged_record(6);
  record.link_delay_s = 0.1;
  during(record, 2, 4, [](Sample& s) { s.truth.tip_force_N = {-2000, 300}; });
  during(record, 2.1, 4.1, [](Sample& s) { s.hand.felt_N = {-2, 0.3}; });
  const Metrics metrics = compute_metrics(record);
  EXPECT_LT(metrics.felt_error_rel.value(), 0.1);  // but for a row at each edge
  EXPECT_LE(metrics.felt_onset_ms.value(), 5 + 1e-6);
  EXPECT_EQ(metrics.unfelt_s.value(), 0);
}

TEST(MetricsOfTruth, CarriedLoadIsToBeFelt) {
  SessionRecord record = engaged_record(6);
  during(record, 2, 6, [](Sample& s) {
    s.truth.payload_kg = 100;
    s.truth.weight_N = {0, -980.665};
  });
  EXPECT_NEAR(compute_metrics(record).felt_error_rel.value(), 1, 1e-9);
  during(record, 2, 6, [](Sample& s) { s.hand.felt_N = {0, -0.980665}; });
  EXPECT_LT(compute_metrics(record).felt_error_rel.value(), 0.1);
}

TEST(MetricsOfTruth, ForceThatNobodyIsToldOfCountsFromThreeTenthsOfASecondOn) {
  SessionRecord record = engaged_record(10);
  during(record, 2, 2.25, [](Sample& s) { s.truth.tip_force_N = {-9000, 0}; });  // a knock
  EXPECT_EQ(compute_metrics(record).unfelt_s.value(), 0);
  during(record, 4, 5, [](Sample& s) {
    s.truth.tip_force_N = {-4500, 0};
    s.hand.felt_N = {-2.6, 0};  // 1.9 N short: bad, but told
  });
  EXPECT_EQ(compute_metrics(record).unfelt_s.value(), 0);
  during(record, 6, 7, [](Sample& s) {
    s.truth.tip_force_N = {-4500, 0};
    s.hand.felt_N = {-2.4, 0};
  });
  EXPECT_NEAR(compute_metrics(record).unfelt_s.value(), 1, 0.01);
}

TEST(MetricsOfTruth, OfUnfeltTimeThatIsShowableInWhichTheDevicesBestIsAboveWhatIsFelt) {
  SessionRecord record = engaged_record(12);
  const auto showable_s = [&record](double device_limit_N) {
    record.device_limit_N = device_limit_N;
    return compute_metrics(record).unfelt_showable_s.value();
  };
  during(record, 2, 3, [](Sample& s) {
    s.truth.tip_force_N = {-15000, 0};
    s.hand.felt_N = {-7.5, 0};
  });
  EXPECT_NEAR(compute_metrics(record).unfelt_s.value(), 1, 0.01);
  EXPECT_EQ(showable_s(8), 0);
  EXPECT_NEAR(showable_s(11), 1, 0.03);
  during(record, 5, 6, [](Sample& s) {
    s.truth.tip_force_N = {-2100, 0};
    s.hand.felt_N = {0, 0};
  });
  EXPECT_NEAR(compute_metrics(record).unfelt_s.value(), 2, 0.02);
  EXPECT_NEAR(showable_s(8), 1 - std::log(2.1 / 0.1) / (2 * M_PI * 20), 0.006) << "above 2 N at 20 Hz";
  during(record, 8, 8.29, [](Sample& s) { s.truth.tip_force_N = {-6000, 0}; });  // too short to count
  EXPECT_NEAR(showable_s(8), 1 - std::log(2.1 / 0.1) / (2 * M_PI * 20), 0.006);
}

TEST(MetricsOfTruth, HammeringIsASwingAndAHandThatPressesSlowlyIsNone) {
  SessionRecord record = engaged_record(8);
  during(record, 2, 6, [](Sample& s) { s.truth.tip_force_N = {-1000 - 900 * std::sin(2 * M_PI * 0.5 * s.t_s), 0}; });
  const double slow = compute_metrics(record).contact_swing_N.value();
  EXPECT_LT(slow, 900);
  during(record, 2, 6, [](Sample& s) { s.truth.tip_force_N = {-1000 - 900 * std::sin(2 * M_PI * 8 * s.t_s), 0}; });
  EXPECT_NEAR(compute_metrics(record).contact_swing_N.value(), 1800, 40);
  EXPECT_EQ(compute_metrics(record).contact_bounces.value(), 0);
}

TEST(MetricsOfTruth, BouncesAreCountedInAllContact) {
  SessionRecord record = engaged_record(8);
  EXPECT_FALSE(compute_metrics(record).contact_bounces);
  for (const double at : {2.0, 2.3, 2.6, 5.0})
    during(record, at, at + 0.2, [](Sample& s) { s.truth.tip_force_N = {-1000, 0}; });
  EXPECT_EQ(compute_metrics(record).contact_bounces.value(), 2);
}

TEST(MetricsOfTruth, FeltForceInFreeAirIsTakenAtItsPeak) {
  SessionRecord record = engaged_record(8);
  during(record, 2, 3, [](Sample& s) { s.truth.tip_force_N = {-2000, 0}; });
  during(record, 3, 3.9, [](Sample& s) { s.hand.felt_N = {-2, 0}; });  // within a second of the contact: not yet free
  during(record, 6, 6.1, [](Sample& s) { s.hand.felt_N = {0, 1.2}; });
  during(record, 4.5, 5, [](Sample& s) { s.truth.payload_kg = 50; });
  during(record, 4.5, 5.9, [](Sample& s) { s.hand.felt_N = {0, -3}; });  // nor within a second of a load
  EXPECT_NEAR(compute_metrics(record).free_felt_peak_N.value(), 1.2, 1e-12);
}

TEST(MetricsOfTruth, WallsAtTheJointsEndsAreNoError) {
  SessionRecord record = engaged_record(8);
  record.link_delay_s = 0.2;
  record.joint_end_high_rad = JointVector::Constant(1);
  during(record, 3.0, 3.5, [](Sample& s) { s.hand.felt_N = {4, 0}; });
  during(record, 6.0, 6.5, [](Sample& s) { s.hand.felt_N = {0.5, 0}; });
  during(record, 7.0, 8.0, [](Sample& s) { s.truth.tip_force_N = {-2000, 0}; });
  const double blamed = compute_metrics(record).felt_error_worst_N.value();
  EXPECT_NEAR(compute_metrics(record).free_felt_peak_N.value(), 4, 1e-12);
  during(record, 3.2, 3.7, [](Sample& s) { s.machine.setpoint_rad[1] = 1.01; });  // as received
  EXPECT_NEAR(compute_metrics(record).free_felt_peak_N.value(), 0.5, 1e-12);
  EXPECT_LT(compute_metrics(record).felt_error_worst_N.value(), blamed);
  record.link_delay_s = 0;  // then half of the force was not at the end
  EXPECT_NEAR(compute_metrics(record).free_felt_peak_N.value(), 4, 1e-12);
}

TEST(MetricsOfTruth, PeakOfEachPressIsJudgedByWhatThatPressAsksFor) {
  SessionRecord record = pressed_record();  // 2 kN in press (phase 1), its hold and the phase after it
  EXPECT_FALSE(compute_metrics(record).peak_over_asked) << "no press asked for a certain force";
  record.asked_N = {0, 1600, 0, 0};
  record.phases = {"approach", "press", "release"};
  during(record, 3, 10, [](Sample& s) { s.phase = 9; });  // holds
  during(record, 10, 12, [](Sample& s) { s.phase = 2; });
  during(record, 11, 11.5, [](Sample& s) { s.truth.tip_force_N = {-9000, 0}; });  // no press
  EXPECT_NEAR(compute_metrics(record).peak_over_asked.value(), 1.25, 1e-12);
  during(record, 5, 5.1, [](Sample& s) { s.truth.tip_force_N = {-4000, 0}; });
  EXPECT_NEAR(compute_metrics(record).peak_over_asked.value(), 2.5, 1e-12);
}

TEST(Metrics, AfterAFaultTheTrueForceIsTakenFromWhereItWasAndTheFeltOneByItsSteps) {
  SessionRecord record = engaged_record(8);
  for (Sample& s : record.samples) {
    const bool late = s.t_s > 1.5;
    s.truth.tip_force_N = PlanarVector(s.t_s < 0.5 ? -9000 : late ? -2300 : -2000, 0);
    s.hand.felt_N = PlanarVector(s.t_s < 0.5 ? -9 : -2, 0);
    if (s.t_s > 6.5) s.truth.tip_force_N.x() = -5000;  // later than a fault has effects
  }
  EXPECT_FALSE(compute_metrics(record).fault_rise_N);
  EXPECT_FALSE(compute_metrics(record).fault_slew_N_per_ms);
  record.injected_s = {1.0};
  EXPECT_NEAR(*compute_metrics(record).fault_rise_N, 300, 1e-9);
  EXPECT_NEAR(*compute_metrics(record).fault_slew_N_per_ms, 0, 1e-9);
  record.samples[300].felt_slew_N_per_ms = 0.7;
  EXPECT_NEAR(*compute_metrics(record).fault_slew_N_per_ms, 0.7, 1e-9);
}

TEST(MetricsOfTruth, ForceFeltTheWrongWayRoundIsNotTold) {
  SessionRecord record = engaged_record(6);
  during(record, 2, 3, [](Sample& s) {
    s.truth.tip_force_N = {-3000, 0};
    s.hand.felt_N = {3, 0};
  });
  EXPECT_NEAR(compute_metrics(record).unfelt_s.value(), 1, 0.01);
  EXPECT_NEAR(compute_metrics(record).felt_onset_ms.value(), 1000, 10);
}

TEST(MetricsOfTruth, TouchOfALoadedBucketHasAnOnsetOfItsOwn) {
  SessionRecord record = engaged_record(10);
  during(record, 1, 10, [](Sample& s) {
    s.truth.payload_kg = 100;
    s.truth.weight_N = {0, -980};
    s.hand.felt_N = {0, -0.98};
  });
  EXPECT_NEAR(compute_metrics(record).felt_onset_ms.value(), 0, 5 + 1e-6);
  during(record, 5, 8, [](Sample& s) {
    s.truth.tip_force_N = {-2000, 0};
    if (s.t_s > 5.4) s.hand.felt_N = {-2, -0.98};
  });
  EXPECT_NEAR(compute_metrics(record).felt_onset_ms.value(), 400, 10);
}

TEST(Metrics, SayWhenTheyWereAtTheirWorst) {
  SessionRecord record = engaged_record(12);
  record.force_scale = 1e-3;
  for (Sample& s : record.samples) {
    const double t = s.t_s;
    if (t >= 4 && t < 6) s.truth.tip_force_N = {-5000, 0};  // and nothing is felt
    if (t >= 8 && t < 8.4) s.truth.tip_force_N = {-3000, 0};
    if (t >= 8.5 && t < 9) s.truth.tip_force_N = {-3000, 0};
    if (t >= 8 && t < 9) s.hand.felt_N = {-3, 0};
  }
  record.samples[1000].truth.tip_force_N = {-7000, 0};                   // at 5 s
  record.samples[400].hand.felt_N = {0.2, 0};                            // at 2 s, in free motion
  record.samples[500].truth.tip_m = {1, 0};                              // at 2.5 s
  record.faults = {{{}, 10, 10, 10.1, 10.2}, {{}, 11, 11, 11.3, 11.1}};  // each the slower one once
  record.events = {{8.2, "piece_broke"}};
  const Metrics metrics = compute_metrics(record);
  const std::pair<Metric Metrics::*, double> worst_at[] = {{&Metrics::peak_N, 5},
                                                           {&Metrics::unfelt_s, 4},
                                                           {&Metrics::felt_onset_ms, 4},
                                                           {&Metrics::free_felt_peak_N, 2},
                                                           {&Metrics::tip_max_m, 2.5},
                                                           {&Metrics::tip_rms_m, 2.5},
                                                           {&Metrics::contact_bounces, 8.4},
                                                           {&Metrics::command_neutral_ms, 11},
                                                           {&Metrics::spool_neutral_ms, 10},
                                                           {&Metrics::pieces_broken, 8.2},
                                                           {&Metrics::faults, 11}};
  for (const auto& [metric, at_s] : worst_at) {
    EXPECT_NEAR((metrics.*metric).at_s.value_or(-1), at_s, 0.006)
        << std::ranges::find(metric_table(), metric, &MetricEntry::member)->name;
  }
  EXPECT_EQ(metrics.engaged_s.at_s, std::nullopt) << "a sum has no such moment";
}

}  // namespace
}  // namespace knuckle::session
