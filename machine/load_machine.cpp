// The machine file's sections, one function each, with the bounds of every key.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/error.h"
#include "core/units.h"
#include "machine/bus_description.h"
#include "machine/file_text.h"
#include "machine/kinematics.h"
#include "machine/load.h"
#include "machine/load_bus.h"
#include "machine/load_bus_lines.h"
#include "machine/load_calibration.h"
#include "machine/room.h"
#include "machine/toml_reader.h"

namespace knuckle {
namespace {

constexpr double kHeaviest_kg = 50000;
constexpr double kLeastGyration = 0.05;     // radius, of a link's length
constexpr double kLargestRadiusRatio = 10;  // of what a joint yields with to what another does

LinkDescription read_link(TomlTable& file) {
  LinkDescription link;
  link.length_m = file.number("length_m", 0.05, kFurthestPin_m);
  link.mass_kg = file.number("mass_kg", 0.1, kHeaviest_kg);
  link.com_m = read_pin(file, "com_m");
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
  return {.parent_pin_m = read_pin(file, "parent_pin_m"), .child_pin_m = read_pin(file, "child_pin_m")};
}

BucketLinkage read_linkage(TomlTable file) {
  BucketLinkage linkage;
  linkage.cylinder_pin_m = read_pin(file, "cylinder_pin_m");
  linkage.rocker_pin_m = read_pin(file, "rocker_pin_m");
  linkage.bucket_pin_m = read_pin(file, "bucket_pin_m");
  linkage.rocker_length_m = file.number("rocker_length_m", 0.01, kFurthestPin_m);
  linkage.coupler_length_m = file.number("coupler_length_m", 0.01, kFurthestPin_m);
  linkage.branch = file.choice("crank_side", {"left", "right"}) == 0 ? 1 : -1;
  linkage.rocker_mass_kg = file.number("rocker_mass_kg", 0, kHeaviest_kg);
  linkage.coupler_mass_kg = file.number("coupler_mass_kg", 0, kHeaviest_kg);
  return linkage;
}

BucketProfile read_profile(TomlTable file) {
  return {.edge_m = read_pin(file, "edge_m"),
          .heel_m = read_pin(file, "heel_m"),
          .back_m = read_pin(file, "back_m"),
          .cheek_m = read_pin(file, "cheek_m")};
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
  if (file.has("without_pressures")) sensors.without_pressures = file.choice("without_pressures", kJointNames);
  return sensors;
}

/// Needed where there is a wire encoder.
void read_encoder_step(TomlTable file, MachineDescription& machine) {
  const bool wire = std::any_of(machine.bus.nodes.begin(), machine.bus.nodes.end(), [](const NodeDescription& node) {
    return node.role == NodeRole::kEncoder && !node.measures_angle();
  });
  if (wire || file.has("encoder_step_mm"))
    machine.sensors.encoder_step_m = file.number("encoder_step_mm", 0.0001, 5, kMilli);
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
  if (machine.sensors.without_pressures != SensorDescription::kNone)
    file.require(limits.chamber_pressure_Pa >= machine.hydraulics.main_relief_Pa, "chamber_pressure_bar",
                 "must be at least main_relief_bar = " + number_text(machine.hydraulics.main_relief_Pa / kBar) +
                     ": nothing lower is kept on a cylinder without transmitters",
                 {".hydraulics.main_relief_bar", ".sensors.without_pressures"});
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

/// Why the model cannot be had with these sensors; empty where it can.
std::string lacks_pressures(ContactModel model, const SensorDescription& sensors) {
  const int without = sensors.without_pressures;
  if (without == SensorDescription::kNone || !needs_pressures(model)[static_cast<std::size_t>(without)]) return "";
  return std::string("needs the pressures of the ") + kJointNames[static_cast<std::size_t>(without)] +
         " cylinder, which sensors.without_pressures says are not measured; bucket_force takes any two";
}

/// All optional: a file without it has the default model.
ForceDescription read_force(TomlTable file, const SensorDescription& sensors) {
  ForceDescription force;
  if (file.has("contact_model"))
    force.contact_model = static_cast<ContactModel>(file.choice("contact_model", kContactModelNames));
  const std::string lacks = lacks_pressures(force.contact_model, sensors);
  file.require(lacks.empty(), "contact_model", lacks, {".sensors.without_pressures"});
  constexpr std::array kDirections{"against_motion", "plumb", "fixed"};
  if (file.has("direction")) force.direction = static_cast<ForceDirection>(file.choice("direction", kDirections));
  if (force.direction != ForceDirection::kFixed) {
    file.leave("fixed_direction");
    file.require(!file.has("fixed_direction"), "fixed_direction", "goes with direction = \"fixed\" alone",
                 {"direction"});
    return force;
  }
  force.fixed_direction = file.numbers<2>("fixed_direction", -1, 1);
  file.require(force.fixed_direction.norm() > 0.1, "fixed_direction", "must be longer than 0.1: (x, z) of a direction");
  return force;
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
  machine.bus = read_bus(bus_tables(file), machine.sensors);
  read_encoder_step(sensors, machine);
  machine.limits = read_limits(tables.limits, machine);
  machine.control = read_control(file.table("control"));
  if (file.has("force")) machine.force = read_force(file.table("force"), machine.sensors);
  TomlTable payload = file.table("payload");
  machine.payload_full_scale_kg = payload.number("full_scale_kg", 1, kHeaviest_kg);
  machine.payload_com_m = read_pin(payload, "com_m");
  machine.cameras = read_cameras(file);
  load_calibration(file, machine);
  if (file.has("commissioning")) read_guard_proofs(file.table("commissioning"), machine.bus);
  check_geometry(machine, tables);
  file.finish();
  return machine;
}

}  // namespace

MachineDescription load_machine(const std::string& path) {
  return read_machine(TomlTable::read_kind("machine", path));
}

MachineDescription parse_machine(std::string_view text, const std::string& source) {
  return read_machine(TomlTable::parse(text, source));
}

MachineDescription with_contact_model(const MachineDescription& machine, std::string_view model) {
  const auto named = contact_model_named(model);
  const std::string lacks = named ? lacks_pressures(*named, machine.sensors) : kContactModelChoice;
  if (!lacks.empty()) throw InputError("--contact-model " + std::string(model) + ": " + lacks);
  const std::string wanted = "contact_model = " + toml_quoted(model);
  bool has_table = false;
  std::string text =
      edited_toml(machine.text, [&](const std::string& table, const std::string& key, std::string& line) {
        if (table != "[force]") return;
        has_table = true;
        if (key == "[force]") line += "\n" + wanted;
        if (key == "contact_model") line.clear();
      });
  if (!has_table) text += "\n[force]\n" + wanted + "\n";
  return parse_machine(text, machine.source);
}

}  // namespace knuckle
