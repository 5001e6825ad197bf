// Any text as a machine's DBC: refused in one line, or messages whose signals are in their frames and apart.
#include <algorithm>
#include <cstdint>
#include <string_view>

#include "app/eds/dbc_file.h"
#include "tests/fuzz/require.h"

namespace {

using namespace knuckle;

/// A frame of this message made of the signals that it says are in it is read as it was written.
void write_and_read(const eds::DbcMessage& message, const CanFrame& drawn) {
  CanFrame made;
  made.size = static_cast<std::uint8_t>(message.size);
  for (const eds::DbcSignal& signal : message.signals) {
    test::require(bytes_of(signal.field) <= message.size && signal.field.scale != 0);
    if (is_in(drawn, message, signal)) write_raw(signal.field, read_raw(signal.field, drawn).value(), made);
  }
  for (const eds::DbcSignal& signal : message.signals) {
    const bool is = is_in(drawn, message, signal);
    test::require(is_in(made, message, signal) == is);
    if (is) test::require(read_raw(signal.field, made) == read_raw(signal.field, drawn));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  CanFrame drawn;
  drawn.size = static_cast<std::uint8_t>(std::min(size, drawn.data.size()));
  std::copy_n(data, drawn.size, drawn.data.rbegin());
  test::refused_or([&] {
    const eds::DbcFile file = eds::parse_dbc({reinterpret_cast<const char*>(data), size}, "input");
    for (const std::string& slip : file.slips) test::require_line(slip);
    for (const eds::DbcMessage& message : file.messages) {
      test::refused_or([&] { (void)file.usable(message.name); });
      test::require(message.unusable.empty() || message.signals.empty());
      if (!message.unusable.empty() || message.is_of_packets()) continue;
      drawn.size = static_cast<std::uint8_t>(message.size);
      write_and_read(message, drawn);
    }
  });
  return 0;
}
