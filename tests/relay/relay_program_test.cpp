// `knuckle relay` as a program, between `knuckle slave --simulate` and an operator's end in the test's hand.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "app/relay/relay.h"
#include "tests/programs/program_rig.h"
#include "tests/support/places.h"
#include "tests/support/refusal.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::test {
namespace {

class RelayThreads : public testing::Test {
 protected:
  [[nodiscard]] std::string path(const std::string& name) const { return folder_.file(name); }
  [[nodiscard]] std::string link_file(const std::string& keys) const {
    std::ofstream(path("link.toml")) << "name = \"test\"\ndescription = \"of a test\"\n" << keys;
    return path("link.toml");
  }
  [[nodiscard]] nlohmann::json result() const {
    std::ifstream in(path("relay.json"));
    return nlohmann::json::parse(in, nullptr, false);
  }

 private:
  TemporaryFolder folder_;
};

TEST_F(RelayThreads, AnOperatorLeadsTheMachineThroughItAndSeesItsDelay) {
  const std::string machine = free_address(), relayed = free_address();
  RunningProgram slave(test::program("knuckle"), {"slave", "--simulate", "--listen", machine, "--insecure"});
  RunningProgram relay(test::program("knuckle"),
                       {"relay", "--listen", relayed, "--connect", machine, "--impairment",
                        link_file("[both]\ndelay_ms = 15\nloss = 0.01\n"), "--json", path("relay.json")});
  {
    Hand hand(relayed);
    const auto follows = [&hand] {
      hand.lead(kArm, 0);
      if (!engage(hand)) return false;
      const double was_rad = hand.machine()->position_rad[kArm];
      hand.lead(kArm, 0.05);
      const auto moved = [&] { return hand.machine()->position_rad[kArm] > was_rad + 0.02; };
      return eventually([&] { return moved() || !hand.sees(Mode::kEngaged); }) && moved();
    };
    bool followed = false;  // a computer too busy to keep the link alive may need more than one try
    for (int tries = 8; tries > 0 && !followed; --tries) followed = follows();
    EXPECT_TRUE(followed);
  }
  relay.signal(SIGINT);
  const ProgramRun run = relay.wait();
  slave.signal(SIGTERM);
  EXPECT_EQ(slave.wait().exit_code, 0);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.err.find("flow 1: 127.0.0.1:"), std::string::npos) << run.err;
  EXPECT_NE(run.err.find("stopped: "), std::string::npos) << run.err;
  const auto json = result();
  EXPECT_EQ(json.at("schema"), "knuckle-relay/1");
  EXPECT_EQ(json.at("impairment"), "test");
  ASSERT_EQ(json.at("flows").size(), 1U);
  for (const char* direction : {"to_machine", "to_operator"}) {
    const auto& told = json.at("flows")[0].at(direction);
    EXPECT_GT(told.at("forwarded").get<int>(), 100);
    EXPECT_GE(told.at("delay_ms").at("p50").get<double>(), 15);
    EXPECT_GT(told.at("lost").get<int>(), 0);
    EXPECT_EQ(told.at("lateness_ms").size(), 3U);
    std::uint64_t binned = 0;
    for (const auto& bin : told.at("delay_bins_ms")) binned += bin.at(1).get<std::uint64_t>();
    EXPECT_EQ(binned, told.at("forwarded").get<std::uint64_t>());
  }
}

TEST_F(RelayThreads, EndsInOrderOnSigtermAndAfterItsDuration) {
  const std::string file = link_file("");
  const std::vector<std::string> arguments{"relay",  "--listen",         "127.0.0.1:0",  "--connect", "127.0.0.1:9",
                                           "--json", path("relay.json"), "--impairment", file};
  RunningProgram relay(test::program("knuckle"), arguments);
  ASSERT_TRUE(relay.comes_to_note(SIGTERM));
  relay.signal(SIGTERM);
  EXPECT_EQ(relay.wait().exit_code, 0);
  EXPECT_TRUE(result().at("first_datagram_at_s").is_null());
  std::vector<std::string> timed = arguments;
  timed.insert(timed.end(), {"--duration", "0.2"});
  EXPECT_EQ(run_program(test::program("knuckle"), timed).exit_code, 0);
  EXPECT_GE(result().at("ran_s").get<double>(), 0.2);
}

TEST_F(RelayThreads, RefusesBadInputInOneLine) {
  const std::string good = link_file("");
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases{
      {{"--listen", "127.0.0.1:0", "--connect", "127.0.0.1:9"}, "--impairment is required"},
      {{"--listen", "127.0.0.1:0", "--connect", "127.0.0.1:9", "--impairment", "no_such_link"}, "unknown link"},
      {{"--listen", "127.0.0.1:0", "--connect", "127.0.0.1:0", "--impairment", good}, "port 0"},
      {{"--listen", "nowhere", "--connect", "127.0.0.1:9", "--impairment", good}, "nowhere"},
      {{"--listen", "127.0.0.1:0", "--connect", "127.0.0.1:9", "--impairment", good, "--seed", "-1"}, "seed"},
      {{"--listen", "127.0.0.1:0", "--connect", "127.0.0.1:9", "--impairment", good, "--duration", "0"}, "--duration"},
      {{"--listen", "127.0.0.1:0", "--connect", "127.0.0.1:9", "--impairment", good, "--json", good}, "--json"},
  };
  for (auto [arguments, says] : cases) {
    arguments.insert(arguments.begin(), "relay");
    const std::string said = refusal([&, &given = arguments] {
      (void)cli::parse_command_line({"knuckle", "", "", {relay::relay_entry()}}, given).run();
    });
    EXPECT_NE(said.find(says), std::string::npos) << said;
    EXPECT_EQ(said.find('\n'), std::string::npos) << said;
  }
}

}  // namespace
}  // namespace knuckle::test
