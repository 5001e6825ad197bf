// `knuckle check`: every error of a file at once, every kind of file, and what follows from a right one.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "app/check/file_check.h"
#include "tests/support/places.h"
#include "tests/support/refusal.h"
#include "tests/support/run_inside.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::checking {
namespace {

namespace fs = std::filesystem;
using test::says;

const std::string kConfig = test::source_dir() + "/config";

std::string shipped(const std::string& file) {
  return test::content(kConfig + "/" + file);
}

/// The text with the line that begins with `key` behind [table] replaced; with `line` empty, without it.
std::string with_line(std::string text, const std::string& table, const std::string& key, const std::string& line) {
  const std::size_t from = table.empty() ? 0 : text.find("[" + table + "]");
  const std::size_t at = text.find("\n" + key + " =", from) + 1;
  EXPECT_NE(from, std::string::npos) << table;
  EXPECT_NE(at, 0U) << key;
  return text.replace(at, text.find('\n', at) - at, line);
}

class Check : public ::testing::Test {
 protected:
  std::string written(const std::string& text) {
    std::ofstream(file_) << text;
    return file_;
  }
  int run(const std::vector<std::string>& arguments) {
    std::vector<std::string> all{"check"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    const test::ProgramRun run = test::run_inside({"knuckle", "", "", {check_entry()}}, all);
    out_ = run.out;
    err_ = run.err;
    return run.exit_code;
  }

  const test::TemporaryFolder folder_;
  const std::string file_ = folder_.file("mine.toml");
  std::string out_, err_;
};

TEST_F(Check, EveryShippedFileIsOfItsKindAndRight) {
  int files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(kConfig)) {
    if (entry.path().extension() != ".toml") continue;
    const FileCheck found = check_file(entry.path().string(), "");
    EXPECT_EQ(found.errors, std::vector<std::string>{}) << entry.path();
    // What a machine without nodes does not tell is said of it; nothing else is noted.
    const bool tells_less = entry.path().stem() == "standard200";
    EXPECT_EQ(found.notes.size(), tells_less ? 2U : 0U) << entry.path();
    EXPECT_EQ(found.kind + (found.kind == "truth" ? "" : "s"),
              found.kind == "mapping" ? "mappings" : entry.path().parent_path().filename().string());
    ++files;
  }
  EXPECT_GT(files, 30);
}

TEST_F(Check, NineFaultsOfAMachineFileAreNineLinesAndExitCodeTwo) {
  std::string text = shipped("machines/compact080.toml");
  text = with_line(text, "links.boom", "mass_kg", "");
  text = with_line(text, "links.arm", "max_rad", "max_rad = -2.9");
  text = with_line(text, "mounts.bucket", "crank_side", "crank_side = \"up\"");
  text = with_line(text, "cylinders.boom", "max_length_m", "max_length_m = 1.6");
  text = with_line(text, "cylinders.boom", "rod_mm", "rod_mm = 400");
  text = with_line(text, "hydraulics", "main_relief_bar", "main_releif_bar = 250");
  text = with_line(text, "bus", "sync_Hz", "sync_Hz = \"200\"");
  text = with_line(text, "limits", "floor_m", "floor_m = 2");
  text = with_line(text, "control", "dither", "dither = 0.01\ndithering = true");
  EXPECT_EQ(run({written(text)}), 2);
  EXPECT_EQ(out_, "");
  for (const char* told :
       {": key 'links.boom.mass_kg' is missing\n", ": key 'links.arm.max_rad' = -2.9: must be at least 0.1 above",
        ": key 'mounts.bucket.crank_side' = 'up': must be one of", ": key 'cylinders.boom.max_length_m' = 1.6: must be",
        ": key 'cylinders.boom.rod_mm' = 400: must be below 0.95 of bore_mm",
        ": key 'hydraulics.main_relief_bar' is missing; is 'main_releif_bar' here meant to be it?",
        ": key 'bus.sync_Hz' = '200': must be a number within [50, 250]", ": key 'limits.floor_m' = 2: must be within",
        ": key 'control.dithering' = true: unknown key; did you mean 'dither'?"})
    EXPECT_TRUE(says(err_, told));
  EXPECT_EQ(std::count(err_.begin(), err_.end(), '\n'), 9) << err_;
  EXPECT_EQ(err_.rfind("knuckle: " + file_ + ":", 0), 0U) << err_;
}

TEST_F(Check, AFullBusIsToldBesideAnIdThatTwoNodesHaveButNotWhereItsFramesAreNotKnown) {
  const std::string full = with_line(shipped("machines/solar015.toml"), "bus", "bit_rate_kbps", "bit_rate_kbps = 250");
  const auto errors = [&](const std::string& from, const std::string& to) {
    std::string text = full;
    return check_file(written(text.replace(text.find(from), from.size(), to)), "").errors;
  };
  const auto twice = errors("id = 0x11", "id = 0x10");
  ASSERT_EQ(twice.size(), 2U);
  EXPECT_TRUE(says(twice[0], "bit_rate_kbps' = 250: too slow: these frames load the bus to 119.1 %"));
  EXPECT_TRUE(says(twice[1], "id' = 0x10: is taken by"));
  const auto unknown = errors("profile = \"cia410\"", "profile = \"cia409\"");
  ASSERT_EQ(unknown.size(), 1U);
  EXPECT_FALSE(says(unknown[0], "too slow"));
}

TEST_F(Check, OtherKindsTellAllTheirFaultsToo) {
  std::string scenario = shipped("scenarios/wall_contact.toml");
  scenario = with_line(scenario, "operator", "limb", "limb = \"strong\"");
  scenario = with_line(scenario, "[wall]", "friction", "friction = 9");
  scenario += "\n[[fault]]\nkind = \"meteor\"\nphase = \"nowhere\"\nafter_s = 1\nduration_s = 1\nnode = \"tilt\"\n";
  EXPECT_EQ(check_file(written(scenario), "").errors.size(), 4U);

  std::string device = shipped("devices/knuckle1.toml");
  device = with_line(device, "joints.wrist", "gear_ratio", "gear_ratio = 0");
  device = with_line(device, "feel", "off_N", "off_N = 4.5");
  EXPECT_EQ(check_file(written(device), "").errors.size(), 2U);

  std::string link = shipped("links/lte.toml");
  link = with_line(link, "", "name", "nmae = \"lte\"");
  link += "\n[[outage]]\nat_s = -1\nlength_ms = 100\nevery_s = 0.05\ndirection = \"up\"\n";
  EXPECT_EQ(check_file(written(link), "").errors.size(), 4U);

  EXPECT_EQ(
      check_file(written("[time]\ncolumn = \"t\"\nunit = \"h\"\n[[channel]]\nname = \"a\"\ncolumn = \"b\"\nunit = "
                         "\"bar\"\nsign = 2\noffset = 0\n"),
                 "")
          .errors.size(),
      3U);
}

TEST_F(Check, WhatIsNoneOfTheKindsIsRefusedAndAMachineForAFileOfNone) {
  const std::string said = test::refusal([&] { (void)check_file(written("title = \"x\"\n"), ""); });
  EXPECT_TRUE(says(said, "is none of the files that can be checked"));
  EXPECT_EQ(test::refusal([&] { (void)check_file(written(""), ""); }), file_ + ": is empty: nothing to check");
  for (const auto& [file, kind] : {std::pair{"machines/solar015.toml", "machine"}, {"links/lte.toml", "link"}}) {
    EXPECT_EQ(test::refusal([&, &name = file] { (void)check_file(kConfig + "/" + name, "compact080"); }),
              std::string("--machine compact080: does not go with a file of kind ") + kind);
  }
}

TEST_F(Check, ComputedRangesAndRatesStandBesideTheFilesAndALimitOfAnotherMachineIsNoted) {
  EXPECT_EQ(run({kConfig + "/machines/solar015.toml"}), 0);
  EXPECT_EQ(err_, "");
  // Range of the file and of the cylinder, lengths, levers, and the rate that IsRefusedWithKeyValueAndBound knows.
  for (const char* told : {"boom    -0.474 to 1.092", "0.773 to 1.114  0.755 to 1.135", "0.634\n",
                           "limits.reach_m = 3.3 m: the tip goes to 3."})
    EXPECT_TRUE(says(out_, told));
  EXPECT_EQ(run({written(with_line(shipped("machines/compact080.toml"), "limits", "reach_m", "reach_m = 3.3"))}), 0);
  EXPECT_TRUE(says(out_, "note: limits.reach_m = 3.3"));
}

TEST_F(Check, TheDrawingHasEveryPinAndTheLimits) {
  const std::string drawing = folder_.file("mine.svg");
  EXPECT_EQ(run({kConfig + "/machines/solar015.toml", "--drawing", drawing}), 0) << err_;
  const std::string svg = test::content(drawing);
  for (const char pin : std::string("ABCDEFGHJKLT")) EXPECT_TRUE(says(svg, std::string(">") + pin + "</text>"));
  for (const char* shown :
       {"reach_m = 3.3", "floor_m = -2.6", "class=\"range\"", "class=\"sweep\"", "arm -148 to -29 deg"})
    EXPECT_TRUE(says(svg, shown));
  EXPECT_EQ(run({kConfig + "/devices/knuckle1.toml", "--drawing", drawing}), 2);
  EXPECT_TRUE(says(err_, "only goes with a machine file"));
}

}  // namespace
}  // namespace knuckle::checking
