// The recorded states of one loop as datasets of a group in an HDF5 file: one for each field, a row a step.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "app/export/hdf5_file.h"
#include "core/fields.h"

namespace knuckle::exporting {

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

}  // namespace knuckle::exporting
