// Cost of reading what the sensors send after one SYNC as fields of frames, beside a decoder made for each frame.
#include <benchmark/benchmark.h>

#include <array>
#include <chrono>
#include <cmath>
#include <vector>

#include "core/quantile.h"
#include "tests/support/sensor_frames.h"
#include "transport/canopen.h"
#include "transport/signal_codec.h"

namespace knuckle {
namespace {

constexpr double kCodecBudget = 2;  // of the decoders made for their frames
constexpr int kSyncs = 1000;        // a timed stretch

struct Located {
  std::size_t frame = 0;
  BitField field;
};

/// Six pressures, three lengths, a tilt.
std::array<CanFrame, 10> frames_of_a_sync() {
  std::array<CanFrame, 10> frames;
  for (std::size_t i = 0; i < 6; ++i) frames[i] = canopen::pressure_frame(0x1A0, {1e6 * static_cast<double>(i), 0});
  for (std::size_t i = 6; i < 9; ++i) frames[i] = canopen::encoder_frame(0x1B0, {0.1 * static_cast<double>(i), 0.01});
  frames[9] = canopen::tilt_frame(0x1B8, -0.05);
  return frames;
}

/// Of them what the slave reads: value and status of the pressures, the other values.
std::array<Located, 16> fields_of_a_sync() {
  using Type = BitField::Type;
  constexpr auto kLittle = BitField::Order::kLittleEndian;
  std::array<Located, 16> fields;
  for (std::size_t i = 0; i < 6; ++i) {
    fields[2 * i] = {i, {Type::kSigned, kLittle, 0, 32, canopen::kPressureStep_Pa}};
    fields[2 * i + 1] = {i, {Type::kUnsigned, kLittle, 32, 8}};
  }
  for (std::size_t i = 6; i < 9; ++i) fields[6 + i] = {i, {Type::kSigned, kLittle, 0, 32, canopen::kEncoderStep_m}};
  fields[15] = {9, {Type::kSigned, kLittle, 0, 16, canopen::kTiltStep_rad}};
  return fields;
}

double read_as_fields(const std::array<CanFrame, 10>& frames, const std::array<Located, 16>& fields) {
  double sum = 0;
  for (const Located& located : fields) sum += read_value(located.field, frames[located.frame]).value_or(0);
  return sum;
}

double read_as_made(const std::array<CanFrame, 10>& frames) {
  double sum = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    const auto reading = canopen::parse_pressure(frames[i]).value_or(canopen::PressureReading{});
    sum += reading.pressure_Pa + reading.status;
  }
  for (std::size_t i = 6; i < 9; ++i)
    sum += canopen::parse_encoder(frames[i]).value_or(canopen::EncoderReading{}).position_m;
  return sum + canopen::parse_tilt(frames[9]).value_or(0);
}

/// Both in turns, so that what else runs on the computer does not count.
void BM_SignalCodecOfASync(benchmark::State& bench) {
  std::array<CanFrame, 10> frames = frames_of_a_sync();
  auto fields = fields_of_a_sync();
  std::vector<double> codec_ns, made_ns;
  double difference = 0;
  const auto timed = [&](std::vector<double>& all_ns, const auto& call) {
    double sum = 0;
    const auto start = std::chrono::steady_clock::now();
    for (int n = 0; n < kSyncs; ++n) {
      benchmark::DoNotOptimize(frames.data());
      benchmark::DoNotOptimize(fields.data());
      benchmark::ClobberMemory();
      sum += call();
    }
    const std::chrono::duration<double, std::nano> taken = std::chrono::steady_clock::now() - start;
    all_ns.push_back(taken.count() / kSyncs);
    return sum;
  };
  for (auto _ : bench) {
    difference += timed(codec_ns, [&] { return read_as_fields(frames, fields); });
    difference -= timed(made_ns, [&] { return read_as_made(frames); });
    bench.SetIterationTime(1e-9 * codec_ns.back());
  }
  const double ratio = median(codec_ns) / median(made_ns);
  bench.counters["codec_ns"] = median(codec_ns);
  bench.counters["made_ns"] = median(made_ns);
  bench.counters["ratio"] = ratio;
  if (ratio > kCodecBudget) bench.SkipWithError("takes more than twice the decoders made for these frames");
  if (std::abs(difference) > 1e-3) bench.SkipWithError("the two do not read the same");
}
BENCHMARK(BM_SignalCodecOfASync)->UseManualTime()->Iterations(500);

}  // namespace
}  // namespace knuckle
