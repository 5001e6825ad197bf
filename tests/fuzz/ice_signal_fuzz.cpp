// What a rendezvous may send: lines, and in them signals. Refused, or the same when it is written again.
#include <cstdlib>
#include <string_view>

#include "transport/ice/rendezvous_line.h"
#include "transport/ice/signal.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace knuckle::ice;
  const std::span<const std::uint8_t> bytes(data, size);
  if (const auto signal = decode(bytes)) {
    if (signal->candidates.size() > kMostCandidates) std::abort();
    const Bytes again = encode(*signal);
    if (again.size() != size || !std::equal(again.begin(), again.end(), data)) std::abort();
  }
  (void)verified(bytes, {});
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  (void)parse_request(text);
  (void)parse_notice(text);
  if (const auto inside = bytes_of_base64(text))
    if (base64(*inside) != text) std::abort();
  LineBuffer buffer;
  if (buffer.add(text))
    while (buffer.next()) {
    }
  return 0;
}
