// A recording as files for other tools, all in one pass.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "app/cli/output_file.h"
#include "core/fields.h"
#include "core/time.h"
#include "recording/events.h"
#include "recording/recording.h"
#include "recording/replay.h"

namespace knuckle::exporting {

// An HDF5 file that is written in one go: datasets that grow row by row, texts, attributes.

class Hdf5File {
 public:
  /// Written through `place`, which the caller commits after close(). Every call throws InputError, named by `place`,
  /// where the disk refuses.
  /// @throws InputError where `place` is no regular file: HDF5 is not written from beginning to end.
  explicit Hdf5File(cli::OutputFile& place);
  /// Without close(): the file is of no use.
  ~Hdf5File();
  Hdf5File(const Hdf5File&) = delete;
  Hdf5File& operator=(const Hdf5File&) = delete;

  /// A dataset of N numbers, or of N x `width` where that is above 1; compressed. Groups in its path are made.
  /// @return its number, for add().
  std::size_t add_dataset(const std::string& path, NumberType type, std::size_t width);
  /// The next row. @param row `width` numbers of the dataset's type.
  void add_row(std::size_t dataset, const void* row);
  /// Texts of one length (that of the longest, zeros behind the others), as all readers know them.
  void add_texts(const std::string& path, const std::vector<std::string>& texts);
  void add_text(const std::string& path, const std::string& text);
  /// Of a dataset, a group, or the file ("/").
  void attribute(const std::string& path, const std::string& name, const std::string& text);
  void attribute(const std::string& path, const std::string& name, const std::vector<std::string>& texts);
  void close();

 private:
  using Handle = std::int64_t;  // HDF5's hid_t
  struct Dataset {
    Handle handle = 0;
    NumberType type{};
    std::size_t width = 1, row_bytes = 0;
    std::uint64_t rows = 0;  // in the file
    std::vector<std::uint8_t> waiting;
  };

  void write_waiting(Dataset& dataset);
  void put_texts(const std::string& path, const std::vector<std::string>& texts, Handle space);
  void put_attribute(const std::string& path, const std::string& name, Handle type, Handle space, const void* value);
  /// What HDF5 returned. @throws InputError where that means failure.
  template <typename Result>
  Result done(Result result) const;

  cli::OutputFile& place_;
  Handle file_ = -1, making_groups_ = -1;
  std::vector<Dataset> datasets_;
};

struct RecordingOutputs {
  std::ostream* csv = nullptr;  ///< A row a step of this side.
  recording::Side side{};
  cli::OutputFile* hdf5 = nullptr;
  std::function<void(const recording::CameraPicture&)> picture;  ///< Called for each, in their order.
  std::ostream* candump = nullptr;                               ///< The frames that crossed, in candump's log format.
  std::function<void()> check;                                   ///< Called all the time; may throw to end it.
  Time from{}, to = Time::max();                                 ///< Steps and events within, both ends included.
};

/// Reads the recording to its end. Null outputs are not written.
/// @throws InputError where a state is of another version of Knuckle, where nothing that was asked for is in the
/// recording between these times, where an output cannot be written.
void export_recording(recording::Recording& recording, const RecordingOutputs& outputs);

}  // namespace knuckle::exporting
