// What a battery of sessions draws from: a TOML file in config/grids. docs/studies.md has every key.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace knuckle::battery {

inline constexpr std::int64_t kMostSeed = 1'000'000'000;  ///< From 1.

enum class Kind : std::uint8_t {
  kFeel,  ///< Presses on drawn walls.
  kWork,  ///< Stock scenarios of ordinary work.
};
[[nodiscard]] const char* name(Kind kind) noexcept;

/// Bounds of a value that is drawn by ratio.
struct Span {
  double low = 0, high = 0;
};

/// A machine that has been commissioned: its calibrated file, and the seed that samples it from the family.
struct CommissionedMachine {
  std::string file;
  std::uint64_t seed = 0;
};

struct Settings {
  Kind kind = Kind::kFeel;
  std::uint64_t sessions = 0;
  std::uint64_t seed = 1;
  std::string machine, family, person;
  std::vector<CommissionedMachine> commissioned;  ///< Taken by turns; none: each session samples a machine of its own.
  std::string control;                            ///< Bilateral law; empty: as the device's file says.
  // Of the link; one of each per session.
  std::vector<double> rtt_ms, jitter_ms, loss, bursts_per_s;
  // kFeel
  Span stiffness_N_per_m, speed_mps, felt_N;
  // kWork
  std::vector<std::string> scenarios;
};

/// @throws InputError naming file, line, key, value and bound.
[[nodiscard]] Settings load_settings(const std::string& path);

/// Of a battery's result as JSON.
inline constexpr const char* kResultSchema = "knuckle-battery/1";

/// What a cell is drawn from, as results keep it; and back.
[[nodiscard]] nlohmann::ordered_json settings_json(const Settings& settings);
/// @throws InputError naming `source` where something is missing or no such thing.
[[nodiscard]] Settings settings_of(const nlohmann::ordered_json& json, const std::string& source);

}  // namespace knuckle::battery
