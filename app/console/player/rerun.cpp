#include "app/console/player/rerun.h"

#include <utility>

#include "master/master_state.h"
#include "slave/slave_loop.h"
#include "slave/slave_state.h"

namespace knuckle::console::player {

Rerun rerun(const std::vector<std::string>& files, const replay::Changes& changes, const Run& recorded) {
  recording::Recording recording(files);
  recording::ReplaySetup setup = recording::setup_of(recording);
  change(setup, changes);
  // What came in is what was recorded.
  const RunData& was = recorded.data();
  RunData data;
  data.operator_side = was.operator_side;
  data.machine_side = was.machine_side;
  data.machine_period = was.machine_period;
  data.position_scale = setup.device.feel.position_scale;
  data.force_scale = setup.device.feel.force_scale;
  data.receipts = was.receipts;
  data.arrivals = was.arrivals;
  data.statuses = was.statuses;
  data.operator_holes = was.operator_holes;
  data.machine_holes = was.machine_holes;
  if (!was.machine_side) data.machine = was.machine;
  recording::ReplayTaps taps;
  taps.operator_step = [&data](Time at, const master::MasterLoop& loop) { data.add(state_of(at, loop)); };
  taps.machine_step = [&data](Time at, const slave::SlaveLoop& loop) { data.add(state_of(at, loop), &loop.sent()); };
  Rerun again;
  again.result = recording::replay(recording, setup, std::move(taps));
  again.run = Run(std::move(data));
  return again;
}

}  // namespace knuckle::console::player
