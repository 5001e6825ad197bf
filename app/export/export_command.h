// `knuckle export`: files for other tools.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "app/cli/command.h"
#include "app/cli/output_file.h"
#include "core/fields.h"
#include "core/time.h"
#include "machine/description_fwd.h"
#include "recording/events.h"
#include "recording/recording.h"
#include "recording/replay.h"
#include "transport/signal_codec.h"

namespace knuckle::exporting {

[[nodiscard]] cli::Command export_entry();

// The machine's model as URDF: links, joints, inertias, shapes without meshes.
//
// Links: base (frame M, origin at the boom pin, x forward, z up, y to the left), boom, arm, bucket, each with the axes
// of its description (x along the link, z to its left), and tip, a frame at the bucket's tip. Joints boom_joint,
// arm_joint and bucket_joint turn about -y, which is counter-clockwise seen with x right and z up; at angle zero all
// axes are parallel to M's. Their limits: range and speed of the machine file, and as effort the greatest torque that
// the cylinder has anywhere in the range at the main relief's pressure.
//
// What the model is: the rigid arm of the force estimate (estimation/regressor.h), so gravity torques and mass matrix
// are those that Knuckle itself computes with. Cylinders and linkage count as point masses at their pins; there are no
// closed chains, no friction, and no mass of the hull in it. Inertias: app/export/urdf.cpp.

/// @param machine as it was read; what was calibrated replaces the drawing, and a comment of the file says which.
/// @throws InputError as link_inertias() does.
void write_urdf(const MachineDescription& machine, std::ostream& out);

// Every frame of the machine's bus and what is in it, from the machine file: the content of its DBC.

/// A number in a frame: physical value = raw * factor + offset, in the given unit.
struct Signal {
  BitField::Type type = BitField::Type::kUnsigned;
  BitField::Order order = BitField::Order::kLittleEndian;
  std::string name{};
  unsigned start_bit = 0, bits = 0;  ///< As BitField and DBC count.
  double factor = 1, offset = 0;
  double min = 0, max = 0;  ///< Of physical values that Knuckle sends or uses.
  std::string unit{};
  std::vector<std::pair<std::uint32_t, std::string>> values{};  ///< Names of raw values.
  std::string about{};
  bool is_multiplexer = false;
  std::optional<std::uint64_t> with_multiplexer{};  ///< Only in frames in which the multiplexer has this raw value.
};

struct Message {
  std::uint32_t id = 0;
  std::string name;    ///< Of at most 32 characters, as DBC has it.
  std::string sender;  ///< Node name.
  std::vector<std::string> receivers;
  std::uint8_t size = 0;  ///< Bytes.
  std::vector<Signal> signals;
  std::optional<double> period_s;  ///< In operation; nullopt: no fixed one.
  std::string about;
};

/// The name of the node that Knuckle is.
inline constexpr const char* kController = "controller";
/// The one that sends what the machine sends by itself, and is told by command frames.
inline constexpr const char* kMachine = "machine_controller";

/// Where there are nodes, NMT, SYNC and the controller's heartbeat; then for each node of the machine file its PDOs,
/// heartbeat, EMCY and SDO. Names: NODE_TPDO1, NODE_RPDO1, NODE_heartbeat, NODE_EMCY, NODE_SDO_tx (answers),
/// NODE_SDO_rx (requests). Broadcasts and commands at last, by their names; signals of broadcasts by Knuckle's. What a
/// multiplexer tells apart is one message, called as its first without the multiplexer's value.
/// @param machine as calibrated() gives it.
[[nodiscard]] std::vector<Message> bus_messages(const MachineDescription& machine);

// The machine's bus as DBC, for tools that show or log CAN: every frame with its node, and what is in it.

/// Periods that are whole milliseconds are GenMsgCycleTime, which knows no others; the comments say all.
/// @param machine as it was read.
void write_dbc(const MachineDescription& machine, std::ostream& out);

// A recording as files for other tools, all in one pass.

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
