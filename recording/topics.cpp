#include "recording/topics.h"

#include "master/master_state.h"
#include "recording/camera_stamp.h"
#include "recording/fields.h"
#include "recording/foxglove_schemas.h"
#include "recording/wire_events.h"
#include "slave/slave_state.h"

namespace knuckle::recording {

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
