// The machine file's sections, one function each, with the bounds of every key.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>

#include "core/units.h"
#include "machine/bus_budget.h"
#include "machine/bus_description.h"
#include "machine/bus_frames.h"
#include "machine/device_profile.h"
#include "machine/kinematics.h"
#include "machine/load.h"
#include "machine/load_calibration.h"
#include "machine/room.h"
#include "machine/toml_reader.h"

namespace knuckle {
namespace {

constexpr double kHeaviest_kg = 50000;
constexpr double kLeastGyration = 0.05;     // radius, of a link's length
constexpr double kLargestRadiusRatio = 10;  // of what a joint yields with to what another does
constexpr int kPvedMostStroke = 32766;
constexpr std::int64_t kMostSteps = std::int64_t{1} << 31;  // of an encoder: what counts more is broken

LinkDescription read_link(TomlTable& file) {
  LinkDescription link;
  link.length_m = file.number("length_m", 0.05, kFurthestPin_m);
  link.mass_kg = file.number("mass_kg", 0.1, kHeaviest_kg);
  link.com_m = file.numbers<2>("com_m", -kFurthestPin_m, kFurthestPin_m);
  link.inertia_kgm2 = file.number("inertia_kgm2", 1e-4, 1e7);
  const double largest_kgm2 = link.mass_kg * link.length_m * link.length_m;
  file.require(link.inertia_kgm2 >= kLeastGyration * kLeastGyration * largest_kgm2 && link.inertia_kgm2 <= largest_kgm2,
               "inertia_kgm2",
               "must be within [" + number_text(kLeastGyration * kLeastGyration * largest_kgm2) + ", " +
                   number_text(largest_kgm2) + "], a radius of gyration of " + number_text(kLeastGyration) +
                   " to 1 of length_m",
               {"mass_kg", "length_m"});
  link.min_rad = file.number("min_rad", -std::numbers::pi, std::numbers::pi);
  link.max_rad = file.number("max_rad", -std::numbers::pi, std::numbers::pi);
  file.require(link.max_rad >= link.min_rad + 0.1, "max_rad",
               "must be at least 0.1 above min_rad = " + number_text(link.min_rad), {"min_rad"});
  link.max_rate_radps = file.number("max_rate_radps", 0.01, 10);
  return link;
}

TriangleMount read_mount(TomlTable file) {
  return {.parent_pin_m = file.numbers<2>("parent_pin_m", -kFurthestPin_m, kFurthestPin_m),
          .child_pin_m = file.numbers<2>("child_pin_m", -kFurthestPin_m, kFurthestPin_m)};
}

BucketLinkage read_linkage(TomlTable file) {
  BucketLinkage linkage;
  linkage.cylinder_pin_m = file.numbers<2>("cylinder_pin_m", -kFurthestPin_m, kFurthestPin_m);
  linkage.rocker_pin_m = file.numbers<2>("rocker_pin_m", -kFurthestPin_m, kFurthestPin_m);
  linkage.bucket_pin_m = file.numbers<2>("bucket_pin_m", -kFurthestPin_m, kFurthestPin_m);
  linkage.rocker_length_m = file.number("rocker_length_m", 0.01, kFurthestPin_m);
  linkage.coupler_length_m = file.number("coupler_length_m", 0.01, kFurthestPin_m);
  linkage.branch = file.choice("crank_side", {"left", "right"}) == 0 ? 1 : -1;
  linkage.rocker_mass_kg = file.number("rocker_mass_kg", 0, kHeaviest_kg);
  linkage.coupler_mass_kg = file.number("coupler_mass_kg", 0, kHeaviest_kg);
  return linkage;
}

BucketProfile read_profile(TomlTable file) {
  return {.edge_m = file.numbers<2>("edge_m", -kFurthestPin_m, kFurthestPin_m),
          .heel_m = file.numbers<2>("heel_m", -kFurthestPin_m, kFurthestPin_m),
          .back_m = file.numbers<2>("back_m", -kFurthestPin_m, kFurthestPin_m),
          .cheek_m = file.numbers<2>("cheek_m", -kFurthestPin_m, kFurthestPin_m)};
}

void check_outline(const TomlTable& file, const MachineDescription& machine) {
  const auto corners = bucket_outline(machine);
  constexpr std::array<const char*, corners.size()> kBlamed{"edge_m", "edge_m", "heel_m",
                                                            "back_m", "back_m", "cheek_m"};
  const double least_m2 = 1e-6 * corners[0].squaredNorm();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const PlanarVector before = corners[i] - corners[(i + corners.size() - 1) % corners.size()];
    const PlanarVector after = corners[(i + 1) % corners.size()] - corners[i];
    const bool convex = before.x() * after.y() - before.y() * after.x() > least_m2;
    if (!file.require(
            convex, kBlamed[i],
            "must leave the outline tip, edge, heel, back, bucket pin, cheek convex and counter-clockwise",
            {"edge_m", "heel_m", "back_m", "cheek_m", ".links.bucket.length_m", ".mounts.bucket.bucket_pin_m"}))
      return;  // the next corner is wrong with it
  }
}

FrictionDescription read_friction(TomlTable file) {
  return {.coulomb_N = file.number("coulomb_N", 0, 1e5),
          .static_ratio = file.number("static_ratio", 1, 5),
          .stribeck_mps = file.number("stribeck_mmps", 1, 200, kMilli),
          .viscous_Ns_per_m = file.number("viscous_kNs_per_m", 0, 2000, 1e3)};
}

ValveDescription read_valve_description(TomlTable file) {
  return {.nominal_flow_m3ps = file.number("nominal_flow_Lpm", 1, 2000, kLitrePerMinute),
          .nominal_drop_Pa = file.number("nominal_drop_bar", 1, 100, kBar),
          .dead_band_extend = file.number("dead_band_extend", 0, 0.4),
          .dead_band_retract = file.number("dead_band_retract", 0, 0.4),
          .hysteresis = file.number("hysteresis", 0, 0.1),
          .delay_s = file.number("delay_ms", 0, 100, kMilli),
          .natural_frequency_Hz = file.number("natural_frequency_Hz", 1, 200),
          .damping_ratio = file.number("damping_ratio", 0.1, 3),
          .full_stroke_s = file.number("full_stroke_ms", 1, 2000, kMilli)};
}

CylinderDescription read_cylinder(TomlTable& file) {
  CylinderDescription cylinder;
  cylinder.bore_m = file.number("bore_mm", 10, 500, kMilli);
  cylinder.rod_m = file.number("rod_mm", 5, 450, kMilli);
  file.require(cylinder.rod_m < 0.95 * cylinder.bore_m, "rod_mm",
               "must be below 0.95 of bore_mm = " + number_text(cylinder.bore_m / kMilli), {"bore_mm"});
  cylinder.min_length_m = file.number("min_length_m", 0.05, kFurthestPin_m);
  cylinder.max_length_m = file.number("max_length_m", 0.05, kFurthestPin_m);
  file.require(cylinder.max_length_m > cylinder.min_length_m, "max_length_m",
               "must be above min_length_m = " + number_text(cylinder.min_length_m), {"min_length_m"});
  file.require(cylinder.max_length_m < 2 * cylinder.min_length_m, "max_length_m",
               "must be below twice min_length_m = " + number_text(cylinder.min_length_m) + ": the stroke is inside",
               {"min_length_m"});
  cylinder.body_mass_kg = file.number("body_mass_kg", 0, kHeaviest_kg);
  cylinder.rod_mass_kg = file.number("rod_mass_kg", 0, kHeaviest_kg);
  cylinder.friction = read_friction(file.table("friction"));
  cylinder.valve = read_valve_description(file.table("valve"));
  return cylinder;
}

HydraulicsDescription read_hydraulics(TomlTable file) {
  HydraulicsDescription hydraulics;
  hydraulics.pump_flow_m3ps = file.number("pump_flow_Lpm", 1, 2000, kLitrePerMinute);
  hydraulics.pump_power_W = file.number("pump_power_kW", 0.5, 2000, 1e3);
  hydraulics.load_sensing_margin_Pa = file.number("load_sensing_margin_bar", 5, 50, kBar);
  hydraulics.load_sensing_lag_s = file.number("load_sensing_lag_ms", 5, 1000, kMilli);
  hydraulics.main_relief_Pa = file.number("main_relief_bar", 50, 400, kBar);
  hydraulics.port_relief_Pa = file.number("port_relief_bar", 50, 450, kBar);
  file.require(hydraulics.port_relief_Pa > hydraulics.main_relief_Pa, "port_relief_bar",
               "must be above main_relief_bar = " + number_text(hydraulics.main_relief_Pa / kBar), {"main_relief_bar"});
  hydraulics.tank_Pa = file.number("tank_bar", 0, 20, kBar);
  hydraulics.bulk_modulus_Pa = file.number("bulk_modulus_GPa", 0.1, 2.5, 1e9);
  hydraulics.hose_volume_m3 = file.number("hose_volume_L", 0.01, 20, kMilli);
  hydraulics.hose_drop_Pa_per_m3ps = file.number("hose_drop_bar_per_Lpm", 0, 5, kBar / kLitrePerMinute);
  return hydraulics;
}

SensorDescription read_sensors(TomlTable file, const HydraulicsDescription& hydraulics) {
  SensorDescription sensors;
  sensors.pressure_range_Pa = file.number("pressure_range_bar", 50, 1000, kBar);
  file.require(sensors.pressure_range_Pa >= 1.05 * hydraulics.port_relief_Pa, "pressure_range_bar",
               "must be at least 1.05 port_relief_bar = " + number_text(1.05 * hydraulics.port_relief_Pa / kBar),
               {".hydraulics.port_relief_bar"});
  sensors.pressure_step_Pa = file.number("pressure_step_bar", 0.001, 5, kBar);
  sensors.pressure_noise_Pa = file.number("pressure_noise_bar", 0, 10, kBar);
  sensors.tilt_step_rad = file.number("tilt_step_deg", 0.001, 2, kDegree);
  sensors.tilt_noise_rad = file.number("tilt_noise_deg", 0, 5, kDegree);
  sensors.tilt_mount = file.choice("tilt_mount", {"hull", "boom"}) == 0 ? SensorDescription::TiltMount::kOnHull
                                                                        : SensorDescription::TiltMount::kOnBoom;
  return sensors;
}

/// Needed where there is a wire encoder.
void read_encoder_step(TomlTable file, MachineDescription& machine) {
  const bool rotary = std::all_of(machine.bus.nodes.begin(), machine.bus.nodes.end(), [](const NodeDescription& node) {
    return node.role != NodeRole::kEncoder || node.measures_angle();
  });
  if (!rotary || file.has("encoder_step_mm"))
    machine.sensors.encoder_step_m = file.number("encoder_step_mm", 0.0001, 5, kMilli);
}

/// Reads nodes and refuses names, signals and ids of nodes and frames that another has taken.
class NodeReader {
 public:
  explicit NodeReader(const BusDescription& bus) : wire_(bus.wire), ids_{{bus.controller_id, "controller_id"}} {}

  /// [bus.nodes]: a key for each signal.
  std::vector<NodeDescription> read_keyed(TomlTable nodes) {
    std::vector<NodeDescription> all;
    for (std::size_t i = 0; i < kSignals.size(); ++i) {
      if (kSignals[i].is_angle) continue;
      NodeDescription node;
      node.name = kSignals[i].node;
      node.role = kSignals[i].role;
      node.channels = {{1, static_cast<std::uint8_t>(i)}};
      TomlTable file = nodes.table(node.name);
      if (node.role == NodeRole::kValve && file.has("profile"))
        node.profile = static_cast<ValveProfile>(file.choice("profile", kValveProfileNames));
      read(file, node);
      all.push_back(std::move(node));
    }
    return all;
  }

  /// [[bus.node]], in any order.
  std::vector<NodeDescription> read_listed(std::vector<TomlTable> files) {
    std::vector<NodeDescription> all;
    for (TomlTable& file : files) {
      NodeDescription node;
      node.name = file.text("name");
      const auto same = [&](const NodeDescription& other) { return other.name == node.name; };
      file.require(std::none_of(all.begin(), all.end(), same), "name", "is the name of another node");
      read_profile(file, node);
      read_channels(file, node);
      check_name(file, node);
      read(file, node);
      all.push_back(std::move(node));
    }
    std::stable_sort(all.begin(), all.end(), [](const NodeDescription& a, const NodeDescription& b) {
      return !a.channels.empty() && (b.channels.empty() || first_signal(a) < first_signal(b));
    });
    return all;
  }

  /// "boom_length or boom_angle, slope"; empty where each signal is some node's.
  [[nodiscard]] std::string missing() const {
    std::string names;
    for (std::size_t i = 0; i < kSignals.size(); ++i) {
      const std::size_t other = in_place_of(i);
      if (other < i || signals_.count(i) + signals_.count(other) > 0) continue;
      names += (names.empty() ? "" : ", ") + std::string(kSignals[i].name);
      if (other != i) names += std::string(" or ") + kSignals[other].name;
    }
    return names;
  }

 private:
  /// The signal that says the same, by another sensor: a joint's length or angle. Itself where there is none.
  static std::size_t in_place_of(std::size_t signal) {
    const SignalInfo& one = kSignals[signal];
    for (std::size_t i = 0; i < kSignals.size(); ++i)
      if (i != signal && kSignals[i].role == one.role && kSignals[i].index == one.index) return i;
    return signal;
  }

  static std::uint8_t first_signal(const NodeDescription& node) {
    return std::min_element(node.channels.begin(), node.channels.end(),
                            [](const NodeChannel& a, const NodeChannel& b) { return a.signal < b.signal; })
        ->signal;
  }

  /// It stands in options, scenarios and a DBC, and must not say that the node is another one.
  static void check_name(TomlTable& file, const NodeDescription& node) {
    constexpr std::size_t kLongest = 22;
    const std::string& name = node.name;
    if (name.empty()) return;  // noted
    const bool plain =
        name.size() <= kLongest && std::isalpha(static_cast<unsigned char>(name.front())) != 0 &&
        std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; });
    file.require(plain && name != "controller", "name",
                 "must be a letter and up to 21 letters, digits and _, and not 'controller'");
    const auto is_named = [&](const SignalInfo& signal) { return signal.name == name || signal.node == name; };
    const bool has_one = std::any_of(node.channels.begin(), node.channels.end(),
                                     [&](const NodeChannel& channel) { return is_named(channel.info()); });
    file.require(has_one || std::none_of(kSignals.begin(), kSignals.end(), is_named), "name",
                 "is what Knuckle calls a signal that this node does not have", {"channels", "profile"});
  }

  static void read_profile(TomlTable& file, NodeDescription& node) {
    constexpr std::array kProfiles{"cia408", "cia408/pved", "cia404", "cia406", "cia410", "cia401"};
    constexpr std::array kRoles{NodeRole::kValve,   NodeRole::kValve, NodeRole::kPressure,
                                NodeRole::kEncoder, NodeRole::kTilt,  NodeRole::kEnable};
    const auto profile = static_cast<std::size_t>(file.choice("profile", kProfiles));
    node.role = kRoles[profile];
    if (profile == 1) node.profile = ValveProfile::kPved;
  }

  struct ChannelRange {
    int most;
    const char* bound;
  };
  static ChannelRange channels_of(const NodeDescription& node) {
    switch (node.role) {
      case NodeRole::kValve:
        if (node.profile == ValveProfile::kPved) return {1, "must be channel 1: a PVED-CC has one axis"};
        return {static_cast<int>(NodeDescription::kMostPdos),
                "must be an axis from 1 to 4: each has PDOs of its own, and a node has 4"};
      case NodeRole::kPressure:
        return {8, "must be a channel from 1 to 8"};
      case NodeRole::kTilt:
        return {2, "must be 1 (longitudinal, 0x6010) or 2 (lateral, 0x6020)"};
      case NodeRole::kEncoder:
      case NodeRole::kEnable:
        break;
    }
    return {1, "must be channel 1"};
  }

  /// channels = { 1 = "boom_head_pressure", 2 = "boom_rod_pressure" }
  void read_channels(TomlTable& file, NodeDescription& node) {
    const ChannelRange range = channels_of(node);
    std::vector<const char*> names;
    std::vector<std::size_t> places;
    for (std::size_t i = 0; i < kSignals.size(); ++i) {
      if (kSignals[i].role != node.role) continue;
      names.push_back(kSignals[i].name);
      places.push_back(i);
    }
    if (!file.sound({"profile"})) {  // which values and keys it may have is not known, then
      file.leave_rest();
      node.channels.push_back({1, static_cast<std::uint8_t>(places[0])});
      return;
    }
    TomlTable channels = file.table("channels");
    std::vector<int> numbers;
    for (const std::string& key : channels.keys()) {
      const bool digits = !key.empty() && key.size() <= 2 &&
                          std::all_of(key.begin(), key.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
      if (digits && key == std::to_string(std::stoi(key))) {
        numbers.push_back(std::stoi(key));
      } else {
        channels.require(false, key, std::string("unknown key: ") + range.bound);
        channels.leave(key);
      }
    }
    std::sort(numbers.begin(), numbers.end());
    for (const int number : numbers) {
      const std::string key = std::to_string(number);
      const std::size_t place = places[static_cast<std::size_t>(channels.choice(key, names))];
      const bool known = channels.sound({key});
      if (!channels.require(number >= 1 && number <= range.most, key, range.bound)) {
        if (known) signals_.emplace(place, node.name);  // it is not missing, too
        continue;
      }
      if (known) {
        const auto [other, is_new] = signals_.emplace(place, node.name);
        channels.require(is_new, key, "is taken by '" + other->second + "'");
        const auto twin = in_place_of(place) == place ? signals_.end() : signals_.find(in_place_of(place));
        channels.require(twin == signals_.end(), key,
                         twin == signals_.end() ? ""
                                                : "'" + twin->second + "' has " + kSignals[twin->first].name +
                                                      ": of a joint's length and angle there must be one");
      }
      node.channels.push_back({static_cast<std::uint8_t>(number), static_cast<std::uint8_t>(place)});
    }
    file.require(!node.channels.empty(), "channels",
                 "must say what channel 1 is: { 1 = \"" + std::string(names[0]) + "\" }");
    if (node.channels.empty()) node.channels.push_back({1, static_cast<std::uint8_t>(places[0])});
  }

  void read(TomlTable& file, NodeDescription& node) {
    constexpr std::int64_t kMax32 = 0xFFFFFFFF;
    node.id = static_cast<std::uint8_t>(file.integer("id", 1, 127));
    if (file.sound({"id"})) {
      const auto [other, is_new] = ids_.emplace(node.id, node.name);
      file.require(is_new, "id", "is taken by '" + other->second + "'; node ids must be unique");
    }
    node.device_type = static_cast<std::uint32_t>(file.integer("device_type", 0, kMax32));
    file.require(
        may_be(node.device_type, node.role), "device_type",
        fmt::format("must have {0} = 0x{0:04X}, the number of the node's profile, in its lower 16 bits; has {1}",
                    profile_number(node.role), profile_number(node.device_type)),
        {"profile"});
    node.vendor = static_cast<std::uint32_t>(file.integer("vendor", 0, kMax32));
    node.product = static_cast<std::uint32_t>(file.integer("product", 0, kMax32));
    if (node.measures_angle()) node.rotary = read_rotary(file);
    read_maps(file, node);
    constexpr std::array kTpdoKeys{"tpdo", "tpdo2", "tpdo3", "tpdo4"}, kRpdoKeys{"rpdo", "rpdo2", "rpdo3", "rpdo4"};
    const std::vector<std::uint8_t> pdos = transmit_pdos(node, wire_);
    file.require(pdos.size() <= NodeDescription::kMostPdos, "channels",
                 "need " + std::to_string(pdos.size()) +
                     " frames, and a node has 4: pressure_value = \"integer16\" needs fewer");
    for (const std::uint8_t pdo : pdos) {
      if (pdo >= NodeDescription::kMostPdos) break;
      node.tpdos[pdo] = frame_id(file, kTpdoKeys[pdo]);
      take(file, node.name, kTpdoKeys[pdo], node.tpdo_id(pdo));
    }
    if (node.is_told() && file.has("unguarded")) node.unguarded = file.text("unguarded");
    for (const std::uint8_t pdo : receive_pdos(node)) {
      node.rpdos[pdo] = frame_id(file, kRpdoKeys[pdo]);
      take(file, node.name, kRpdoKeys[pdo], node.rpdo_id(pdo));
    }
  }

  /// Optional, one after the other from the first.
  void read_maps(TomlTable& file, NodeDescription& node) const {
    constexpr double kMax32 = 0xFFFFFFFF;
    constexpr std::size_t kMostMapped = 8;  // bytes of a frame
    const std::vector<FrameField> wanted = known_fields(node);
    for (const char* key : {"tpdo_map", "tpdo2_map", "tpdo3_map", "tpdo4_map"}) {
      if (!file.has(key)) break;
      std::vector<std::uint32_t>& map = node.tpdo_maps.emplace_back();
      std::uint32_t bits = 0;
      for (const double entry : file.list(key, 1, kMostMapped, 0, kMax32)) {
        map.push_back(static_cast<std::uint32_t>(entry));
        const std::uint32_t own = canopen::mapped_bits(map.back());
        file.require(entry == std::floor(entry), key,
                     fmt::format("has {}: must be whole numbers, such as 0x61300120", number_text(entry)));
        file.require(own > 0, key, fmt::format("has 0x{:08X}, which is 0 bits: must be at least 1", map.back()));
        bits += own;
      }
      file.require(!node.is_told(), key,
                   "only goes with sensors: a node that moves something maps as start-up wants it");
      file.require(bits % 8 == 0 && bits <= 64, key, fmt::format("has {} bits: must be whole bytes, 8 at most", bits));
      require_once(file, key, node.tpdo_maps, wanted);
    }
    if (node.tpdo_maps.empty() || node.is_told()) return;
    const std::vector<FrameField> found = known_fields(node);
    for (const FrameField& field : wanted) {
      file.require(field.part != FrameField::Part::kValue || find_field(found, field.part, field.channel) != nullptr,
                   "tpdo_map",
                   fmt::format("nor a further one has 0x{:08X}, which is {}",
                               canopen::mapping(field.object, field.bits.bits), field.channel.info().name));
    }
  }
  /// Which of two would be the value is not known.
  static void require_once(const TomlTable& file, const char* key, const std::vector<std::vector<std::uint32_t>>& maps,
                           const std::vector<FrameField>& wanted) {
    for (const FrameField& field : wanted) {
      const std::uint32_t entry = canopen::mapping(field.object, field.bits.bits);
      const auto times_in = [&](const auto& map) { return std::count(map.begin(), map.end(), entry); };
      const auto here = times_in(maps.back());
      file.require(here <= 1, key, fmt::format("has 0x{:08X} twice", entry));
      const bool before = std::any_of(maps.begin(), maps.end() - 1, [&](const auto& map) { return times_in(map) > 0; });
      file.require(here == 0 || !before, key, fmt::format("has 0x{:08X}, which an earlier map has, too", entry));
    }
  }
  [[nodiscard]] std::vector<FrameField> known_fields(const NodeDescription& node) const {
    BusDescription alone;
    alone.wire = wire_;
    alone.nodes = {node};
    std::vector<FrameField> all;
    for (const BusFrame& frame : bus_frames(alone)) {
      if (!frame.to_node) all.insert(all.end(), frame.fields.begin(), frame.fields.end());
    }
    return all;
  }

  static RotaryDescription read_rotary(TomlTable& file) {
    RotaryDescription rotary;
    rotary.steps_per_turn = static_cast<std::uint32_t>(file.integer("steps_per_turn", 1 << 9, 1 << 24));
    if (file.has("turns")) {
      rotary.turns = static_cast<std::uint32_t>(file.integer("turns", 1, 1 << 16));
      file.require(std::int64_t{rotary.steps_per_turn} * rotary.turns <= kMostSteps, "turns",
                   "must be at most " + std::to_string(kMostSteps / rotary.steps_per_turn) + ": 2^31 steps in all",
                   {"steps_per_turn"});
    }
    if (file.has("sign")) {
      rotary.sign = static_cast<int>(file.integer("sign", -1, 1));
      file.require(rotary.sign != 0, "sign", "must be 1 or -1");
    }
    if (file.has("zero_rad")) rotary.zero_rad = file.number("zero_rad", -std::numbers::pi, std::numbers::pi);
    return rotary;
  }

  /// Optional. CiA 301 keeps what lies outside for other services.
  static std::uint16_t frame_id(TomlTable& file, const char* pdo) {
    if (!file.has(pdo)) return 0;
    const std::int64_t id = file.integer(pdo, 0, 0xFFFF);
    file.require(id >= 0x181 && id <= 0x57F, pdo, "must be within [0x181, 0x57F]");
    return static_cast<std::uint16_t>(id);
  }

  void take(const TomlTable& file, const std::string& name, const char* pdo, std::uint32_t id) {
    if (!file.sound({"id", pdo})) return;
    const auto [other, is_new] = frames_.emplace(id, name + "." + pdo);
    file.require(is_new, file.has(pdo) ? pdo : "id",
                 "its frames' identifier " + fmt::format("0x{:03X}", id) + " is taken by '" + other->second + "'");
  }

  WireDescription wire_;
  std::map<std::int64_t, std::string> ids_;
  std::map<std::uint32_t, std::string> frames_;
  std::map<std::size_t, std::string> signals_;
};

std::vector<NodeDescription> read_nodes(TomlTable& file, const BusDescription& bus) {
  NodeReader read(bus);
  if (!file.has("node") && file.has("nodes")) return read.read_keyed(file.table("nodes"));
  if (file.has("nodes")) {
    file.leave("nodes");
    file.require(false, "nodes", "stands beside [[bus.node]] tables: keep one of the two");
  }
  std::vector<NodeDescription> nodes = read.read_listed(file.tables("node"));
  const std::string missing = read.missing();
  file.require(missing.empty(), "node", "no node has " + missing);
  return nodes;
}

/// All optional: what the default profiles say where it is absent.
WireDescription read_wire(TomlTable file) {
  WireDescription wire;
  if (file.has("valve_full_stroke")) wire.valve_full_stroke = file.number("valve_full_stroke", 100, 32767);
  using Pressure = WireDescription::Pressure;
  if (file.has("pressure_value"))
    wire.pressure = static_cast<Pressure>(file.choice("pressure_value", {"integer", "float", "integer16"}));
  if (file.has("pressure_digits")) {
    wire.pressure_digits = static_cast<int>(file.integer("pressure_digits", 0, 4));
    file.require(wire.pressure != Pressure::kFloat, "pressure_digits",
                 "only goes with pressure_value = \"integer\" or \"integer16\"", {"pressure_value"});
  }
  if (file.has("encoder_speed_step_mmps")) {
    wire.encoder_speed_step_mps = file.number("encoder_speed_step_mmps", 0.01, 10, kMilli);
  }
  return wire;
}

void read_patience(TomlTable& file, BusDescription& bus) {
  const auto optional = [&file](const char* key, double most_ms, double& seconds) {
    if (file.has(key)) seconds = file.number(key, 10, most_ms, kMilli);
  };
  optional("sdo_timeout_ms", 5000, bus.sdo_timeout_s);
  optional("boot_timeout_ms", 30000, bus.boot_timeout_s);
  optional("start_timeout_ms", 30000, bus.start_timeout_s);
  optional("activate_timeout_ms", 30000, bus.activate_timeout_s);
}

BusDescription read_bus(TomlTable file, const SensorDescription& sensors) {
  BusDescription bus;
  const std::int64_t kbps = file.integer("bit_rate_kbps", kBitRates_kbps.front(), kBitRates_kbps.back());
  file.require(std::find(kBitRates_kbps.begin(), kBitRates_kbps.end(), kbps) != kBitRates_kbps.end(), "bit_rate_kbps",
               fmt::format("must be one of CANopen's: {}", fmt::join(kBitRates_kbps, ", ")));
  bus.bit_rate = static_cast<std::uint32_t>(1000 * kbps);
  bus.sync_Hz = file.number("sync_Hz", 50, 250);
  const double period_ms = 1e3 / bus.sync_Hz;
  file.require(std::abs(period_ms - std::round(period_ms)) < 1e-6, "sync_Hz", "its period must be whole milliseconds");
  const auto every_nth = [&file](const char* key) { return static_cast<int>(file.integer(key, 1, 8)); };
  bus.set_point_every_nth_sync = every_nth("set_point_every_nth_sync");
  bus.valve_status_every_nth_sync = every_nth("valve_status_every_nth_sync");
  bus.tilt_every_nth_sync = every_nth("tilt_every_nth_sync");
  bus.controller_heartbeat_s = file.number("controller_heartbeat_ms", 10, 500, kMilli);
  bus.node_heartbeat_s = file.number("node_heartbeat_ms", 10, 500, kMilli);
  const auto at_least = [&file](const char* key, double twice_ms, const std::string& what, TomlTable::Keys of,
                                double most_ms = 2000) {
    const double ms = file.number(key, 1, most_ms);
    file.require(ms >= 2 * twice_ms, key, "must be at least " + number_text(2 * twice_ms) + ", twice the " + what, of);
    return ms * kMilli;
  };
  bus.node_heartbeat_timeout_s = at_least("node_heartbeat_timeout_ms", bus.node_heartbeat_s / kMilli,
                                          "nodes' heartbeat period", {"node_heartbeat_ms"});
  bus.valve_watchdog_s = at_least("valve_watchdog_ms", period_ms * bus.set_point_every_nth_sync,
                                  "valves' command period", {"sync_Hz", "set_point_every_nth_sync"}, kLongestBlind_ms);
  bus.controller_timeout_s = at_least("controller_timeout_ms", bus.controller_heartbeat_s / kMilli,
                                      "controller's heartbeat period", {"controller_heartbeat_ms"});
  bus.sensor_age_limit_s = at_least("sensor_age_limit_ms", period_ms * bus.tilt_every_nth_sync, "tilt sensor's period",
                                    {"sync_Hz", "tilt_every_nth_sync"}, kLongestBlind_ms);
  read_patience(file, bus);
  if (file.has("wire")) bus.wire = read_wire(file.table("wire"));
  bus.controller_id = static_cast<std::uint8_t>(file.integer("controller_id", 1, 127));
  bus.nodes = read_nodes(file, bus);
  const bool floats = std::any_of(bus.nodes.begin(), bus.nodes.end(),
                                  [](const NodeDescription& valve) { return valve.profile == ValveProfile::kPved; });
  file.require(!floats || bus.wire.valve_full_stroke <= kPvedMostStroke, "wire",
               fmt::format("valve_full_stroke must be at most {}: above that a valve of profile cia408/pved floats",
                           kPvedMostStroke));
  const double reach_Pa = std::numeric_limits<std::int16_t>::max() * bus.wire.pressure_unit_Pa();
  file.require(
      bus.wire.pressure != WireDescription::Pressure::kInteger16 || reach_Pa > kOverRange * sensors.pressure_range_Pa,
      "wire",
      "16 bits reach " + number_text(reach_Pa / kBar) + " bar, less than the transmitters: needs fewer pressure_digits",
      {".sensors.pressure_range_bar"});
  if (const double load = worst_bus_load(bus); load > kFullestBus) {
    const std::string fits = what_fits(bus, sensors);
    file.require(false, "bit_rate_kbps",
                 "too slow: these frames load the bus to " + number_text(std::round(1000 * load) / 10) +
                     " % with worst-case stuffing; must be at most " + number_text(100 * kFullestBus) + " %" +
                     (fits.empty() ? "" : "; " + fits),
                 {"node", "nodes", "wire", "sync_Hz", "set_point_every_nth_sync", "valve_status_every_nth_sync",
                  "tilt_every_nth_sync", "controller_heartbeat_ms", "node_heartbeat_ms"});
  }
  return bus;
}

LimitsDescription read_limits(TomlTable file, const MachineDescription& machine) {
  LimitsDescription limits;
  limits.tip_speed_mps = file.number("tip_speed_mps", 0.05, 5);
  limits.joint_soft_margin_rad = file.number("joint_soft_margin_rad", 0, 0.3);
  for (std::size_t joint = 0; joint < kJoints; ++joint) {
    const LinkDescription& link = machine.links[joint];
    const std::string of = std::string(".links.") + kJointNames[joint];
    file.require(2 * limits.joint_soft_margin_rad < link.max_rad - link.min_rad, "joint_soft_margin_rad",
                 "must leave room in a working range of " + number_text(link.max_rad - link.min_rad),
                 {of + ".min_rad", of + ".max_rad"});
  }
  limits.chamber_pressure_Pa = file.number("chamber_pressure_bar", 50, 450, kBar);
  file.require(limits.chamber_pressure_Pa <= machine.sensors.pressure_range_Pa, "chamber_pressure_bar",
               "must be within the transmitters' range of " + number_text(machine.sensors.pressure_range_Pa / kBar),
               {".sensors.pressure_range_bar"});
  limits.tip_force_N = file.number("tip_force_kN", 0.3, 1000, 1e3);
  limits.power_W = file.number("power_kW", 0.5, 2000, 1e3);
  limits.floor_m = file.number("floor_m", -100, 0);
  limits.ceiling_m = file.number("ceiling_m", 0, 100);
  limits.reach_m = file.number("reach_m", 0, 100);
  return limits;
}

MachineDescription::Control read_control(TomlTable file) {
  MachineDescription::Control control;
  control.position_gain_1ps = file.number("position_gain_1ps", 0.1, 20);
  control.tip_stiffness_N_per_m = file.number("tip_stiffness_N_per_m", 1e3, 1e7);
  control.bucket_position_gain_1ps = file.number("bucket_position_gain_1ps", 0.1, 20);
  constexpr double kHighestRatio = 1e-4;  // limit cycles on stiff walls begin here
  const double highest_1ps = kHighestRatio * control.tip_stiffness_N_per_m;
  for (const auto& [key, gain_1ps] : {std::pair{"position_gain_1ps", control.position_gain_1ps},
                                      {"bucket_position_gain_1ps", control.bucket_position_gain_1ps}})
    file.require(gain_1ps <= highest_1ps, key,
                 "must be at most " + number_text(highest_1ps) + " = 1e-4 * tip_stiffness_N_per_m",
                 {"tip_stiffness_N_per_m"});
  control.stiffness_radius_m = file.numbers<kJoints>("stiffness_radius_m", 0.05, kFurthestPin_m);
  file.require(control.stiffness_radius_m.maxCoeff() <= kLargestRadiusRatio * control.stiffness_radius_m.minCoeff(),
               "stiffness_radius_m",
               "the largest must be at most " + number_text(kLargestRadiusRatio) + " times the smallest");
  control.contact_crossover_radps = file.number("contact_crossover_radps", 0.5, 100);
  control.feed_forward_fade_N = file.number("feed_forward_fade_N", 1, 1e6);
  control.dither = file.number("dither", 0, 0.05);
  control.learning_limit = file.number("learning_limit", 0, 0.1);
  control.dead_band_fill = file.number("dead_band_fill", 0, 1);
  return control;
}

/// The tables of a machine file that its geometry is checked by.
struct GeometryTables {
  TomlTable links, cylinders, limits;
  std::vector<TomlTable> link, cylinder;  ///< Per joint, as they were read.
};

/// Whether all that the joint's kinematics hang on is known.
bool geometry_sound(const GeometryTables& tables, std::size_t joint) {
  const TomlTable& link = tables.link[joint];
  return link.sound({"length_m", "min_rad", "max_rad", std::string(".mounts.") + kJointNames[joint]}) &&
         tables.cylinder[joint].sound({"min_length_m", "max_length_m"}) &&
         (joint == kBoom || tables.link[joint - 1].sound({"length_m"}));
}

/// No joint may be asked for more than the whole pump gives its cylinder's head side at the longest lever.
void check_rate(const MachineDescription& machine, const Kinematics& kinematics, std::size_t joint,
                const TomlTable& link) {
  const double fastest_radps = fastest_rate_radps(machine, kinematics, static_cast<int>(joint));
  link.require(machine.links[joint].max_rate_radps <= fastest_radps, "max_rate_radps",
               "must be at most " + number_text(std::floor(1000 * fastest_radps) / 1000) +
                   ", what the whole pump flow gives at the longest lever",
               {".hydraulics.pump_flow_Lpm", std::string(".cylinders.") + kJointNames[joint] + ".bore_mm"});
}

/// The virtual wall in front must leave the tip something to work in: the gate lets nothing move further beyond it.
void check_room(const MachineDescription& machine, const TomlTable& limits) {
  constexpr double kLeastShare = 0.2;  // of all poses
  std::vector<double> x_m;
  for (const PlanarVector& tip_m : tips_over_range(machine)) x_m.push_back(tip_m.x());
  std::sort(x_m.begin(), x_m.end());
  const double least_m = x_m[static_cast<std::size_t>(kLeastShare * static_cast<double>(x_m.size()))];
  limits.require(machine.limits.reach_m >= least_m, "reach_m",
                 "must be at least " + number_text(std::ceil(100 * least_m) / 100) +
                     ": beyond it is the tip in four poses of five");
}

/// Levers do not hang on the cylinders' own lengths.
std::optional<Kinematics> with_any_stroke(MachineDescription machine) {
  for (CylinderDescription& cylinder : machine.cylinders) {
    cylinder.min_length_m = 0;
    cylinder.max_length_m = 4 * kFurthestPin_m;
  }
  try {
    return Kinematics(machine);
  } catch (const GeometryErrors&) {
    return std::nullopt;  // told of the machine itself
  }
}

/// What the sections say together: cylinders that reach, rates that the pump gives, room to work in.
void check_geometry(const MachineDescription& machine, const GeometryTables& tables) {
  PerJoint<bool> sound{};
  bool room_known = true;
  for (std::size_t joint = 0; joint < kJoints; ++joint) {
    sound[joint] = geometry_sound(tables, joint);
    room_known &= tables.link[joint].sound({"length_m", "min_rad", "max_rad"});
  }
  try {
    (void)Kinematics(machine);
  } catch (const GeometryErrors& found) {
    for (const GeometryError& error : found.errors()) {
      const auto joint = static_cast<std::size_t>(error.joint);
      const bool of_link = error.table == std::string_view("links");
      if (sound[joint]) (of_link ? tables.link : tables.cylinder)[joint].require(false, error.key, error.bound);
    }
  }
  const std::optional<Kinematics> kinematics = with_any_stroke(machine);
  for (std::size_t joint = 0; kinematics && joint < kJoints; ++joint)
    if (sound[joint]) check_rate(machine, *kinematics, joint, tables.link[joint]);
  if (room_known) check_room(machine, tables.limits);
}

/// All optional: a machine has any number of cameras.
std::vector<CameraDescription> read_cameras(TomlTable& file) {
  std::vector<CameraDescription> cameras;
  for (TomlTable& table : file.tables("camera")) {
    CameraDescription camera;
    camera.name = table.text("name");
    const bool plain = std::all_of(camera.name.begin(), camera.name.end(),
                                   [](unsigned char c) { return std::isalnum(c) != 0 || c == '_' || c == '-'; });
    table.require(plain, "name", "must be made of letters, digits, - and _: it is given as --camera NAME=SOURCE");
    const bool taken = std::any_of(cameras.begin(), cameras.end(),
                                   [&camera](const CameraDescription& other) { return other.name == camera.name; });
    table.require(!taken, "name", "is taken by another camera; names must be unique");
    camera.position_m = table.numbers<3>("position_m", -kFurthestPin_m, kFurthestPin_m);
    camera.pan_rad = table.number("pan_deg", -180, 180, kDegree);
    camera.tilt_rad = table.number("tilt_deg", -89, 89, kDegree);
    camera.field_of_view_rad = table.number("field_of_view_deg", 5, 150, kDegree);
    cameras.push_back(camera);
  }
  return cameras;
}

/// What `knuckle commission` has found: the rest is for people and tools. What it says of a node that is no longer
/// there is nothing.
void read_guard_proofs(TomlTable record, BusDescription& bus) {
  for (TomlTable& file : record.tables("guards")) {
    using Changed = GuardProof::Changed;
    const std::string name = file.text("node");
    const auto number = [&](const char* key) { return static_cast<std::uint32_t>(file.integer(key, 0, 0xFFFFFFFF)); };
    const auto is_now = [&](const char* key, double now_s) {
      constexpr double kMost_ms = 1e5, kSame_s = 1e-6;
      return std::abs(file.number(key, 0, kMost_ms, kMilli) - now_s) < kSame_s;
    };
    GuardProof proof;
    proof.proved = file.boolean("proved");
    if (file.has("serial")) proof.serial = number("serial");
    proof.date = file.text("date");
    file.leave("seen");
    const std::uint32_t vendor = number("vendor"), product = number("product");
    const bool recorded = file.has("channels");
    const std::string channels = recorded ? file.text("channels") : "";
    const bool watchdog = recorded && is_now("valve_watchdog_ms", bus.valve_watchdog_s);
    const bool timeout = recorded && is_now("controller_timeout_ms", bus.controller_timeout_s);
    const auto of =
        std::find_if(bus.nodes.begin(), bus.nodes.end(), [&](const NodeDescription& n) { return n.name == name; });
    if (of == bus.nodes.end()) continue;
    if (of->vendor != vendor || of->product != product)
      proof.changed = Changed::kDevice;
    else if (!recorded)
      proof.changed = Changed::kNotRecorded;
    else if (channels != channels_text(*of))
      proof.changed = Changed::kChannels;
    else if (!timeout || (of->role == NodeRole::kValve && !watchdog))
      proof.changed = Changed::kTimes;
    of->guard = proof;
  }
  record.leave_rest();
}

MachineDescription read_machine(TomlTable file) {
  MachineDescription machine;
  machine.name = file.text("name");
  machine.source = file.source();
  machine.text = file.document();
  GeometryTables tables{file.table("links"), file.table("cylinders"), file.table("limits"), {}, {}};
  TomlTable mounts = file.table("mounts");
  for (std::size_t joint = 0; joint < kJoints; ++joint) {
    machine.links[joint] = read_link(tables.link.emplace_back(tables.links.table(kJointNames[joint])));
    machine.cylinders[joint] = read_cylinder(tables.cylinder.emplace_back(tables.cylinders.table(kJointNames[joint])));
  }
  machine.boom_mount = read_mount(mounts.table("boom"));
  machine.arm_mount = read_mount(mounts.table("arm"));
  machine.bucket_linkage = read_linkage(mounts.table("bucket"));
  const TomlTable profile = file.table("bucket_profile");
  machine.bucket_profile = read_profile(profile);
  check_outline(profile, machine);
  machine.hydraulics = read_hydraulics(file.table("hydraulics"));
  const TomlTable sensors = file.table("sensors");
  machine.sensors = read_sensors(sensors, machine.hydraulics);
  machine.bus = read_bus(file.table("bus"), machine.sensors);
  read_encoder_step(sensors, machine);
  machine.limits = read_limits(tables.limits, machine);
  machine.control = read_control(file.table("control"));
  TomlTable payload = file.table("payload");
  machine.payload_full_scale_kg = payload.number("full_scale_kg", 1, kHeaviest_kg);
  machine.payload_com_m = payload.numbers<2>("com_m", -kFurthestPin_m, kFurthestPin_m);
  machine.cameras = read_cameras(file);
  load_calibration(file, machine);
  if (file.has("commissioning")) read_guard_proofs(file.table("commissioning"), machine.bus);
  check_geometry(machine, tables);
  file.finish();
  return machine;
}

}  // namespace

double worst_bus_load(const BusDescription& bus) {
  // 11-bit data frame with n bytes: 47 bits and interframe space, 8 n of data, a stuff bit per 4 of 34 + 8 n - 1.
  const auto bits = [](int bytes) -> double {
    const int stuffed = (34 + 8 * bytes - 1) / 4;
    return 47 + 8 * bytes + stuffed;
  };
  double bits_per_s = bus.sync_Hz * bits(0) + bits(1) / bus.controller_heartbeat_s;
  for (const BusFrame& frame : bus_frames(bus)) bits_per_s += frame.rate_Hz(bus.sync_Hz) * bits(frame.bytes());
  bits_per_s += static_cast<double>(bus.nodes.size()) / bus.node_heartbeat_s * bits(1);
  return bits_per_s / bus.bit_rate;
}

MachineDescription load_machine(const std::string& path) {
  return read_machine(TomlTable::read(path));
}

MachineDescription parse_machine(std::string_view text, const std::string& source) {
  return read_machine(TomlTable::parse(text, source));
}

}  // namespace knuckle
