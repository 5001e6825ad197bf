#include <fmt/format.h>

#include <charconv>
#include <chrono>
#include <filesystem>
#include <map>
#include <optional>

#include "app/cli/interrupt.h"
#include "app/recordings/info.h"
#include "core/error.h"
#include "core/text.h"
#include "recording/events.h"
#include "recording/head.h"
#include "recording/mcap/reader.h"
#include "recording/recording.h"
#include "recording/topics.h"

namespace knuckle::recordings {
namespace {

constexpr std::size_t kMostTopics = 20, kMostRemarks = 8;

struct TopicSeen {
  std::uint64_t messages = 0, first_ns = 0, last_ns = 0;
};

/// What the head of a recording says, in the version that wrote it.
class HeadTexts {
 public:
  explicit HeadTexts(const mcap::Reader& file) {
    for (const mcap::Metadata& metadata : file.metadata())
      if (metadata.name == recording::kHeadName && !texts_) texts_ = metadata.values;
  }
  [[nodiscard]] bool there() const { return texts_.has_value(); }
  /// Empty where it says nothing.
  [[nodiscard]] std::string text(const char* key) const {
    if (!texts_) return "";
    const auto found = texts_->find(key);
    return found == texts_->end() ? "" : shortened(found->second, 200);
  }
  [[nodiscard]] bool yes(const char* key) const { return text(key) == "yes"; }
  [[nodiscard]] std::int64_t number(const char* key) const {
    const std::string value = text(key);
    std::int64_t number = 0;
    std::from_chars(value.data(), value.data() + value.size(), number);
    return number;
  }

 private:
  std::optional<mcap::Texts> texts_;
};

std::string utc(std::int64_t unix_ns) {
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  return fmt::format("{}.{:03}", utc_text(unix_ns / kSecond_ns, "%Y-%m-%d %H:%M:%S"), unix_ns % kSecond_ns / 1'000'000);
}

/// Clocks of computers that have none of their own begin in 1970.
std::string clock_doubt(std::int64_t unix_ns) {
  using std::chrono::system_clock;
  constexpr auto kFirst = std::chrono::sys_days(std::chrono::year(2020) / 1 / 1);
  const system_clock::time_point at{std::chrono::nanoseconds(unix_ns)};
  if (at < kFirst) return " (the clock was not set)";
  if (at > system_clock::now() + std::chrono::hours(24)) return " (the clock was ahead of this computer's)";
  return "";
}

std::string sides(const HeadTexts& head) {
  const bool both = head.yes("operator") && head.yes("machine");
  const std::string of = both                   ? "both sides"
                         : head.yes("operator") ? "the operator's side"
                         : head.yes("machine")  ? "the machine's side"
                                                : "the bus alone";
  return of + (head.yes("simulated") ? ", machine simulated" : "");
}

std::string kind(const HeadTexts& head) {
  if (head.yes("imported")) return "imported table";
  const std::int64_t part = head.number("part");
  return part == 0 ? "flight record" : fmt::format("recording, part {}", part);
}

void describe_head(const HeadTexts& head, const mcap::Reader& file, std::vector<std::string>& lines) {
  if (!head.there()) {
    const bool begun = !file.complete() && file.library().starts_with("knuckle ");
    lines.push_back(begun ? "  kind      recording of Knuckle, cut off before what it is of"
                          : "  kind      MCAP file of another program: " +
                                (file.library().empty() ? "it does not say which" : shortened(file.library())));
    return;
  }
  lines.push_back(fmt::format("  kind      {} of {}", kind(head), sides(head)));
  lines.push_back(fmt::format("  written   by {} ({})", head.text("program"), head.text("version")));
}

void describe_time(const HeadTexts& head, const mcap::Reader& file, std::vector<std::string>& lines) {
  if (!file.times()) return lines.push_back("  time      no messages");
  const auto [first_ns, last_ns] = *file.times();
  const double length_s = 1e-9 * static_cast<double>(last_ns - first_ns);
  if (head.yes("virtual_time")) {
    lines.push_back(fmt::format("  time      virtual, {:.3f} s to {:.3f} s: {:.3f} s",
                                1e-9 * static_cast<double>(first_ns), 1e-9 * static_cast<double>(last_ns), length_s));
  } else {
    const auto from_ns = static_cast<std::int64_t>(first_ns);
    lines.push_back(fmt::format("  time      {} to {} UTC: {:.3f} s{}", utc(from_ns),
                                utc(static_cast<std::int64_t>(last_ns)), length_s, clock_doubt(from_ns)));
  }
}

void describe_topics(const std::map<std::string, TopicSeen>& topics, std::uint64_t begin_ns,
                     std::vector<std::string>& lines) {
  lines.push_back(fmt::format("  {:<20} {:>10} {:>10} {:>12} {:>12}", "topic", "messages", "per s", "from s", "to s"));
  std::size_t shown = 0;
  for (const auto& [name, seen] : topics) {
    if (shown++ == kMostTopics) {
      lines.push_back(fmt::format("  and {} more topics", topics.size() - kMostTopics));
      break;
    }
    const auto since_s = [&](std::uint64_t ns) {
      return 1e-9 * static_cast<double>(static_cast<std::int64_t>(ns - begin_ns));
    };
    const double length_s = since_s(seen.last_ns) - since_s(seen.first_ns);
    const std::string rate =
        length_s > 0 ? fmt::format("{:.1f}", static_cast<double>(seen.messages - 1) / length_s) : "";
    lines.push_back(fmt::format("  {:<20} {:>10} {:>10} {:>12.3f} {:>12.3f}", shortened(name, 40), seen.messages, rate,
                                since_s(seen.first_ns), since_s(seen.last_ns)));
  }
}

void describe_files(const mcap::Reader& file, std::vector<std::string>& lines) {
  std::string names;
  for (const mcap::AttachmentEntry& entry : file.attachments())
    names += fmt::format("{}{} ({} bytes)", names.empty() ? "" : ", ", shortened(entry.name), entry.bytes);
  if (!names.empty()) lines.push_back("  files     " + names);
}

/// What this version of Knuckle would look for in the states, and not find.
void describe_states(const mcap::Reader& file, FileInfo& info) {
  for (const auto& [id, channel] : file.topics().channels) {
    try {
      const auto translation = recording::translation_of(file.topics(), channel, channel.topic);
      const std::string lacks = translation ? recording::lacks_text(*translation) : "";
      if (!lacks.empty()) info.lines.push_back("  " + channel.topic + ": " + lacks);
    } catch (const InputError& refusal) {
      info.whole = false;
      info.lines.push_back("  cannot be used: " + std::string(refusal.what()));
    }
  }
}

void add_remarks(const std::vector<std::string>& remarks, std::vector<std::string>& lines) {
  for (std::size_t i = 0; i < remarks.size(); ++i) {
    if (i == kMostRemarks) return lines.push_back(fmt::format("  and {} more", remarks.size() - kMostRemarks));
    lines.push_back("  " + remarks[i]);
  }
}

}  // namespace

std::string size_of_file(const std::string& path) {
  const auto bytes = static_cast<double>(std::filesystem::file_size(path));
  if (bytes < 1000) return fmt::format("{:.0f} bytes", bytes);
  return bytes < 1e6 ? fmt::format("{:.1f} kB", 1e-3 * bytes) : fmt::format("{:.1f} MB", 1e-6 * bytes);
}

FileInfo recording_info(const std::string& path) {
  mcap::Reader file(path, recording::kTopicNames);
  const HeadTexts head(file);
  std::map<std::string, TopicSeen> topics;
  std::uint64_t warnings = 0, errors = 0;
  while (const auto message = file.next()) {
    cli::check_interrupt();
    const std::string& topic = file.topics().channels.at(message->channel_id).topic;
    TopicSeen& seen = topics[topic];
    if (seen.messages++ == 0) seen.first_ns = message->log_time_ns;
    seen.last_ns = message->log_time_ns;
    if (!head.there() || topic != recording::kTopicNames[static_cast<std::size_t>(recording::Topic::kEvents)]) continue;
    const auto event = recording::decode_log(message->data, 0);
    warnings += event && event->severity == recording::Severity::kWarning ? 1U : 0U;
    errors += event && event->severity >= recording::Severity::kError ? 1U : 0U;
  }
  for (const mcap::AttachmentEntry& entry : file.attachments()) (void)file.read(entry);  // tells what is damaged
  FileInfo info;
  info.whole = file.complete() && file.damages().empty();
  const char* const state = info.whole                ? "whole"
                            : !file.damages().empty() ? "damaged"
                                                      : "has no end: its program was killed, or the disk was full";
  info.lines.push_back(fmt::format("{}: {}, {}", path, size_of_file(path), state));
  describe_head(head, file, info.lines);
  describe_time(head, file, info.lines);
  describe_files(file, info.lines);
  const std::uint64_t begin_ns = head.there()   ? static_cast<std::uint64_t>(head.number("started_unix_ns"))
                                 : file.times() ? file.times()->first_ns
                                                : 0;
  if (!topics.empty()) describe_topics(topics, begin_ns, info.lines);
  if (head.there()) describe_states(file, info);
  if (warnings + errors > 0)
    info.lines.push_back(fmt::format(
        "  events    {} errors, {} warnings: `knuckle explain` tells what stopped the machine", errors, warnings));
  add_remarks(file.damages(), info.lines);
  add_remarks(file.order_notes(), info.lines);
  return info;
}

}  // namespace knuckle::recordings
