// Cost of recording: one second of a session (1200 messages, 0.9 MB) gathered into a chunk, beside a memcpy of the same
// bytes; written into a file in memory; and read again. x_memcpy is how many times as long as that memcpy it takes.
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <cstring>
#include <ctime>
#include <random>
#include <string>
#include <vector>

#include "recording/mcap/chunk.h"
#include "recording/mcap/file_writer.h"
#include "recording/mcap/reader.h"

namespace knuckle::mcap {
namespace {

constexpr std::size_t kMessages = 1200, kMessage_bytes = 750;

/// Numbers that change slowly, as a loop's state does; half of the bytes of each repeat.
std::vector<std::uint8_t> second_of_messages() {
  std::mt19937 random(1);
  std::vector<std::uint8_t> bytes(kMessages * kMessage_bytes);
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const bool noise = i % 8 < 3;
    bytes[i] = static_cast<std::uint8_t>(noise ? random() : i % kMessage_bytes);
  }
  return bytes;
}

void gather(ChunkBuilder& builder, const std::vector<std::uint8_t>& bytes) {
  for (std::size_t i = 0; i < kMessages; ++i) {
    builder.add(static_cast<std::uint16_t>(1 + i % 12), static_cast<std::uint32_t>(i), i * 833'333, i * 833'333,
                std::span(bytes).subspan(i * kMessage_bytes, kMessage_bytes));
  }
}

double processor_time_s() noexcept {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Times one call after the other, in turns with a memcpy of its input.
template <typename Call>
void beside_memcpy(benchmark::State& bench, const std::vector<std::uint8_t>& bytes, const Call& call) {
  std::vector<std::uint8_t> copy(bytes.size());
  double copied_s = 0, called_s = 0;
  for (auto _ : bench) {
    const double start = processor_time_s();
    std::memcpy(copy.data(), bytes.data(), bytes.size());
    benchmark::ClobberMemory();
    const double middle = processor_time_s();
    call();
    const double end = processor_time_s();
    copied_s += middle - start;
    called_s += end - middle;
    bench.SetIterationTime(end - middle);
  }
  bench.counters["x_memcpy"] = called_s / copied_s;
  bench.SetBytesProcessed(static_cast<std::int64_t>(bench.iterations()) * static_cast<std::int64_t>(bytes.size()));
}

/// Argument: zstd's level, 0 for no compression.
void BM_McapChunk(benchmark::State& bench) {
  const auto bytes = second_of_messages();
  const Compression compression = bench.range(0) == 0 ? Compression{} : Compression{static_cast<int>(bench.range(0))};
  ChunkBuilder builder;
  Chunk chunk;
  beside_memcpy(bench, bytes, [&] {
    gather(builder, bytes);
    chunk = builder.finish(compression, std::move(chunk));
  });
  bench.counters["compressed_to"] = static_cast<double>(chunk.bytes.size()) / static_cast<double>(bytes.size());
}
BENCHMARK(BM_McapChunk)->Arg(0)->Arg(-5)->Arg(-1)->Arg(1)->Arg(3)->UseManualTime();

/// The system's part of a write included.
void BM_McapWrite(benchmark::State& bench) {
  const auto bytes = second_of_messages();
  const std::string path = "/dev/shm/knuckle_bench_" + std::to_string(getpid()) + ".mcap";
  Topics topics;
  FileWriter writer;
  ChunkBuilder builder;
  gather(builder, bytes);
  const Chunk chunk = builder.finish({});
  bool written = true;
  beside_memcpy(bench, bytes, [&] {
    if (writer.bytes() > (64 << 20) || !writer.is_open()) {
      unlink(path.c_str());
      written = writer.open(path, topics) && written;
    }
    written = writer.append(chunk) && written;
  });
  if (!written) bench.SkipWithError("cannot write");
  unlink(path.c_str());
}
BENCHMARK(BM_McapWrite)->UseManualTime();

/// Argument: zstd's level, 0 for no compression. A file of 64 chunks.
void BM_McapRead(benchmark::State& bench) {
  const auto bytes = second_of_messages();
  const std::string path = "/dev/shm/knuckle_bench_" + std::to_string(getpid()) + ".mcap";
  const Compression compression = bench.range(0) == 0 ? Compression{} : Compression{static_cast<int>(bench.range(0))};
  constexpr int kChunks = 64;
  {
    Topics topics;
    for (int i = 0; i < 12; ++i) topics.add(Channel{"/" + std::to_string(i), "", 0, {}});
    FileWriter writer;
    bool written = writer.open(path, topics);
    ChunkBuilder builder;
    for (int i = 0; i < kChunks; ++i) {
      gather(builder, bytes);
      written = writer.append(builder.finish(compression)) && written;
    }
    if (!written) bench.SkipWithError("cannot write");
  }
  std::size_t messages = 0;
  for (auto _ : bench) {
    Reader reader(path);
    messages = 0;
    while (const auto message = reader.next()) {
      benchmark::DoNotOptimize(message->data.data());
      ++messages;
    }
  }
  if (messages != kChunks * kMessages) bench.SkipWithError("messages are missing");
  bench.SetBytesProcessed(static_cast<std::int64_t>(bench.iterations()) * kChunks *
                          static_cast<std::int64_t>(bytes.size()));
  unlink(path.c_str());
}
BENCHMARK(BM_McapRead)->Arg(0)->Arg(1);

}  // namespace
}  // namespace knuckle::mcap
