// Any file as a recording: refused in one line, or read to its end, from its beginning and from a time on; what is
// damaged is told in lines. What is not damaged comes in the order of time. Any schema is refused or read as a state's.
#include <cstdint>
#include <string>
#include <string_view>

#include "recording/mcap/reader.h"
#include "recording/states.h"
#include "slave/slave_state.h"
#include "tests/fuzz/file_in_memory.h"
#include "tests/fuzz/require.h"

namespace {

using namespace knuckle;

using knuckle::test::refused_or;
using knuckle::test::require;
using knuckle::test::require_line;

struct Sums {
  std::uint64_t messages = 0, bytes = 0, later = 0;
  bool operator==(const Sums&) const = default;
};
Sums read_all(mcap::Reader& reader, std::uint64_t from_ns) {
  Sums sums;
  std::uint64_t last_ns = 0;
  while (const auto message = reader.next()) {
    require(message->log_time_ns >= last_ns || !reader.damages().empty());
    last_ns = message->log_time_ns;
    require(reader.topics().channels.contains(message->channel_id));
    ++sums.messages;
    for (const std::uint8_t byte : message->data) sums.bytes += byte;
    if (message->log_time_ns >= from_ns) ++sums.later;
  }
  return sums;
}

void read(const std::string& path) {
  mcap::Reader reader(path);
  for (const mcap::AttachmentEntry& entry : reader.attachments()) {
    const auto attachment = reader.read(entry);
    require(!attachment || attachment->data.size() == entry.bytes);
  }
  const std::uint64_t middle_ns =
      reader.times() ? reader.times()->first_ns / 2 + reader.times()->last_ns / 2 : std::uint64_t{1} << 62;
  const Sums first = read_all(reader, middle_ns);
  // Again: by now all channels are known that chunks hold.
  reader.seek(0);
  const Sums again = read_all(reader, middle_ns);
  require(again.messages >= first.messages);
  reader.seek(0);
  require(read_all(reader, middle_ns) == again);
  reader.seek(middle_ns);
  const Sums later = read_all(reader, middle_ns);
  require(later.messages == later.later && later.later <= again.later);
  require(reader.damages().size() <= 101);
  for (const std::string& line : reader.damages()) require_line(line);
  for (const auto& schema : reader.topics().schemas) {
    refused_or([&schema] {
      auto translation = recording::translation_to<slave::SlaveState>(schema.second.data, "file");
      if (translation) (void)translation->translated(recording::kCdrHeader);
    });
  }
  require(reader.order_notes().size() <= 2);
  for (const std::string& line : reader.order_notes()) require_line(line);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const test::FileInMemory file(std::string_view(reinterpret_cast<const char*>(data), size));
  refused_or([&file] { read(file.path()); });
  return 0;
}
