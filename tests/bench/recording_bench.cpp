// What recording costs: processor time of a session on virtual time with a recorder beside the same session without
// one, taken in turns; the size of what is recorded; and how much faster than it went the recording is read and run
// again.
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/session/session.h"
#include "app/session/session_setup.h"
#include "recording/recorder.h"
#include "recording/recording.h"
#include "recording/replay.h"

namespace knuckle {
namespace {

constexpr double kDuration_s = 20;

double processor_time_s() noexcept {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

struct Place {
  Place() : file("/tmp/knuckle_bench_" + std::to_string(::getpid()) + ".mcap") {}
  ~Place() { std::filesystem::remove(file); }
  std::string file;
};

/// Processor time of one session. @param compression none: not recorded.
double session_s(const std::optional<mcap::Compression>& compression, const std::string& file) {
  session::SimulateOptions options;
  options.scenario = "dismantle";
  options.duration_s = kDuration_s;
  const session::LoadedSession loaded = session::load_session(options);
  session::Session session(loaded.setup);
  const double start = processor_time_s();
  std::optional<recording::Recorder> recorder;
  if (compression) {
    recording::RecorderOptions how;
    how.file = file;
    how.compression = *compression;
    how.ring_bytes = 1 << 18;
    recorder.emplace(how, session::session_head(loaded.setup, options), loaded.setup.machine);
    session.record_to(*recorder);
  }
  for (int tick = 0; !session.done(); ++tick) {
    session.step();
    if (recorder && tick % 50 == 0) recorder->drain();
  }
  if (recorder) recorder->close();
  return processor_time_s() - start;
}

/// @param bench its argument: level of zstd; 0: not compressed.
void RecordedSession(benchmark::State& bench) {
  const Place place;
  mcap::Compression compression;
  if (bench.range(0) != 0) compression.zstd_level = static_cast<int>(bench.range(0));
  std::vector<double> without, with;
  for (auto _ : bench) {
    without.push_back(session_s(std::nullopt, place.file));
    with.push_back(session_s(compression, place.file));
    bench.SetIterationTime(with.back());
  }
  const auto median = [](std::vector<double>& values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
  };
  bench.counters["x_without"] = median(with) / median(without);
  bench.counters["MB_per_min"] = 1e-6 * static_cast<double>(std::filesystem::file_size(place.file)) * 60 / kDuration_s;
}
BENCHMARK(RecordedSession)
    ->Arg(0)
    ->Arg(-5)
    ->Arg(1)
    ->Arg(3)
    ->UseManualTime()
    ->Iterations(15)
    ->Unit(benchmark::kMillisecond);

/// x_real_time: seconds of the session for each second of reading.
void ReadRecording(benchmark::State& bench) {
  const Place place;
  (void)session_s(mcap::Compression{1}, place.file);
  for (auto _ : bench) {
    recording::Recording recording({place.file});
    while (const auto entry = recording.next()) benchmark::DoNotOptimize(entry->data.data());
  }
  bench.counters["x_real_time"] =
      benchmark::Counter(kDuration_s * static_cast<double>(bench.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK(ReadRecording)->Unit(benchmark::kMillisecond);

void ReplayRecording(benchmark::State& bench) {
  const Place place;
  (void)session_s(mcap::Compression{1}, place.file);
  for (auto _ : bench) {
    recording::Recording recording({place.file});
    if (!recording::replay(recording, recording::setup_of(recording)).identical()) bench.SkipWithError("differs");
  }
  bench.counters["x_real_time"] =
      benchmark::Counter(kDuration_s * static_cast<double>(bench.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK(ReplayRecording)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace knuckle
