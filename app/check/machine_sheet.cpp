#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <sstream>

#include "app/check/file_check.h"
#include "app/report/html.h"
#include "app/report/machine_drawing.h"
#include "core/units.h"
#include "machine/bus_budget.h"
#include "machine/kinematics.h"
#include "machine/room.h"
#include "machine/toml_reader.h"

namespace knuckle::checking {

namespace {

std::string range_text(double low, double high, int digits) {
  return fmt::format("{:.{}f} to {:.{}f}", low, digits, high, digits);
}

std::string joint_line(const MachineDescription& machine, const Kinematics& kinematics, int joint) {
  const auto i = static_cast<std::size_t>(joint);
  const LinkDescription& link = machine.links[i];
  const CylinderDescription& cylinder = machine.cylinders[i];
  const JointSpan span = cylinder_span(machine, kinematics, joint);
  const auto [low_m, high_m] = std::minmax(
      {kinematics.cylinder_at(joint, link.min_rad)->length_m, kinematics.cylinder_at(joint, link.max_rad)->length_m});
  const LeverRange lever = lever_range(machine, kinematics, joint);
  return fmt::format("{:<7} {:<17} {:<17} {:<15} {:<15} {:<15} {:<6} {:.3f}", kJointNames[i],
                     range_text(link.min_rad, link.max_rad, 3), range_text(span.min_rad, span.max_rad, 3),
                     range_text(low_m, high_m, 3), range_text(cylinder.min_length_m, cylinder.max_length_m, 3),
                     range_text(lever.shortest_m, lever.longest_m, 3), number_text(link.max_rate_radps),
                     std::floor(1000 * fastest_rate_radps(machine, kinematics, joint)) / 1000);
}

}  // namespace

std::vector<std::string> machine_sheet(const MachineDescription& machine) {
  const Kinematics kinematics(machine);
  std::vector<std::string> lines{fmt::format("{:<7} {:<17} {:<17} {:<15} {:<15} {:<15} {}", "", "joint range, rad",
                                             "cylinder allows", "cylinder, m", "can be", "lever, m", "fastest, rad/s"),
                                 fmt::format("{:<7} {:<17} {:<17} {:<15} {:<15} {:<15} {:<6} {}", "joint", "file",
                                             "computed", "computed", "file", "computed", "file", "pump gives")};
  for (int joint = 0; joint < kJoints; ++joint) lines.push_back(joint_line(machine, kinematics, joint));
  for (const WallRoom& room : wall_rooms(machine))
    lines.push_back(
        fmt::format("limits.{} = {} m: the tip goes to {:.2f} m{}", room.key, number_text(room.limit_m), room.reached_m,
                    room.cut_share > 0 ? fmt::format(", {:.0f} % of all poses cut off", 100 * room.cut_share)
                                       : ", outside of all poses"));
  for (std::size_t on = 0; on < machine.bus.lines(); ++on) {
    const BusDescription bus = machine.bus.alone(on);
    lines.push_back(fmt::format("bus{}{}: {:.1f} % of {} kbit/s with worst-case stuffing{}",
                                bus.name.empty() ? "" : " ", bus.name, 100 * worst_bus_load(bus), bus.bit_rate / 1000,
                                bus.foreign_load > 0 ? fmt::format(", {:g} % of others", 100 * bus.foreign_load) : ""));
  }
  return lines;
}

std::vector<std::string> device_sheet(const DeviceDescription& device) {
  std::vector<std::string> lines{fmt::format("{:<8} {:<18} {:<14} {}", "joint", "joint range, rad", "step, rad",
                                             "force at the tip, stretched: rated, peak N")};
  constexpr PerJoint<const char*> kNames{"forearm", "wrist", "finger"};
  for (std::size_t i = 0; i < kJoints; ++i) {
    const double to_tip_m = device.link_m.tail(kJoints - static_cast<int>(i)).sum();
    const double tip_N_per_A = device.torque_constant_Nm_per_A[i] * device.gear_ratio[i] / to_tip_m;
    lines.push_back(fmt::format("{:<8} {:<18} {:<14.2g} {:.1f}, {:.1f}", kNames[i],
                                range_text(device.min_rad[i], device.max_rad[i], 3),
                                2 * std::numbers::pi / (device.counts_per_turn[i] * device.gear_ratio[i]),
                                tip_N_per_A * device.rated_current_A[i], tip_N_per_A * device.peak_current_A[i]));
  }
  lines.push_back(fmt::format("feel.force_limit_N = {}", number_text(device.feel.force_limit_N)));
  return lines;
}

namespace {

constexpr const char* kStyle = R"(<style>
.hull,.track{fill:#e4e7e9;stroke:none}.link{fill:#f6dfa0;stroke:#8a6d1f;stroke-width:.3%}
.bucket{fill:#d3d9dd;stroke:#5d666d;stroke-width:.3%}.barrel{fill:none;stroke:#4a5157}.rod{fill:none;stroke:#9aa5ad}
.rocker{fill:none;stroke:#7a3e9d}.pin{fill:#fff;stroke:#1d2429;stroke-width:.15%}
.sweep{fill:none;stroke:#0072b2;stroke-width:.12%;stroke-opacity:.5}.range{fill:#b24400;fill-opacity:.16;stroke:#b24400;stroke-width:.12%}
.wall{fill:none;stroke:#c8102e;stroke-width:.35%;stroke-dasharray:1.5% 1%}
text{font-family:sans-serif;fill:#1d2429;paint-order:stroke;stroke:#fff;stroke-width:.3%}
.letter{font-weight:bold;text-anchor:middle}.limit{fill:#c8102e}.angle{fill:#b24400}.sheet{font-family:monospace;white-space:pre}
</style>)";

/// Angles at which no two pins hide each other, as far as the machine has them.
JointVector shown_pose(const MachineDescription& machine) {
  JointVector joints(0.60, -1.35, -0.75);
  for (int j = 0; j < kJoints; ++j) {
    const LinkDescription& link = machine.links[static_cast<std::size_t>(j)];
    joints[j] = std::clamp(joints[j], link.min_rad, link.max_rad);
  }
  return joints;
}

/// Ways of the tip while one joint turns and the others stand at ends of their ranges.
std::vector<std::vector<PlanarVector>> sweeps(const MachineDescription& machine, const Kinematics& kinematics) {
  constexpr int kSteps = 40;
  std::vector<std::vector<PlanarVector>> ways;
  for (int moving = 0; moving < kJoints; ++moving) {
    for (unsigned ends = 0; ends < (1U << kJoints); ++ends) {
      if ((ends & (1U << moving)) != 0) continue;  // the same way again
      JointVector joints;
      for (int j = 0; j < kJoints; ++j) {
        const LinkDescription& link = machine.links[static_cast<std::size_t>(j)];
        joints[j] = (ends & (1U << j)) != 0 ? link.max_rad : link.min_rad;
      }
      const LinkDescription& link = machine.links[static_cast<std::size_t>(moving)];
      auto& way = ways.emplace_back();
      for (int step = 0; step <= kSteps; ++step) {
        joints[moving] = link.min_rad + (link.max_rad - link.min_rad) * step / kSteps;
        way.push_back(kinematics.tip(joints));
      }
    }
  }
  return ways;
}

/// One picture: shapes in metres, y up, in a frame that holds them all.
class Sheet {
 public:
  explicit Sheet(const MachineDescription& machine)
      : machine_(machine),
        kinematics_(machine),
        size_m_(reach_m(machine)),
        joints_(shown_pose(machine)),
        pose_(pose_of(machine, joints_)),
        canvas_(shapes_) {
    box_.extend(PlanarVector(-0.58 * size_m_, ground_level_m(machine)));
    for (const PlanarVector& tip_m : tips_over_range(machine)) box_.extend(tip_m);
    box_.min().array() -= 0.08 * size_m_;
    box_.max().array() += 0.08 * size_m_;
  }

  void write(std::ostream& out) {
    for (const auto& way : sweeps(machine_, kinematics_)) canvas_.polyline("sweep", way);
    report::draw_machine(canvas_, machine_, joints_, ground_level_m(machine_));
    draw_ranges();
    draw_walls();
    draw_pins();
    const std::vector<std::string> lines = machine_sheet(machine_);
    const double line_m = 0.026 * size_m_, from_m = -box_.min().y() + 1.5 * line_m;
    for (std::size_t i = 0; i < lines.size(); ++i)
      write_text("sheet", {box_.min().x() + line_m, -from_m - line_m * static_cast<double>(i)}, 0.6 * line_m, lines[i]);
    const double height_m = box_.sizes().y() + line_m * static_cast<double>(lines.size() + 2);
    out << fmt::format("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"{:.3f} {:.3f} {:.3f} {:.3f}\">",
                       box_.min().x(), -box_.max().y(), box_.sizes().x(), height_m)
        << "<title>Machine " << report::escaped(machine_.name) << ": pins, ranges and limits</title>" << kStyle
        << fmt::format("<rect x=\"{:.3f}\" y=\"{:.3f}\" width=\"100%\" height=\"100%\" fill=\"#fff\"/>", box_.min().x(),
                       -box_.max().y())
        << shapes_.str() << "</svg>\n";
  }

 private:
  void write_text(const char* css_class, const PlanarVector& at_m, double height_m, const std::string& text) {
    shapes_ << fmt::format(
        "<text class=\"{}\" x=\"{:.3f}\" y=\"{:.3f}\" font-size=\"{:.4f}\" xml:space=\"preserve\">{}</text>", css_class,
        at_m.x(), -at_m.y(), height_m, report::escaped(text));
  }

  /// A sector at each joint: from the direction of the link before, over the working range. Its words stand in the
  /// corner above the hull, where no pin's letter is.
  void draw_ranges() {
    constexpr int kSteps = 30;
    const std::array<PlanarVector, kJoints> pins{pose_.boom.translation(), pose_.arm.translation(),
                                                 pose_.bucket.translation()};
    double before_rad = 0;
    for (std::size_t j = 0; j < kJoints; ++j) {
      const LinkDescription& link = machine_.links[j];
      const double radius_m = 0.3 * link.length_m;
      std::vector<PlanarVector> sector{pins[j]};
      for (int step = 0; step <= kSteps; ++step) {
        const double angle = before_rad + link.min_rad + (link.max_rad - link.min_rad) * step / kSteps;
        sector.push_back(pins[j] + radius_m * PlanarVector(std::cos(angle), std::sin(angle)));
      }
      canvas_.polygon("range", sector);
      const PlanarVector corner_m(box_.min().x(), box_.max().y());
      write_text(
          "angle", corner_m + PlanarVector(1, -1.5 * static_cast<double>(j + 1)) * 0.026 * size_m_, 0.02 * size_m_,
          fmt::format("{} {:.0f} to {:.0f} deg", kJointNames[j], link.min_rad / kDegree, link.max_rad / kDegree));
      before_rad += joints_[static_cast<Eigen::Index>(j)];
    }
  }

  /// Those that lie in the picture; others are in the lines below it.
  void draw_walls() {
    const auto line = [&](const PlanarVector& from_m, const PlanarVector& to_m, const std::string& text) {
      if (!box_.contains(from_m) || !box_.contains(to_m)) return;
      canvas_.polyline("wall", {from_m, to_m});
      write_text("limit", from_m + PlanarVector(0.01, 0.01) * size_m_, 0.022 * size_m_, text);
    };
    const LimitsDescription& limits = machine_.limits;
    const double left = box_.min().x(), right = box_.max().x(), low = box_.min().y(), high = box_.max().y();
    line({left, limits.floor_m}, {right, limits.floor_m}, fmt::format("floor_m = {:g}", limits.floor_m));
    line({left, limits.ceiling_m}, {right, limits.ceiling_m}, fmt::format("ceiling_m = {:g}", limits.ceiling_m));
    line({limits.reach_m, low}, {limits.reach_m, high}, fmt::format("reach_m = {:g}", limits.reach_m));
  }

  void draw_pins() {
    struct Pin {
      const char* letter;
      PlanarVector at_m;
      double right, up;  ///< Of the letter, in its height.
    };
    const auto& cylinders = pose_.cylinders;
    const std::array<Pin, 12> pins{{{"A", pose_.boom.translation(), -1, 0.5},
                                    {"B", pose_.arm.translation(), 0, -1.5},
                                    {"C", cylinders[kBoom].base_m, 0.8, -1.2},
                                    {"D", cylinders[kBoom].rod_end_m, -0.4, -1.5},
                                    {"E", cylinders[kArm].base_m, -0.5, 0.9},
                                    {"F", cylinders[kArm].rod_end_m, 0.8, 0.7},
                                    {"G", cylinders[kBucket].base_m, 1, 0.4},
                                    {"H", pose_.linkage_pin_m, 1.1, 0},
                                    {"J", pose_.rocker_pin_m, -0.8, -1.2},
                                    {"K", pose_.bucket_pin_m, 1, -0.4},
                                    {"L", pose_.bucket.translation(), -1, -0.6},
                                    {"T", pose_.tip_m, 0, -1.5}}};
    const double height_m = 0.026 * size_m_;
    for (const Pin& pin : pins)
      write_text("letter", pin.at_m + height_m * PlanarVector(pin.right, pin.up), height_m, pin.letter);
  }

  const MachineDescription& machine_;
  Kinematics kinematics_;
  double size_m_;
  JointVector joints_;
  MachinePose pose_;
  Eigen::AlignedBox2d box_;
  std::ostringstream shapes_;
  report::SvgCanvas canvas_;
};

}  // namespace

void draw_machine_sheet(const MachineDescription& machine, std::ostream& out) {
  Sheet(machine).write(out);
}

}  // namespace knuckle::checking
