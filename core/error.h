// The one exception of set-up code: bad input, reported in one line that names file, key, value and bound.
#pragma once

#include <stdexcept>
#include <string>

namespace knuckle {

/// Bad usage or bad input; the program prints what() after "knuckle: " and exits with 2.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace knuckle
