#include "recording/scene.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "recording/cdr.h"
#include "recording/fields.h"

namespace knuckle::recording {

namespace {

constexpr double kLabelHeight_px = 16;

void put_count(CdrWriter& out, std::size_t count) noexcept {
  out.put(static_cast<std::uint32_t>(count));
}
template <typename Element>
void put_each(CdrWriter& out, std::span<const Element> elements) noexcept {
  put_count(out, elements.size());
  for (const Element& element : elements) put(out, element);
}

void put_line(CdrWriter& out, const Line& line) noexcept {
  put(out, line.kind);
  put(out, Pose3{});
  out.put(line.thickness_m);
  put(out, false);  // thickness in pixels
  put_each(out, line.points_m);
  put(out, line.colour);
  put_count(out, 0);  // colours of points
  put_count(out, 0);  // indices
}

void put_label(CdrWriter& out, const Label& label) noexcept {
  put(out, Pose3{.position_m = label.position_m});
  put(out, true);  // faces the camera
  out.put(kLabelHeight_px);
  put(out, true);  // height in pixels
  put(out, label.colour);
  out.put_text(label.text);
}

}  // namespace

/// About y, which points away from that viewer, a right-handed turn is clockwise: hence about -y.
Pose3 pose_in_plane(const PlanarVector& at_m, double angle_rad) noexcept {
  return {{at_m.x(), 0, at_m.y()}, {0, -std::sin(angle_rad / 2), 0, std::cos(angle_rad / 2)}};
}

void put_deletion(CdrWriter& out, std::int64_t unix_ns, std::string_view id) noexcept {
  constexpr std::uint8_t kMatchingId = 0;
  out.put_time(unix_ns);
  out.put(kMatchingId);
  out.put_text(id);
}

void put_entity(CdrWriter& out, std::int64_t unix_ns, const Entity& entity) noexcept {
  out.put_time(unix_ns);
  out.put_text(entity.frame);
  out.put_text(entity.id);
  out.put_time(0);  // lifetime: until it is replaced or deleted
  put(out, true);   // moves with its frame
  put_count(out, entity.note.key.empty() ? 0 : 1);
  if (!entity.note.key.empty()) {
    out.put_text(entity.note.key);
    out.put_text(entity.note.value);
  }
  put_each(out, entity.arrows);
  put_each(out, entity.boxes);
  put_each(out, entity.ellipsoids);
  put_count(out, 0);  // cylinders
  put_count(out, entity.lines.size());
  for (const Line& line : entity.lines) put_line(out, line);
  put_count(out, 0);  // triangles
  put_count(out, entity.labels.size());
  for (const Label& label : entity.labels) put_label(out, label);
  put_count(out, 0);  // models
}

namespace {

constexpr std::size_t kRoom = 8192;  // the longest message has less than half of that
constexpr Duration kMachinePeriod = 1s;

constexpr const char* kMachineFrame = "machine";
constexpr const char* kGroundFrame = "ground";
constexpr const char* kTipFrame = "tip";

// Vermilion of Okabe and Ito for what is felt, as in the console; what is not known fades.
constexpr Colour kForce{0.835, 0.369, 0, 1}, kUnknown{0.541, 0.561, 0.588, 0.3};
constexpr Colour kPaint{0.890, 0.663, 0.231, 1}, kSteel{0.353, 0.376, 0.408, 1}, kRod{0.62, 0.65, 0.68, 1};
constexpr Colour kEarth{0.725, 0.714, 0.682, 0.4}, kInk{0.45, 0.47, 0.5, 1};

// Of the reach: the description does not say how wide things are.
constexpr double kLinkWidth = 0.05, kBucketWidth = 0.16, kLineThickness = 0.006, kGroundWidth = 1.2;
constexpr double kArrowThickness = 0.013, kLongestHead = 0.05, kContactSize = 0.045, kLabelAbove = 0.08;

/// Radius of the 95 % ellipse of two normal variables, in standard deviations: sqrt(-2 ln 0.05).
constexpr double kTwoSided95 = 1.96, kLineLength = 0.15;  // of the line drawn, to each side; of the reach
const double kSigmas95 = std::sqrt(-2 * std::log(0.05));

std::int64_t stamp_of(const slave::SlaveState& state, std::int64_t unix_ns) {
  return unix_ns + state.at.time_since_epoch().count();
}

Eigen::Vector3d in_space(const PlanarVector& at_m, double y_m = 0) {
  return {at_m.x(), y_m, at_m.y()};
}

Colour faded(double confidence) {
  const double trust = std::clamp(confidence, 0.0, 1.0);
  Colour colour;
  for (std::size_t i = 0; i < colour.size(); ++i) colour[i] = kUnknown[i] + trust * (kForce[i] - kUnknown[i]);
  return colour;
}

/// A short text without allocation.
class ShortText {
 public:
  template <typename... Values>
  explicit ShortText(fmt::format_string<Values...> format, Values&&... values) {
    size_ = std::min(fmt::format_to_n(text_.data(), text_.size(), format, std::forward<Values>(values)...).size,
                     text_.size());
  }
  [[nodiscard]] std::string_view view() const { return {text_.data(), size_}; }

 private:
  std::array<char, 80> text_;
  std::size_t size_;
};

}  // namespace

SceneWriter::SceneWriter(const MachineDescription& machine)
    : machine_(machine),
      reach_m_(reach_m(machine)),
      newtons_per_m_(std::max(1.0, std::round(machine.limits.tip_force_N / reach_m_))),
      scale_(fmt::format("1 m = {:.0f} N", newtons_per_m_)),
      room_(kRoom) {
  const auto outline = bucket_outline(machine);
  for (std::size_t i = 0; i < outline.size(); ++i) {
    bucket_m_[i] = in_space(outline[i], -kBucketWidth / 2 * reach_m_);
    bucket_m_[i + outline.size()] = in_space(outline[i], kBucketWidth / 2 * reach_m_);
  }
}

std::span<const std::uint8_t> SceneWriter::transforms(const slave::SlaveState& state, std::int64_t unix_ns) {
  const std::int64_t at_ns = stamp_of(state, unix_ns);
  CdrWriter out(room_);
  out.put(std::uint32_t{5});
  const auto put_frame = [&](const char* parent, const char* child, const Pose3& pose) {
    out.put_time(at_ns);
    out.put_text(parent);
    out.put_text(child);
    put(out, pose);
  };
  const char* parent = kMachineFrame;
  double along_m = 0;
  for (std::size_t i = 0; i < kJoints; ++i) {
    put_frame(parent, kJointNames[i], pose_in_plane({along_m, 0}, state.joint_rad[static_cast<Eigen::Index>(i)]));
    parent = kJointNames[i];
    along_m = machine_.links[i].length_m;
  }
  put_frame(parent, kTipFrame, pose_in_plane({along_m, 0}, 0));
  put_frame(kMachineFrame, kGroundFrame, pose_in_plane({0, ground_level_m(machine_)}, 0));
  return out.written();
}

std::span<const std::uint8_t> SceneWriter::scene(const slave::SlaveState& state, std::int64_t unix_ns) {
  const std::int64_t at_ns = stamp_of(state, unix_ns);
  const MachinePose pose = pose_of(machine_, state.joint_rad);
  const bool loaded = state.payload_kg > 2 * state.payload_sigma_kg;
  CdrWriter out(room_);
  out.put(static_cast<std::uint32_t>(!state.contact) + static_cast<std::uint32_t>(!loaded));
  if (!state.contact) put_deletion(out, at_ns, "contact");
  if (!loaded) put_deletion(out, at_ns, "load");
  out.put(2 + static_cast<std::uint32_t>(state.contact) + static_cast<std::uint32_t>(loaded));
  put_cylinders(out, at_ns, pose);
  put_force(out, at_ns, pose.tip_m, state);
  if (state.contact) put_contact(out, at_ns, pose.tip_m);
  if (loaded) put_load(out, at_ns, pose, state);
  return out.written();
}

std::span<const std::uint8_t> SceneWriter::machine(const slave::SlaveState& state, std::int64_t unix_ns) {
  if (state.at - machine_at_ < kMachinePeriod) return {};
  machine_at_ = state.at;
  const std::int64_t at_ns = stamp_of(state, unix_ns);
  CdrWriter out(room_);
  out.put(std::uint32_t{0});  // deletions
  out.put(std::uint32_t{4});
  put_ground(out, at_ns);
  put_link(out, at_ns, kBoom);
  put_link(out, at_ns, kArm);
  put_bucket(out, at_ns);
  return out.written();
}

/// In one entity, since they move with no frame: barrels, and as thin lines rods, rocker and coupler.
void SceneWriter::put_cylinders(CdrWriter& out, std::int64_t at_ns, const MachinePose& pose) const {
  std::array<Eigen::Vector3d, 6> barrels;
  std::array<Eigen::Vector3d, 10> rods;
  for (std::size_t i = 0; i < kJoints; ++i) {
    const MachinePose::Cylinder& cylinder = pose.cylinders[i];
    const double share = barrel_length_m(machine_.cylinders[i], cylinder.length_m()) / cylinder.length_m();
    rods[2 * i] = barrels[2 * i] = in_space(cylinder.base_m);
    rods[2 * i + 1] = in_space(cylinder.rod_end_m);
    barrels[2 * i + 1] = in_space(cylinder.base_m + share * (cylinder.rod_end_m - cylinder.base_m));
  }
  rods[6] = in_space(pose.rocker_pin_m);
  rods[7] = rods[8] = in_space(pose.linkage_pin_m);
  rods[9] = in_space(pose.bucket_pin_m);
  const std::array lines{Line{LineKind::kList, machine_.cylinders[kBoom].bore_m, barrels, kSteel},
                         Line{LineKind::kList, machine_.cylinders[kBoom].rod_m, rods, kRod}};
  put_entity(out, at_ns, {.id = "cylinders", .frame = kMachineFrame, .lines = lines});
}

namespace {

/// From the tip to the nearest point of the line of action; nearer the tip the less sure it is that it passes it by.
PlanarVector place_on_line(const slave::SlaveState& state) {
  const PlanarVector unit = state.tip_force_N.stableNormalized();
  const double offset2 = state.line_offset_m * state.line_offset_m;
  const double sure = offset2 > 0 ? offset2 / (offset2 + state.line_sigma_m * state.line_sigma_m) : 0;
  return sure * state.line_offset_m * PlanarVector(-unit.y(), unit.x());
}

}  // namespace

void SceneWriter::put_force(CdrWriter& out, std::int64_t at_ns, const PlanarVector& tip_m,
                            const slave::SlaveState& state) const {
  const PlanarVector arrow_m = state.tip_force_N / newtons_per_m_;
  const PlanarVector at_m = tip_m + place_on_line(state);
  const double length_m = arrow_m.norm(), head_m = std::min(kLongestHead * reach_m_, 0.6 * length_m);
  const double thickness_m = std::min(kArrowThickness * reach_m_, 0.26 * head_m);
  const Colour colour = faded(state.confidence);
  const std::array arrows{Arrow{pose_in_plane(at_m, std::atan2(arrow_m.y(), arrow_m.x())), length_m - head_m,
                                thickness_m, head_m, 2 * thickness_m, colour}};
  const bool known = state.confidence > kKnown;
  const ShortText text =
      known ? ShortText("{:.0f} N (confidence {:.0f} %)", state.tip_force_N.norm(), 100 * state.confidence)
            : ShortText("force not known");
  const std::array labels{
      Label{in_space(tip_m + PlanarVector(0, kLabelAbove * reach_m_)), text.view(), known ? kForce : kInk}};
  std::array<Solid, 1> ellipses;
  if (known) ellipses[0] = ellipse(at_m + arrow_m, state.covariance_N2);
  // Along the line of action, as wide as 95 % of it.
  const PlanarVector along_m = kLineLength * reach_m_ * state.tip_force_N.stableNormalized();
  const std::array ends{in_space(at_m - along_m), in_space(at_m + along_m)};
  Colour pale = kForce;
  pale[3] = 0.15;
  const std::array lines{Line{LineKind::kStrip, 2 * kTwoSided95 * state.line_sigma_m, ends, pale}};
  put_entity(out, at_ns,
             {.id = "force",
              .frame = kMachineFrame,
              .note = {"scale", scale_},
              .arrows = arrows,
              .ellipsoids = std::span<const Solid>(ellipses).first(known ? 1 : 0),
              .lines = std::span<const Line>(lines).first(known && state.line_sigma_m > 0 ? 1 : 0),
              .labels = labels});
}

/// A flat ellipsoid whose section with the arm's plane holds the true end of the arrow in 95 of 100 cases.
Solid SceneWriter::ellipse(const PlanarVector& centre_m, const std::array<double, 3>& covariance_N2) const {
  const auto& [xx, xz, zz] = covariance_N2;
  Eigen::Matrix2d covariance;
  covariance << xx, xz, xz, zz;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver;
  solver.computeDirect(covariance);
  const Eigen::Vector2d size_m = 2 * kSigmas95 / newtons_per_m_ * solver.eigenvalues().cwiseMax(0).cwiseSqrt();
  const PlanarVector axis = solver.eigenvectors().col(0);
  Colour colour = kForce;
  colour[3] = 0.25;
  return {pose_in_plane(centre_m, std::atan2(axis.y(), axis.x())),
          {size_m[0], kLineThickness * reach_m_, size_m[1]},
          colour};
}

void SceneWriter::put_contact(CdrWriter& out, std::int64_t at_ns, const PlanarVector& tip_m) const {
  const std::array ball{Solid{pose_in_plane(tip_m, 0), Eigen::Vector3d::Constant(kContactSize * reach_m_), kForce}};
  put_entity(out, at_ns, {.id = "contact", .frame = kMachineFrame, .ellipsoids = ball});
}

void SceneWriter::put_load(CdrWriter& out, std::int64_t at_ns, const MachinePose& pose,
                           const slave::SlaveState& state) const {
  const ShortText text("load {:.0f} kg, sigma {:.0f} kg", state.payload_kg, state.payload_sigma_kg);
  const PlanarVector below = pose.bucket * machine_.payload_com_m - PlanarVector(0, kLabelAbove * reach_m_);
  const std::array labels{Label{in_space(below), text.view(), kInk}};
  put_entity(out, at_ns, {.id = "load", .frame = kMachineFrame, .labels = labels});
}

void SceneWriter::put_link(CdrWriter& out, std::int64_t at_ns, int joint) const {
  const auto index = static_cast<std::size_t>(joint);
  const double length_m = machine_.links[index].length_m, width_m = kLinkWidth * reach_m_;
  const std::array box{Solid{pose_in_plane({length_m / 2, 0}, 0), {length_m, width_m, width_m}, kPaint}};
  put_entity(out, at_ns, {.id = kJointNames[index], .frame = kJointNames[index], .boxes = box});
}

void SceneWriter::put_bucket(CdrWriter& out, std::int64_t at_ns) const {
  const auto outlines = std::span<const Eigen::Vector3d>(bucket_m_);
  const double thickness_m = kLineThickness * reach_m_;
  const std::array lines{Line{LineKind::kLoop, thickness_m, outlines.first<6>(), kSteel},
                         Line{LineKind::kLoop, thickness_m, outlines.last<6>(), kSteel}};
  put_entity(out, at_ns, {.id = kJointNames[kBucket], .frame = kJointNames[kBucket], .lines = lines});
}

void SceneWriter::put_ground(CdrWriter& out, std::int64_t at_ns) const {
  const double width_m = kGroundWidth * reach_m_, thickness_m = kLineThickness * reach_m_;
  // Its surface at the frame's height, from behind the tracks to beyond the arm's reach.
  const std::array slab{
      Solid{pose_in_plane({0.4 * reach_m_, -thickness_m / 2}, 0), {2 * width_m, width_m, thickness_m}, kEarth}};
  put_entity(out, at_ns, {.id = kGroundFrame, .frame = kGroundFrame, .boxes = slab});
}

}  // namespace knuckle::recording
