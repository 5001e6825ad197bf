// Shipped machine and device files load; every way to break one key is refused with a line that names it.
#include "machine/load.h"

#include <gtest/gtest.h>
#include <toml++/toml.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>

#include "core/error.h"
#include "machine/bus_budget.h"
#include "machine/kinematics.h"
#include "machine/toml_reader.h"
#include "tests/support/keyed_nodes.h"
#include "tests/support/places.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"

namespace knuckle {
namespace {

const std::string kConfig = test::source_dir() + "/config";

/// The paths of all keys, tables included: "bus", "bus.node", "bus.node[3].id".
std::vector<std::string> paths_in(const toml::table& table, const std::string& path = "") {
  std::vector<std::string> all;
  const auto add_below = [&all](const toml::node& node, const std::string& at) {
    if (!node.is_table()) return;
    for (std::string& below : paths_in(*node.as_table(), at + ".")) all.push_back(std::move(below));
  };
  for (const auto& [key, value] : table) {
    const std::string at = path + std::string(key.str());
    all.push_back(at);
    add_below(value, at);
    if (!value.is_array()) continue;
    for (std::size_t i = 0; i < value.as_array()->size(); ++i)
      add_below((*value.as_array())[i], at + "[" + std::to_string(i) + "]");
  }
  return all;
}

/// The table that has the key of a path, and the key.
std::pair<toml::table*, std::string> place_of(toml::table& file, const std::string& path) {
  const std::size_t dot = path.rfind('.');
  if (dot == std::string::npos) return {&file, path};
  return {toml::at_path(file, path.substr(0, dot)).as_table(), path.substr(dot + 1)};
}

constexpr const char* kInOlderWords = "older/";

/// A file of the shipped configuration, to be broken key by key.
class Shipped : public ::testing::TestWithParam<const char*> {
 protected:
  void TearDown() override { std::filesystem::remove(scratch_); }

  /// What loading a changed copy says; "accepted" if nothing.
  std::string refusal(const std::string& text) {
    std::ofstream(scratch_) << text;
    return test::refusal([&] {
      if (std::string(GetParam()).starts_with("devices/")) {
        (void)load_device(scratch_);
      } else {
        (void)load_machine(scratch_);
      }
    });
  }
  std::string refusal(const toml::table& changed) {
    std::ostringstream text;
    text << changed;
    return refusal(text.str());
  }

  /// Calls `change(parent, key)` on a fresh copy for every key, tables included, and `check(line, path)` on what
  /// loading it says.
  void for_every_key(const std::function<bool(toml::table&, const std::string&)>& change,
                     const std::function<void(const std::string&, const std::string&)>& check) {
    for (const std::string& path : paths_in(original_)) {
      toml::table copy = original_;
      const auto [parent, key] = place_of(copy, path);
      if (!change(*parent, key)) continue;
      check(refusal(copy), path);
      ++changed_;
    }
  }

  const toml::table original_ = toml::parse(text_of(GetParam()));
  int changed_ = 0;

 private:
  static std::string text_of(const std::string& file) {
    if (!file.starts_with(kInOlderWords)) return test::content(kConfig + "/" + file);
    return test::with_keyed_nodes(
        test::content(kConfig + "/machines/" + file.substr(std::string(kInOlderWords).size())));
  }

  const std::string scratch_ = ::testing::TempDir() + "knuckle_load_" + std::to_string(getpid()) + ".toml";
};
INSTANTIATE_TEST_SUITE_P(Files, Shipped,
                         ::testing::Values("machines/solar015.toml", "older/solar015.toml", "devices/knuckle1.toml"),
                         [](const auto& chosen) {
                           const std::filesystem::path file = chosen.param;
                           return file.stem().string() +
                                  (file.string().starts_with(kInOlderWords) ? "_in_older_words" : "");
                         });

void expect_names(const std::string& line, const std::string& key) {
  EXPECT_TRUE(test::says(line, "key '" + key + "'")) << key;
  EXPECT_FALSE(test::says(line, "\n"));
}

TEST_P(Shipped, LoadsAsItIs) {
  EXPECT_EQ(refusal(original_), "accepted");
}

TEST_P(Shipped, RefusesEveryMissingKeyByName) {
  for_every_key(
      [](toml::table& parent, const std::string& key) {
        parent.erase(key);
        return key != "camera";  // a machine may have none
      },
      [](const std::string& line, const std::string& key) {
        std::string named = key, said = "is missing";
        if (key == "bus.node" || key == "bus.nodes") {
          named = "bus.node";
          said = "no node has boom_spool, ";
        } else if (key.ends_with(".channels.1")) {
          named = key.substr(0, key.size() - 2);
          said = "must say what channel 1 is";
        }
        expect_names(line, named);
        EXPECT_TRUE(test::says(line, said));
      });
  EXPECT_GT(changed_, 50);
}

TEST_P(Shipped, RefusesEveryNumberThatIsNotFiniteOrHuge) {
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity(), 1e30, -1e30}) {
    for_every_key(
        [bad](toml::table& parent, const std::string& key) {
          toml::node& value = *parent.get(key);
          if (value.is_array()) {
            value.as_array()->replace(value.as_array()->cbegin(), bad);
          } else if (value.is_number()) {
            parent.insert_or_assign(key, bad);
          } else {
            return false;
          }
          return true;
        },
        expect_names);
  }
  EXPECT_GT(changed_, 150);
}

TEST_P(Shipped, RefusesEveryKeyOfAnotherType) {
  for_every_key(
      [](toml::table& parent, const std::string& key) {
        parent.insert_or_assign(key, true);
        return true;
      },
      expect_names);
}

TEST_P(Shipped, RefusesAnUnknownKeyInEveryTable) {
  for_every_key(
      [](toml::table& parent, const std::string& key) {
        const bool first = parent.begin()->first == key;
        parent.insert("surprise", 1);
        return first;  // once in each table
      },
      [](const std::string& line, const std::string& key) {
        expect_names(line, key.substr(0, key.rfind('.') + 1) + "surprise");
        EXPECT_TRUE(test::says(line, "unknown key"));
      });
  EXPECT_GT(changed_, 5);
}

/// One value of the default machine changed to one that is in its bounds but contradicts another.
class Contradiction : public Shipped {
 protected:
  std::string with(const std::string& path, double value) {
    toml::table copy = original_;
    const auto [parent, key] = place_of(copy, path);
    if (value == std::floor(value)) {
      parent->insert_or_assign(key, static_cast<std::int64_t>(value));
    } else {
      parent->insert_or_assign(key, value);
    }
    return refusal(copy);
  }
};
INSTANTIATE_TEST_SUITE_P(Default, Contradiction, ::testing::Values("machines/solar015.toml"));

TEST_P(Contradiction, BucketOutlineMustBeConvexAndCounterClockwise) {
  const auto with_corner = [&](const char* corner, double x, double z) {
    toml::table copy = original_;
    copy["bucket_profile"].as_table()->insert_or_assign(corner, toml::array{x, z});
    return refusal(copy);
  };
  for (const auto& [corner, x, z] : {std::tuple{"heel_m", 0.25, 0.05}, {"back_m", 0.2, 0.1}, {"cheek_m", 0.25, 0.02}}) {
    const std::string line = with_corner(corner, x, z);
    expect_names(line, std::string("bucket_profile.") + corner);
    EXPECT_TRUE(test::says(line, "must leave the outline"));
  }
  EXPECT_EQ(with_corner("cheek_m", 0.3, -0.01), "accepted");
}

TEST_P(Contradiction, JointsYieldWithRadiiOfOneSize) {
  toml::table copy = original_;
  copy["control"].as_table()->insert_or_assign("stiffness_radius_m", toml::array{2.4, 1.3, 0.2});
  const std::string line = refusal(copy);
  expect_names(line, "control.stiffness_radius_m");
  EXPECT_TRUE(test::says(line, "= [2.4, 1.3, 0.2]: the largest must be at most 10 times the smallest"));
}

TEST_P(Contradiction, IsRefusedWithKeyValueAndBound) {
  const std::vector<std::tuple<std::string, double, std::string>> cases{
      {"links.arm.max_rad", -2.6, "= -2.6: must be at least 0.1 above min_rad = -2.585"},
      {"links.boom.max_rate_radps", 0.9, "= 0.9: must be at most 0.634, what the whole pump flow gives"},
      {"links.bucket.max_rad", 1.2, "= 1.2: "},
      {"mounts.bucket.coupler_length_m", 0.05, ""},
      {"cylinders.arm.rod_mm", 60, "= 60: must be below 0.95 of bore_mm = 60"},
      {"cylinders.arm.max_length_m", 1.2, "= 1.2: must be at least 1.328"},
      {"cylinders.boom.min_length_m", 0.8, "= 0.8: must be at most 0.772"},
      {"hydraulics.port_relief_bar", 200, "= 200: must be above main_relief_bar = 205"},
      {"sensors.pressure_range_bar", 235, "= 235: must be at least 1.05 port_relief_bar = 241.5"},
      {"links.boom.inertia_kgm2", 1000, "= 1000: must be within [0.765625, 306.25], a radius of gyration of 0.05 to 1"},
      {"links.bucket.inertia_kgm2", 0.01, "= 0.01: must be within [0.0375, 15], a radius of gyration of 0.05 to 1"},
      {"bus.bit_rate_kbps", 501, "= 501: must be one of CANopen's: 10, 20, 50, 125, 250, 500, 800, 1000"},
      {"bus.bit_rate_kbps", 250, "= 250: too slow: these frames load the bus to 119.1 %"},
      {"bus.sync_Hz", 160, "= 160: its period must be whole milliseconds"},
      {"bus.valve_watchdog_ms", 9, "= 9: must be at least 10, twice the valves' command period"},
      {"bus.valve_watchdog_ms", 201, "= 201: must be within [1, 200]"},
      {"bus.sensor_age_limit_ms", 201, "= 201: must be within [1, 200]"},
      {"bus.node[10].id", 0x30, "= 48: is taken by 'boom_encoder'; node ids must be unique"},
      {"bus.node[12].id", 1, "= 1: is taken by 'controller_id'"},
      {"bus.node[12].id", 128, "= 128: must be a whole number within [1, 127]"},
      {"limits.chamber_pressure_bar", 420, "= 420: must be within the transmitters' range of 400"},
      {"limits.reach_m", 0.1, "= 0.1: must be at least 0.91: beyond it is the tip in four poses of five"},
      {"control.position_gain_1ps", 15, "= 15: must be at most 10 = 1e-4 * tip_stiffness_N_per_m"},
      {"control.bucket_position_gain_1ps", 15, "= 15: must be at most 10 = 1e-4 * tip_stiffness_N_per_m"},
      {"control.contact_crossover_radps", 0, "= 0: must be within [0.5, 100]"},
      {"control.contact_crossover_radps", 101, "= 101: must be within [0.5, 100]"},
      {"control.dead_band_fill", 1.1, "= 1.1: must be within [0, 1]"},
  };
  for (const auto& [key, value, bound] : cases) {
    const std::string line = with(key, value);
    EXPECT_NE(line, "accepted") << key;
    EXPECT_TRUE(test::says(line, bound)) << key;
    if (!bound.empty()) {
      expect_names(line, key);
    }
  }
}

/// The lines of all errors, without the file's name and line.
std::vector<std::string> errors_of(const toml::table& machine) {
  std::ostringstream text;
  text << machine;
  try {
    (void)parse_machine(text.str(), "m.toml");
  } catch (const FileErrors& errors) {
    std::vector<std::string> lines;
    for (const std::string& line : errors.lines()) lines.push_back(line.substr(line.find("key ")));
    return lines;
  }
  return {};
}

TEST(LoadMachine, OneKeyThatIsGoneOrHugeIsOneError) {
  const toml::table original = toml::parse_file(kConfig + "/machines/compact080.toml");
  for (const std::string& path : paths_in(original)) {
    if (path == "camera") continue;  // a machine may have none
    toml::table copy = original;
    const auto [parent, key] = place_of(copy, path);
    parent->erase(key);
    EXPECT_EQ(errors_of(copy).size(), 1U) << path << " gone: " << ::testing::PrintToString(errors_of(copy));
    parent->insert_or_assign(key, 1e30);
    EXPECT_EQ(errors_of(copy).size(), 1U) << path << " huge: " << ::testing::PrintToString(errors_of(copy));
  }
  EXPECT_EQ(errors_of(original).size(), 0U);
}

TEST(LoadMachine, ConvertsToSi) {
  const MachineDescription machine = load_machine(kConfig + "/machines/solar015.toml");
  EXPECT_EQ(machine.name, "solar015");
  EXPECT_EQ(machine.source, kConfig + "/machines/solar015.toml");
  EXPECT_DOUBLE_EQ(machine.cylinders[kBoom].bore_m, 0.065);
  EXPECT_NEAR(machine.cylinders[kBoom].head_area_m2(), 33.183e-4, 1e-7);
  EXPECT_NEAR(machine.cylinders[kBoom].rod_side_area_m2(), 23.562e-4, 1e-7);
  EXPECT_DOUBLE_EQ(machine.cylinders[kArm].friction.viscous_Ns_per_m, 20e3);
  EXPECT_DOUBLE_EQ(machine.cylinders[kArm].friction.stribeck_mps, 0.012);
  EXPECT_DOUBLE_EQ(machine.cylinders[kBoom].valve.nominal_flow_m3ps, 0.5e-3);
  EXPECT_DOUBLE_EQ(machine.cylinders[kBoom].valve.nominal_drop_Pa, 15e5);
  EXPECT_DOUBLE_EQ(machine.cylinders[kBoom].valve.delay_s, 0.015);
  EXPECT_DOUBLE_EQ(machine.hydraulics.main_relief_Pa, 205e5);
  EXPECT_DOUBLE_EQ(machine.hydraulics.bulk_modulus_Pa, 1e9);
  EXPECT_DOUBLE_EQ(machine.hydraulics.hose_volume_m3, 0.15e-3);
  EXPECT_DOUBLE_EQ(machine.hydraulics.hose_drop_Pa_per_m3ps * 0.5e-3, 1.5e5) << "1.5 bar at 30 L/min";
  EXPECT_NEAR(machine.sensors.tilt_step_rad, 1.7453e-3, 1e-7);
  EXPECT_DOUBLE_EQ(machine.sensors.encoder_step_m, 1e-4);
  EXPECT_EQ(machine.bus.bit_rate, 500000u);
  EXPECT_DOUBLE_EQ(machine.bus.sensor_age_limit_s, 0.025);
  EXPECT_EQ(machine.bus.pressure(3).id, 0x23);
  EXPECT_EQ(machine.bus.tilt().device_type & 0xFFFF, 410u);
}

TEST(LoadMachine, DefaultMachineHasThePublishedGravityMoments) {
  const MachineDescription machine = load_machine(kConfig + "/machines/solar015.toml");
  const std::array<std::pair<double, double>, kJoints> published{{{98.65, 11.48}, {28.30, -2.67}, {26.01, 31.82}}};
  for (std::size_t i = 0; i < kJoints; ++i) {
    const PlanarVector moment = machine.links[i].mass_kg * machine.links[i].com_m;
    EXPECT_NEAR(moment.norm(), published[i].first, 1e-3);
    EXPECT_NEAR(std::atan2(moment.y(), moment.x()) * 180 / std::numbers::pi, published[i].second, 1e-2);
  }
}

// Counted by hand for 500 kbit/s: worst-stuffed frames of 0, 1, 2, 4, 5, 6 bytes are 55, 65, 75, 95, 105, 115 bits.
TEST(LoadMachine, BusLoadCountsEveryFrame) {
  const MachineDescription machine = load_machine(kConfig + "/machines/solar015.toml");
  const double every_sync = 200 * (55 + 6 * 105 + 3 * 115 + 3 * 95);
  const double every_second = 100 * 75, every_fourth = 50 * 3 * 95;
  const double slow = (20 + 20 + 20 + 140) * 65;
  EXPECT_NEAR(worst_bus_load(machine.bus), (every_sync + every_second + every_fourth + slow) / 500e3, 1e-12);
}

TEST(LoadDevice, OnlyALawThatLeadsAMachineIsTakenButAnyIsReadInARecordingsFile) {
  const std::string shipped = load_device(kConfig + "/devices/knuckle1.toml").text, echo = "law = \"echo\"";
  const std::string scratch = std::filesystem::temp_directory_path() / "knuckle_load_test_law.toml";
  for (const std::string law : {"cues", "direct", "wave", "tdpa", "telepathy"}) {
    std::string text = shipped;
    text.replace(text.find(echo), echo.size(), "law = \"" + law + "\"");
    std::ofstream(scratch) << text;
    EXPECT_EQ(parse_device(text, "FILE").feel.law, law == "cues" ? ControlLaw::kCues : ControlLaw::kEchoSpring);
    if (law == "cues") {
      EXPECT_EQ(load_device(scratch).feel.law, ControlLaw::kCues);
      continue;
    }
    try {
      (void)load_device(scratch);
      ADD_FAILURE() << law;
    } catch (const InputError& error) {
      const std::string said = error.what();
      EXPECT_TRUE(test::begins(said, scratch));
      EXPECT_TRUE(test::says(said, "'feel.law' = '" + law + "': must be echo or cues: no other law leads a machine"));
    }
  }
  std::filesystem::remove(scratch);
}

TEST(LoadDevice, ShippedDevicesCanRenderTheirForceAndAreFineEnough) {
  const std::array<std::pair<const char*, const char*>, 3> pairs{
      {{"knuckle1", "solar015"}, {"knuckle1_compact080", "compact080"}, {"knuckle1_standard200", "standard200"}}};
  for (const auto& [name, machine_name] : pairs) {
    const DeviceDescription device = load_device(kConfig + "/devices/" + name + ".toml");
    const MachineDescription machine = load_machine(kConfig + "/machines/" + machine_name + ".toml");
    for (std::size_t i = 0; i < kJoints; ++i) {
      const double to_tip = device.link_m.tail(kJoints - static_cast<int>(i)).sum();
      const double count = 2 * std::numbers::pi / (device.counts_per_turn[i] * device.gear_ratio[i]) * to_tip;
      EXPECT_LE(count, 5e-6) << name << " joint " << i;
      const double peak = device.peak_current_A[i] * device.torque_constant_Nm_per_A[i] * device.gear_ratio[i];
      EXPECT_GE(peak, device.feel.force_limit_N * to_tip) << name << " joint " << i;
      EXPECT_LE(device.friction_Nm[i] / to_tip, 0.06) << name << " joint " << i;
      EXPECT_DOUBLE_EQ(device.min_rad[i], machine.links[i].min_rad);
      EXPECT_DOUBLE_EQ(device.max_rad[i], machine.links[i].max_rad);
    }
    EXPECT_NEAR(device.feel.spring_N_per_m,
                device.feel.force_scale * device.feel.position_scale * machine.control.tip_stiffness_N_per_m, 1e-9);
  }
}

TEST(FindConfig, TurnsNamesIntoPathsAndLeavesPathsAlone) {
  EXPECT_EQ(find_config("machine", "solar015"), kConfig + "/machines/solar015.toml");
  EXPECT_EQ(find_config("device", "./mine"), "./mine");
  EXPECT_EQ(find_config("device", "mine.toml"), "mine.toml");
}

TEST(FindConfig, ListsWhatThereIsForAnUnknownName) {
  const std::string said = test::refusal([&] { (void)find_config("machine", "solar15"); });
  EXPECT_EQ(said, "unknown machine 'solar15': " + kConfig + "/machines has compact080, solar015, standard200");
  EXPECT_TRUE(test::says(test::refusal([&] { (void)find_config("scenario", "walk"); }), "wall_contact"));
  const test::TemporaryFolder folder;
  std::ofstream(folder.file("a.txt")) << "x";
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path(folder.path());
  EXPECT_EQ(test::refusal([&] { (void)find_config("machine", "a.txt"); }),
            "machine 'a.txt': is a file whose name does not end in .toml: write ./a.txt where it is meant");
  std::filesystem::current_path(before);
}

TEST(LoadedFile, OfAnotherKindIsCalledSo) {
  const std::string machine = kConfig + "/machines/solar015.toml", device = kConfig + "/devices/knuckle1.toml",
                    link = kConfig + "/links/lte.toml";
  EXPECT_EQ(test::refusal([&] { (void)load_machine(device); }), device + ": is a device file, not a machine file");
  EXPECT_EQ(test::refusal([&] { (void)load_device(machine); }), machine + ": is a machine file, not a device file");
  EXPECT_EQ(test::refusal([&] { (void)TomlTable::read_kind("scenario", link); }),
            link + ": is a link file, not a scenario file");
  for (const char* kind : {"machine", "device"})  // may be either, for all that is there
    EXPECT_EQ(test::refusal([&] { (void)TomlTable::read_kind(kind, kConfig + "/truth/example.toml"); }), "accepted");
}

TEST(WholeFile, LargerThanItMayBeIsRefused) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.file("a.toml"), std::ios::binary) << std::string(10'000'000, 'k') << " = 1";
  EXPECT_EQ(test::refusal([&] { (void)load_machine(folder.file("a.toml")); }),
            folder.file("a.toml") + ": must be at most 1 MB");
}

TEST(FindConfig, FollowsTheEnvironment) {
  ASSERT_EQ(setenv("KNUCKLE_CONFIG_DIR", "/nowhere", 1), 0);
  EXPECT_TRUE(test::begins(test::refusal([] { (void)find_config("machine", "solar015"); }),
                           "KNUCKLE_CONFIG_DIR = /nowhere: has no folder 'machines'"));
  ASSERT_EQ(unsetenv("KNUCKLE_CONFIG_DIR"), 0);
}

}  // namespace
}  // namespace knuckle
