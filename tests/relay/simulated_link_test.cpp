// A link file on virtual time: `knuckle simulate --impairment`.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "app/programs/programs.h"
#include "app/session/session_result.h"
#include "tests/support/places.h"
#include "tests/support/refusal.h"
#include "tests/support/run_program.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::test {
namespace {

class SimulatedLink : public testing::Test {
 protected:
  [[nodiscard]] std::string link(const std::string& keys) const {
    std::ofstream(file_) << "name = \"test\"\ndescription = \"of a test\"\n" << keys;
    return file_;
  }
  static session::SessionResult run(const std::string& impairment, std::optional<double> delay_ms = {}) {
    session::SimulateOptions options;
    options.scenario = "free_motion";
    options.duration_s = 4;
    options.impairment = impairment;
    options.delay_ms = delay_ms;
    return session::run_simulation(options, {});
  }

 private:
  TemporaryFolder folder_;
  std::string file_ = folder_.file("link.toml");
};

TEST_F(SimulatedLink, IsThatOfTheOptionsWhereTheFileSaysTheSame) {
  EXPECT_EQ(run(link("[both]\ndelay_ms = 30\n")).digest.whole, run("", 30).digest.whole);
}

TEST_F(SimulatedLink, AnOutageOfItsFileStopsTheMachineWithinTheLossPolicy) {
  session::SimulateOptions options;
  options.scenario = "free_motion";
  options.duration_s = 8;
  options.impairment = link("[[outage]]\ndirection = \"both\"\nat_s = 5\nlength_ms = 700\n");
  const session::SessionResult result = session::run_simulation(options, {});
  ASSERT_EQ(result.record.faults.size(), 1U);
  EXPECT_EQ(result.record.faults[0].reason.code, ReasonCode::kLinkLost);
  EXPECT_NEAR(result.record.faults[0].at_s, 5.2, 0.05);
}

TEST_F(SimulatedLink, SaysWhichFileItWasAndWhatOfItDoesNothing) {
  const std::string file = link("[[address_change]]\ndirection = \"to_machine\"\nat_s = 1\n");
  const ProgramRun run = run_program(test::program("knuckle"), {"simulate", "--scenario", "free_motion", "--duration",
                                                                "1", "--impairment", file, "--json", "-"});
  const auto json = nlohmann::json::parse(run.out, nullptr, false);
  EXPECT_EQ(json.at("link").at("impairment"), file);
  ASSERT_EQ(json.at("notes").size(), 1U);
  EXPECT_NE(json.at("notes")[0].get<std::string>().find("address changes do nothing"), std::string::npos);
}

TEST_F(SimulatedLink, IsDescribedOnceAndHasAddressesInRealTimeOnly) {
  struct Refused {
    std::vector<std::string> arguments;
    std::string why;
  };
  const std::vector<Refused> cases{
      {{"--impairment", "lte", "--delay-ms", "5"}, "--impairment lte: does not go with --delay-ms"},
      {{"--impairment", "no_such_link"}, "unknown link 'no_such_link'"},
      {{"--impairment", link("[both]\ndelay_s = 1\n")}, "delay_s"},
      {{"--impairment", "lte", "--realtime"}, "--impairment: cannot be set with --realtime"},
      {{"--realtime", "--listen", "127.0.0.1:0"}, "--listen and --connect, or neither"},
      {{"--listen", "127.0.0.1:0", "--connect", "127.0.0.1:1"}, "only goes with --realtime"},
  };
  for (const Refused& refused : cases) {
    std::vector<std::string> arguments{"simulate", "--scenario", "free_motion", "--duration", "1"};
    arguments.insert(arguments.end(), refused.arguments.begin(), refused.arguments.end());
    const auto simulate = [](const session::SimulateOptions& options, const std::string&) {
      (void)session::run_simulation(options, {});
      return 0;
    };
    const std::string said = refusal([&] {
      (void)cli::parse_command_line({"knuckle", "", "", {programs::simulate_entry(simulate)}}, arguments).run();
    });
    EXPECT_TRUE(says(said, refused.why));
    EXPECT_FALSE(says(said, "\n"));
  }
}

}  // namespace
}  // namespace knuckle::test
