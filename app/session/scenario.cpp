#include "app/session/scenario.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "core/units.h"
#include "machine/bus_description.h"
#include "machine/description.h"
#include "machine/kinematics.h"
#include "machine/toml_reader.h"

namespace knuckle::session {
namespace {

constexpr double kFar_m = 100;

/// What one unit of length and one of load in the file are on this machine.
struct Scale {
  double length = 1, load = 1;
};

/// Refuses poses that a machine cannot take.
class WorkingRange {
 public:
  explicit WorkingRange(const MachineDescription& machine) : machine_(machine), kinematics_(machine) {}

  /// @param who goes before the complaint, such as "phase 'lift': ".
  /// @param others that the pose hangs on.
  void require_pose(const TomlTable& table, const char* key, const JointVector& joints_rad, const std::string& who = "",
                    TomlTable::Keys others = {}) const {
    for (std::size_t i = 0; i < kJoints; ++i) {
      const double angle = joints_rad[static_cast<Eigen::Index>(i)];
      const double min = machine_.links[i].min_rad, max = machine_.links[i].max_rad;
      table.require(angle >= min && angle <= max, key,
                    who + kJointNames[i] + " would be at " + degrees(angle) + " deg: must be within [" + degrees(min) +
                        ", " + degrees(max) + "] on machine '" + machine_.name + "'",
                    others);
    }
  }
  void require_tip(const TomlTable& table, const char* key, const PlanarVector& tip_m, double bucket_rad,
                   const std::string& who) const {
    const auto joints = kinematics_.inverse(tip_m, bucket_rad);
    const TomlTable::Keys others{"bucket_deg", ".reference_reach_m"};
    if (table.require(joints.has_value(), key,
                      who + "outside the range of machine '" + machine_.name + "' with this bucket_deg", others))
      require_pose(table, key, *joints, who, others);
  }

 private:
  static std::string degrees(double rad) { return number_text(std::round(10 * rad / kDegree) / 10); }
  const MachineDescription& machine_;
  Kinematics kinematics_;
};

bool flag(TomlTable& table, const char* key) {
  return table.has(key) && table.boolean(key);
}

double number_or(TomlTable& table, const char* key, double fallback, double min, double max, double factor = 1) {
  return table.has(key) ? table.number(key, min, max, factor) : fallback * factor;
}

PlanarVector point(TomlTable& table, const char* key, const Scale& scale) {
  return table.numbers<2>(key, -kFar_m, kFar_m, scale.length);
}

void read_target(TomlTable& table, sim::Phase& phase, const Scale& scale, const WorkingRange& range) {
  const std::string who = "phase '" + table.text("name") + "': ";
  phase.joint_space = table.has("joints_deg");
  phase.tolerance_m = number_or(table, "tolerance_m", 0.06, 1e-3, 10, scale.length);
  if (phase.joint_space) {
    phase.joints_rad = table.numbers<3>("joints_deg", -180, 180, kDegree);
    range.require_pose(table, "joints_deg", phase.joints_rad, who);
    phase.speed_mps = table.number("speed_radps", 0.01, 3);
  } else {
    phase.tip_m = point(table, "tip_m", scale);
    phase.bucket_rad = table.number("bucket_deg", -360, 180, kDegree);
    range.require_tip(table, "tip_m", phase.tip_m, phase.bucket_rad, who);
    phase.speed_mps = table.number("speed_mps", 0.01, 3, scale.length);
  }
}

void read_press(TomlTable& table, sim::Phase& phase, const Scale& scale) {
  phase.direction = table.numbers<2>("direction", -1, 1);
  table.require(phase.direction.norm() > 1e-3, "direction", "must not be zero");
  phase.direction.normalize();
  phase.speed_mps = table.number("speed_mps", 0.01, 1, scale.length);
  phase.force_N = table.number("felt_N", 0.1, 20);
  phase.until_break = flag(table, "until_break");
  if (!table.sound({"until_break"})) {
    table.leave("hold_s");
  } else if (!phase.until_break) {
    phase.duration_s = table.number("hold_s", 0, 600);
  }
}

sim::Phase read_phase(TomlTable& table, const Scale& scale, const WorkingRange& range) {
  using sim::PhaseKind;
  sim::Phase phase;
  // In the order of PhaseKind.
  const int kind =
      table.choice("kind", {"engage", "let_go", "move", "press", "sweep", "path", "clutch", "wait", "wander", "home"});
  phase.kind = static_cast<PhaseKind>(kind);
  if (!table.sound({"kind"})) {
    table.leave_rest();
    return phase;
  }
  phase.timeout_s = number_or(table, "timeout_s", 30, 0.1, 3600);
  switch (phase.kind) {
    case PhaseKind::kEngage:
    case PhaseKind::kPath:
    case PhaseKind::kHome:
      break;
    case PhaseKind::kMove:
      read_target(table, phase, scale, range);
      phase.until_hold = flag(table, "until_hold");
      break;
    case PhaseKind::kPress:
      read_press(table, phase, scale);
      break;
    case PhaseKind::kClutch:
      phase.joints_rad = table.numbers<3>("hand_deg", -90, 90, kDegree);
      break;
    case PhaseKind::kWander:
      phase.speed_mps = table.number("speed_radps", 0.01, 3);
      phase.duration_s = table.number("duration_s", 0, 3600);
      break;
    case PhaseKind::kSweep:
      phase.joints_rad = table.numbers<3>("amplitude_deg", 0, 90, kDegree);
      phase.periods_s = table.numbers<3>("period_s", 0.5, 100);
      [[fallthrough]];
    case PhaseKind::kLetGo:
    case PhaseKind::kWait:
      phase.duration_s = table.number("duration_s", 0, 3600);
      phase.until_fault = phase.kind != PhaseKind::kLetGo && flag(table, "until_fault");
      break;
  }
  return phase;
}

sim::WallDescription read_wall(TomlTable& table, const Scale& scale) {
  sim::WallDescription wall;
  wall.point_m = point(table, "point_m", scale);
  wall.normal = table.numbers<2>("normal", -1, 1);
  table.require(wall.normal.norm() > 1e-3, "normal", "must not be zero");
  if (table.has("hunt_crossley_N_per_m15")) {
    wall.hunt_crossley_N_per_m15 = table.number("hunt_crossley_N_per_m15", 1e6, 1e10);
  } else {
    wall.stiffness_N_per_m = table.number("stiffness_N_per_m", 1e4, 1e8);
    wall.damping_ratio = table.number("damping_ratio", 0, 1);
  }
  wall.friction = table.number("friction", 0, 1.5);
  if (table.has("from_m")) wall.from_m = table.number("from_m", -kFar_m, kFar_m, scale.length);
  if (table.has("to_m")) wall.to_m = table.number("to_m", -kFar_m, kFar_m, scale.length);
  table.require(wall.from_m < wall.to_m, "to_m", "must be above from_m", {"from_m"});
  if (table.has("break_force_N")) {
    wall.break_force_N = table.number("break_force_N", 100, 1e6, scale.load);
    wall.break_impulse_Ns = table.number("break_impulse_Ns", 1, 1e6, scale.load);
    wall.piece_mass_kg = table.number("piece_mass_kg", 1, 1e5, scale.load);
    wall.piece_depth_m = table.number("piece_depth_m", 0.01, 5, scale.length);
    wall.piece_rest_m = point(table, "piece_rest_m", scale);
  }
  return wall;
}

sim::SoilDescription read_soil(TomlTable& table, const Scale& scale) {
  sim::SoilDescription soil;
  soil.surface_point_m = point(table, "surface_point_m", scale);
  soil.slope_rad = table.number("slope_deg", -45, 45, kDegree);
  soil.density_kg_per_m3 = table.number("density_kg_per_m3", 500, 4000);
  soil.cohesion_Pa = table.number("cohesion_Pa", 0, 2e5);
  soil.internal_friction_rad = table.number("internal_friction_deg", 0, 60, kDegree);
  soil.tool_friction_rad = table.number("tool_friction_deg", 0, 45, kDegree);
  soil.bucket_width_m = table.number("bucket_width_m", 0.1, 5, scale.length);
  soil.bearing_area_m2 *= scale.length * scale.length;
  soil.bucket_capacity_m3 = table.number("bucket_capacity_m3", 1e-3, 10, scale.load);
  return soil;
}

/// The ground that pictures show: what the machine stands on, unless there is soil or the file says otherwise.
std::optional<sim::GroundDescription> read_ground(TomlTable& file, const Scale& scale,
                                                  const MachineDescription& machine) {
  sim::GroundDescription ground{.height_m = ground_level_m(machine)};
  if (!file.has("ground")) return file.has("soil") ? std::nullopt : std::optional(ground);
  ground.height_m = file.table("ground").number("height_m", -kFar_m, kFar_m, scale.length);
  return ground;
}

sim::WorldDescription read_world(TomlTable& file, const Scale& scale, const MachineDescription& machine) {
  sim::WorldDescription world;
  world.ground = read_ground(file, scale, machine);
  world.scoop_reach_m *= scale.length;
  for (TomlTable& table : file.tables("wall")) world.walls.push_back(read_wall(table, scale));
  for (TomlTable& table : file.tables("soil")) world.soil.push_back(read_soil(table, scale));
  file.require(world.soil.size() <= 1, "soil", "must be one table at most");
  for (TomlTable& table : file.tables("weight")) {
    sim::DeadWeightDescription weight;
    weight.mass_kg = table.number("mass_kg", 0.1, 1e4, scale.load);
    weight.point_m = machine.payload_com_m;
    weight.attach_at_s = table.number("attach_at_s", 0, 3600);
    if (table.has("detach_at_s")) weight.detach_at_s = table.number("detach_at_s", weight.attach_at_s, 3600);
    world.weights.push_back(weight);
  }
  for (TomlTable& table : file.tables("piece")) {
    world.pieces.push_back({table.number("mass_kg", 0.1, 1e4, scale.load), point(table, "position_m", scale)});
  }
  for (TomlTable& table : file.tables("pipe")) {
    sim::PipeDescription pipe;
    pipe.centre_m = point(table, "centre_m", scale);
    pipe.radius_m = table.number("radius_m", 0.005, 1, scale.length);
    world.pipes.push_back(pipe);
  }
  return world;
}

/// Id of the node that a fault is about; 0 where it is about none.
int fault_subject(TomlTable& table, sim::FaultKind kind, const BusDescription& bus) {
  const bool by_sync = kind == sim::FaultKind::kOtherController || kind == sim::FaultKind::kSyncDropped;
  table.require(!by_sync || !bus.without_nodes(), "kind",
                "needs a machine with CANopen nodes: there is no SYNC on this one");
  if (concerns_bus(kind) && bus.second) {
    const auto found = bus.line_named(table.text("bus"));
    table.require(found.has_value(), "bus", "must be one of " + bus.line_names());
    return static_cast<int>(found.value_or(0));
  }
  if (concerns_frame(kind)) {
    const auto found = sim::frame_subject(table.text("frame"), bus);
    if (!table.require(found.has_value(), "frame", "must be one of " + sim::frame_subject_names(bus))) return 0;
    const char* const why = why_not(kind, *found, bus);
    table.require(why == nullptr, "frame", why == nullptr ? "" : why);
    return *found;
  }
  if (!concerns_node(kind)) return 0;
  const auto joint = [&table] { return static_cast<std::size_t>(table.choice("joint", {"boom", "arm", "bucket"})); };
  if (kind == sim::FaultKind::kEncoderBroken) {
    const std::uint8_t id = bus.encoder(joint()).id;
    table.require(id != 0, "joint", "has an encoder that is no node of the machine's bus");
    return id;
  }
  if (kind == sim::FaultKind::kValveStuck) {
    const std::uint8_t id = bus.valve(joint()).id;
    table.require(id != 0, "joint", "has a valve that is no node of the machine's bus");
    return id;
  }
  const NodeDescription* const found = bus.find(table.text("node"));
  if (!table.require(found != nullptr, "node", "must be one of " + bus.node_names())) return 0;
  const std::uint8_t node = found->id;
  const char* const why = why_not(kind, node, bus);
  table.require(why == nullptr, "node", why == nullptr ? "" : why);
  return node;
}

std::vector<ScheduledFault> read_faults(TomlTable& file, const std::vector<std::string>& phases,
                                        const MachineDescription& machine) {
  std::vector<ScheduledFault> faults;
  for (TomlTable& table : file.tables("fault")) {
    ScheduledFault fault;
    const auto kind = sim::fault_named(table.text("kind"));
    table.require(kind.has_value(), "kind", "must be one of " + sim::fault_names());
    const std::string phase = table.text("phase");
    const auto with_name = std::count(phases.begin(), phases.end(), phase);
    const bool all_named = std::count(phases.begin(), phases.end(), "") == 0;  // else it may be this one's
    table.require(with_name > 0 || !all_named, "phase", "no [[phase]] has this name");
    table.require(with_name <= 1, "phase", "more than one [[phase]] has this name");
    fault.phase = static_cast<int>(std::find(phases.begin(), phases.end(), phase) - phases.begin());
    fault.after_s = table.number("after_s", 0, 3600);
    fault.duration_s = table.number("duration_s", 0.001, 3600);
    if (kind) {
      fault.kind = *kind;
      fault.subject = fault_subject(table, fault.kind, machine.bus);
    } else {
      table.leave("node");
      table.leave("joint");
      table.leave("bus");
      table.leave("frame");
    }
    faults.push_back(fault);
  }
  return faults;
}

AssistSettings read_assist(TomlTable table, const Scale& scale) {
  AssistSettings assist;
  assist.force_limit_N = number_or(table, "force_limit_N", 0, kLeastAssist_N, kMostAssist_N, scale.load);
  assist.stop_on_object = flag(table, "stop_on_object");
  return assist;
}

void read_plan(TomlTable& file, const Scale& scale, const WorkingRange& range, Scenario& scenario) {
  constexpr std::size_t kMostPhases = 250;  // a row of the record has one byte for it
  for (TomlTable& table : file.tables("phase")) {
    scenario.phase_names.push_back(table.text("name"));
    scenario.phases.push_back(read_phase(table, scale, range));
  }
  file.require(!scenario.phases.empty(), "phase", "at least one [[phase]] is needed");
  file.require(scenario.phases.size() <= kMostPhases, "phase", "must be 250 at most");
}

/// Tells every phase how many pieces can break. A press until something breaks needs one.
void count_pieces(const TomlTable& file, Scenario& scenario) {
  const auto pieces = std::count_if(scenario.world.walls.begin(), scenario.world.walls.end(),
                                    [](const sim::WallDescription& wall) { return wall.break_force_N > 0; });
  for (sim::Phase& phase : scenario.phases) {
    file.require(!phase.until_break || pieces > 0, "phase", "until_break is set, but no [[wall]] has a break_force_N",
                 {"wall"});
    phase.pieces = static_cast<int>(pieces);
  }
}

/// The bucket starts in the open: a plant that starts inside a wall or below the soil would be thrown out of it.
void check_start(const TomlTable& file, const Scenario& scenario, const MachineDescription& machine) {
  constexpr double kClear_m = 0.05;  // pins of a sampled machine put its bucket up to 4 cm beside
  if (!file.sound({"start_deg", "wall", "soil", "ground", "reference_reach_m"})) return;
  const MachinePose pose = pose_of(machine, scenario.start_rad);
  std::vector<PlanarVector> places_m{pose.linkage_pin_m};
  for (const PlanarVector& corner : bucket_outline(machine)) places_m.emplace_back(pose.bucket * corner);
  for (const PlanarVector& at_m : places_m) {
    for (std::size_t i = 0; i < scenario.world.walls.size(); ++i) {
      const sim::WallDescription& wall = scenario.world.walls[i];
      const PlanarVector normal = wall.normal.normalized(), from_m = at_m - wall.point_m;
      const double along_m = PlanarVector(-normal.y(), normal.x()).dot(from_m), clear_m = normal.dot(from_m);
      const bool has_end = std::isfinite(wall.from_m) || std::isfinite(wall.to_m);  // else nothing reaches behind it
      const bool beside = along_m < wall.from_m || along_m > wall.to_m || (has_end && clear_m < -wall.depth_m);
      file.require(beside || clear_m > kClear_m, "start_deg",
                   fmt::format("puts the bucket into or behind wall[{}], or within 5 cm of it", i));
    }
    for (const sim::SoilDescription& soil : scenario.world.soil) {
      const PlanarVector up(-std::sin(soil.slope_rad), std::cos(soil.slope_rad));
      file.require(up.dot(at_m - soil.surface_point_m) > kClear_m, "start_deg",
                   "puts the bucket into the [[soil]] or within 5 cm of it");
    }
    if (scenario.world.ground) {
      file.require(at_m.y() > scenario.world.ground->height_m + kClear_m, "start_deg",
                   "puts the bucket into the ground or within 5 cm of it");
    }
  }
}

/// What is measured at the machine grows with it: ways with its reach, loads and forces with its payload.
double criterion_factor(const MetricEntry& entry, const Scale& scale) {
  if (entry.group == "tracking" && entry.unit == "m") return scale.length;
  if (entry.unit == "kg" || (entry.group == "force" && entry.unit == "N")) return scale.load;
  return 1;
}

Criterion read_criterion(TomlTable& table, CriterionKind kind, const Scale& scale) {
  Criterion criterion;
  criterion.kind = kind;
  criterion.metric = table.text("metric");
  const MetricEntry* const entry = find_metric(criterion.metric);
  table.require(entry != nullptr, "metric", "is not a metric: docs/scenarios.md lists them");
  if (kind == CriterionKind::kSafety) {
    std::string known;
    for (const std::string_view metric : kSafetyMetrics) known += (known.empty() ? "" : ", ") + std::string(metric);
    table.require(std::ranges::find(kSafetyMetrics, criterion.metric) != std::end(kSafetyMetrics), "metric",
                  "of [[safety]] must be one of " + known);
  }
  const double factor = entry != nullptr ? criterion_factor(*entry, scale) : 1;
  if (table.has("min")) criterion.min = table.number("min", -1e12, 1e12, factor);
  if (table.has("max")) criterion.max = table.number("max", -1e12, 1e12, factor);
  table.require(criterion.min || criterion.max, "metric", "has neither min nor max");
  table.require(!criterion.min || !criterion.max || *criterion.min <= *criterion.max, "min",
                "must not be above max: no value could meet both", {"max"});
  return criterion;
}

std::vector<Criterion> read_criteria(TomlTable& file, const Scale& scale) {
  std::vector<Criterion> criteria;
  for (const auto& [key, kind] : {std::pair{"safety", CriterionKind::kSafety},
                                  {"criteria", CriterionKind::kCriterion},
                                  {"requirement", CriterionKind::kRequirement},
                                  {"goal", CriterionKind::kGoal}}) {
    for (TomlTable& table : file.tables(key)) criteria.push_back(read_criterion(table, kind, scale));
  }
  return criteria;
}

Scenario read_scenario(TomlTable file, const MachineDescription& machine) {
  const WorkingRange range(machine);
  Scenario scenario;
  scenario.source = file.source();
  scenario.text = file.document();
  scenario.name = file.text("name");
  scenario.description = file.text("description");
  const Scale scale{reach_m(machine) / file.number("reference_reach_m", 0.1, 100),
                    machine.payload_full_scale_kg / file.number("reference_payload_kg", 1, 1e5)};
  scenario.start_rad = file.numbers<3>("start_deg", -180, 180, kDegree);
  range.require_pose(file, "start_deg", scenario.start_rad);
  scenario.hand_rad = file.numbers<3>("hand_deg", -180, 180, kDegree);
  range.require_pose(file, "hand_deg", scenario.hand_rad);
  scenario.duration_s = file.number("duration_s", 1, 3600);
  if (file.has("link")) scenario.delay_ms = file.table("link").number("delay_ms", 0, kLongestDelay_ms);
  if (file.has("assist")) scenario.assist = read_assist(file.table("assist"), scale);
  TomlTable person = file.table("operator");
  scenario.limb =
      static_cast<sim::LimbClass>(person.choice("limb", {"relaxed", "normal", "co_contracted", "light_grip"}));
  if (person.has("person"))
    scenario.person = static_cast<sim::PersonClass>(person.choice("person", {"exact", "steady", "rough"}));
  scenario.reaction = from_seconds(person.number("reaction_ms", 0, 600, 1e-3));
  read_plan(file, scale, range, scenario);
  scenario.world = read_world(file, scale, machine);
  scenario.faults = read_faults(file, scenario.phase_names, machine);
  scenario.criteria = read_criteria(file, scale);
  count_pieces(file, scenario);
  check_start(file, scenario, machine);
  file.finish();
  return scenario;
}

}  // namespace

Scenario load_scenario(const std::string& path, const MachineDescription& machine) {
  return read_scenario(TomlTable::read_kind("scenario", path), machine);
}

Scenario parse_scenario(std::string_view text, const std::string& source, const MachineDescription& machine) {
  return read_scenario(TomlTable::parse(text, source), machine);
}

void refuse_faults(const Scenario& scenario, const std::string& how) {
  if (scenario.faults.empty()) return;
  throw InputError(scenario.source + ": schedules faults, which need virtual time: run it with knuckle simulate" + how);
}

void check_strength(const Scenario& scenario, sim::LimbClass limb) {
  const double most_N = sim::sustained_N(limb);
  for (std::size_t i = 0; i < scenario.phases.size(); ++i) {
    const sim::Phase& phase = scenario.phases[i];
    if (phase.kind != sim::PhaseKind::kPress || phase.force_N <= most_N) continue;
    throw InputError(scenario.source + ": phase '" + scenario.phase_names[i] +
                     "': felt_N = " + number_text(phase.force_N) + ": a person's " + sim::name(limb) + " hand holds " +
                     number_text(most_N) + " N at most");
  }
}

bool follows_recording(const Scenario& scenario) {
  return std::any_of(scenario.phases.begin(), scenario.phases.end(),
                     [](const sim::Phase& phase) { return phase.kind == sim::PhaseKind::kPath; });
}

}  // namespace knuckle::session
