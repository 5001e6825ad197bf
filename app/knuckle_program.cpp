#include "app/knuckle_program.h"

#include <memory>

#include "app/audit/audit_files.h"
#include "app/bringup/commission_command.h"
#include "app/bringup/device_calibration.h"
#include "app/bringup/doctor_command.h"
#include "app/bringup/recover.h"
#include "app/check/file_check.h"
#include "app/console/picture/simulated_camera.h"
#include "app/console/window/console_program.h"
#include "app/eds/bus_command.h"
#include "app/explain/explain_command.h"
#include "app/export/export_command.h"
#include "app/identify/identify.h"
#include "app/pairing/key_folder.h"
#include "app/pairing/pairing_exchange.h"
#include "app/programs/programs.h"
#include "app/recordings/import.h"
#include "app/recordings/info.h"
#include "app/relay/relay.h"
#include "app/rendezvous/rendezvous_server.h"
#include "app/replay/replay_command.h"

namespace knuckle {
namespace {

using console::picture::SimulatedCamera;
static_assert(SimulatedCamera::kWidth_px == programs::kDrawnWidth_px &&
              SimulatedCamera::kHeight_px == programs::kDrawnHeight_px);

/// A camera of the simulated machine, for who sends its pictures.
programs::DrawnCamera draw_camera(const MachineDescription& machine, const CameraDescription& mount,
                                  const sim::WorldDescription& world, const SimulatedCamera::Give& give) {
  const auto camera = std::make_shared<SimulatedCamera>(machine, mount, give);
  camera->begin(world);
  return {[camera](const session::MachineSight& sight) { camera->show(sight); }, [camera] { return camera->status(); }};
}

}  // namespace

cli::Program knuckle_program() {
  return {
      "knuckle",
      "Knuckle: teleoperation of a dismantling machine with force feedback and no force sensor.\n",
      "Try: knuckle simulate --scenario dismantle --report report.html\n",
      {
          programs::simulate_entry([](const session::SimulateOptions& options, const std::string& command_line) {
            return programs::simulate_command(options, command_line, session::run_simulation);
          }),
          identify::identify_entry(identify::identify_command),
          exporting::export_entry(),
          recordings::import_entry(),
          recordings::info_entry(),
          console::window::console_entry(),
          programs::slave_entry(draw_camera),
          programs::master_entry(),
          programs::node_entry(),
          programs::device_entry(),
          relay::relay_entry(),
          pairing::pair_entry(),
          replay::replay_entry(),
          explain::explain_entry(),
          audit::audit_entry(),
          rendezvous::rendezvous_entry(),
          bringup::calibrate_device_entry(),
          eds::bus_entry(),
          bringup::doctor_entry(),
          checking::check_entry(),
          bringup::commission_entry(),
          bringup::recover_entry(),
      },
      {pairing::kept_name, audit::kept_name},
  };
}

}  // namespace knuckle
