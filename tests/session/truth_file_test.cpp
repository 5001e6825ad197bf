// --truth FILE: every key reaches the simulated machine in the right unit, bad values are refused.
#include "app/session/truth_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <numbers>

#include "machine/load.h"
#include "tests/support/places.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"
#include "tests/support/solar.h"

namespace knuckle::session {
namespace {
namespace fs = std::filesystem;

class TruthFile : public ::testing::Test {
 protected:
  ~TruthFile() override { fs::remove(path_); }
  sim::MachineTruth load(const std::string& text) {
    std::ofstream(path_) << text;
    return load_truth(path_, test::solar());
  }
  std::string refusal(const std::string& text) {
    return test::refusal([&] { return load(text); });
  }
  fs::path path_ = fs::temp_directory_path() / ("knuckle_truth_" + std::to_string(getpid()) + ".toml");
};

struct Key {
  const char* table;
  const char* line;
  std::function<double(const sim::MachineTruth&)> value;
  double expected;
  const char* too_much;  ///< The same key beyond its bound.
};

const std::vector<Key> kKeys{
    {"", "pressure_offset_bar = [1, 2, 3, 4, 5, 6]", [](auto& t) { return t.pressure[4].offset_Pa; }, 5e5,
     "pressure_offset_bar = [1, 2, 3, 4, 5, 26]"},
    {"", "encoder_offset_mm = [1, 2, 3]", [](auto& t) { return t.encoder_offset_m[2]; }, 3e-3,
     "encoder_offset_mm = [1, 2]"},
    {"", "pressure_lag_ms = 6", [](auto& t) { return t.pressure[3].lag_s; }, 6e-3, "pressure_lag_ms = 60"},
    {"", "encoder_noise_mm = 0.02", [](auto& t) { return t.encoder_noise_m; }, 2e-5, "encoder_noise_mm = -1"},
    {"", "hull_pitch_deg = 2", [](auto& t) { return t.hull_pitch_rad; }, 2 * std::numbers::pi / 180,
     "hull_pitch_deg = 31"},
    {"", "tilt_offset_deg = -1", [](auto& t) { return t.tilt_offset_rad; }, -std::numbers::pi / 180,
     "tilt_offset_deg = -6"},
    {"", "viscosity_factor = 1.5", [](auto& t) { return t.viscosity_factor; }, 1.5, "viscosity_factor = 0"},
    {"", "bulk_modulus_GPa = 0.7", [](auto& t) { return t.machine.hydraulics.bulk_modulus_Pa; }, 0.7e9,
     "bulk_modulus_GPa = 7"},
    {"[arm]", "mass_factor = 1.1", [](auto& t) { return t.machine.links[1].mass_kg; }, 66, "mass_factor = 3"},
    {"[arm]", "mass_factor = 1.1", [](auto& t) { return t.machine.links[1].inertia_kgm2; }, 6.6, "mass_factor = 0"},
    {"[boom.friction]", "coulomb_extend_N = 500", [](auto& t) { return t.friction[0].coulomb_extend_N; }, 500,
     "coulomb_extend_N = 0"},
    {"[boom.friction]", "coulomb_retract_N = 400", [](auto& t) { return t.friction[0].coulomb_retract_N; }, 400,
     "coulomb_retract_N = -1"},
    {"[arm.friction]", "static_ratio = 1.6", [](auto& t) { return t.friction[1].static_ratio; }, 1.6,
     "static_ratio = 0.9"},
    {"[arm.friction]", "stribeck_mmps = 15", [](auto& t) { return t.friction[1].stribeck_mps; }, 0.015,
     "stribeck_mmps = 0"},
    {"[bucket.friction]", "viscous_kNs_per_m = 30", [](auto& t) { return t.friction[2].viscous_Ns_per_m; }, 3e4,
     "viscous_kNs_per_m = 2000"},
    {"[bucket.valve]", "dead_band_extend = 0.13", [](auto& t) { return t.machine.cylinders[2].valve.dead_band_extend; },
     0.13, "dead_band_extend = 0.6"},
    {"[bucket.valve]", "dead_band_retract = 0.09",
     [](auto& t) { return t.machine.cylinders[2].valve.dead_band_retract; }, 0.09, "dead_band_retract = -0.1"},
    {"[boom.valve]", "hysteresis = 0.02", [](auto& t) { return t.machine.cylinders[0].valve.hysteresis; }, 0.02,
     "hysteresis = 0.2"},
    {"[boom.valve]", "delay_ms = 25", [](auto& t) { return t.machine.cylinders[0].valve.delay_s; }, 0.025,
     "delay_ms = 200"},
    {"[arm.valve]", "natural_frequency_Hz = 7",
     [](auto& t) { return t.machine.cylinders[1].valve.natural_frequency_Hz; }, 7, "natural_frequency_Hz = 0"}};

TEST_F(TruthFile, EveryKeyAloneReachesTheMachineInItsUnit) {
  for (const Key& key : kKeys) {
    const sim::MachineTruth truth = load(std::string(key.table) + "\n" + key.line + "\n");
    EXPECT_NEAR(key.value(truth), key.expected, 1e-9 * std::abs(key.expected)) << key.table << " " << key.line;
    EXPECT_GT(std::abs(key.value(truth) - key.value(sim::nominal_truth(test::solar()))), 1e-6 * std::abs(key.expected))
        << key.line << " is to change something";
  }
}

TEST_F(TruthFile, ValuesBeyondTheirBoundsAreRefusedByFileAndKey) {
  for (const Key& key : kKeys) {
    const std::string text(key.too_much), name = text.substr(0, text.find(' '));
    const std::string line = refusal(std::string(key.table) + "\n" + text + "\n");
    for (const std::string& said : {path_.string(), name, std::string("must be")}) EXPECT_TRUE(test::says(line, said));
    EXPECT_FALSE(test::says(line, "\n"));
  }
}

TEST_F(TruthFile, UnknownKeysAreRefusedWithTheOneThatWasMeant) {
  for (const char* text :
       {"viscosity = 1", "[boom]\nmass = 1", "[boom.friction]\ncoulomb_N = 300", "[stick]\nmass_factor = 1"}) {
    EXPECT_NE(refusal(text), "accepted") << text;
  }
  for (const auto& [text, meant] : {std::pair{"visocsity_factor = 1.5", "viscosity_factor"},
                                    {"[boom.friction]\ncoulomb_extend = 300", "coulomb_extend_N"}})
    EXPECT_TRUE(test::says(refusal(text), std::string("did you mean '") + meant + "'?"));
}

TEST_F(TruthFile, TheShippedExampleFitsEveryShippedMachine) {
  for (const char* name : {"solar015", "compact080", "standard200"}) {
    EXPECT_NO_THROW((void)load_truth(test::source_dir() + "/config/truth/example.toml",
                                     load_machine(find_config("machine", name))));
  }
}

}  // namespace
}  // namespace knuckle::session
