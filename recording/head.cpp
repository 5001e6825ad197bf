#include "recording/head.h"

#include <charconv>

#include "core/error.h"
#include "core/text.h"
#include "recording/wire_events.h"

namespace knuckle::recording {
namespace {

constexpr const char* kFormat = "knuckle-recording/1";

const char* word(bool yes) {
  return yes ? "yes" : "no";
}

/// Values of a head, each checked.
class Values {
 public:
  Values(const mcap::Texts& texts, const std::string& source) : texts_(texts), source_(source) {}

  [[nodiscard]] const std::string& text(const char* key) const {
    const auto found = texts_.find(key);
    if (found == texts_.end())
      throw InputError(source_ + ": metadata " + kHeadName + ": " + key + ": is missing: not a recording of Knuckle");
    return found->second;
  }
  [[nodiscard]] bool yes(const char* key) const {
    const std::string& value = text(key);
    if (value != "yes" && value != "no") refuse(key, "must be yes or no");
    return value == "yes";
  }
  template <typename Number>
  [[nodiscard]] Number number(const char* key) const {
    const std::string& value = text(key);
    Number number{};
    const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
    if (error != std::errc() || end != value.data() + value.size()) refuse(key, "must be a whole number");
    return number;
  }
  [[noreturn]] void refuse(const char* key, const std::string& bound) const {
    throw InputError(source_ + ": metadata " + kHeadName + ": " + key + " = " + shortened(text(key)) + ": " + bound);
  }

 private:
  const mcap::Texts& texts_;
  const std::string& source_;
};

}  // namespace

mcap::Metadata metadata_of(const Head& head) {
  return {kHeadName,
          {{"format", kFormat},
           {"program", head.program},
           {"version", head.version},
           {"link_version", std::to_string(head.link_version)},
           {"started_unix_ns", std::to_string(head.started_unix_ns)},
           {"virtual_time", word(head.virtual_time)},
           {"simulated", word(head.simulated)},
           {"imported", word(head.imported)},
           {"operator", word(head.has_operator)},
           {"machine", word(head.has_machine)},
           {"operator_session", std::to_string(head.operator_start.session)},
           {"operator_origin_ns", std::to_string(head.operator_start.origin.count())},
           {"machine_session", std::to_string(head.machine_start.session)},
           {"machine_origin_ns", std::to_string(head.machine_start.origin.count())},
           {"law", head.law},
           {"far_end_is_this_machine", word(head.far_end_is_this_machine)},
           {"part", std::to_string(head.part)}}};
}

std::vector<mcap::Attachment> attachments_of(const Head& head) {
  std::vector<mcap::Attachment> files;
  const auto add = [&](const char* name, const std::string& text) {
    if (text.empty()) return;
    const auto at = static_cast<std::uint64_t>(head.started_unix_ns);
    files.push_back({name, "application/toml", at, at, text});
  };
  add(kMachineFile, head.machine_file);
  add(kDeviceFile, head.device_file);
  add(kScenarioFile, head.scenario_file);
  add(kMappingFile, head.mapping_file);
  return files;
}

Head head_of(const mcap::Metadata& metadata, const std::string& source) {
  const Values values(metadata.values, source);
  if (values.text("format") != kFormat) values.refuse("format", "must be " + std::string(kFormat));
  Head head;
  head.link_version = values.number<int>("link_version");
  if (head.link_version < kOldestLinkVersion || head.link_version > kLinkVersion)
    throw InputError(source + ": was recorded by another version of Knuckle (" + shortened(values.text("version")) +
                     "): its link_version = " + std::to_string(head.link_version) + ": must be " +
                     std::to_string(kOldestLinkVersion) + " to " + std::to_string(kLinkVersion));
  head.program = values.text("program");
  head.version = values.text("version");
  head.started_unix_ns = values.number<std::int64_t>("started_unix_ns");
  head.virtual_time = values.yes("virtual_time");
  head.simulated = values.yes("simulated");
  head.imported = metadata.values.contains("imported") && values.yes("imported");  // older recordings: they are not
  head.has_operator = values.yes("operator");
  head.has_machine = values.yes("machine");
  head.operator_start = {values.number<std::uint64_t>("operator_session"),
                         Duration(values.number<std::int64_t>("operator_origin_ns"))};
  head.machine_start = {values.number<std::uint64_t>("machine_session"),
                        Duration(values.number<std::int64_t>("machine_origin_ns"))};
  head.law = values.text("law");
  head.far_end_is_this_machine = values.yes("far_end_is_this_machine");
  head.part = values.number<int>("part");
  return head;
}

}  // namespace knuckle::recording
