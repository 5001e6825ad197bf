// What a rendezvous may send: lines, and in them signals. Refused, or the same when it is written again.
#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "tests/fuzz/require.h"
#include "transport/ice/rendezvous_line.h"
#include "transport/ice/signal.h"

namespace {

using namespace knuckle::ice;

using knuckle::test::require;

/// What a server makes of a line is all of the line: nothing in it is passed over.
void check_request(std::string_view line) {
  const auto request = parse_request(line);
  if (!request) return;
  std::string again(request->verb);
  for (const std::string_view word : {request->room, request->rest})
    if (!word.empty()) again.append(" ").append(word);
  require(again == line && line.size() <= kMostLine);
}

std::vector<std::string> lines_of(std::string_view stream, std::size_t piece) {
  LineBuffer buffer;
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < stream.size(); at += piece) {
    const bool of_use = buffer.add(stream.substr(at, piece));
    while (const auto line = buffer.next()) lines.push_back(*line);
    if (!of_use) break;
  }
  return lines;
}

/// However the network cuts a stream, its lines are the same; only one that is too long may end it sooner.
void check_lines(std::string_view stream) {
  const std::vector<std::string> whole = lines_of(stream, stream.size() + 1), pieces = lines_of(stream, 7);
  const auto too_long = [](const std::string& line) { return line.size() >= kMostLine; };
  const auto end = std::find_if(whole.begin(), whole.end(), too_long);
  if (end == whole.end()) require(pieces == whole);
  for (const std::string& line : whole) {
    check_request(line);
    (void)parse_notice(line);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::uint8_t> bytes(data, size);
  if (const auto signal = decode(bytes)) {
    require(signal->candidates.size() <= kMostCandidates);
    const Bytes again = encode(*signal);
    require(again.size() == size && std::equal(again.begin(), again.end(), data));
  }
  (void)verified(bytes, {});
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  check_request(text);
  (void)parse_notice(text);
  if (const auto inside = bytes_of_base64(text)) require(base64(*inside) == text);
  check_lines(text);
  return 0;
}
