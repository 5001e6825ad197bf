// The link of a program that runs: what somebody types into its terminal, or writes into its standard input, to give
// control up or take it; and, where it was dialled, its paths for the result.
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "app/cli/json.h"
#include "app/pairing/chosen_link.h"

namespace knuckle::programs {

/// Lines, without waiting for any.
class ControlInput {
 public:
  explicit ControlInput(int descriptor) : descriptor_(descriptor) {}
  /// Lines that have come, without their ends, and of a very long one its beginning: some hundred bytes each time. None
  /// for a program in the background of its terminal, which reading would stop.
  [[nodiscard]] std::vector<std::string> lines();

 private:
  int descriptor_;
  bool ended_ = false;
  std::string text_;  // of a line that has not ended
};

/// Does what the lines say: "release", "grant", "take", or "home". @return what was done.
/// @param home asks the machine to go home on two; returns what is done.
[[nodiscard]] std::vector<cli::News> obey_control_lines(ControlInput& input, pairing::ChosenLink& link,
                                                        const std::function<std::string()>& home);

/// {pairs: [{at_s, far_end, kind, local, remote, round_trip_ms}], round_trip_ms}; null where the far end has an
/// address.
/// @param started when the program's time was 0.
[[nodiscard]] cli::Json path_json(const pairing::ChosenLink& link, std::chrono::steady_clock::time_point started);

}  // namespace knuckle::programs
