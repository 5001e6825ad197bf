// What the console records, by itself and when it is told to: every session anew, from its first step on.
#include "app/console/console_log.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "app/console/console_host.h"
#include "app/session/session_setup.h"
#include "core/error.h"
#include "tests/console/console_rig.h"
#include "tests/console/recorded.h"
#include "tests/support/says.h"
#include "transport/udp_link.h"

namespace knuckle::test {
namespace {

using console::ConsoleHost;
using console::LogChoice;
using Led = console::LiveSession::Led;
using Light = console::RecordingLight;

LogChoice into(const TemporaryFolder& folder) {
  LogChoice log;
  log.options.folder = folder.path().string();
  return log;
}

/// The default folder of recordings, for as long as this lives.
struct DefaultFolder {
  explicit DefaultFolder(const std::string& path) { setenv("KNUCKLE_RECORDINGS", path.c_str(), 1); }
  ~DefaultFolder() { unsetenv("KNUCKLE_RECORDINGS"); }
  DefaultFolder(const DefaultFolder&) = delete;
  DefaultFolder& operator=(const DefaultFolder&) = delete;
};

TEST(ConsoleLog, ASimulatedSessionRunsAgainFromItsRecordingBitByBit) {
  const TemporaryFolder folder;
  {
    ConsoleHost host(simulated("wall_contact"), Led::kByScenario, nullptr, nullptr, into(folder));
    host.skip_to(7);
    EXPECT_EQ(host.view().machine.mode, Mode::kEngaged);
    EXPECT_EQ(host.log().light().state, Light::State::kOn);
    EXPECT_EQ(host.log().light().steps_lost, 0u);
  }
  ASSERT_EQ(recorded_in(folder).size(), 1u);
  expect_identical(recorded_in(folder).front(), 7000);
  const recording::Recording recording({recorded_in(folder).front()});
  EXPECT_FALSE(recording.head().far_end_is_this_machine) << "it waits until the machine has told its name";
  EXPECT_GT(recording.head().started_unix_ns, 0) << "files are named by the computer's clock";
}

TEST(ConsoleLog, AnEventGoesIntoTheRecordingOfItsOwnSession) {
  const TemporaryFolder folder;
  console::ConsoleLog log(into(folder));
  const session::SessionSetup setup = session::load_session(simulated("free_motion")).setup;
  const recording::Head head = console::head_of(setup, simulated("free_motion"), log.choice());
  const auto note = [&log](std::uint32_t run, const char* text) {
    log.note({1, run, Time(1s), console::Severity::kWarning, "bookmark", text, true});
  };
  ASSERT_NE(log.make(head, setup.machine), nullptr);
  log.take_over(1);
  note(1, "of the first");
  ASSERT_NE(log.make(head, setup.machine), nullptr);
  note(1, "still of the first");
  note(2, "of the second, told before it is known to have begun");
  log.take_over(2);
  note(1, "too late");
  note(2, "of the second");
  log.close();
  const auto files = recorded_in(folder);
  ASSERT_EQ(files.size(), 2u);
  const auto first = events_of(files[0]), second = events_of(files[1]);
  ASSERT_EQ(first.size(), 2u);
  ASSERT_EQ(second.size(), 2u);
  EXPECT_EQ(first[1].text, "still of the first");
  EXPECT_EQ(first[1].severity, recording::Severity::kWarning);
  EXPECT_EQ(first[1].at, Time(1s));
  EXPECT_EQ(second[1].text, "of the second");
}

/// The operator's side of a far machine that never answers, with what a command line says of recording it.
struct Station {
  explicit Station(LogChoice log) {
    log.real = true;
    host = std::make_unique<ConsoleHost>(setup, link, nullptr, std::move(log));
  }
  UdpLink machine = UdpLink::listen("127.0.0.1:0");
  UdpLink link = UdpLink::connect("127.0.0.1:" + std::to_string(machine.port()));
  console::StationSetup setup = console::station_setup(live_setup());
  std::unique_ptr<ConsoleHost> host;
};

TEST(ConsoleLogThread, TheOperatorsSideOfAFarMachineIsRecordedByItself) {
  const TemporaryFolder folder;
  const DefaultFolder by_default(folder.path().string());
  {
    Station station({});
    station.host->begin();
    HostWindow window{*station.host};
    ASSERT_TRUE(window.until([](const auto& v) { return v.now > Time(400ms); }));
    EXPECT_EQ(station.host->log().light().state, Light::State::kOn);
    window.input.stop = true;
    window.input.position_scale = 7;
    window.input.assist = {1500, true};
    ASSERT_TRUE(window.until([](const auto& v) { return v.hand.stop && v.now > Time(800ms); }));
  }
  ASSERT_EQ(recorded_in(folder).size(), 1u);
  expect_identical(recorded_in(folder).front(), 600);
}

TEST(ConsoleLog, NoLogTurnsOffAllButFlightRecordsAndASimulationHasNoneByItself) {
  const TemporaryFolder folder;
  const DefaultFolder by_default(folder.path().string());
  LogChoice log;
  log.options.off = true;
  Station station(log);
  const Light light = station.host->log().light();
  EXPECT_EQ(light.state, Light::State::kOff);
  EXPECT_TRUE(light.real) << "stands out";
  ASSERT_EQ(station.host->log().notes().size(), 1u);
  EXPECT_TRUE(says(station.host->log().notes().front(), "NOT RECORDED"));
  station.host.reset();
  ConsoleHost simulation(simulated("free_motion"), Led::kByScenario, nullptr, nullptr);  // no folder is named
  simulation.skip_to(1);
  simulation.stop();
  EXPECT_EQ(simulation.log().light().state, Light::State::kOff);
  EXPECT_FALSE(simulation.log().light().real);
  EXPECT_TRUE(recorded_in(folder).empty());
}

TEST(ConsoleLog, AFaultWithoutARecordingStillLeavesAFlightRecordThatIsTold) {
  const TemporaryFolder folder;
  LogChoice log = into(folder);
  log.options = {.folder = "", .off = true};
  log.real = true;
  const DefaultFolder by_default(folder.path().string());
  ConsoleHost host(simulated("free_motion"), Led::kByScenario, nullptr, nullptr, log);
  console::ConsoleInput input;
  host.skip_to(3);
  input.stop = true;
  input.at = Time(3s);
  host.put(input);
  host.skip_to(4);
  ASSERT_EQ(host.view().machine.mode, Mode::kFault);
  host.stop();
  const std::vector<cli::News> news = host.log().news();
  const std::vector<std::string> flights = recorded_in(folder, true);
  ASSERT_EQ(flights.size(), 1u);
  ASSERT_EQ(news.size(), 1u);
  EXPECT_TRUE(says(news.front().what, flights.front()));
  EXPECT_TRUE(host.log().news().empty()) << "told once";
  EXPECT_TRUE(recorded_in(folder).empty());
}

TEST(ConsoleLog, ADefaultFolderThatRefusesIsToldAndTheConsoleGoesOnButANamedOneIsRefused) {
  const TemporaryFolder folder;
  const std::string file = folder.file("in_the_way");
  std::ofstream(file) << "no folder";
  const DefaultFolder by_default(file + "/recordings");
  Station station({});
  const Light light = station.host->log().light();
  EXPECT_EQ(light.state, Light::State::kStopped);
  EXPECT_TRUE(says(light.why, "in_the_way"));
  LogChoice named;
  named.options.folder = file;
  EXPECT_THROW(ConsoleHost(simulated("free_motion"), Led::kByScenario, nullptr, nullptr, named), InputError);
}

TEST(ConsoleLogThread, AFolderThatIsGoneWhenASessionBeginsAnewEndsTheRecordingNotTheConsole) {
  const TemporaryFolder folder;
  LogChoice log;
  log.options.folder = folder.file("log");
  ConsoleHost host(simulated("free_motion"), Led::kByPerson, nullptr, nullptr, log);
  host.begin();
  HostWindow window{host};
  ASSERT_TRUE(window.until([](const auto& v) { return v.simulated_s > 0.2; }));
  std::filesystem::remove_all(log.options.folder);
  std::ofstream(log.options.folder) << "in the way";
  ++window.input.reset_count;
  ASSERT_TRUE(window.until([](const auto& v) { return v.run == 2 && v.simulated_s > 0.2; }));
  EXPECT_EQ(host.log().light().state, Light::State::kStopped);
  EXPECT_TRUE(says(host.log().light().why, log.options.folder));
  const auto news = host.log().news();
  EXPECT_TRUE(std::any_of(news.begin(), news.end(), [](const auto& n) { return n.kind == "recording"; }));
}

}  // namespace
}  // namespace knuckle::test
