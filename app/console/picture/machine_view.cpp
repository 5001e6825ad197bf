#include "app/console/picture/machine_view.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "app/console/picture/machine_mesh.h"
#include "app/console/picture/painter.h"
#include "app/console/picture/world_mesh.h"
#include "machine/kinematics.h"

namespace knuckle::console::picture {
namespace {

using Eigen::Matrix4f;
using Eigen::Vector3f;

// Bits of the stencil buffer.
constexpr GLuint kOnGround = 1;  // the ground's surface: shadows fall here
constexpr GLuint kInShadow = 2;  // drawn once, however many bodies shade it
constexpr GLuint kSeen = 4;      // the machine, nothing in front of it
constexpr GLuint kHidden = 8;    // the machine behind something
constexpr GLuint kTold = 16;     // inside the commanded machine: its outline runs around this

constexpr double kLongestArrow = 1.25;  // times the one of full force

const Matrix4f kHere = Matrix4f::Identity();

/// Radius of the 95 % ellipse of two normal variables, in standard deviations: sqrt(-2 ln 0.05).
const double kSigmas95 = std::sqrt(-2 * std::log(0.05));

/// Everything falls along the light onto z = level.
Matrix4f shadow_on(double level_m) {
  const Vector3f light = sun_direction();
  Matrix4f m = Matrix4f::Identity();
  m(0, 2) = -light.x() / light.z();
  m(1, 2) = -light.y() / light.z();
  m(2, 2) = 0;
  m(0, 3) = -m(0, 2) * static_cast<float>(level_m);
  m(1, 3) = -m(1, 2) * static_cast<float>(level_m);
  m(2, 3) = static_cast<float>(level_m);
  return m;
}

bool same(const session::Scene& a, const session::Scene& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const session::SceneLine& x, const session::SceneLine& y) {
                      return x.kind == y.kind && x.closed == y.closed && x.breaks == y.breaks && x.name == y.name &&
                             x.points_m == y.points_m;
                    });
}

using BodyPlaces = std::array<Matrix4f, kBodies>;
BodyPlaces places(const MachineDescription& machine, const JointVector& joints_rad) {
  const std::array<Frame2, kBodies> frames = body_frames(pose_of(machine, joints_rad));
  BodyPlaces all;
  std::transform(frames.begin(), frames.end(), all.begin(), in_space);
  return all;
}

/// While it lives, what is drawn is mixed with what is there and hides nothing that comes after.
class Blended {
 public:
  Blended() {
    glEnable(GL_BLEND);
    glDepthMask(GL_FALSE);
  }
  Blended(const Blended&) = delete;
  Blended& operator=(const Blended&) = delete;
  ~Blended() {
    glDisable(GL_BLEND);
    glDepthMask(GL_TRUE);
  }
};

/// Draws where the compared bits are those of `value`, or where they are not, and changes the written ones.
void stencil(GLenum draws_where, GLuint value, GLuint compared, GLenum change, GLuint written) {
  glStencilFunc(draws_where, static_cast<GLint>(value), compared);
  glStencilOp(GL_KEEP, GL_KEEP, change);
  glStencilMask(written);
}
void no_stencil() {
  stencil(GL_ALWAYS, 0, 0, GL_KEEP, 0xFF);
}

/// What MachineView::draw() promises of OpenGL's state.
void leave_as_agreed() {
  glBindVertexArray(0);
  glDisable(GL_LINE_SMOOTH);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_STENCIL_TEST);
  glDisable(GL_SCISSOR_TEST);
  glDisable(GL_BLEND);
  glDisable(GL_CULL_FACE);
}

}  // namespace

ForceScale force_scale(const MachineDescription& machine) {
  // What the arm's cylinder presses with at the tip of a stretched arm, to the next round number below half of it:
  // work is mostly done with less.
  const Kinematics kinematics(machine);
  const LinkDescription& arm = machine.links[kArm];
  const auto cylinder = kinematics.cylinder_at(kArm, (arm.min_rad + arm.max_rad) / 2);
  const double torque_Nm =
      machine.hydraulics.main_relief_Pa * machine.cylinders[kArm].head_area_m2() * std::abs(cylinder->lever_m);
  const double most_N = 0.5 * torque_Nm / (arm.length_m + machine.links[kBucket].length_m);
  const double decade = std::pow(10, std::floor(std::log10(most_N)));
  const double full_N = most_N >= 5 * decade ? 5 * decade : most_N >= 2 * decade ? 2 * decade : decade;
  return {full_N, 0.35 * reach_m(machine), 0.03 * full_N};
}

struct MachineView::Parts {
  explicit Parts(const MachineDescription& description)
      : machine(description),
        force(force_scale(description)),
        disc(disc_mesh()),
        grid(grid_mesh()),
        shaft(arrow_shaft()),
        head(arrow_head()) {
    for (const Mesh& mesh : body_meshes(machine)) bodies.emplace_back(mesh);
  }

  void rebuild_world(const session::Scene& now) {
    scene = now;
    const double reach = reach_m(machine);
    ground_m = track_level_m(now, reach);
    hull.emplace(hull_mesh(machine, ground_m));
    const WorldMeshes meshes = world_meshes(now, reach);
    world.clear();
    for (const Mesh* mesh :
         {&meshes.ground, &meshes.grid, &meshes.solids, &meshes.soil, &meshes.cracks, &meshes.virtual_walls})
      world.emplace_back(*mesh);
  }
  enum World : std::uint8_t { kGround, kGrid, kSolids, kSoil, kCracks, kVirtualWalls };

  void clear(const Viewport& viewport, const PictureColours& colours, GLbitfield buffers);
  void draw_grid(const Grid& at, const PictureColours& colours);
  void draw_world(const PictureColours& colours);
  void draw_shadow(const BodyPlaces& at, const PictureColours& colours);
  void draw_solid(const BodyPlaces& at, const Look& look, const PictureColours& colours);
  void draw_hidden(const BodyPlaces& at, const Look& look);
  void draw_transparent_world(const PictureColours& colours, bool as_seen);
  void draw_ghost(const BodyPlaces& at, const Rgb& colour);
  void draw_outline(const BodyPlaces& at, const Rgb& colour);
  void draw_force(const MachinePicture& picture, const PictureColours& colours);
  void draw_arrow(const PlanarVector& tip_m, const PlanarVector& arrow_m, const Look& look);
  void draw_line(const PlanarVector& at, const PlanarVector& unit, double sigma_m, const Rgb& colour);
  void draw_ellipse(const PlanarVector& end_m, const std::array<double, 3>& covariance_N2, const Rgb& colour);
  void draw_ring(const PlanarVector& place_m, double contact_s, const PictureColours& colours);
  void lines(double width) { glLineWidth(static_cast<float>(std::max(1.0, width * line_scale))); }

  MachineDescription machine;
  ForceScale force;
  Painter painter;
  std::vector<GlMesh> bodies, world;
  std::optional<GlMesh> hull;
  GlMesh disc, grid, shaft, head;
  SeenThings seen_things;
  std::optional<session::Scene> scene;
  double ground_m = 0;
  double line_scale = 1;
};

void MachineView::Parts::clear(const Viewport& v, const PictureColours& colours, GLbitfield buffers) {
  line_scale = v.line_scale;
  glViewport(v.left_px, v.bottom_px, v.width_px, v.height_px);
  glScissor(v.left_px, v.bottom_px, v.width_px, v.height_px);
  glEnable(GL_SCISSOR_TEST);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glDepthMask(GL_TRUE);
  glStencilMask(0xFF);
  glClearColor(colours.background.x(), colours.background.y(), colours.background.z(), 1);
  glClear(buffers);
  glEnable(GL_DEPTH_TEST);
  glEnable(GL_STENCIL_TEST);
  glEnable(GL_CULL_FACE);
  glDisable(GL_BLEND);
  glEnable(GL_LINE_SMOOTH);
  glDepthFunc(GL_LEQUAL);
  glCullFace(GL_BACK);
  glFrontFace(GL_CCW);
  glPolygonOffset(1, 1);
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
}

/// Behind everything.
void MachineView::Parts::draw_grid(const Grid& at, const PictureColours& colours) {
  const Frame2 middle(Eigen::Translation2d{at.middle_m});
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_LINE_SMOOTH);  // level and upright: sharp without
  {
    const Blended soft;
    lines(1);
    painter.edges(grid, scaled(in_space(middle), at.step_m, 1, at.step_m), {colours.grid, 1, 0.38F, false});
  }
  glEnable(GL_LINE_SMOOTH);
  glEnable(GL_DEPTH_TEST);
}

/// Surfaces stand a little back, so that the lines on them are seen.
void MachineView::Parts::draw_world(const PictureColours& colours) {
  glEnable(GL_POLYGON_OFFSET_FILL);
  stencil(GL_ALWAYS, kOnGround, kOnGround, GL_REPLACE, kOnGround);
  painter.triangles(world[kGround], kHere, {});
  stencil(GL_ALWAYS, 0, kOnGround, GL_REPLACE, kOnGround);
  painter.triangles(world[kSolids], kHere, {});
  no_stencil();
  glDisable(GL_POLYGON_OFFSET_FILL);
  const Blended soft;
  lines(1);
  painter.edges(world[kGrid], kHere, {colours.grid, 1, 1, false});
  painter.edges(world[kGround], kHere, {colours.grid, 1, 1, false});
  painter.edges(world[kSolids], kHere, {colours.edge, 0.7F, 1, false});
  lines(1.5);
  painter.edges(world[kCracks], kHere, {colours.edge, 0.8F, 1, false});
}

void MachineView::Parts::draw_shadow(const BodyPlaces& at, const PictureColours& colours) {
  const Matrix4f fall = shadow_on(ground_m + 1e-3 * reach_m(machine));
  Look dark{colours.shadow, 1, 0.28F, false};
  const Blended mixed;
  glDisable(GL_CULL_FACE);
  stencil(GL_EQUAL, kOnGround, kOnGround | kInShadow, GL_INVERT, kInShadow);
  painter.triangles(*hull, fall, dark);
  glEnable(GL_CLIP_DISTANCE0);
  for (std::size_t i = 0; i < kBodies; ++i) {
    dark.kept = at[i].row(2);
    dark.kept.w() -= static_cast<float>(ground_m);  // what is below the ground has no shadow on it
    painter.triangles(bodies[i], fall * at[i], dark);
  }
  glDisable(GL_CLIP_DISTANCE0);
  no_stencil();
  glEnable(GL_CULL_FACE);
}

void MachineView::Parts::draw_solid(const BodyPlaces& at, const Look& look, const PictureColours& colours) {
  glEnable(GL_POLYGON_OFFSET_FILL);
  stencil(GL_ALWAYS, kSeen, kSeen, GL_REPLACE, kSeen);
  painter.triangles(*hull, kHere, look);
  for (std::size_t i = 0; i < kBodies; ++i) painter.triangles(bodies[i], at[i], look);
  glDisable(GL_POLYGON_OFFSET_FILL);
  no_stencil();
  const Blended soft;
  lines(1);
  const Look edge{colours.edge, 0.75F, 1, false};
  painter.edges(*hull, kHere, edge);
  for (std::size_t i = 0; i < kBodies; ++i) painter.edges(bodies[i], at[i], edge);
}

/// What of the arm is behind a wall or below the ground shines through: the tip must not get lost.
void MachineView::Parts::draw_hidden(const BodyPlaces& at, const Look& look) {
  const Blended mixed;
  glDepthFunc(GL_GREATER);
  stencil(GL_EQUAL, 0, kSeen | kHidden, GL_INVERT, kHidden);
  for (std::size_t i = 0; i < kBodies; ++i) painter.triangles(bodies[i], at[i], look);
  no_stencil();
  glDepthFunc(GL_LEQUAL);
}

void MachineView::Parts::draw_transparent_world(const PictureColours& colours, bool as_seen) {
  const Blended mixed;
  painter.triangles(world[kSoil], kHere, {Rgb::Zero(), 0, 0.62F, true});
  painter.edges(world[kSoil], kHere, {colours.edge, 0.4F, 0.8F, false});
  if (as_seen) return;
  lines(1.5);
  painter.edges(world[kVirtualWalls], kHere, {colours.virtual_wall, 1, 0.65F, false});
}

/// Depth first, so that only its nearest surface is seen through; behind the machine where both are in one place.
void MachineView::Parts::draw_ghost(const BodyPlaces& at, const Rgb& colour) {
  const Look look{colour, 1, 0.42F, true};
  glEnable(GL_POLYGON_OFFSET_FILL);
  glPolygonOffset(2, 4);
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  for (std::size_t i = 0; i < kBodies; ++i) painter.triangles(bodies[i], at[i], look);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  const Blended mixed;
  for (std::size_t i = 0; i < kBodies; ++i) painter.triangles(bodies[i], at[i], look);
  glPolygonOffset(1, 1);
  glDisable(GL_POLYGON_OFFSET_FILL);
}

/// Wide wires, kept only outside the shape itself; in front of everything.
void MachineView::Parts::draw_outline(const BodyPlaces& at, const Rgb& colour) {
  glDisable(GL_DEPTH_TEST);
  glStencilMask(kTold);
  glClear(GL_STENCIL_BUFFER_BIT);  // of an outline before this one
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  stencil(GL_ALWAYS, kTold, kTold, GL_REPLACE, kTold);
  for (std::size_t i = 0; i < kBodies; ++i) painter.triangles(bodies[i], at[i], {});
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  stencil(GL_NOTEQUAL, kTold, kTold, GL_KEEP, 0);
  glDisable(GL_LINE_SMOOTH);  // too many short lines to be smoothed by the processor
  lines(4);
  for (std::size_t i = 0; i < kBodies; ++i) painter.wires(bodies[i], at[i], {colour, 1, 1, false});
  no_stencil();
  glEnable(GL_LINE_SMOOTH);
  glEnable(GL_DEPTH_TEST);
}

void MachineView::Parts::draw_arrow(const PlanarVector& tip, const PlanarVector& arrow, const Look& look) {
  const double length = arrow.norm();
  const double head_m = std::min(0.05 * reach_m(machine), 0.6 * length), thick = 0.26 * head_m;
  const Frame2 turn = Eigen::Translation2d(tip) * Eigen::Rotation2Dd(std::atan2(arrow.y(), arrow.x()));
  painter.triangles(shaft, scaled(in_space(turn), length - head_m, thick, thick), look);
  const Frame2 neck = turn * Eigen::Translation2d(length - head_m, 0);
  painter.triangles(head, scaled(in_space(neck), head_m, 1.7 * thick, 1.7 * thick), look);
}

/// Around the place of contact; wide at first touch.
void MachineView::Parts::draw_ring(const PlanarVector& place_m, double contact_s, const PictureColours& colours) {
  constexpr double kFlash_s = 0.4;
  const double flash = std::clamp(1 - contact_s / kFlash_s, 0.0, 1.0);
  const double radius = (0.03 + 0.07 * flash) * reach_m(machine);
  const Frame2 at(Eigen::Translation2d{place_m});
  const Blended soft;
  lines(2 + 2 * flash);
  painter.wires(disc, scaled(in_space(at), radius, radius, radius), {colours.force, 1, 1, false});
}

/// Of 95 %, around the arrow's end and to its scale.
void MachineView::Parts::draw_ellipse(const PlanarVector& end, const std::array<double, 3>& covariance_N2,
                                      const Rgb& colour) {
  const auto& [xx, xz, zz] = covariance_N2;
  Eigen::Matrix2d covariance;
  covariance << xx, xz, xz, zz;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(covariance);
  const Eigen::Vector2d radii = kSigmas95 * force.full_m / force.full_N * solver.eigenvalues().cwiseMax(0).cwiseSqrt();
  const PlanarVector axis = solver.eigenvectors().col(0);
  const Frame2 centre = Eigen::Translation2d(end) * Eigen::Rotation2Dd(std::atan2(axis.y(), axis.x()));
  const Matrix4f ellipse = scaled(in_space(centre), radii[0], 0.1 * reach_m(machine), radii[1]);
  const Blended mixed;
  painter.triangles(disc, ellipse, {colour, 1, 0.22F, false});
  lines(1);
  painter.wires(disc, ellipse, {colour, 1, 0.9F, false});
}

/// Along the line of action, as wide as 95 % of it.
void MachineView::Parts::draw_line(const PlanarVector& at, const PlanarVector& unit, double sigma_m,
                                   const Rgb& colour) {
  constexpr double kTwoSided95 = 1.96, kLength = 0.15;  // to each side, of the reach
  const double half_m = kLength * reach_m(machine);
  const Frame2 start = Eigen::Translation2d(at - half_m * unit) * Eigen::Rotation2Dd(std::atan2(unit.y(), unit.x()));
  const Blended mixed;
  painter.triangles(shaft, scaled(in_space(start), 2 * half_m, 1e-3, kTwoSided95 * sigma_m), {colour, 1, 0.25F, false});
}

/// In front of everything: what is felt must not hide behind the bucket.
void MachineView::Parts::draw_force(const MachinePicture& picture, const PictureColours& colours) {
  glClear(GL_DEPTH_BUFFER_BIT);
  const double force_N = picture.tip_force_N.norm();
  const bool shown = force_N > force.least_N;
  const PlanarVector unit = shown ? PlanarVector(picture.tip_force_N / force_N) : PlanarVector(PlanarVector::Zero());
  const double offset2 = picture.line_offset_m * picture.line_offset_m;
  const double sure = offset2 > 0 ? offset2 / (offset2 + picture.line_sigma_m * picture.line_sigma_m) : 0;
  const PlanarVector at =
      pose_of(machine, picture.measured_rad).tip_m + sure * picture.line_offset_m * PlanarVector(-unit.y(), unit.x());
  if (picture.contact) draw_ring(at, picture.contact_s, colours);
  if (!shown) return;
  const auto trust = static_cast<float>(std::clamp(picture.confidence, 0.0, 1.0));
  const Rgb colour = colours.uncertain + trust * (colours.force - colours.uncertain);
  const double length = std::min(force_N / force.full_N, kLongestArrow) * force.full_m;
  const PlanarVector arrow = length * unit;
  if (picture.line_sigma_m > 0) draw_line(at, unit, picture.line_sigma_m, colour);
  draw_ellipse(at + arrow, picture.covariance_N2, colour);
  glEnable(GL_BLEND);
  draw_arrow(at, arrow, {colour, 1, 0.5F + 0.5F * trust, true});
  glDisable(GL_BLEND);
}

MachineView::MachineView(const MachineDescription& machine) : parts_(std::make_unique<Parts>(machine)) {}
MachineView::~MachineView() = default;

void MachineView::draw(const MachinePicture& picture, const Camera& camera, const Viewport& viewport,
                       const PictureColours& colours) {
  Parts& p = *parts_;
  const session::Scene scene = picture.scene == nullptr ? session::Scene{} : scene_at(*picture.scene, picture.scene_s);
  if (!p.scene || !same(scene, *p.scene)) p.rebuild_world(scene);
  p.clear(viewport, colours, GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);
  p.painter.begin(view_projection(camera, viewport).cast<float>(), colours);
  const BodyPlaces measured = places(p.machine, picture.measured_rad);
  if (picture.grid) p.draw_grid(*picture.grid, colours);
  p.draw_world(colours);
  p.draw_shadow(measured, colours);
  const float greyed = picture.measured_is_stale ? 0.92F : 0.0F;
  p.draw_solid(measured, {colours.stale, greyed, 1, true}, colours);
  if (!picture.as_seen) p.draw_hidden(measured, {colours.stale, greyed, 0.38F, true});
  p.draw_transparent_world(colours, picture.as_seen);
  if (picture.as_seen)
    p.seen_things.draw_balls(p.painter, measured[static_cast<std::size_t>(Body::kBucket)], p.machine, colours);
  if (picture.dust != nullptr) {
    const Blended mixed;
    p.seen_things.draw_dust(p.painter, *picture.dust, camera, colours.dust);
  }
  if (picture.hand_rad) p.draw_ghost(places(p.machine, *picture.hand_rad), colours.hand);
  if (picture.beside_rad) {
    const BodyPlaces beside = places(p.machine, *picture.beside_rad);
    p.draw_ghost(beside, colours.beside);
    p.draw_outline(beside, colours.beside);
  }
  if (picture.commanded_rad) p.draw_outline(places(p.machine, *picture.commanded_rad), colours.commanded);
  p.draw_force(picture, colours);
  leave_as_agreed();
}

void MachineView::draw_over(const MachinePicture& picture, const Camera& camera, const Viewport& viewport,
                            const PictureColours& colours) {
  Parts& p = *parts_;
  p.clear(viewport, colours, GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);
  p.painter.begin(view_projection(camera, viewport).cast<float>(), colours);
  p.draw_outline(places(p.machine, picture.measured_rad), Rgb::Ones());
  glClear(GL_STENCIL_BUFFER_BIT);
  if (picture.commanded_rad) p.draw_outline(places(p.machine, *picture.commanded_rad), colours.commanded);
  p.draw_force(picture, colours);
  leave_as_agreed();
}

}  // namespace knuckle::console::picture
