// Any 64 bytes: refused, or a report that survives being sent again. The checksum is put right, or almost nothing
// would get past it.
#include <algorithm>

#include "tests/fuzz/require.h"
#include "transport/hid_reports.h"

namespace {

template <typename Decode>
void check(const knuckle::HidReport& report, Decode decode) {
  const auto message = decode(report);
  if (!message) return;
  const knuckle::HidReport once = encode(*message);
  const auto again = decode(once);
  knuckle::test::require(again && encode(*again) == once);
}

void check_all(const knuckle::HidReport& report) {
  check(report, knuckle::decode_state);
  check(report, knuckle::decode_command);
  check(report, knuckle::decode_identity);
  (void)knuckle::is_describe_request(report);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  knuckle::HidReport report{};
  std::copy_n(data, std::min(size, report.size()), report.begin());
  check_all(report);
  const std::uint16_t crc = knuckle::crc16_ccitt_false(report.data(), report.size() - 2);
  report[62] = static_cast<std::uint8_t>(crc & 0xFF);
  report[63] = static_cast<std::uint8_t>(crc >> 8);
  check_all(report);
  return 0;
}
