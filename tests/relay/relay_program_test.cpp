// `knuckle relay` as a program, between two sockets of the test.
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "app/relay/relay.h"
#include "tests/support/free_address.h"
#include "tests/support/places.h"
#include "tests/support/refusal.h"
#include "tests/support/run_program.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"
#include "transport/udp_socket.h"

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

/// A datagram there, and the answer to it back.
void talk(const UdpSocket& person, const UdpSocket& machine) {
  const std::vector<std::uint8_t> word{1, 2, 3};
  std::array<std::uint8_t, 2048> bytes;
  SocketAddress from;
  (void)person.send(word, {});
  while (machine.receive(bytes, from)) (void)machine.send(word, from);
  while (person.receive(bytes, from)) {
  }
}

TEST_F(RelayThreads, ForwardsUntilItIsEndedAndSaysWhatBecameOfItAll) {
  const std::string relayed = free_address();
  const UdpSocket machine(open_udp_socket("", parse_address("127.0.0.1:0"), ::bind, "listen on"));
  RunningProgram relay(
      test::program("knuckle"),
      {"relay", "--listen", relayed, "--connect", text(local_address(machine.descriptor())), "--impairment",
       link_file("[both]\ndelay_ms = 15\nloss = 0.3\n"), "--json", path("relay.json")});
  ASSERT_TRUE(relay.comes_to_note(SIGINT));
  const UdpSocket person(open_udp_socket("", parse_address(relayed), ::connect, "reach"));
  for (int i = 0; i < 500; ++i) {
    talk(person, machine);
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  relay.signal(SIGINT);
  const ProgramRun run = relay.wait();
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_TRUE(says(run.err, "flow 1: 127.0.0.1:"));
  EXPECT_TRUE(says(run.err, "stopped: "));
  const auto json = result();
  EXPECT_EQ(json.at("schema"), "knuckle-relay/1");
  EXPECT_EQ(json.at("impairment"), "test");
  ASSERT_EQ(json.at("flows").size(), 1U);
  for (const char* direction : {"to_machine", "to_operator"}) {
    const auto& told = json.at("flows")[0].at(direction);
    EXPECT_GT(told.at("forwarded").get<int>(), 50);
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
  for (auto [arguments, why] : cases) {
    arguments.insert(arguments.begin(), "relay");
    const std::string said = refusal([&, &given = arguments] {
      (void)cli::parse_command_line({"knuckle", "", "", {relay::relay_entry()}}, given).run();
    });
    EXPECT_TRUE(says(said, why));
    EXPECT_FALSE(says(said, "\n"));
  }
}

}  // namespace
}  // namespace knuckle::test
