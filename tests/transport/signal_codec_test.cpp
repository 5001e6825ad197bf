// Numbers in frames: against a decoder that goes bit by bit, and canmatrix.
#include "transport/signal_codec.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <fstream>
#include <limits>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "tests/support/no_alloc.h"
#include "tests/support/places.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"
#include "transport/timed_frame.h"

namespace knuckle {
namespace {

using Type = BitField::Type;
using Order = BitField::Order;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Where the bits of a field are, least significant first: 8 * byte + bit. Big endian goes from the most significant
/// bit down through its byte, then on at the top of the next. Empty where they are not all in a frame.
std::vector<int> bit_places(const BitField& field) {
  std::vector<int> places;
  int at = field.start_bit;
  for (int i = 0; i < field.bits; ++i) {
    if (at >= 64) return {};
    places.push_back(at);
    at = field.order == Order::kLittleEndian ? at + 1 : at % 8 == 0 ? at + 15 : at - 1;
  }
  if (field.order == Order::kBigEndian) std::reverse(places.begin(), places.end());
  return places;
}

std::uint64_t read_bit_by_bit(const BitField& field, const CanFrame& frame) {
  std::uint64_t raw = 0;
  const std::vector<int> places = bit_places(field);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto byte = frame.data[static_cast<std::size_t>(places[i] / 8)];
    if ((byte >> (places[i] % 8) & 1) != 0) raw += std::uint64_t{1} << i;
  }
  return raw;
}

/// As mathematics has it: a signed number with its top bit is 2^bits less.
double meaning(const BitField& field, std::uint64_t raw) {
  if (field.type == Type::kFloat)
    return field.bits == 32 ? double{std::bit_cast<float>(static_cast<std::uint32_t>(raw))}
                            : std::bit_cast<double>(raw);
  const bool negative = field.type == Type::kSigned && (raw >> (field.bits - 1) & 1) != 0;
  if (!negative) return static_cast<double>(raw);
  return -static_cast<double>(field.bits == 64 ? ~raw + 1 : (std::uint64_t{1} << field.bits) - raw);
}

class DrawnFields {
 public:
  explicit DrawnFields(std::uint64_t seed) : random_(seed) {}
  std::uint64_t word() { return random_(); }
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  CanFrame frame(std::uint8_t size = 8) {
    CanFrame frame;
    frame.size = size;
    for (auto& byte : frame.data) byte = static_cast<std::uint8_t>(word());
    return frame;
  }
  /// Of any kind, somewhere in a frame.
  BitField field() {
    BitField field;
    do {
      field.type = static_cast<Type>(word() % 3);
      field.order = static_cast<Order>(word() % 2);
      field.start_bit = static_cast<std::uint8_t>(word() % 64);
      field.bits = static_cast<std::uint8_t>(field.type == Type::kFloat ? 32 << word() % 2 : 1 + word() % 64);
    } while (bit_places(field).empty());
    return field;
  }

 private:
  std::mt19937_64 random_;
};

std::string told(const BitField& f) {
  constexpr std::array kTypes{"unsigned", "signed", "float"};
  return std::string(kTypes[static_cast<std::size_t>(f.type)]) + " of " + std::to_string(f.bits) + " bits from " +
         std::to_string(f.start_bit) + (f.order == Order::kLittleEndian ? ", little" : ", big") + " endian";
}

void expect_same(double value, double expected, const std::string& what) {
  if (std::isnan(expected)) {
    EXPECT_TRUE(std::isnan(value)) << what;
  } else {
    EXPECT_EQ(std::bit_cast<std::uint64_t>(value), std::bit_cast<std::uint64_t>(expected)) << what << ": " << value;
  }
}

TEST(SignalCodec, ReadsAnyFieldAsADecoderThatGoesBitByBit) {
  DrawnFields drawn(1);
  for (int n = 0; n < 20000; ++n) {
    const BitField field = drawn.field();
    const CanFrame frame = drawn.frame();
    const std::uint64_t raw = read_bit_by_bit(field, frame);
    ASSERT_EQ(read_raw(field, frame), raw) << told(field);
    expect_same(read_value(field, frame).value(), meaning(field, raw), told(field));
  }
}

TEST(SignalCodec, WritesItsOwnBitsAndNoOthers) {
  DrawnFields drawn(2);
  for (int n = 0; n < 20000; ++n) {
    const BitField field = drawn.field();
    const CanFrame before = drawn.frame();
    const std::uint64_t raw = drawn.word();  // its bits above the field's do not count
    CanFrame frame = before;
    write_raw(field, raw, frame);
    const std::uint64_t unused = 64U - field.bits;
    ASSERT_EQ(read_bit_by_bit(field, frame), raw << unused >> unused) << told(field);
    const std::vector<int> own = bit_places(field);
    for (int bit = 0; bit < 64; ++bit) {
      if (std::find(own.begin(), own.end(), bit) != own.end()) continue;
      const auto byte = static_cast<std::size_t>(bit / 8);
      ASSERT_EQ((frame.data[byte] ^ before.data[byte]) >> bit % 8 & 1, 0) << told(field) << ", bit " << bit;
    }
  }
}

TEST(SignalCodec, NeedsAFrameThatReachesToTheFieldsLastBitAndWritingMakesItSoLong) {
  DrawnFields drawn(3);
  for (int n = 0; n < 5000; ++n) {
    const BitField field = drawn.field();
    const std::vector<int> places = bit_places(field);
    const int bytes = *std::max_element(places.begin(), places.end()) / 8 + 1;
    ASSERT_EQ(bytes_of(field), bytes) << told(field);
    for (std::uint8_t size = 0; size <= 8; ++size) {
      CanFrame frame = drawn.frame(size);
      ASSERT_EQ(read_raw(field, frame).has_value(), size >= bytes) << told(field) << ", " << int{size};
      ASSERT_EQ(read_value(field, frame).has_value(), size >= bytes);
      write_raw(field, 0, frame);
      ASSERT_EQ(frame.size, std::max<int>(size, bytes)) << told(field);
    }
  }
}

TEST(SignalCodec, AFieldThatNoFrameCanHaveIsNeitherReadNorWritten) {
  int beyond = 0;
  for (unsigned n = 0; n < 0x20000; ++n) {
    const BitField field{Type::kUnsigned, static_cast<Order>(n >> 16), static_cast<std::uint8_t>(n),
                         static_cast<std::uint8_t>(n >> 8)};
    if (!bit_places(field).empty()) continue;
    ++beyond;
    CanFrame frame;
    frame.size = 8;
    ASSERT_FALSE(read_raw(field, frame)) << told(field);
    ASSERT_FALSE(read_value(field, frame)) << told(field);
    write_raw(field, ~std::uint64_t{0}, frame);
    write_value(field, 1, frame);
    ASSERT_EQ(frame.data, CanFrame{}.data) << told(field);
    ASSERT_FALSE(overlap(field, field));
  }
  EXPECT_GT(beyond, 100000);
}

TEST(SignalCodec, AtTheBordersOfBytesAndOfTheFrame) {
  CanFrame frame;
  frame.size = 8;
  frame.data = {0x01, 0x23, 0x45, 0x67, 0x89, 0xAB, 0xCD, 0xEF};
  struct Case {
    BitField field;
    double value;
  };
  const Case cases[]{
      {{Type::kUnsigned, Order::kLittleEndian, 0, 64}, 0xEFCDAB8967452301p0},
      {{Type::kUnsigned, Order::kBigEndian, 7, 64}, 0x0123456789ABCDEFp0},
      {{Type::kSigned, Order::kLittleEndian, 0, 64}, -0x1032547698BADCFFp0},
      {{Type::kUnsigned, Order::kLittleEndian, 8, 16}, 0x4523},
      {{Type::kUnsigned, Order::kBigEndian, 15, 16}, 0x2345},
      {{Type::kUnsigned, Order::kLittleEndian, 4, 8}, 0x30},
      {{Type::kUnsigned, Order::kBigEndian, 3, 8}, 0x12},   // over the border of bytes 0 and 1
      {{Type::kUnsigned, Order::kBigEndian, 8, 2}, 0b10},   // bit 0 of byte 1, then bit 7 of byte 2
      {{Type::kUnsigned, Order::kLittleEndian, 63, 1}, 1},  // the last bit of all
      {{Type::kUnsigned, Order::kBigEndian, 56, 1}, 1},     // which comes last in big endian
      {{Type::kSigned, Order::kLittleEndian, 63, 1}, -1},   // one signed bit
      {{Type::kSigned, Order::kLittleEndian, 56, 8}, -17},  // 0xEF
      {{Type::kSigned, Order::kBigEndian, 63, 8}, -17},     //
      {{Type::kSigned, Order::kBigEndian, 7, 8}, 1},        //
      {{Type::kUnsigned, Order::kLittleEndian, 0, 8, 0.4, -40}, -39.6},
  };
  for (const Case& c : cases) EXPECT_EQ(read_value(c.field, frame), c.value) << told(c.field);
  frame.data.fill(0xFF);
  for (std::uint8_t bits = 1; bits <= 64; ++bits)
    EXPECT_EQ(read_value({Type::kSigned, Order::kLittleEndian, 0, bits}, frame), -1.0) << int{bits};
}

TEST(SignalCodec, WritesTheNearestValueOfAllThatTheFieldHas) {
  DrawnFields drawn(4);
  for (int n = 0; n < 3000; ++n) {
    BitField field = drawn.field();
    if (field.type == Type::kFloat) field.type = Type::kSigned;
    field.bits = static_cast<std::uint8_t>(1 + drawn.word() % 8);
    field.scale = drawn.uniform(0.01, 3) * (drawn.word() % 2 == 0 ? 1 : -1);
    field.offset = drawn.uniform(-100, 100);
    const double value = drawn.uniform(-600, 600);
    double least = kInfinity;
    for (std::uint64_t raw = 0; raw < 1U << field.bits; ++raw)
      least = std::min(least, std::abs(meaning(field, raw) * field.scale + field.offset - value));
    const std::uint64_t raw = raw_of(field, value);
    ASSERT_LT(raw, 1U << field.bits) << told(field);
    EXPECT_LE(std::abs(value_of(field, raw) - value), least + 1e-9) << told(field) << ", " << value;
  }
}

TEST(SignalCodec, WhatItHasReadItWritesAgain) {
  DrawnFields drawn(5);
  for (int n = 0; n < 20000; ++n) {
    BitField field = drawn.field();
    if (field.type != Type::kFloat && field.bits > 40) field.bits = 40;  // beyond, a double has fewer steps
    if (field.type != Type::kFloat) {
      field.scale = drawn.uniform(1e-4, 10);
      field.offset = field.scale * drawn.uniform(-1000, 1000);
    }
    if (bit_places(field).empty()) continue;
    const CanFrame before = drawn.frame();
    const double value = read_value(field, before).value();
    if (std::isnan(value)) continue;
    CanFrame after = before;
    write_value(field, value, after);
    ASSERT_EQ(after, before) << told(field) << ", " << value;
  }
}

TEST(SignalCodec, SaturatesAtTheFieldsRangeAndTakesNanForZero) {
  using F = BitField;
  constexpr auto kLittle = Order::kLittleEndian;
  constexpr std::uint64_t kAll = ~std::uint64_t{0}, kTop = std::uint64_t{1} << 63;
  struct Case {
    BitField field;
    double value;
    std::uint64_t raw;
  };
  const Case cases[]{
      {F{Type::kUnsigned, kLittle, 0, 8}, 255.4, 255},
      {F{Type::kUnsigned, kLittle, 0, 8}, 256, 255},
      {F{Type::kUnsigned, kLittle, 0, 8}, kInfinity, 255},
      {F{Type::kUnsigned, kLittle, 0, 8}, -1, 0},
      {F{Type::kUnsigned, kLittle, 0, 8}, -kInfinity, 0},
      {F{Type::kUnsigned, kLittle, 0, 8}, kNan, 0},
      {F{Type::kUnsigned, kLittle, 0, 8}, 2.5, 3},  // a tie
      {F{Type::kSigned, kLittle, 0, 8}, -2.5, 0xFD},
      {F{Type::kSigned, kLittle, 0, 8}, 127.6, 127},
      {F{Type::kSigned, kLittle, 0, 8}, -129, 128},
      {F{Type::kSigned, kLittle, 0, 1}, 1, 0},
      {F{Type::kSigned, kLittle, 0, 1}, -5, 1},
      {F{Type::kUnsigned, kLittle, 0, 64}, 1.9e19, kAll},
      {F{Type::kUnsigned, kLittle, 0, 64}, 0x1p63, kTop},
      {F{Type::kUnsigned, kLittle, 0, 64}, kInfinity, kAll},
      {F{Type::kSigned, kLittle, 0, 64}, 1e19, kAll >> 1},
      {F{Type::kSigned, kLittle, 0, 64}, -1e19, kTop},
      {F{Type::kSigned, kLittle, 0, 64}, -1, kAll},
      {F{Type::kUnsigned, kLittle, 0, 16, 0.0005, -16}, kNan, 32000},  // standstill, not full speed backwards
      {F{Type::kUnsigned, kLittle, 0, 16, 0.0005, -16}, 0, 32000},
      {F{Type::kUnsigned, kLittle, 0, 8, 1, 5}, kNan, 0},       // 0 is below its range ...
      {F{Type::kUnsigned, kLittle, 0, 8, -1, 300}, kNan, 255},  // ... and beyond it
      {F{Type::kUnsigned, kLittle, 0, 8, 0}, 0, 0},             // no scale at all, and still a number
      {F{Type::kFloat, kLittle, 0, 32}, kInfinity, 0x7F800000},
      {F{Type::kFloat, kLittle, 0, 32}, -1.5, 0xBFC00000},
      {F{Type::kFloat, kLittle, 0, 64}, -kInfinity, 0xFFF0000000000000},
  };
  for (const Case& c : cases) EXPECT_EQ(raw_of(c.field, c.value), c.raw) << told(c.field) << ", " << c.value;
  for (const std::uint8_t bits : std::array<std::uint8_t, 2>{32, 64}) {
    const BitField field{Type::kFloat, kLittle, 0, bits, 0.1, 7};
    EXPECT_TRUE(std::isnan(value_of(field, raw_of(field, kNan))));
  }
}

TEST(SignalCodec, FieldsOverlapWhereTheyShareABit) {
  DrawnFields drawn(6);
  int shared = 0;
  for (int n = 0; n < 20000; ++n) {
    BitField a = drawn.field(), b = drawn.field();
    for (BitField* field : {&a, &b}) {
      if (field->bits > 20) field->bits = static_cast<std::uint8_t>(field->bits / 4);
    }
    const std::vector<int> of_a = bit_places(a), of_b = bit_places(b);
    const bool common = std::any_of(of_a.begin(), of_a.end(),
                                    [&](int bit) { return std::find(of_b.begin(), of_b.end(), bit) != of_b.end(); });
    ASSERT_EQ(overlap(a, b), common) << told(a) << "; " << told(b);
    ASSERT_EQ(overlap(b, a), common);
    shared += common ? 1 : 0;
  }
  EXPECT_GT(shared, 3000);
  EXPECT_LT(shared, 17000);
}

TEST(SignalCodec, AllocatesNothing) {
  DrawnFields drawn(7);
  const BitField field = drawn.field();
  CanFrame frame;
  const test::NoAllocScope scope;
  write_value(field, 1, frame);
  const auto value = read_value(field, frame);
  EXPECT_EQ(scope.allocations(), 0U);
  EXPECT_TRUE(value);
}

// ---- canmatrix

/// One message of 8 bytes a field, in its identifier.
std::string dbc_of(const std::vector<BitField>& fields) {
  std::string messages, floats;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const BitField& f = fields[i];
    const std::string id = std::to_string(i + 1), name = "s" + id;
    const char order = f.order == Order::kLittleEndian ? '1' : '0', sign = f.type == Type::kUnsigned ? '+' : '-';
    messages += "BO_ " + id + " m" + id + ": 8 Vector__XXX\n SG_ " + name + " : " + std::to_string(f.start_bit) + "|" +
                std::to_string(f.bits) + "@" + order + sign + " (1,0) [0|0] \"\" Vector__XXX\n\n";
    if (f.type == Type::kFloat)
      floats += "SIG_VALTYPE_ " + id + " " + name + " : " + (f.bits == 32 ? "1" : "2") + ";\n";
  }
  return "VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_:\n\n" + messages + floats;
}

TEST(SignalCodec, CanmatrixReadsWhatIsWrittenAndTheSameOfAnyFrame) {
  DrawnFields drawn(9);
  std::vector<BitField> fields;
  std::set<std::pair<Type, Order>> kinds;
  for (int n = 0; n < 500; ++n) {
    fields.push_back(drawn.field());
    kinds.insert({fields.back().type, fields.back().order});
  }
  EXPECT_EQ(kinds.size(), 6U);
  fields.push_back({Type::kSigned, Order::kBigEndian, 7, 64});
  fields.push_back({Type::kUnsigned, Order::kLittleEndian, 0, 64});
  std::vector<CanFrame> frames;
  std::vector<std::uint64_t> raws;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    for (int n = 0; n < 4; ++n) {
      CanFrame frame = drawn.frame();
      frame.id = static_cast<std::uint32_t>(i + 1);
      if (n % 2 == 0) write_raw(fields[i], drawn.word(), frame);
      frames.push_back(frame);
      raws.push_back(read_raw(fields[i], frame).value());
    }
  }
  const test::TemporaryFolder folder;
  const std::string dbc = folder.file("fields.dbc"), log = folder.file("frames.log"), out = folder.file("out");
  std::ofstream(dbc) << dbc_of(fields);
  {
    std::ofstream file(log);
    for (const CanFrame& frame : frames) file << candump_line(Time{}, frame) << '\n';
  }
  const std::string witness = test::source_dir() + "/tests/export/canmatrix_witness.py";
  const test::ProgramRun run = test::run_program("/usr/bin/python3", {witness, "raw", dbc, log, out});  // Debian's
  if (run.exit_code == 77 || run.exit_code == 127)
    GTEST_SKIP() << "NOT TESTED: canmatrix is not installed (python3-canmatrix)";
  ASSERT_EQ(run.exit_code, 0) << run.err;
  std::ifstream answer(out);
  for (std::size_t n = 0; n < frames.size(); ++n) {
    const BitField& field = fields[frames[n].id - 1];
    std::string line;
    ASSERT_TRUE(std::getline(answer, line)) << n;
    const std::string number = line.substr(line.find('=') + 1);
    if (field.type == Type::kUnsigned) {
      EXPECT_EQ(number, std::to_string(raws[n])) << told(field);
    } else if (field.type == Type::kSigned) {
      const unsigned unused = 64U - field.bits;
      EXPECT_EQ(number, std::to_string(static_cast<std::int64_t>(raws[n] << unused) >> unused)) << told(field);
    } else {
      expect_same(std::strtod(number.c_str(), nullptr), value_of(field, raws[n]), told(field));
    }
  }
}

}  // namespace
}  // namespace knuckle
