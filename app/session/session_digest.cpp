#include "app/session/session_digest.h"

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "app/cli/digest.h"
#include "core/fields.h"

namespace knuckle::session {
namespace {

constexpr std::size_t kDigits = 16;

void append(std::string& bytes, const void* from, std::size_t size) {
  bytes.append(static_cast<const char*>(from), size);
}

std::string digest_of(std::string_view bytes) {
  cli::Digest digest;
  digest.add(bytes);
  return digest.finish();
}

/// Without padding: values only.
std::string bytes_of(const FrameLog& frames) {
  std::string bytes;
  for (const TimedFrame& timed : frames) {
    const std::int64_t at_ns = timed.at.time_since_epoch().count();
    append(bytes, &at_ns, sizeof at_ns);
    append(bytes, &timed.frame.id, sizeof timed.frame.id);
    append(bytes, &timed.frame.size, sizeof timed.frame.size);
    append(bytes, timed.frame.data.data(), timed.frame.data.size());
  }
  return bytes;
}

}  // namespace

SessionDigest digest_of(const std::vector<Sample>& rows, const FrameLog& frames) {
  SessionDigest session;
  std::string bytes, all;
  const auto add = [&](const std::string& field) {
    session.lines.push_back({field, digest_of(bytes).substr(0, kDigits)});
    all += field + ' ' + session.lines.back().digest + '\n';
    bytes.clear();
  };
  for (const Field& field : fields_of<Sample>()) {
    for (const Sample& row : rows) append(bytes, reinterpret_cast<const std::byte*>(&row) + field.offset, field.size);
    add(field.part.empty() ? field.name : field.part + "_" + field.name);
  }
  bytes = bytes_of(frames);
  add("frames");
  session.whole = digest_of(all);
  return session;
}

}  // namespace knuckle::session
