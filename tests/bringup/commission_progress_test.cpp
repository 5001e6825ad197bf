// The file by which an ended commissioning goes on: whole, of this machine, as it was written, or refused in a line.
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>

#include "app/bringup/commission_command.h"
#include "tests/support/places.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::bringup {
namespace {

using knuckle::test::says;
const ProgressOf kOf{"can0", "abc123"};

WizardProgress some() {
  WizardProgress progress;
  progress.completed = kStrokes;
  progress.serials = {{0x20, 77}, {0x30, 4000000000}};
  progress.axes[1] = {0.4171234567890123, -0.0031, true, std::nullopt, 0.1, 0.0625};
  progress.findings = {{Finding::Level::kOk, "arm", "encoder preset: 512.0 mm before, 510.2 mm now"},
                       {Finding::Level::kNote, "bucket", "skipped"}};
  return progress;
}

class ProgressFile : public testing::Test {
 protected:
  std::string refusal(const ProgressOf& of = kOf) const {
    return knuckle::test::refusal([&] { (void)read_progress(file_, of); });
  }
  std::string text() const { return knuckle::test::content(file_); }
  void put(const std::string& text) const { std::ofstream(file_) << text; }

  knuckle::test::TemporaryFolder folder_;
  std::string file_ = progress_file(folder_.file("found.toml"));
};

TEST_F(ProgressFile, IsReadAsItWasWrittenToTheLastDigit) {
  write_progress(file_, some(), kOf);
  const WizardProgress read = read_progress(file_, kOf);
  EXPECT_EQ(read.completed, kStrokes);
  EXPECT_EQ(read.serials, some().serials);
  EXPECT_EQ(read.axes[1].stroke_m, some().axes[1].stroke_m);
  EXPECT_EQ(read.axes[1].offset_m, some().axes[1].offset_m);
  EXPECT_TRUE(read.axes[1].preset);
  EXPECT_EQ(read.axes[1].zero_shift, some().axes[1].zero_shift);
  EXPECT_EQ(read.axes[1].dead_band_retract, some().axes[1].dead_band_retract);
  EXPECT_FALSE(read.axes[1].dead_band_extend);
  EXPECT_FALSE(read.axes[0].stroke_m);
  ASSERT_EQ(read.findings.size(), 2u);
  EXPECT_EQ(read.findings[1].level, Finding::Level::kNote);
  EXPECT_EQ(read.findings[0].text, some().findings[0].text);
}

TEST_F(ProgressFile, IsRefusedInOneLineWhereItIsOfAnotherMachineOrBus) {
  write_progress(file_, some(), kOf);
  const std::string other_machine = refusal({"can0", "another"}), other_bus = refusal({"can1", "abc123"});
  EXPECT_TRUE(says(other_machine, "is of another machine file"));
  EXPECT_TRUE(says(other_bus, "is of the bus can0, not can1"));
  for (const std::string& why : {other_machine, other_bus}) EXPECT_FALSE(says(why, "\n"));
  EXPECT_EQ(refusal(), "accepted") << "of this one";
}

TEST_F(ProgressFile, IsRefusedInOneLineWhateverWasChangedInIt) {
  write_progress(file_, some(), kOf);
  const std::string whole = text();
  int refused = 0;
  for (std::size_t i = 0; i < whole.size(); ++i) {
    if (std::isalnum(static_cast<unsigned char>(whole[i])) == 0) continue;
    std::string changed = whole;
    changed[i] = changed[i] == '1' ? '2' : '1';
    put(changed);
    const std::string why = refusal();
    EXPECT_NE(why, "accepted") << "byte " << i << ": " << changed.substr(i > 20 ? i - 20 : 0, 40);
    EXPECT_FALSE(says(why, "\n"));
    ++refused;
  }
  EXPECT_GT(refused, 300);
  for (const std::string& bad :
       {std::string(), std::string("{}"), std::string("[1, 2"), whole.substr(0, whole.size() / 2)}) {
    put(bad);
    EXPECT_TRUE(says(refusal(), "begin anew, without --resume")) << bad;
  }
  std::remove(file_.c_str());
  EXPECT_EQ(refusal(),
            "--resume " + file_ + ": no earlier run to go on with is kept there: begin anew, without --resume");
}

}  // namespace
}  // namespace knuckle::bringup
