#include "app/export/recording_export.h"

#include <fmt/format.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "app/export/hdf5_file.h"
#include "app/recordings/state_table.h"
#include "core/error.h"
#include "core/fields.h"
#include "core/time.h"
#include "master/master_state.h"
#include "recording/events.h"
#include "recording/fields.h"
#include "recording/wire_events.h"
#include "slave/slave_state.h"
#include "transport/timed_frame.h"

namespace knuckle::exporting {
namespace {

// The recorded states of one loop as datasets of a group in an HDF5 file: one for each field, a row a step.

/// Fields are called as in the state's own list. Attributes: `unit`, where there is one ("1" of other doubles);
/// `columns` of vectors, their elements as in the CSV; `words` of modes and reasons, the word of code 0 first.
class StateDatasets {
 public:
  /// Makes the datasets, and time_s beside them. @param group "/machine". @param fields the first is the time.
  StateDatasets(Hdf5File& file, const std::string& group, std::span<const Field> fields);
  /// @param state that the fields are of.
  void add(const void* state);

 private:
  Hdf5File& file_;
  std::span<const Field> fields_;
  std::size_t first_ = 0;  // the others follow it
};

std::vector<std::string> words_of(const Field& field) {
  std::vector<std::string> words;
  for (unsigned code = 0; code < field.words; ++code) words.emplace_back(field.word(code));
  return words;
}

std::string unit_of_field(const Field& field) {
  const bool of_reason = field.type == NumberType::kFloat;  // which unit, its code says
  const std::string unit = of_reason ? "" : unit_of(field.name);
  return unit.empty() && field.type == NumberType::kDouble ? "1" : unit;
}

StateDatasets::StateDatasets(Hdf5File& file, const std::string& group, std::span<const Field> fields)
    : file_(file), fields_(fields) {
  first_ = file.add_dataset(group + "/time_s", NumberType::kDouble, 1);
  file.attribute(group + "/time_s", "unit", "s");
  for (const Field& field : fields_) {
    const std::string path = group + "/" + field.name;
    (void)file_.add_dataset(path, field.type, field.count);
    if (const std::string unit = unit_of_field(field); !unit.empty()) file_.attribute(path, "unit", unit);
    if (field.vector) file_.attribute(path, "columns", recordings::column_names(field));
    if (field.word != nullptr) file_.attribute(path, "words", words_of(field));
  }
}

void StateDatasets::add(const void* state) {
  std::size_t dataset = first_;
  const double time_s = to_seconds(Duration(static_cast<std::int64_t>(number_at(state, fields_.front()))));
  file_.add_row(dataset++, &time_s);
  for (const Field& field : fields_) file_.add_row(dataset++, static_cast<const std::byte*>(state) + field.offset);
}

using recording::Entry;
using recording::Topic;

/// The states of one loop, into a table and a group of datasets.
template <typename State>
class StateOutputs {
 public:
  StateOutputs(std::ostream* csv, Hdf5File* hdf5, const char* group) : hdf5_(hdf5), group_(group) {
    if (csv != nullptr) table_.emplace(*csv, fields_of<State>());
  }

  /// @throws InputError where it is none of this version's.
  void take(const Entry& entry, const std::string& source) {
    State state;
    if (!recording::decode(entry.data, state))
      throw InputError(fmt::format("{}: {} at {:.3f} s: {} bytes are not the {} of this version of Knuckle", source,
                                   recording::kTopicNames[static_cast<std::size_t>(entry.topic)], to_seconds(entry.at),
                                   entry.data.size(), State::kSchemaName));
    if (hdf5_ != nullptr && !datasets_) datasets_.emplace(*hdf5_, group_, fields_of<State>());
    if (datasets_) datasets_->add(&state);
    if (table_) table_->add(&state);
    any_ = true;
  }
  [[nodiscard]] bool wanted() const noexcept { return table_ || hdf5_ != nullptr; }
  [[nodiscard]] bool any() const noexcept { return any_; }

 private:
  Hdf5File* hdf5_;
  std::string group_;
  std::optional<recordings::StateTable> table_;
  std::optional<StateDatasets> datasets_;
  bool any_ = false;
};

/// Attributes of the whole file, and the files that the recording holds.
void write_head(Hdf5File& file, const recording::Head& head) {
  for (const auto& [key, value] : recording::metadata_of(head).values) file.attribute("/", key, value);
  const auto add = [&file](const char* name, const std::string& text) {
    if (!text.empty()) file.add_text(std::string("/files/") + name, text);
  };
  add("machine_toml", head.machine_file);
  add("device_toml", head.device_file);
  add("scenario_toml", head.scenario_file);
  add("mapping_toml", head.mapping_file);
}

void write_events(Hdf5File& file, const std::vector<recording::Event>& events) {
  std::vector<std::string> kinds, texts;
  const std::size_t times = file.add_dataset("/events/time_s", NumberType::kDouble, 1);
  const std::size_t severities = file.add_dataset("/events/severity", NumberType::kUint8, 1);
  file.attribute("/events/time_s", "unit", "s");
  file.attribute("/events/severity", "words", {"unknown", "debug", "info", "warning", "error", "fatal"});
  for (const recording::Event& event : events) {
    const double time_s = to_seconds(event.at);
    file.add_row(times, &time_s);
    file.add_row(severities, &event.severity);
    kinds.push_back(event.kind);
    texts.push_back(event.text);
  }
  file.add_texts("/events/kind", kinds);
  file.add_texts("/events/text", texts);
}

/// Frames that the step read and those that it sent, in this order, as the loop did.
std::size_t write_frames(std::ostream& out, const Entry& entry, int link_version) {
  const auto wires = recording::decode_wires(entry.data, link_version);
  if (!wires) return 0;
  std::size_t frames = 0;
  for (const recording::WireEvent& event : wires->events) {
    using Kind = recording::WireEventKind;
    if (event.kind != Kind::kCanReceived && event.kind != Kind::kCanSent) continue;
    out << candump_line(wires->at, recording::can_frame(event)) << '\n';
    ++frames;
  }
  return frames;
}

[[noreturn]] void nothing(const recording::Recording& recording, const RecordingOutputs& outputs, const char* option,
                          const std::string& what) {
  const std::string until = outputs.to == Time::max() ? "its end" : fmt::format("{:g} s", to_seconds(outputs.to));
  const std::string between = fmt::format("{:g} s and {}", to_seconds(outputs.from), until);
  throw InputError(fmt::format("{}: {} has no {} between {}", option, recording.source(), what, between));
}

}  // namespace

void export_recording(recording::Recording& recording, const RecordingOutputs& outputs) {
  std::optional<Hdf5File> hdf5;
  if (outputs.hdf5 != nullptr) hdf5.emplace(*outputs.hdf5);
  Hdf5File* const datasets = hdf5 ? &*hdf5 : nullptr;
  const bool machine_table = outputs.side == recording::Side::kMachine;
  StateOutputs<slave::SlaveState> machine(machine_table ? outputs.csv : nullptr, datasets, "/machine");
  StateOutputs<master::MasterState> operators(machine_table ? nullptr : outputs.csv, datasets, "/operator");
  std::vector<recording::Event> events;
  std::size_t frames = 0, pictures = 0;
  recording.seek(outputs.from);
  while (const auto entry = recording.next()) {
    if (outputs.check) outputs.check();
    if (entry->at > outputs.to) continue;  // the sides follow each other in chunks: others may be earlier
    switch (entry->topic) {
      case Topic::kMachineState:
        if (machine.wanted()) machine.take(*entry, recording.source());
        break;
      case Topic::kOperatorState:
        if (operators.wanted()) operators.take(*entry, recording.source());
        break;
      case Topic::kMachineWires:
        if (outputs.candump != nullptr) frames += write_frames(*outputs.candump, *entry, recording.head().link_version);
        break;
      case Topic::kEvents:
        if (auto event = recording::decode_log(entry->data, recording.head().started_unix_ns))
          events.push_back(std::move(*event));
        break;
      case Topic::kCameraPictures:
        if (!outputs.picture) break;
        if (const auto picture = recording::decode_camera_picture(entry->data, recording.head().started_unix_ns)) {
          outputs.picture(*picture);
          ++pictures;
        }
        break;
      default:
        break;
    }
  }
  const bool any_row = machine_table ? machine.any() : operators.any();
  if (outputs.csv != nullptr && !any_row)
    nothing(recording, outputs, "--csv", std::string("step of the ") + recording::name(outputs.side) + "'s side");
  if (hdf5 && !machine.any() && !operators.any()) nothing(recording, outputs, "--hdf5", "step");
  if (outputs.candump != nullptr && frames == 0) nothing(recording, outputs, "--candump", "CAN frame");
  if (outputs.picture && pictures == 0) nothing(recording, outputs, "--pictures", "picture of a camera");
  if (!hdf5) return;
  write_head(*hdf5, recording.head());
  write_events(*hdf5, events);
  hdf5->close();
}

}  // namespace knuckle::exporting
