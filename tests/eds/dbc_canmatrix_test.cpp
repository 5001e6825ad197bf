// DBC files read by canmatrix: raw values of drawn frames, from bytes to numbers and back.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <sstream>

#include "app/eds/dbc_file.h"
#include "tests/support/places.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"
#include "transport/signal_codec.h"

namespace knuckle::eds {
namespace {

// canmatrix is otherwise where it is wrong or has no answer:
// - encode() refuses frames with SG_MUL_VAL_: the witness calls what it packs all others with.
// - NaN has 2^23 spellings in a float; on the way through Python's numbers some become others. Left out of encoding.
// - A default of GenMsgCycleTime (BA_DEF_DEF_) is no period to it, and VECTOR__INDEPENDENT_SIG_MSG at 0xC0000000 is a
//   message: these tests ask it for neither.
// - Frames shorter than their message are refused, where Knuckle reads the signals that they reach to: none are drawn.

std::string hex(const CanFrame& frame) {
  std::string text;
  for (std::size_t i = 0; i < frame.size; ++i) {
    constexpr const char* kDigits = "0123456789abcdef";
    text += kDigits[frame.data[i] >> 4];
    text += kDigits[frame.data[i] & 0xFU];
  }
  return text;
}

class DbcAgainstCanmatrix : public ::testing::Test {
 protected:
  /// @return values and frames that were compared; nothing where canmatrix is not there.
  void compare(const std::string& path, int frames, std::uint64_t seed) {
    const DbcFile file = read_dbc(path);
    std::vector<const DbcMessage*> usable;
    for (const DbcMessage& message : file.messages)
      if (message.unusable.empty() && !message.is_of_packets() && !message.signals.empty()) usable.push_back(&message);
    std::mt19937_64 random(seed);
    std::vector<std::pair<const DbcMessage*, CanFrame>> drawn;
    for (int n = 0; n < frames; ++n) {
      const DbcMessage& message = *usable[static_cast<std::size_t>(n) % usable.size()];
      CanFrame frame{.id = message.id, .size = static_cast<std::uint8_t>(message.size)};
      for (std::size_t i = 0; i < frame.size; ++i) frame.data[i] = static_cast<std::uint8_t>(random());
      if (random() % 2 == 0) frame.data[0] &= 0x13;  // multiplexers often have a value that something is there for
      drawn.emplace_back(&message, frame);
    }
    ask(path, drawn);
  }

  void ask(const std::string& path, const std::vector<std::pair<const DbcMessage*, CanFrame>>& drawn) {
    const std::string log = folder_.file("frames.log"), out = folder_.file("out");
    {
      std::ofstream lines(log);
      for (const auto& [message, frame] : drawn) {
        const bool extended = frame.id >> 31 != 0;
        std::ostringstream id;
        id << std::hex << std::setfill('0') << std::setw(extended ? 8 : 3) << (frame.id & 0x1FFFFFFF);
        lines << "(0) can0 " << id.str() << '#' << hex(frame) << '\n';
      }
    }
    const std::string witness = test::source_dir() + "/tests/export/canmatrix_witness.py";
    const test::ProgramRun run = test::run_program("/usr/bin/python3", {witness, "both", path, log, out});  // Debian's
    if (run.exit_code == 77 || run.exit_code == 127)
      GTEST_SKIP() << "NOT TESTED: canmatrix is not installed (python3-canmatrix)";
    ASSERT_EQ(run.exit_code, 0) << run.err;
    std::ifstream answers(out);
    for (const auto& [message, frame] : drawn) {
      std::string answer;
      ASSERT_TRUE(std::getline(answers, answer));
      compare(*message, frame, answer);
      if (HasFailure()) FAIL() << message->name << " " << hex(frame) << "\n" << answer;
    }
  }

  /// One frame, and "MESSAGE, SIGNAL=RAW ..., BYTES" of the witness.
  void compare(const DbcMessage& message, const CanFrame& frame, const std::string& answer) {
    std::istringstream row(answer);
    std::string cell, last;
    ASSERT_TRUE(std::getline(row, cell, '\t'));
    EXPECT_EQ(cell, message.name);
    std::map<std::string, std::string> theirs;
    while (std::getline(row, cell, '\t')) {
      if (const auto equals = cell.find('='); equals != std::string::npos)
        theirs[cell.substr(0, equals)] = cell.substr(equals + 1);
      else
        last = cell;
    }
    CanFrame made{.id = message.id, .size = frame.size};
    std::size_t present = 0;
    for (const DbcSignal& signal : message.signals) {
      if (!is_in(frame, message, signal)) continue;
      ++present;
      const std::uint64_t raw = read_raw(signal.field, frame).value();
      const BitField unscaled{signal.field.type, signal.field.order, signal.field.start_bit, signal.field.bits};
      const unsigned unused = 64U - signal.field.bits;
      if (signal.field.type == BitField::Type::kFloat) {
        const double number = value_of(unscaled, raw), their = std::strtod(theirs[signal.name].c_str(), nullptr);
        EXPECT_TRUE(number == their || (std::isnan(number) && std::isnan(their))) << signal.name;
        if (std::isnan(number)) continue;
      } else if (signal.field.type == BitField::Type::kSigned) {
        EXPECT_EQ(theirs[signal.name], std::to_string(static_cast<std::int64_t>(raw << unused) >> unused));
      } else {
        EXPECT_EQ(theirs[signal.name], std::to_string(raw)) << signal.name;
      }
      write_raw(signal.field, raw, made);
    }
    EXPECT_EQ(present, theirs.size());
    EXPECT_EQ(hex(made), last);
    values_ += present;
    ++frames_;
  }

  const std::string own_ = test::source_dir() + "/tests/eds/excavator.dbc";
  const std::string sold_ = test::source_dir() + "/../shared/data/devices/zx200.dbc";
  std::size_t values_ = 0, frames_ = 0;

 private:
  test::TemporaryFolder folder_;
};

TEST_F(DbcAgainstCanmatrix, DrawnFramesOfAnInventedExcavatorHaveTheSameRawValuesBothWays) {
  compare(own_, 20000, 11);
}

TEST_F(DbcAgainstCanmatrix, DrawnFramesOfASoldExcavatorHaveTheSameRawValuesBothWays) {
  if (!std::filesystem::exists(sold_))
    GTEST_SKIP() << "NOT TESTED: files of devices that are sold: no ../shared/data/devices";
  compare(sold_, 10000, 12);
}

class DeepDbcAgainstCanmatrix : public DbcAgainstCanmatrix {};

TEST_F(DeepDbcAgainstCanmatrix, AMillionDrawnFramesHaveTheSameRawValuesBothWays) {
  const bool both = std::filesystem::exists(sold_);
  for (std::uint64_t seed = 100; seed < 120 && !HasFailure() && !IsSkipped(); ++seed)
    compare(both && seed % 2 == 0 ? sold_ : own_, 50000, seed);
  RecordProperty("frames", std::to_string(frames_));
  RecordProperty("values", std::to_string(values_));
  std::cout << frames_ << " frames, " << values_ << " values" << (both ? "" : "; no ../shared/data/devices") << '\n';
}

}  // namespace
}  // namespace knuckle::eds
