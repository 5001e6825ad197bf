#include "app/session/link_file.h"

#include <gtest/gtest.h>

#include <vector>

#include "app/session/session_setup.h"
#include "machine/load.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"
#include "transport/impaired_link.h"

namespace knuckle::session {
namespace {

const std::string kHead = "name = \"test\"\ndescription = \"of a test\"\n";

LinkFile parsed(const std::string& keys) {
  return parse_link(kHead + keys, "test.toml");
}

std::string refusal(const std::string& keys) {
  return test::refusal([&] { return parsed(keys); });
}

TEST(LinkFile, LeavesOffWhatIsNotThere) {
  const LinkFile file = parsed("");
  EXPECT_EQ(file.name, "test");
  EXPECT_EQ(file.source, "test.toml");
  for (const LinkImpairment* link : {&file.to_machine, &file.to_operator}) {
    ImpairmentModel model(*link, 1);
    const auto fate = model.send(100, Time(1s));
    ASSERT_EQ(fate.copies, 1U);
    EXPECT_EQ(fate.arrivals[0], Time(1s));
  }
}

TEST(LinkFile, ReadsEveryKeyInItsUnit) {
  const LinkFile file = parsed(R"(
[to_machine]
delay_ms = 20
jitter = { distribution = "uniform", half_width_ms = 3 }
slow_jitter = { distribution = "pareto", deviation_ms = 4, correlation_s = 0.7 }
in_order = true
loss = 0.01
burst_loss = { mean_good_s = 5, mean_bad_ms = 40, loss_in_good = 0.001, loss_in_bad = 0.8 }
random_outages = { per_s = 0.2, length_ms = 70 }
duplication = 0.02
reorder_delay_ms = 6
second_path_delay_ms = 250
rate_limit = { rate_kBps = 100, queue_kB = 64 }
[to_operator]
jitter = { distribution = "normal", deviation_ms = 3 }
reordering = 0.03
reorder_delay_ms = 7
[[outage]]
direction = "both"
at_s = 10
length_ms = 300
[[outage]]
direction = "to_operator"
at_s = 20
length_ms = 100
every_s = 5
[[address_change]]
direction = "to_machine"
at_s = 30
[[change]]
at_s = 40
[change.to_operator]
delay_ms = 90
)");
  const LinkImpairment& up = file.to_machine;
  EXPECT_EQ(up.delay, 20ms);
  EXPECT_EQ(up.jitter, 3ms);
  EXPECT_EQ(up.jitter_shape, JitterShape::kUniform);
  EXPECT_EQ(up.slow_jitter, 4ms);
  EXPECT_EQ(up.slow_jitter_shape, JitterShape::kPareto);
  EXPECT_EQ(up.jitter_time, 700ms);
  EXPECT_TRUE(up.in_order);
  EXPECT_EQ(up.loss, 0.01);
  EXPECT_EQ(up.burst_loss.mean_good, 5s);
  EXPECT_EQ(up.burst_loss.mean_bad, 40ms);
  EXPECT_EQ(up.burst_loss.loss_in_good, 0.001);
  EXPECT_EQ(up.burst_loss.loss_in_bad, 0.8);
  EXPECT_EQ(up.bursts_per_s, 0.2);
  EXPECT_EQ(up.burst_length, 70ms);
  EXPECT_EQ(up.duplication, 0.02);
  EXPECT_EQ(up.reorder_delay, 6ms);
  EXPECT_EQ(up.second_path, 250ms);
  EXPECT_EQ(up.rate_Bps, 100'000);
  EXPECT_EQ(up.queue_B, 64'000U);
  ASSERT_EQ(up.outages.size(), 1U);
  EXPECT_EQ(up.outages[0].from, Time(10s));
  EXPECT_EQ(up.outages[0].length, 300ms);
  EXPECT_EQ(up.address_changes, std::vector<Time>{Time(30s)});
  EXPECT_TRUE(up.changes.empty());
  const LinkImpairment& down = file.to_operator;
  EXPECT_EQ(down.jitter_shape, JitterShape::kNormal);
  EXPECT_EQ(down.jitter, 3ms);
  EXPECT_EQ(down.reordering, 0.03);
  EXPECT_EQ(down.reorder_delay, 7ms);
  ASSERT_EQ(down.outages.size(), 2U);
  EXPECT_EQ(down.outages[1].every, 5s);
  ASSERT_EQ(down.changes.size(), 1U);
  EXPECT_EQ(down.changes[0].at, Time(40s));
  EXPECT_EQ(down.changes[0].to.delay, 90ms);
  EXPECT_EQ(down.changes[0].to.reordering, 0) << "a change replaces everything";
}

TEST(LinkFile, BothIsEachDirection) {
  const LinkFile file = parsed("[both]\ndelay_ms = 20\n[[change]]\nat_s = 1\n[change.both]\ndelay_ms = 30\n");
  for (const LinkImpairment* link : {&file.to_machine, &file.to_operator}) {
    EXPECT_EQ(link->delay, 20ms);
    ASSERT_EQ(link->changes.size(), 1U);
    EXPECT_EQ(link->changes[0].to.delay, 30ms);
  }
}

TEST(LinkFile, RefusesWhatIsOutOfBoundsContradictoryOrUnknownInOneLine) {
  struct Case {
    std::string keys, says;
  };
  const std::vector<Case> cases{
      {"[both]\ndelay_ms = -1", "'both.delay_ms' = -1: must be within [0, 5000]"},
      {"[both]\ndelay_s = 1", "delay_s"},
      {"[both]\nloss = 1.01", "'both.loss' = 1.01: must be within [0, 1]"},
      {"[both]\nloss = nan", "loss"},
      {"[both]\njitter = { distribution = \"cauchy\", deviation_ms = 1 }",
       R"(must be one of "uniform", "normal", "pareto")"},
      {"[both]\njitter = { distribution = \"uniform\", deviation_ms = 1 }", "half_width_ms"},
      {"[both]\ndelay_ms = 5\njitter = { distribution = \"uniform\", half_width_ms = 50 }",
       "must be at least the half widths of its uniform jitter (50 ms)"},
      {"[both]\nslow_jitter = { distribution = \"normal\", deviation_ms = 1 }", "correlation_s"},
      {"[both]\nslow_jitter = { distribution = \"normal\", deviation_ms = 1, correlation_s = 0 }",
       "within [0.001, 60]"},
      {"[both]\nburst_loss = { mean_good_s = 0, mean_bad_ms = 40, loss_in_bad = 1 }", "mean_good_s"},
      {"[both]\nburst_loss = { mean_good_s = 1, mean_bad_ms = 10 }", "loss_in_bad"},
      {"[both]\nduplication = 0.1", "reorder_delay_ms"},
      {"[both]\nreorder_delay_ms = 5", "reorder_delay_ms"},
      {"[both]\nin_order = true\nreordering = 0.1\nreorder_delay_ms = 5", "must be 0 where in_order is true"},
      {"[both]\nrate_limit = { rate_kBps = 0, queue_kB = 64 }", "rate_kBps"},
      {"[both]\nrate_limit = { rate_kBps = 100 }", "queue_kB"},
      {"[both]\nrate_limit = { rate_kBps = 100, queue_kB = 1 }", "within [1.5, 1"},
      {"[both]\n[to_machine]", "does not go with [both]: give [both] alone"},
      {"[sideways]\ndelay_ms = 1", "sideways"},
      {"[[outage]]\nat_s = 1\nlength_ms = 100", "direction"},
      {"[[outage]]\ndirection = \"both\"\nat_s = 1\nlength_ms = 100\nevery_s = 0.1", "must be longer than the outage"},
      {"[[address_change]]\ndirection = \"both\"\nat_s = 1", R"(must be one of "to_machine", "to_operator")"},
      {"[[change]]\nat_s = 2\n[change.both]\n[[change]]\nat_s = 2\n[change.to_machine]", "must be above that"},
      {"[[change]]\nat_s = 2\ndelay_ms = 5\n[change.both]", "delay_ms"},
      {"[[change]]\nat_s = 2\ndelay_ms = 5", "changes nothing: give [change.both]"},
      {"[[change]]\nat_s = 90000", "at_s"},
  };
  for (const Case& wrong : cases) {
    const std::string message = refusal(wrong.keys);
    EXPECT_TRUE(test::says(message, wrong.says)) << wrong.keys;
    EXPECT_TRUE(test::begins(message, "test.toml:"));
    EXPECT_FALSE(test::says(message, "\n"));
  }
  std::string many;
  for (int i = 0; i < 65; ++i) many += "[[outage]]\ndirection = \"both\"\nat_s = 1\nlength_ms = 100\n";
  EXPECT_TRUE(test::says(refusal(many), "at most 64"));
}

TEST(LinkOptions, JitterIsAtMostTheDelayAsInAFile) {
  SimulateOptions options;
  options.scenario = "wall_contact";  // its link delays by 10 ms
  const auto refused = [&options] { return test::refusal([&options] { return load_session(options).shortened; }); };
  options.jitter_ms = 10;
  EXPECT_EQ(refused(), "accepted");
  options.jitter_ms = 11;
  EXPECT_EQ(refused(), "--jitter-ms 11: must be at most the delay, 10 ms: see --delay-ms");
  options.delay_ms = 11;
  EXPECT_EQ(refused(), "accepted");
  options.delay_ms = 0;
  EXPECT_TRUE(test::says(refused(), "at most the delay, 0 ms"));
}

TEST(LinkFile, AllThatAreShippedCanBeRead) {
  const auto names = config_names("link");
  EXPECT_GE(names.size(), 5U);
  for (const std::string& name : names) {
    const LinkFile file = load_link(find_config("link", name));
    EXPECT_EQ(file.name, name);
    EXPECT_GT(file.to_machine.delay, Duration::zero());
  }
}

}  // namespace
}  // namespace knuckle::session
