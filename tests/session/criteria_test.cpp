// Criteria at their edges, which kind decides and when, and the digest of a session.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include "app/cli/digest.h"
#include "app/session/metrics.h"
#include "app/session/options.h"
#include "app/session/session_result.h"
#include "app/session/session_setup.h"
#include "tests/session/synthetic_session.h"

namespace knuckle::session {
namespace {

TEST(Criteria, EachBoundIsJudgedAtItsEdge) {
  Metrics metrics;
  metrics.tip_rms_m = 0.05;
  EXPECT_TRUE(all_passed(evaluate({{"tip_rms_m", 0.05, 0.05}}, metrics)));
  EXPECT_FALSE(all_passed(evaluate({{"tip_rms_m", {}, 0.0499}}, metrics)));
  EXPECT_FALSE(all_passed(evaluate({{"tip_rms_m", 0.0501, {}}}, metrics)));
}

TEST(Criteria, WhatWasNotMeasuredOrIsNotANumberFails) {
  Metrics metrics;
  EXPECT_FALSE(all_passed(evaluate({{"hold_error_N", {}, 1}}, metrics)));
  metrics.hold_error_N = std::nan("");
  EXPECT_FALSE(all_passed(evaluate({{"hold_error_N", {}, 1}}, metrics)));
}

SessionResult with_two_faults(CriterionKind kind, double most) {
  SessionResult session = synthetic_session();
  session.record.faults = {{{}, 20, 20, 20.1, 20.2}, {{}, 30, 30, 30.1, 30.2}};
  session.criteria = {{"faults", {}, most, kind}};
  return session;
}

TEST(Verdict, OfEachKindDecidesWhereItShould) {
  struct Case {
    CriterionKind kind;
    bool requirements_decide, passes_when_missed;
  };
  for (const Case& c : {Case{CriterionKind::kSafety, false, false}, Case{CriterionKind::kSafety, true, false},
                        Case{CriterionKind::kCriterion, false, false}, Case{CriterionKind::kCriterion, true, false},
                        Case{CriterionKind::kRequirement, false, true}, Case{CriterionKind::kRequirement, true, false},
                        Case{CriterionKind::kGoal, false, true}, Case{CriterionKind::kGoal, true, true}}) {
    for (const double most : {1.0, 2.0}) {
      SessionResult session = with_two_faults(c.kind, most);
      session.requirements_decide = c.requirements_decide;
      const Judged judged = judge(session);
      const bool missed = most < 2;
      EXPECT_EQ(judged.criteria.at(0).met, !missed) << "shown, whether it decides or not";
      EXPECT_EQ(judged.passed, !missed || c.passes_when_missed)
          << "kind " << static_cast<int>(c.kind) << ", most " << most << ", asked " << c.requirements_decide;
    }
  }
}

TEST(Verdict, OfASessionCutShortIsNoneUntilSomethingUnsafeHappened) {
  SessionResult session = with_two_faults(CriterionKind::kSafety, 2);
  session.record.cut_short = true;
  for (const CriterionKind kind : {CriterionKind::kCriterion, CriterionKind::kRequirement, CriterionKind::kGoal})
    session.criteria.push_back({"faults", {}, 1, kind});
  session.criteria.push_back({"faults", 4, {}, CriterionKind::kSafety});             // they may still come
  session.criteria.push_back({"resumed_by_itself", {}, 0, CriterionKind::kSafety});  // none so far
  const Judged judged = judge(session);
  EXPECT_EQ(judged.passed, std::nullopt);
  for (const CriterionResult& result : judged.criteria) EXPECT_EQ(result.met, std::nullopt) << result.name;
  session.record.resumed_by_itself = 1;
  EXPECT_EQ(judge(session).passed, false);
}

TEST(Verdict, OfAFaultAtTheEndOfASessionCutShortWaitsForItsBound) {
  for (const auto& [fault_s, passed] : {std::pair{35.9, std::optional<bool>()}, {35.0, std::optional(false)}}) {
    SessionResult session = synthetic_session();
    session.record.cut_short = true;
    session.record.faults = {{{}, fault_s, fault_s, 0, 0}};  // not neutral yet
    session.criteria = {{"spool_neutral_ms", {}, 320, CriterionKind::kSafety}};
    EXPECT_EQ(judge(session).passed, passed) << fault_s;
    session.record.cut_short = false;
    EXPECT_EQ(judge(session).passed, false) << "never";
  }
}

TEST(Verdict, SaysWhenAndInWhichPhaseEachValueWasWorst) {
  SessionResult session = synthetic_session();
  session.record.samples[5000].hand.felt_N = {9, 9};  // at 25 s
  session.record.faults = {{{}, 20, 20, 20.1, 20.2}};
  session.criteria = {{"max_slew_N_per_ms", {}, 0.5}, {"faults", {}, 0}, {"engaged_s", 1, {}}, {"faults", 4, {}}};
  const Judged judged = judge(session);
  EXPECT_NEAR(judged.criteria.at(0).at_s.value(), 25, 0.006);
  EXPECT_EQ(judged.criteria.at(0).phase, "scoop");
  EXPECT_EQ(judged.criteria.at(1).at_s, 20);
  EXPECT_EQ(judged.criteria.at(1).phase, "release");
  EXPECT_EQ(judged.criteria.at(2).at_s, std::nullopt) << "a sum has no worst moment";
  EXPECT_EQ(judged.criteria.at(2).phase, "");
  EXPECT_EQ(judged.criteria.at(3).at_s, std::nullopt) << "too few: no moment shows what is missing";
}

TEST(Criteria, AMetricThatIsNoNumberIsTheWorstWheneverItComes) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const auto& values : {std::array{1.0, nan, 3.0}, {nan, 1.0, 3.0}, {1.0, 3.0, nan}}) {
    Metric worst;
    for (const double value : values) keep_worst(worst, value, 1);
    EXPECT_TRUE(std::isnan(worst.value()));
  }
}

TEST(Verdict, IsThereWhereTheDurationLeavesTheScenarioItsTime) {
  SimulateOptions options;
  options.scenario = "free_motion";
  EXPECT_FALSE(load_session(options).shortened);
  options.duration_s = 3600;
  EXPECT_FALSE(load_session(options).shortened);
  options.duration_s = 3;
  EXPECT_TRUE(load_session(options).shortened);
}

TEST(StockSetUp, IsTheDefaultMachineAndNothingElseChanged) {
  const auto with = [](const std::function<void(SimulateOptions&)>& change) {
    SimulateOptions options;
    change(options);
    return is_stock(options);
  };
  EXPECT_TRUE(with([](auto&) {}));
  EXPECT_TRUE(with([](auto& o) { o.scenario = "/srv/my.toml"; }));
  EXPECT_TRUE(with([](auto& o) { o.machine = "solar015"; }));
  EXPECT_TRUE(with([](auto& o) { o.seed = 201; }));
  EXPECT_TRUE(with([](auto& o) { o.report = o.json = o.csv = o.candump = o.log = o.flights = "somewhere"; }));
  EXPECT_FALSE(with([](auto& o) { o.machine = "compact080"; }));
  EXPECT_FALSE(with([](auto& o) { o.device = "knuckle1"; }));
  EXPECT_FALSE(with([](auto& o) { o.truth = "truth.toml"; }));
  EXPECT_FALSE(with([](auto& o) { o.family = "worn"; }));
  EXPECT_FALSE(with([](auto& o) { o.machine_seed = 1; }));
  EXPECT_FALSE(with([](auto& o) { o.delay_ms = 1; }));
  EXPECT_FALSE(with([](auto& o) { o.impairment = "lte"; }));
  EXPECT_FALSE(with([](auto& o) { o.control = "echo"; }));
  EXPECT_FALSE(with([](auto& o) { o.operator_name = "relaxed"; }));
  EXPECT_FALSE(with([](auto& o) { o.person = "rough"; }));
  EXPECT_FALSE(with([](auto& o) { o.duration_s = 300; }));
  EXPECT_FALSE(with([](auto& o) { o.realtime = true; }));
  EXPECT_FALSE(with([](auto& o) { o.assist_stop_on_object = true; }));
}

TEST(SessionDigest, IsSha256OfValuesAndSeesEveryOne) {
  EXPECT_EQ(cli::Digest().finish(), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  const FrameLog frames{{Time{1ns}, CanFrame{0x181, 2, {1, 2}}}};
  const SessionDigest base = digest_of({Sample{}}, frames);
  EXPECT_EQ(base.whole, digest_of({Sample{}}, frames).whole);
  Sample changed;
  changed.felt_slew_N_per_ms = 1e-300;
  const SessionDigest other = digest_of({changed}, frames);
  EXPECT_NE(base.whole, other.whole);
  ASSERT_EQ(base.lines.size(), other.lines.size());
  for (std::size_t i = 0; i < base.lines.size(); ++i)
    EXPECT_EQ(base.lines[i].digest == other.lines[i].digest, base.lines[i].field != "felt_slew_N_per_ms")
        << base.lines[i].field;
  EXPECT_NE(digest_of({Sample{}}, {{Time{1ns}, CanFrame{0x181, 2, {1, 3}}}}).whole, base.whole);
}

}  // namespace
}  // namespace knuckle::session
