// Two paired computers, as programs: pairing, control and its change of hands, observers, revocation, the audit trail.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "app/audit/audit_files.h"
#include "app/pairing/chosen_link.h"
#include "app/pairing/key_folder.h"
#include "tests/programs/program_rig.h"
#include "tests/support/paired_computers.h"
#include "tests/support/places.h"
#include "tests/support/run_program.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"
#include "tests/video/lossy_wire.h"
#include "video/camera.h"
#include "video/sender.h"

namespace knuckle::test {
namespace {

using Json = nlohmann::json;

std::string line_with(const std::string& text, const std::string& what) {
  const auto at = text.find(what);
  return at == std::string::npos ? "" : text.substr(at, text.find('\n', at) - at);
}

/// An operator's end that is paired, and a camera of the machine's side with the keys of its session.
struct Viewer {
  Viewer(const std::string& address, const std::string& keys, std::uint16_t port, const std::string& name)
      : link(pairing::ChosenLink::connect(options(address, keys))),
        camera({name, video::receiver_of(port, "127.0.0.1", true)}),
        camera_name(name) {}
  /// As a loop and a window do.
  bool until(const std::function<bool()>& so) {
    return eventually([&] {
      Datagram heard;
      while (link.link().receive(heard)) continue;
      (void)link.link().send(std::array<std::uint8_t, 1>{});
      if (std::optional<secure::VideoSecret> secret; link.take(secret) && secret)
        camera.set_key(secure::video_key(*secret, camera_name));
      return so();
    });
  }
  static pairing::LinkOptions options(const std::string& address, const std::string& keys) {
    pairing::LinkOptions o;
    o.address = address;
    o.keys = keys;
    return o;
  }
  pairing::ChosenLink link;
  video::Camera camera;
  std::string camera_name;
};

struct PairedProgramsThreads : ::testing::Test {
  TemporaryFolder temporary;
  const std::string address = free_address();
  const std::string trail = keys("machine") + "/audit";

  [[nodiscard]] std::string keys(const std::string& computer) const { return temporary.file(computer); }
  /// Both computers' keys in place, each paired with the other.
  void pair(const std::string& computer, bool observer = false) const {
    pair_computers(keys("machine"), keys(computer), computer, observer);
  }
  [[nodiscard]] std::vector<std::string> slave(std::vector<std::string> more = {}) const {
    std::vector<std::string> all{"slave", "--simulate", "--listen", address, "--keys", keys("machine")};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  [[nodiscard]] std::vector<std::string> master(const std::string& computer, std::vector<std::string> more = {}) const {
    std::vector<std::string> all{"master",    "--machine", "solar015", "--device",    "none",
                                 "--connect", address,     "--keys",   keys(computer)};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  [[nodiscard]] std::vector<std::string> observer(const std::string& computer, std::vector<std::string> more) const {
    std::vector<std::string> all{"master", "--observe", "--device", "none", "--keys", keys(computer)};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  /// Lines of the trail with this event.
  [[nodiscard]] std::vector<Json> noted(const std::string& event) const {
    std::vector<Json> found;
    if (!std::filesystem::exists(trail)) return found;
    for (const std::string& line : audit::check_trail(trail).lines) {
      Json json = Json::parse(line);
      if (json["event"] == event) found.push_back(std::move(json));
    }
    return found;
  }
  [[nodiscard]] bool notes(const std::string& event) const {
    return eventually([&] { return !noted(event).empty(); });
  }
  /// `knuckle pair`, for a shell.
  [[nodiscard]] std::vector<std::string> side(const std::string& typed, const std::string& computer,
                                              const std::string& options) const {
    // No pipe: a program behind one would go on where the test ends it.
    return {"-c", "typed=$(mktemp -p " + temporary.path().string() + "); printf '" + typed + "' > $typed; exec " +
                      test::program("knuckle") + " pair --keys " + keys(computer) + " " + options + " < $typed"};
  }
};

TEST_F(PairedProgramsThreads, TwoComputersArePairedByTheSameCode) {
  RunningProgram listening("/bin/sh", side("yes\n", "machine", "--name 'site arm' --listen " + address));
  const ProgramRun asking =
      run_program("/bin/sh", side("yes\n", "desk", "--name 'desk 1' --as 'my arm' --connect " + address));
  const ProgramRun machine = listening.wait();
  EXPECT_EQ(machine.exit_code, 0) << machine.err;
  EXPECT_EQ(asking.exit_code, 0) << asking.err;
  EXPECT_EQ(line_with(machine.out, "code: ").size(), 6 + 29U) << machine.out;
  EXPECT_EQ(line_with(machine.out, "code: "), line_with(asking.out, "code: "));
  EXPECT_TRUE(test::says(machine.out, "paired with desk 1"));
  EXPECT_EQ(pairing::KeyFolder(keys("desk")).peers().at(0).name, "my arm");
  EXPECT_EQ(pairing::KeyFolder(keys("desk")).peers().at(0).fingerprint,
            pairing::KeyFolder(keys("machine")).identity().fingerprint());
  const ProgramRun list = run_program(test::program("knuckle"), {"pair", "--keys", keys("machine")});
  EXPECT_TRUE(test::says(list.out, "paired with: desk 1 ("));
}

/// What two people type, one at each computer that is about to be paired.
struct PairingDialogueThreads : PairedProgramsThreads {
  ProgramRun machine, desk;
  void type(const std::string& at_machine, const std::string& at_desk, const std::string& options = "",
            const std::string& keys_of_desk = "desk 1") {
    RunningProgram listening("/bin/sh", side(at_machine, "machine", "--listen " + address));
    desk = run_program("/bin/sh", side(at_desk, "'" + keys_of_desk + "'", "--connect " + address + " " + options));
    machine = listening.wait();
  }
  void expect_nobody_paired() {
    for (const char* computer : {"machine", "desk 1"})
      EXPECT_TRUE(pairing::KeyFolder(keys(computer)).peers().empty()) << computer;
  }
};

TEST_F(PairingDialogueThreads, NobodyIsPairedWhereOneOfTheTwoSaysNo) {
  type("yes\n", "no\n");
  EXPECT_EQ(machine.exit_code, 1);
  EXPECT_TRUE(test::says(machine.err, "not paired: the other computer has not confirmed the code"));
  EXPECT_EQ(desk.exit_code, 1);
  EXPECT_TRUE(test::says(desk.err, "not paired: you answered no"));
  expect_nobody_paired();
  type("", "yes\n");
  EXPECT_EQ(desk.exit_code, 1);
  EXPECT_TRUE(test::says(machine.err, "not paired: standard input ended without an answer"));
  expect_nobody_paired();
  type("no\n", "", "--code AAAA-AAAA-AAAA-AAAA-AAAA-AAAA");
  EXPECT_EQ(desk.exit_code, 1);
  EXPECT_TRUE(test::says(desk.err, "not paired"));
  expect_nobody_paired();
}

TEST_F(PairingDialogueThreads, ANameThatIsTakenIsToldBeforeAnybodyIsAsked) {
  pair("desk 1");
  pairing::KeyFolder(keys("machine")).change_peers([](secure::Peers& peers) {
    peers.at(0).fingerprint.bytes[0] ^= 1;  // another computer
  });
  type("yes\n", "yes\n");
  EXPECT_EQ(machine.exit_code, 2);
  EXPECT_TRUE(test::says(machine.err, "--as desk 1: another far end has this name in "));
  EXPECT_FALSE(test::says(machine.out, "[yes/no]"));
  EXPECT_EQ(desk.exit_code, 1);
}

TEST_F(PairingDialogueThreads, NoComputerIsPairedWithItself) {
  pair("desk 1");
  type("yes\n", "yes\n", "", "machine");
  for (const ProgramRun& run : {machine, desk}) {
    EXPECT_EQ(run.exit_code, 2);
    EXPECT_TRUE(test::says(run.err, "the other computer shows this computer's own key"));
  }
}

TEST_F(PairingDialogueThreads, ACodeThatAFirstRunShowedPairsWithoutAQuestionInTheSecond) {
  type("no\n", "");
  std::string code = line_with(machine.out, "code: ").substr(6);
  std::transform(code.begin(), code.end(), code.begin(), [](unsigned char c) { return std::tolower(c); });
  std::erase(code, '-');
  type("yes\n", "", "--code " + code);
  EXPECT_EQ(machine.exit_code, 0) << machine.err;
  EXPECT_EQ(desk.exit_code, 0) << desk.err;
}

TEST_F(PairingDialogueThreads, NobodyIsAskedForACodeThatCannotBeShown) {
  const ProgramRun blind = run_program("/bin/sh", side("yes\n", "machine", "--listen " + address + " >&-"));
  EXPECT_EQ(blind.exit_code, 2);
  EXPECT_TRUE(test::says(blind.err, "nobody would see the code"));
}

TEST_F(PairingDialogueThreads, OnlyKnucklePairAnswersKnucklePair) {
  pair("desk 1");
  const std::string said = temporary.file("said");
  RunningProgram slave_program(test::program("knuckle"), slave());
  RunningProgram asking("/bin/sh", side("yes\n", "'desk 1'", "--connect " + address + " 2> " + said));
  EXPECT_TRUE(eventually([&] { return content(said).find("knuckle slave runs there") != std::string::npos; }))
      << content(said);
  ASSERT_TRUE(notes("refused"));
  EXPECT_TRUE(test::says(noted("refused")[0].dump(), "the far end runs knuckle pair"));
}

TEST_F(PairedProgramsThreads, EitherComputerMayListenAndTheMachinesSaysWhoObservesOnly) {
  RunningProgram listening("/bin/sh", side("maybe\nYES\r\n", "wall", "--name wall --listen " + address));
  const ProgramRun machine = run_program("/bin/sh", side("Y", "machine", "--observer --connect " + address));
  const ProgramRun wall = listening.wait();
  EXPECT_EQ(wall.exit_code, 0) << wall.err;
  EXPECT_TRUE(test::says(wall.out, "Type yes or no: "));
  EXPECT_EQ(machine.exit_code, 0) << machine.err;
  EXPECT_TRUE(test::says(machine.out, "which may observe a machine here, not control it"));
  EXPECT_TRUE(pairing::KeyFolder(keys("machine")).peers().at(0).observer);
}

TEST_F(PairedProgramsThreads, CtrlCEndsTheQuestionForTheCode) {
  const std::string program = test::program("knuckle"), fifo = temporary.file("typed"), said = temporary.file("said");
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  RunningProgram listening("/bin/sh", {"-c", "exec " + program + " pair --keys " + keys("machine") + " --listen " +
                                                 address + " < " + fifo + " > " + said});
  const std::ofstream typed(fifo);  // nothing is
  RunningProgram asking("/bin/sh",
                        {"-c", "echo no | " + program + " pair --keys " + keys("desk") + " --connect " + address});
  ASSERT_TRUE(eventually([&] { return content(said).find("[yes/no]") != std::string::npos; }));
  listening.signal(SIGINT);
  ASSERT_TRUE(listening.ends_within(kPatience));
  const ProgramRun ended = listening.wait();
  EXPECT_EQ(ended.exit_code, 130);
  EXPECT_TRUE(test::says(ended.err, "interrupted; not paired"));
}

TEST_F(PairedProgramsThreads, ASessionLeavesItsAuditTrail) {
  pair("desk 1");
  {
    RunningProgram machine(test::program("knuckle"), slave());
    ASSERT_TRUE(notes("started"));
    RunningProgram desk(test::program("knuckle"), master("desk 1"));
    ASSERT_TRUE(notes("control_taken"));
    desk.signal(SIGTERM);
    EXPECT_EQ(desk.wait().exit_code, 0);
    ASSERT_TRUE(notes("control_released"));
    machine.signal(SIGTERM);
    EXPECT_EQ(machine.wait().exit_code, 0);
  }
  EXPECT_EQ(noted("ended").size(), 1U);
  EXPECT_EQ(noted("started")[0]["machine_file_sha256"].get<std::string>().size(), 64U);
  EXPECT_EQ(noted("control_taken")[0]["name"], "desk 1");
  EXPECT_EQ(noted("control_taken")[0]["fingerprint"],
            secure::hex(pairing::KeyFolder(keys("desk 1")).identity().fingerprint()));
  const ProgramRun checked = run_program(test::program("knuckle"), {"audit", trail});
  EXPECT_EQ(checked.exit_code, 0) << checked.err;
  EXPECT_TRUE(test::says(checked.out, " control_taken: name=desk 1, fingerprint="));
  std::string text = content(trail + "/audit-000001.jsonl");
  std::ofstream(trail + "/audit-000001.jsonl") << text.replace(text.find("desk 1"), 6, "desk 9");
  const ProgramRun broken = run_program(test::program("knuckle"), {"audit", "--quiet", trail});
  EXPECT_EQ(broken.exit_code, 1);
  EXPECT_TRUE(test::says(broken.err, "BROKEN: " + trail + "/audit-000001.jsonl:"));
  const ProgramRun warned = run_program(test::program("knuckle"), slave({"--duration", "0.2"}));
  EXPECT_EQ(warned.exit_code, 0) << warned.err;
  EXPECT_TRUE(test::says(warned.err, "is BROKEN: " + trail + "/audit-000001.jsonl:"));
}

TEST_F(PairedProgramsThreads, ATrailHasOneWriterAndARevokedOperatorIsCutOffWhileItRuns) {
  pair("desk 1");
  RunningProgram machine(test::program("knuckle"), slave());
  RunningProgram desk(test::program("knuckle"), master("desk 1"));
  ASSERT_TRUE(notes("control_taken"));
  const ProgramRun second = run_program(test::program("knuckle"),
                                        {"slave", "--simulate", "--listen", "127.0.0.1:0", "--keys", keys("machine")});
  EXPECT_EQ(second.exit_code, 2);
  EXPECT_TRUE(test::says(second.err, "another program writes its audit trail there"));
  EXPECT_EQ(run_program(test::program("knuckle"), {"pair", "--keys", keys("machine"), "--revoke", "desk 1"}).exit_code,
            0);
  ASSERT_TRUE(notes("cut_off"));
  EXPECT_TRUE(notes("pairings_changed"));
  ASSERT_TRUE(notes("refused"));
  desk.signal(SIGTERM);
  EXPECT_TRUE(test::says(desk.wait().err, "has revoked this computer's pairing"));
}

TEST_F(PairedProgramsThreads, ControlChangesHandsByALineOfTheOperator) {
  pair("desk 1");
  pair("desk 2");
  RunningProgram machine(test::program("knuckle"), slave());
  const std::string fifo = temporary.file("typed");
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  std::string command = "exec " + test::program("knuckle");
  for (const std::string& argument : master("desk 1")) command += " '" + argument + "'";
  RunningProgram first("/bin/sh", {"-c", command + " < " + fifo});
  std::ofstream typed(fifo);
  ASSERT_TRUE(notes("control_taken"));
  typed << "home" << std::endl;
  const std::string asks = temporary.file("asks"), heard = temporary.file("heard");
  ASSERT_EQ(mkfifo(asks.c_str(), 0600), 0);
  std::string other = "exec " + test::program("knuckle");
  for (const std::string& argument : master("desk 2")) other += " '" + argument + "'";
  RunningProgram second("/bin/sh", {"-c", other + " < " + asks + " 2> " + heard});
  std::ofstream asking(asks);
  ASSERT_TRUE(notes("refused"));
  EXPECT_EQ(noted("refused")[0]["name"], "desk 2");
  ASSERT_TRUE(eventually([&] { return content(heard).find("link: desk 1 has control there") != std::string::npos; }));
  asking << "grant" << std::endl;
  EXPECT_TRUE(eventually([&] {
    return content(heard).find("this computer has no control: desk 1 has it\n") != std::string::npos;
  })) << content(heard);
  EXPECT_FALSE(test::says(content(heard), "link connected")) << "it has a session for the answer only";
  ASSERT_TRUE(eventually([&] {
    typed << "grant" << std::endl;
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    return noted("control_taken").size() == 2;
  }));
  EXPECT_EQ(noted("control_granted")[0]["to"],
            secure::hex(pairing::KeyFolder(keys("desk 2")).identity().fingerprint()));
  EXPECT_EQ(noted("control_taken")[1]["name"], "desk 2");
  first.signal(SIGTERM);
  const std::string told = first.wait().err;
  EXPECT_TRUE(test::says(told, "desk 2 ("));
  EXPECT_TRUE(test::says(told, "asks for control"));
  EXPECT_TRUE(test::says(told, "control granted to desk 2"));
  EXPECT_TRUE(test::says(told, "home on two: the machine does not offer it"));
}

TEST_F(PairedProgramsThreads, AnObserverSeesTheMachineBesideTheOperator) {
  pair("desk 1");
  pair("wall", true);
  RunningProgram machine(test::program("knuckle"), slave());
  RunningProgram desk(test::program("knuckle"), master("desk 1"));
  ASSERT_TRUE(notes("control_taken"));
  const std::string result = temporary.file("wall.json");
  const ProgramRun wall = run_program(test::program("knuckle"),
                                      observer("wall", {"--connect", address, "--duration", "2", "--json", result}));
  EXPECT_EQ(wall.exit_code, 0) << wall.err;
  const Json observed = Json::parse(content(result));
  EXPECT_EQ(observed["connect"], address);
  EXPECT_TRUE(observed.at("path").is_null());
  EXPECT_GT(observed["messages"].get<int>(), 50);
  EXPECT_EQ(observed["machine_side"][0]["heard"], true);
  EXPECT_TRUE(notes("observer_gone"));
  EXPECT_EQ(noted("control_taken").size(), 1U);
  const ProgramRun leads = run_program(test::program("knuckle"), master("wall", {"--duration", "1"}));
  EXPECT_TRUE(test::says(leads.err, "lets this computer observe only"));
}

TEST_F(PairedProgramsThreads, AnObserverThatDialsSaysWhereAndByWhichPath) {
  pair("wall", true);
  const std::string result = temporary.file("wall.json");
  const ProgramRun wall = run_program(
      test::program("knuckle"),
      observer("wall", {"--dial", "127.0.0.1:9", "--peer", "site arm", "--duration", "0.2", "--json", result}));
  EXPECT_EQ(wall.exit_code, 1) << wall.err;
  EXPECT_TRUE(test::says(wall.err, "the machine was not heard at any time"));
  EXPECT_TRUE(test::says(wall.err, "observing 127.0.0.1:9: nothing is controlled from here"));
  const Json observed = Json::parse(content(result));
  EXPECT_TRUE(observed.at("connect").is_null());
  EXPECT_TRUE(observed.at("path").at("pairs").empty());
  EXPECT_EQ(observed.at("records_lost"), 0);
}

TEST_F(PairedProgramsThreads, PicturesAreSealedWithTheSession) {
  pair("desk 1");
  const std::uint16_t port = free_port();
  const RunningProgram machine(test::program("knuckle"),
                               slave({"--no-log", "--camera", "mast=videotestsrc is-live=true", "--video-to",
                                      "127.0.0.1:" + std::to_string(port)}));
  Viewer viewer(address, keys("desk 1"), port, "mast");
  EXPECT_TRUE(viewer.until([&] { return viewer.camera.take() != nullptr; })) << viewer.camera.status().why.data();
}

TEST_F(PairedProgramsThreads, NoPictureIsSentAnyMoreToAnOperatorWhoWasRevoked) {
  pair("desk 1");
  const video::LossyWire wire(free_port(), 1);  // counts all, and passes nothing on
  const RunningProgram machine(test::program("knuckle"),
                               slave({"--no-log", "--camera", "mast=videotestsrc is-live=true", "--video-to",
                                      "127.0.0.1:" + std::to_string(wire.port())}));
  Viewer viewer(address, keys("desk 1"), free_port(), "mast");
  ASSERT_TRUE(viewer.until([&] { return wire.lost() > 100; }));
  EXPECT_EQ(run_program(test::program("knuckle"), {"pair", "--keys", keys("machine"), "--revoke", "desk 1"}).exit_code,
            0);
  ASSERT_TRUE(viewer.until([&] { return !noted("cut_off").empty(); }));
  std::this_thread::sleep_for(500ms);  // what was on its way
  const std::uint64_t before = wire.lost();
  std::this_thread::sleep_for(1500ms);
  EXPECT_EQ(wire.lost(), before);
}

}  // namespace
}  // namespace knuckle::test
