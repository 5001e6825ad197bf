// The page that repeats both papers: all tables and figures are there, its numbers are those of the recordings, and
// nothing is left behind by wrong usage or an interrupt.
#include "app/studies/papers.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>
#include <utility>

#include "estimation/identification/baseline.h"
#include "estimation/identification/full.h"
#include "estimation/regressor.h"
#include "machine/load.h"
#include "tests/support/patterns.h"
#include "tests/support/places.h"
#include "tests/support/run_program.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/two_cylinders.h"

namespace knuckle::studies {
namespace {

using estimation::TorqueComparison;
using test::ProgramRun;
using test::says;

ProgramRun papers(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "papers");
  return test::run_program(test::program("knuckle-studies"), arguments);
}

std::string page_of(const RepeatedPapers& papers) {
  std::ostringstream out;
  write_papers_page(papers, {}, out);
  return out.str();
}

double rms_error_Nm(const TorqueComparison& torque, int joint) {
  double squares = 0, count = 0;
  for (std::size_t i = 0; i < torque.usable.size(); ++i) {
    if (torque.usable[i] == 0) continue;
    squares += std::pow(torque.measured_Nm[i][joint] - torque.modelled_Nm[i][joint], 2);
    ++count;
  }
  return std::sqrt(squares / count);
}

/// The row of this quantity, its cells parted by "|".
std::string row(const std::string& page, const std::string& quantity) {
  const std::string start = "<tr><td>" + quantity + "<td class=\"n\">", cell = "<td class=\"n\">";
  const std::size_t at = page.find(start);
  if (at == std::string::npos) return "no row " + quantity;
  std::string text = page.substr(at + start.size(), page.find("</tr>", at) - at - start.size());
  for (std::size_t next = text.find(cell); next != std::string::npos; next = text.find(cell))
    text.replace(next, cell.size(), "|");
  return text;
}

TEST(PapersPage, ShowsEveryTableAndFigureAndTheNumbersOfTheRecordings) {
  const RepeatedPapers papers = repeat_papers({}, [](double) {});
  ASSERT_TRUE(papers.complete()) << papers.malaguti.why_not << papers.kim.why_not;
  const std::string page = page_of(papers);
  for (const std::string part :
       {"(solar015, smooth, seed 1)", "In short", "M, table 1", "M, table 2", "M, table 3",
        "M: force on the empty bucket, held out", "M, figure 3, held out", "M, figure 4, held out", "K, figure 4",
        "K, figure 5", "K, figure 6", "K, table 1", "K, figure 7 (a)", "K, figure 7 (b)", "K, figure 8", "</html>"})
    EXPECT_TRUE(says(page, part));
  EXPECT_EQ(test::matches(page, "</svg>").size(), 11U);
  EXPECT_EQ(test::matches(page, "Not repeated|>nan").size(), 0U);

  const identify::IdentifyData& digging = papers.malaguti.done->digging.data;
  const MachineDescription machine = calibrated(digging.machine);
  const auto malaguti = identify_malaguti(machine, digging.training);
  estimation::FullOptions quick;
  quick.usual_errors = false;  // they widen standard deviations alone
  const auto full = identify_full(machine, digging.training, quick);
  const auto& other = digging.hold_out.front();
  const auto bucket = [&](const estimation::Recording& recording) {
    return fmt::format("{:.1f}|{:.1f}", rms_error_Nm(compare_torque(malaguti, machine, recording), kBucket),
                       torque_fit(compare_torque(full.dynamics, machine, recording), 20).rms_Nm[kBucket]);
  };
  EXPECT_EQ(row(page, "τ<sub>2</sub>, bucket: RMS error, of the fit"), "N m|43.12|" + bucket(digging.training.front()));
  EXPECT_EQ(row(page, "τ<sub>2</sub>, bucket: RMS error, held out"), "N m|not shown|" + bucket(other));

  const identify::IdentifyData& slow = papers.kim.done->data;
  const MachineDescription seen = calibrated(slow.machine);
  double most = 0;
  for (const Eigen::Vector3d& wrench : external_wrench(identify_kim(seen, slow.training), seen, slow.hold_out[1])) {
    if (wrench.allFinite()) most = std::max(most, std::abs(wrench[0]));
  }
  const std::string largest = row(page, "verification 2: largest horizontal force");
  EXPECT_TRUE(test::begins(largest, fmt::format("N|under 200 (run not named)|{:.1f}|", most)));
}

TEST(PapersPage, SaysWhyAMachineCouldNotBeIdentified) {
  RepeatedPapers papers{.machine = "solar015, worn, seed 3", .malaguti = {}, .kim = {}};
  papers.malaguti.why_not = "experiment malaguti, default method: boom cylinder extends for 0.0 s only";
  papers.kim.why_not = "experiment kim, their method: no poses";
  EXPECT_FALSE(papers.complete());
  const std::string page = page_of(papers);
  for (const std::string& why : {papers.malaguti.why_not, papers.kim.why_not})
    EXPECT_TRUE(says(page, "this machine could not be identified.</b> " + why));
}

TEST(DeepPapersPage, OfAMachineThatCannotBeIdentifiedSaysWhyAndExitsWith1) {
  const test::TemporaryFolder folder;
  const ProgramRun run = papers({"--family", "worn", "--seed", "3", "--report", folder.file("page.html")});
  EXPECT_EQ(run.exit_code, 1) << run.err;
  const std::string why = "experiment malaguti, default method: boom cylinder extends for 0.0 s only";
  EXPECT_TRUE(says(run.err, "not repeated: " + why));
  EXPECT_TRUE(says(test::content(folder.file("page.html")), "could not be identified.</b> " + why));
}

TEST(PapersPage, OfAMachineThatLacksWhatAnExperimentMeasuresSaysSoBeforeAnythingIsDriven) {
  const test::TemporaryFolder folder;
  const std::string file = folder.file("page.html");
  std::ofstream(folder.file("two.toml")) << test::without_transmitters("arm");
  const ProgramRun run = papers({"--machine", folder.file("two.toml"), "--report", file});
  EXPECT_EQ(run.exit_code, 1) << run.err;
  EXPECT_EQ(run.out, "written: " + file + "\n");
  const std::string page = test::content(file);
  for (const std::string why :
       {"experiment malaguti: needs the pressures of arm and bucket; nobody measures those of the arm "
        "(sensors.without_pressures)",
        "experiment kim: needs the pressures of all three cylinders; nobody measures those of the arm "
        "(sensors.without_pressures)"}) {
    EXPECT_TRUE(says(run.err, "not repeated: " + why));
    EXPECT_TRUE(says(page, "Not repeated: this machine lacks what the experiment measures.</b> " + why));
  }
  EXPECT_FALSE(says(page, "Another seed is another machine"));
  EXPECT_TRUE(says(page, "<code>knuckle-studies papers --machine " + folder.file("two.toml")));
}

TEST(MalagutiEquation1, HoldsForOurModelAsCorrectedInTheTheoryAndNotAsPrinted) {
  const MachineDescription machine = load_machine(test::source_dir() + "/config/machines/solar015.toml");
  const estimation::BaseParameters base = estimation::base_parameters(machine);
  const JointVector joint_rad(0, -1.2, -0.7), radps(0, 0.8, -1.5);  // the boom stands still
  const estimation::Pose pose(joint_rad, 0);
  const JointVector torque_Nm = estimation::joint_torque(
      (estimation::RigidArm(machine).inverse_dynamics(pose, estimation::absolute(radps), JointVector::Zero()) -
       estimation::RigidArm::gravity(pose)) *
      base);
  const double x = base[estimation::kMomentX + kBucket], z = base[estimation::kMomentZ + kBucket];
  const double c = machine.links[kArm].length_m * (x * std::sin(joint_rad[kBucket]) + z * std::cos(joint_rad[kBucket]));
  const double first = radps[kArm] * radps[kArm], second = radps[kBucket] * radps[kBucket],
               both = std::pow(radps[kArm] + radps[kBucket], 2);
  EXPECT_NEAR(torque_Nm[kBucket], c * first, 1e-9);
  EXPECT_NEAR(torque_Nm[kArm], c * first - c * both, 1e-9);
  EXPECT_GT(std::abs(torque_Nm[kArm] - (c * first + c * second)), 5);
}

TEST(PapersPage, WrongUsageIsOneLineAndLeavesNothingBehind) {
  const test::TemporaryFolder folder;
  const std::string page = folder.file("page.html");
  using Arguments = std::vector<std::string>;
  for (const auto& [arguments, said] : std::vector<std::pair<Arguments, std::string>>{
           {{}, "--report"},
           {{"--report", page, "--seed", "-1"}, "--seed"},
           {{"--report", page, "--family", "old"}, "--family old: must be one of smooth, serviced, worn"},
           {{"--report", page, "--machine", "none"}, "none"},
           {{"--report", folder.file("page.toml")}, "page.toml"}}) {
    const ProgramRun run = papers(arguments);
    EXPECT_EQ(run.exit_code, 2) << run.err;
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
    EXPECT_TRUE(says(run.err, said));
  }
  EXPECT_EQ(folder.count(), 0);
}

TEST(PapersPage, InterruptedLeavesNothingBehind) {
  const test::TemporaryFolder folder;
  test::RunningProgram program(test::program("knuckle-studies"), {"papers", "--report", folder.file("page.html")});
  EXPECT_TRUE(program.interrupt_when_it_listens());
  const ProgramRun run = program.wait();
  EXPECT_EQ(run.exit_code, 130) << run.err;
  EXPECT_EQ(run.err, "knuckle-studies: interrupted; nothing was written\n");
  EXPECT_EQ(folder.count(), 0);
}

}  // namespace
}  // namespace knuckle::studies
