#include "recording/topics.h"

#include <array>

#include "master/master_state.h"
#include "recording/events.h"
#include "recording/fields.h"
#include "recording/wire_events.h"
#include "slave/slave_state.h"

namespace knuckle::recording {

namespace {

struct Definition {
  std::string_view name;
  std::string_view lines;  ///< Each "type name", or "type NAME=value" for a constant.
};

constexpr std::array kDefinitions{
    Definition{"builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"},
    Definition{"builtin_interfaces/Duration", "int32 sec\nuint32 nanosec\n"},
    Definition{"geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"},
    Definition{"geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"},
    Definition{"geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"},
    Definition{"geometry_msgs/Pose", "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"},
    Definition{kLogSchemaName,
               "builtin_interfaces/Time timestamp\n"
               "uint8 UNKNOWN=0\nuint8 DEBUG=1\nuint8 INFO=2\nuint8 WARNING=3\nuint8 ERROR=4\nuint8 FATAL=5\n"
               "uint8 level\nstring message\nstring name\nstring file\nuint32 line\n"},
    Definition{kPictureSchemaName, "builtin_interfaces/Time timestamp\nstring frame_id\nuint8[] data\nstring format\n"},
    Definition{kTransformsSchemaName, "foxglove_msgs/FrameTransform[] transforms\n"},
    Definition{"foxglove_msgs/FrameTransform",
               "builtin_interfaces/Time timestamp\nstring parent_frame_id\nstring child_frame_id\n"
               "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"},
    Definition{kSceneSchemaName,
               "foxglove_msgs/SceneEntityDeletion[] deletions\nfoxglove_msgs/SceneEntity[] entities\n"},
    Definition{"foxglove_msgs/SceneEntityDeletion",
               "builtin_interfaces/Time timestamp\nuint8 MATCHING_ID=0\nuint8 ALL=1\nuint8 type\nstring id\n"},
    Definition{"foxglove_msgs/SceneEntity",
               "builtin_interfaces/Time timestamp\nstring frame_id\nstring id\nbuiltin_interfaces/Duration lifetime\n"
               "bool frame_locked\nfoxglove_msgs/KeyValuePair[] metadata\nfoxglove_msgs/ArrowPrimitive[] arrows\n"
               "foxglove_msgs/CubePrimitive[] cubes\nfoxglove_msgs/SpherePrimitive[] spheres\n"
               "foxglove_msgs/CylinderPrimitive[] cylinders\nfoxglove_msgs/LinePrimitive[] lines\n"
               "foxglove_msgs/TriangleListPrimitive[] triangles\nfoxglove_msgs/TextPrimitive[] texts\n"
               "foxglove_msgs/ModelPrimitive[] models\n"},
    Definition{"foxglove_msgs/KeyValuePair", "string key\nstring value\n"},
    Definition{"foxglove_msgs/Color", "float64 r\nfloat64 g\nfloat64 b\nfloat64 a\n"},
    Definition{"foxglove_msgs/ArrowPrimitive",
               "geometry_msgs/Pose pose\nfloat64 shaft_length\nfloat64 shaft_diameter\nfloat64 head_length\n"
               "float64 head_diameter\nfoxglove_msgs/Color color\n"},
    Definition{"foxglove_msgs/CubePrimitive",
               "geometry_msgs/Pose pose\ngeometry_msgs/Vector3 size\nfoxglove_msgs/Color color\n"},
    Definition{"foxglove_msgs/SpherePrimitive",
               "geometry_msgs/Pose pose\ngeometry_msgs/Vector3 size\nfoxglove_msgs/Color color\n"},
    Definition{"foxglove_msgs/CylinderPrimitive",
               "geometry_msgs/Pose pose\ngeometry_msgs/Vector3 size\nfloat64 bottom_scale\nfloat64 top_scale\n"
               "foxglove_msgs/Color color\n"},
    Definition{"foxglove_msgs/LinePrimitive",
               "uint8 LINE_STRIP=0\nuint8 LINE_LOOP=1\nuint8 LINE_LIST=2\nuint8 type\ngeometry_msgs/Pose pose\n"
               "float64 thickness\nbool scale_invariant\ngeometry_msgs/Point[] points\nfoxglove_msgs/Color color\n"
               "foxglove_msgs/Color[] colors\nuint32[] indices\n"},
    Definition{"foxglove_msgs/TriangleListPrimitive",
               "geometry_msgs/Pose pose\ngeometry_msgs/Point[] points\nfoxglove_msgs/Color color\n"
               "foxglove_msgs/Color[] colors\nuint32[] indices\n"},
    Definition{"foxglove_msgs/TextPrimitive",
               "geometry_msgs/Pose pose\nbool billboard\nfloat64 font_size\nbool scale_invariant\n"
               "foxglove_msgs/Color color\nstring text\n"},
    Definition{"foxglove_msgs/ModelPrimitive",
               "geometry_msgs/Pose pose\ngeometry_msgs/Vector3 scale\nfoxglove_msgs/Color color\n"
               "bool override_color\nstring url\nstring media_type\nuint8[] data\n"},
};

/// Empty for what is no message.
std::string_view lines_of(std::string_view name) {
  for (const Definition& definition : kDefinitions) {
    if (definition.name == name) return definition.lines;
  }
  return {};
}

/// Calls take(type, name) for each.
template <typename Take>
void for_each_line(std::string_view lines, const Take& take) {
  while (!lines.empty()) {
    const std::size_t space = lines.find(' '), end = lines.find('\n');
    take(lines.substr(0, space), lines.substr(space + 1, end - space - 1));
    lines.remove_prefix(end + 1);
  }
}

void add_messages_within(std::string_view lines, SchemaText& schema) {
  for_each_line(lines, [&schema](std::string_view type, std::string_view) {
    const std::string_view element = type.substr(0, type.find('['));
    const std::string_view inner = lines_of(element);
    if (inner.empty()) return;
    schema.inner(element, inner);
    add_messages_within(inner, schema);
  });
}

}  // namespace

std::string foxglove_schema(std::string_view name) {
  SchemaText schema;
  const std::string_view lines = lines_of(name);
  for_each_line(lines, [&schema](std::string_view type, std::string_view field) { schema.line(type, field); });
  add_messages_within(lines, schema);
  return schema.text();
}

mcap::Topics topics() {
  mcap::Topics topics;
  const auto schema = [&](const std::string& name, std::string text) {
    return topics.add(mcap::Schema{name, "ros2msg", std::move(text)});
  };
  const auto wires = schema("knuckle_msgs/msg/Wires", wires_schema());
  const auto operator_state = schema("knuckle_msgs/msg/OperatorState", schema_text<master::MasterState>());
  const auto machine_state = schema("knuckle_msgs/msg/MachineState", schema_text<slave::SlaveState>());
  const auto log = schema(kLogSchemaName, foxglove_schema(kLogSchemaName));
  const auto transforms = schema(kTransformsSchemaName, foxglove_schema(kTransformsSchemaName));
  const auto scene = schema(kSceneSchemaName, foxglove_schema(kSceneSchemaName));
  const auto stamp = schema(kCameraStampSchemaName, camera_stamp_schema());
  const auto picture = schema(kPictureSchemaName, foxglove_schema(kPictureSchemaName));
  const std::array<std::uint16_t, static_cast<std::size_t>(Topic::kCount)> schemas{
      wires, operator_state, wires, machine_state, log, transforms, scene, scene, stamp, picture};
  for (std::size_t i = 0; i < schemas.size(); ++i) topics.add(mcap::Channel{kTopicNames[i], "cdr", schemas[i], {}});
  return topics;
}

}  // namespace knuckle::recording
