// Messages, chunks and files that the tests of the format share.
#pragma once

#include <algorithm>
#include <cstdint>
#include <ostream>
#include <random>
#include <string>
#include <vector>

#include "recording/mcap/chunk.h"
#include "recording/mcap/file_writer.h"
#include "recording/mcap/reader.h"

namespace knuckle::mcap {

/// A message with data of its own.
struct Kept {
  std::uint16_t channel_id = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time_ns = 0;
  std::uint64_t publish_time_ns = 0;
  std::vector<std::uint8_t> data;
  bool operator==(const Kept&) const = default;
};
inline std::ostream& operator<<(std::ostream& out, const Kept& m) {
  return out << "message of channel " << m.channel_id << " at " << m.log_time_ns << " ns, " << m.data.size()
             << " bytes";
}

/// Channels 1 to 4; the last has no schema.
[[nodiscard]] inline Topics sample_topics() {
  Topics topics;
  const auto state = topics.add(Schema{"state", "jsonschema", R"({"type": "object"})"});
  const auto frame = topics.add(Schema{"frame", "protobuf", std::string("\0\1\2", 3)});
  (void)topics.add(Channel{"/slave/state", "json", state, {{"unit", "m"}}});
  (void)topics.add(Channel{"/can/in", "protobuf", frame, {}});
  (void)topics.add(Channel{"/can/out", "protobuf", frame, {{"interface", "can0"}, {"rate", "500000"}}});
  (void)topics.add(Channel{"/raw", "", 0, {}});
  return topics;
}

[[nodiscard]] inline std::vector<Kept> random_messages(std::mt19937& random, std::size_t count) {
  std::vector<Kept> messages(count);
  for (Kept& m : messages) {
    m.channel_id = static_cast<std::uint16_t>(1 + random() % 4);
    m.sequence = static_cast<std::uint32_t>(random());
    m.log_time_ns = random();
    m.publish_time_ns = random() % 3 ? m.log_time_ns : std::uint64_t{random()} << 32;
    m.data.resize(random() % 10 ? random() % 100 : random() % 5000);
    const bool compressible = random() % 2;
    for (std::uint8_t& byte : m.data) byte = static_cast<std::uint8_t>(compressible ? random() % 3 : random());
  }
  return messages;
}

inline constexpr std::uint32_t kPerSecond = 6;
/// Of second `second`, 150 ms apart, ascending, of channels 1 to 3.
[[nodiscard]] inline std::vector<Kept> sample_messages(std::uint32_t second) {
  std::vector<Kept> messages;
  for (std::uint32_t i = 0; i < kPerSecond; ++i) {
    const std::uint64_t at = 1'000'000'000ull * second + 150'000'000ull * i;
    const auto byte = static_cast<std::uint8_t>(16 * second + i);
    messages.push_back({static_cast<std::uint16_t>(1 + i % 3), i / 3, at, at - std::min<std::uint64_t>(at, 1000),
                        std::vector<std::uint8_t>(i % 7, byte)});
  }
  return messages;
}
[[nodiscard]] inline Chunk sample_chunk(std::uint32_t second, Compression compression = {}) {
  ChunkBuilder builder;
  for (const Kept& m : sample_messages(second))
    builder.add(m.channel_id, m.sequence, m.log_time_ns, m.publish_time_ns, m.data);
  return builder.finish(compression);
}

[[nodiscard]] inline std::vector<Kept> read_all(Reader& reader) {
  std::vector<Kept> messages;
  while (const auto m = reader.next())
    messages.push_back(
        {m->channel_id, m->sequence, m->log_time_ns, m->publish_time_ns, {m->data.begin(), m->data.end()}});
  return messages;
}

}  // namespace knuckle::mcap
