// Why the joints of a machine cannot work as its file says: all that Kinematics refuses it for.
#pragma once

#include <string>
#include <vector>

#include "core/error.h"

namespace knuckle {

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

}  // namespace knuckle
