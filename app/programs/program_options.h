// What the programs' command lines have in common.
#pragma once

#include <initializer_list>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "app/cli/output_file.h"
#include "core/histogram.h"
#include "core/realtime_thread.h"
#include "core/reason.h"
#include "machine/bus_description.h"
#include "transport/can_health.h"

namespace knuckle::programs {

inline constexpr double kLongestRun_s = 1e7;

/// A link that nobody protects has to be asked for. @throws InputError unless it was.
void check_plain_link(const std::string& option, const std::string& address, bool insecure);
/// The line that says what was asked for.
inline constexpr const char* kPlainLinkNote =
    "plain UDP (--insecure): nothing is encrypted, nobody is proven; for loopback, labs, or inside a tunnel";

/// An output that may have been asked for.
class AskedOutput {
 public:
  /// @param target empty: not asked for. @throws InputError where it cannot be written.
  AskedOutput(const char* option, const std::string& target) {
    if (!target.empty()) file_.emplace(option, target);
  }
  /// nullptr: not asked for.
  [[nodiscard]] std::ostream* stream() noexcept { return file_ ? &file_->stream() : nullptr; }
  /// Puts the finished file in place. @throws InputError where the disk refused what was written.
  void commit() {
    if (file_) file_->commit();
  }

 private:
  std::optional<cli::OutputFile> file_;
};

/// Puts every finished file in place, also where the disk refused another. @throws InputError as the first that was
/// refused.
void commit_all(std::initializer_list<AskedOutput*> outputs);

/// A node of the machine file: its key there and what it must be.
struct NamedNode {
  std::string name;  ///< "boom_valve", "arm_rod_pressure", "bucket_encoder", "tilt", "enable"
  NodeDescription node;
};
[[nodiscard]] std::vector<NamedNode> named_nodes(const BusDescription& bus);

/// How a loop ran, as `knuckle simulate --json` says it.
[[nodiscard]] nlohmann::ordered_json loop_json(const RealtimeReport& report);
/// Every counter by its name, as docs/can-bus.md lists them.
[[nodiscard]] nlohmann::ordered_json counters_json(const CanCounters& counters);
/// {p50, p99, max}; null where nothing was measured.
[[nodiscard]] nlohmann::ordered_json milliseconds_json(const Histogram& histogram);
/// {code, reason}; null where there is none.
[[nodiscard]] nlohmann::ordered_json reason_json(const Reason& reason);

}  // namespace knuckle::programs
