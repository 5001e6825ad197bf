#include <fmt/format.h>
#include <hdf5.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <span>
#include <utility>

#include "app/export/export_command.h"
#include "app/recordings/state_table.h"
#include "core/error.h"
#include "master/master_state.h"
#include "recording/wire_events.h"
#include "slave/slave_state.h"
#include "transport/timed_frame.h"

namespace knuckle::exporting {

namespace {

constexpr std::size_t kChunkRows = 1024;
constexpr unsigned kFastDeflate = 1;

hid_t native(NumberType type) {
  const std::array types{H5T_NATIVE_UINT8, H5T_NATIVE_UINT16, H5T_NATIVE_UINT32, H5T_NATIVE_UINT64,
                         H5T_NATIVE_INT64, H5T_NATIVE_FLOAT,  H5T_NATIVE_DOUBLE};
  return types.at(static_cast<std::size_t>(type));
}

/// Something of HDF5's that is closed at the end of its scope.
class Owned {
 public:
  Owned(hid_t handle, herr_t (*close)(hid_t)) : handle_(handle), close_(close) {}
  ~Owned() {
    if (handle_ >= 0) close_(handle_);
  }
  Owned(const Owned&) = delete;
  Owned& operator=(const Owned&) = delete;
  operator hid_t() const noexcept { return handle_; }

 private:
  hid_t handle_;
  herr_t (*close_)(hid_t);
};

std::size_t longest(const std::vector<std::string>& texts) {
  std::size_t bytes = 1;
  for (const std::string& text : texts) bytes = std::max(bytes, text.size());
  return bytes;
}

/// One behind the other, each filled up with zeros.
std::string evened(const std::vector<std::string>& texts) {
  const std::size_t bytes = longest(texts);
  std::string all;
  for (std::string text : texts) {
    text.resize(bytes);
    all += text;
  }
  return all;
}

/// Of strings of this many bytes, which need no zero at the end. Nominally ASCII, whatever is in them: Octave reads no
/// others.
hid_t text_type(std::size_t bytes) {
  const hid_t type = H5Tcopy(H5T_C_S1);
  H5Tset_size(type, bytes);
  H5Tset_strpad(type, H5T_STR_NULLPAD);
  return type;
}

hid_t row_of(hsize_t count) {
  return H5Screate_simple(1, &count, nullptr);
}

}  // namespace

template <typename Result>
Result Hdf5File::done(Result result) const {
  if (result < 0) place_.fail(errno != 0 ? errno : EIO);
  return result;
}

Hdf5File::Hdf5File(cli::OutputFile& place) : place_(place) {
  struct stat about {};
  if (fstat(place.descriptor(), &about) != 0) place.fail(errno);
  if (!S_ISREG(about.st_mode))
    throw InputError(place.refusal(ENOTSUP) + ": HDF5 is not written in one stream, name a file");
  H5dont_atexit();  // else it tries again at the program's end to write what the disk has refused, and crashes
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // failures are ours to tell
  // The file that is put in place at the end has no name of its own to the outside.
  const std::string path = "/proc/self/fd/" + std::to_string(place.descriptor());
  errno = 0;
  file_ = done(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT));
  making_groups_ = done(H5Pcreate(H5P_LINK_CREATE));
  done(H5Pset_create_intermediate_group(making_groups_, 1));
}

Hdf5File::~Hdf5File() {
  for (const Dataset& dataset : datasets_) H5Dclose(dataset.handle);
  if (making_groups_ >= 0) H5Pclose(making_groups_);
  if (file_ >= 0) H5Fclose(file_);
}

std::size_t Hdf5File::add_dataset(const std::string& path, NumberType type, std::size_t width) {
  const int rank = width > 1 ? 2 : 1;
  const std::array<hsize_t, 2> none{0, width}, most{H5S_UNLIMITED, width}, chunk{kChunkRows, width};
  const Owned space(done(H5Screate_simple(rank, none.data(), most.data())), H5Sclose);
  const Owned how(done(H5Pcreate(H5P_DATASET_CREATE)), H5Pclose);
  done(H5Pset_chunk(how, rank, chunk.data()));
  done(H5Pset_shuffle(how));
  done(H5Pset_deflate(how, kFastDeflate));
  Dataset dataset;
  dataset.handle = done(H5Dcreate2(file_, path.c_str(), native(type), space, making_groups_, how, H5P_DEFAULT));
  dataset.type = type;
  dataset.width = width;
  dataset.row_bytes = width * H5Tget_size(native(type));
  datasets_.push_back(std::move(dataset));
  return datasets_.size() - 1;
}

void Hdf5File::add_row(std::size_t dataset, const void* row) {
  Dataset& to = datasets_.at(dataset);
  const auto* const bytes = static_cast<const std::uint8_t*>(row);
  to.waiting.insert(to.waiting.end(), bytes, bytes + to.row_bytes);
  if (to.waiting.size() == kChunkRows * to.row_bytes) write_waiting(to);
}

void Hdf5File::write_waiting(Dataset& dataset) {
  const std::uint64_t rows = dataset.waiting.size() / dataset.row_bytes;
  if (rows == 0) return;
  const int rank = dataset.width > 1 ? 2 : 1;
  const std::array<hsize_t, 2> all{dataset.rows + rows, dataset.width}, begin{dataset.rows, 0},
      count{rows, dataset.width};
  errno = 0;
  done(H5Dset_extent(dataset.handle, all.data()));
  const Owned in_file(done(H5Dget_space(dataset.handle)), H5Sclose);
  const Owned in_memory(done(H5Screate_simple(rank, count.data(), nullptr)), H5Sclose);
  done(H5Sselect_hyperslab(in_file, H5S_SELECT_SET, begin.data(), nullptr, count.data(), nullptr));
  done(H5Dwrite(dataset.handle, native(dataset.type), in_memory, in_file, H5P_DEFAULT, dataset.waiting.data()));
  dataset.rows += rows;
  dataset.waiting.clear();
}

void Hdf5File::put_texts(const std::string& path, const std::vector<std::string>& texts, Handle space) {
  const Owned type(done(text_type(longest(texts))), H5Tclose);
  const Owned set(done(H5Dcreate2(file_, path.c_str(), type, space, making_groups_, H5P_DEFAULT, H5P_DEFAULT)),
                  H5Dclose);
  if (!texts.empty()) done(H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, evened(texts).data()));
}

void Hdf5File::add_texts(const std::string& path, const std::vector<std::string>& texts) {
  put_texts(path, texts, Owned(done(row_of(texts.size())), H5Sclose));
}

void Hdf5File::add_text(const std::string& path, const std::string& text) {
  put_texts(path, {text}, Owned(done(H5Screate(H5S_SCALAR)), H5Sclose));
}

void Hdf5File::put_attribute(const std::string& path, const std::string& name, Handle type, Handle space,
                             const void* value) {
  const Owned attribute(
      done(H5Acreate_by_name(file_, path.c_str(), name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT)),
      H5Aclose);
  done(H5Awrite(attribute, type, value));
}

void Hdf5File::attribute(const std::string& path, const std::string& name, const std::string& text) {
  const Owned type(done(text_type(longest({text}))), H5Tclose), space(done(H5Screate(H5S_SCALAR)), H5Sclose);
  put_attribute(path, name, type, space, evened({text}).data());
}

void Hdf5File::attribute(const std::string& path, const std::string& name, const std::vector<std::string>& texts) {
  const Owned type(done(text_type(longest(texts))), H5Tclose), space(done(row_of(texts.size())), H5Sclose);
  put_attribute(path, name, type, space, evened(texts).data());
}

void Hdf5File::close() {
  for (Dataset& dataset : datasets_) {
    write_waiting(dataset);
    done(H5Dclose(std::exchange(dataset.handle, -1)));
  }
  datasets_.clear();
  errno = 0;
  done(H5Pclose(std::exchange(making_groups_, -1)));
  done(H5Fclose(std::exchange(file_, -1)));
}

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
    const std::string path = group + "/" + (field.part.empty() ? "" : field.part + "_") + field.name;
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

  /// @throws InputError where it is no state.
  void take(const Entry& entry, const recording::Recording& recording) {
    auto state = recording::state_in<State>(entry, recording);
    recordings::show_unknown(state);
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
        if (machine.wanted()) machine.take(*entry, recording);
        break;
      case Topic::kOperatorState:
        if (operators.wanted()) operators.take(*entry, recording);
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
