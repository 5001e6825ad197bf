// What a recording says of itself; foreign and damaged heads are refused with their key.
#include <gtest/gtest.h>

#include "core/error.h"
#include "recording/recording.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"

namespace knuckle::test {
namespace {

TEST(RecordingHead, SurvivesTheFile) {
  recording::Head head;
  head.program = "knuckle slave --can can0";
  head.version = "1.2.3";
  head.started_unix_ns = 1'700'000'000'123'456'789;
  head.has_machine = true;
  head.machine_start = {~std::uint64_t{0}, Duration(std::int64_t{1} << 56)};
  head.law = "cues";
  head.part = 7;
  const recording::Head read = recording::head_of(recording::metadata_of(head), "FILE");
  EXPECT_EQ(recording::metadata_of(read), recording::metadata_of(head));
  EXPECT_EQ(read.machine_start.session, head.machine_start.session);
}

TEST(RecordingHead, ForeignOrDamagedOnesAreRefusedWithTheirKey) {
  const mcap::Metadata good = recording::metadata_of({});
  for (const auto& [key, value] : good.values) {
    if (key == "imported") continue;  // recordings from before there were imports have none
    mcap::Metadata missing = good;
    missing.values.erase(key);
    EXPECT_TRUE(says(refusal([&] { (void)recording::head_of(missing, "FILE"); }), key));
  }
  for (const char* version : {"6", "12"}) {
    mcap::Metadata other = good;
    other.values["link_version"] = version;
    EXPECT_TRUE(says(refusal([&] { (void)recording::head_of(other, "FILE"); }),
                     std::string("link_version = ") + version + ": must be 7 to 11"));
  }
  mcap::Metadata older = good;
  older.values["link_version"] = "7";
  EXPECT_EQ(recording::head_of(older, "FILE").link_version, 7);
  mcap::Metadata odd = good;
  odd.values["part"] = "seven";
  EXPECT_THROW((void)recording::head_of(odd, "FILE"), InputError);
}

}  // namespace
}  // namespace knuckle::test
