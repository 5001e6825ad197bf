// The optional [calibration] of a machine file, as strict as the rest of it.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "core/joints.h"
#include "machine/description_fwd.h"
#include "machine/toml_reader.h"

namespace knuckle {

inline constexpr double kFurthestPin_m = 30;  ///< Of any point of a machine, from the origin of its link.
[[nodiscard]] inline PlanarVector read_pin(TomlTable& file, std::string_view key) {
  return file.numbers<2>(key, -kFurthestPin_m, kFurthestPin_m);
}

// Why the joints of a machine cannot work as its file says: all that Kinematics refuses it for.

struct GeometryError {
  int joint;
  const char* table;  ///< "links" or "cylinders", of it the joint's.
  const char* key;
  double value;
  std::string bound;
};

/// what() names the machine file and the first error.
class GeometryErrors : public InputError {
 public:
  /// @param errors at least one.
  GeometryErrors(const std::string& source, std::vector<GeometryError> errors);
  [[nodiscard]] const std::vector<GeometryError>& errors() const noexcept { return errors_; }

 private:
  std::vector<GeometryError> errors_;
};

/// "links.boom.min_rad"
[[nodiscard]] std::string key_of(const GeometryError& error);

/// Fills the optionals of `machine`, whose other fields are complete, from the root table's `calibration`.
/// Notes what is wrong with it; also where a covariance is not symmetric and positive semidefinite, friction would
/// drive, or the measured geometry does not reach the working range.
void load_calibration(TomlTable& file, MachineDescription& machine);

}  // namespace knuckle
