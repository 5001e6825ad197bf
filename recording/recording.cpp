#include "recording/recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/error.h"
#include "master/master_state.h"
#include "slave/slave_state.h"

namespace knuckle::recording {

namespace {

Head read_head(const mcap::Reader& file, const std::string& path) {
  for (const mcap::Metadata& metadata : file.metadata()) {
    if (metadata.name == kHeadName) return head_of(metadata, path);
  }
  if (!file.complete()) throw InputError(path + ": is cut off before what makes it a recording of Knuckle");
  throw InputError(path + ": is not a recording of Knuckle: it has no metadata named " + kHeadName);
}

void read_files(mcap::Reader& file, Head& head) {
  for (const mcap::AttachmentEntry& entry : file.attachments()) {
    auto attachment = file.read(entry);
    if (!attachment) continue;
    if (attachment->name == kMachineFile) head.machine_file = std::move(attachment->data);
    if (attachment->name == kDeviceFile) head.device_file = std::move(attachment->data);
    if (attachment->name == kScenarioFile) head.scenario_file = std::move(attachment->data);
    if (attachment->name == kMappingFile) head.mapping_file = std::move(attachment->data);
  }
}

void check_follows(const Head& head, const Head& before, const std::string& path) {
  const bool same_session = head.started_unix_ns == before.started_unix_ns &&
                            head.operator_start.session == before.operator_start.session &&
                            head.machine_start.session == before.machine_start.session;
  if (!same_session) throw InputError(path + ": is of another session than the file before it");
  if (head.part != before.part + 1)
    throw InputError(path + ": part = " + std::to_string(head.part) + ": must be " + std::to_string(before.part + 1) +
                     ", as the file before it is part " + std::to_string(before.part) +
                     "; several files are the parts of one recording: name others one at a time");
}

}  // namespace

Recording::Recording(const std::vector<std::string>& paths) : paths_(paths) {
  if (paths.empty()) throw InputError("no recording was named");
  Head before;
  for (const std::string& path : paths) {
    parts_.push_back(std::make_unique<mcap::Reader>(path, kTopicNames));
    Head head = read_head(*parts_.back(), path);
    if (head.part == 0 && paths.size() > 1) throw InputError(path + ": is a flight record: name it alone");
    if (parts_.size() == 1) {
      read_files(*parts_.back(), head);
      head_ = head;
    } else {
      check_follows(head, before, path);
    }
    before = std::move(head);
  }
}

std::optional<StateTranslation> translation_of(const mcap::Topics& topics, const mcap::Channel& channel,
                                               const std::string& where) {
  const auto schema = topics.schemas.find(channel.schema_id);
  const auto is = [&](Topic topic) { return channel.topic == kTopicNames[static_cast<std::size_t>(topic)]; };
  if (schema == topics.schemas.end()) return std::nullopt;
  if (is(Topic::kOperatorState)) return translation_to<master::MasterState>(schema->second.data, where);
  if (is(Topic::kMachineState)) return translation_to<slave::SlaveState>(schema->second.data, where);
  return std::nullopt;
}

std::string lacks_text(const StateTranslation& translation) {
  if (translation.lacks().empty()) return "";
  return fmt::format("recorded by another version of Knuckle, without {}", fmt::join(translation.lacks(), ", "));
}

std::optional<Entry> Recording::next() {
  for (; part_ < parts_.size(); ++part_) {
    while (const auto message = parts_[part_]->next()) {
      if (auto entry = entry_of(*message)) return entry;
    }
  }
  return std::nullopt;
}

Recording::Source Recording::source_of(std::uint16_t channel_id) const {
  const mcap::Topics& topics = parts_[part_]->topics();
  const auto channel = topics.channels.find(channel_id);
  if (channel == topics.channels.end()) return {};
  const auto name = std::find(kTopicNames.begin(), kTopicNames.end(), channel->second.topic);
  if (name == kTopicNames.end()) return {};
  return {static_cast<Topic>(name - kTopicNames.begin()),
          translation_of(topics, channel->second, paths_[part_] + ": " + *name)};
}

std::optional<Entry> Recording::entry_of(const mcap::Message& message) {
  const std::pair key(part_, message.channel_id);
  auto found = sources_.find(key);
  if (found == sources_.end()) found = sources_.emplace(key, source_of(message.channel_id)).first;
  Source& source = found->second;
  if (!source.topic) return std::nullopt;
  Entry entry{*source.topic, time_of(message.log_time_ns), message.data, {}};
  if (source.translation) {
    entry.data = source.translation->translated(message.data);
    entry.lacks = source.translation->lacks();
  }
  return entry;
}

void Recording::seek(Time from) {
  const std::int64_t ns = head_.started_unix_ns + from.time_since_epoch().count();
  for (const auto& part : parts_) part->seek(static_cast<std::uint64_t>(std::max<std::int64_t>(ns, 0)));
  part_ = 0;
}

std::optional<Recording::Span> Recording::span() const {
  std::optional<Span> span;
  for (const auto& part : parts_) {
    if (!part->times()) continue;
    const Time first = time_of(part->times()->first_ns), last = time_of(part->times()->last_ns);
    span = span ? Span{std::min(span->first, first), std::max(span->last, last)} : Span{first, last};
  }
  return span;
}

std::vector<std::string> Recording::damages() const {
  std::vector<std::string> all;
  for (const auto& part : parts_) all.insert(all.end(), part->damages().begin(), part->damages().end());
  return all;
}

std::vector<std::string> Recording::order_notes() const {
  std::vector<std::string> all;
  for (const auto& part : parts_)
    for (std::string& note : part->order_notes()) all.push_back(std::move(note));
  for (const auto& [place, source] : sources_) {
    const std::string lacks = source.translation ? lacks_text(*source.translation) : "";
    if (!lacks.empty())
      all.push_back(
          fmt::format("{}: {}: {}", paths_[place.first], kTopicNames[static_cast<std::size_t>(*source.topic)], lacks));
  }
  return all;
}

bool Recording::complete() const {
  return std::all_of(parts_.begin(), parts_.end(), [](const auto& part) { return part->complete(); });
}

void refuse_state(const Entry& entry, const Recording& recording) {
  throw InputError(fmt::format("{}: {} at {:.3f} s: is no state: damaged, or of another version (recorded by {})",
                               recording.source(), kTopicNames[static_cast<std::size_t>(entry.topic)],
                               to_seconds(entry.at), recording.head().version));
}

std::vector<std::string> defects(const Recording& recording) {
  constexpr const char* kNoEnd = "has no end: its program was killed, or the disk refused the rest";
  std::vector<std::string> all = recording.damages();
  if (recording.complete()) return all;
  // What is cut off has no end: one line says both.
  const auto cut = std::find_if(all.rbegin(), all.rend(),
                                [](const std::string& line) { return line.find(": cut off") != std::string::npos; });
  if (cut != all.rend())
    *cut += "; it " + std::string(kNoEnd);
  else
    all.push_back(recording.source() + ": " + kNoEnd);
  return all;
}

std::vector<std::string> remarks(const Recording& recording) {
  std::vector<std::string> all = defects(recording);
  for (std::string& note : recording.order_notes()) all.push_back(std::move(note));
  return all;
}

}  // namespace knuckle::recording
