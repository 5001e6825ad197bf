#include "app/console/live_session.h"

#include "app/session/loop_views.h"
#include "app/session/operator_path.h"
#include "core/loop_table.h"

namespace knuckle::console {
namespace {

StationSetup station_setup(const session::SessionSetup& setup) {
  StationSetup station{.side = session::operator_setup(setup),
                       .limb = setup.limb,
                       .hand_rad = setup.scenario.hand_rad,
                       .start_rad = setup.scenario.start_rad,
                       .seed = setup.seed};
  station.side.far_end = master::FarEnd::kTellsItsMachine;  // as a real one
  return station;
}

}  // namespace

LiveSession::LiveSession(const session::SessionSetup& setup, Led led, HidPort* device)
    : network_(setup.to_machine, setup.to_operator, setup.seed),
      station_(station_setup(setup), network_.a(), led == Led::kByPerson ? device : nullptr),
      machine_(setup.machine),
      far_(machine_, setup.truth, setup.scenario, setup.seed, network_.b()) {
  far_.side.report_status(machine_, true);
  if (led == Led::kByPerson) return;
  scripted_ = session::operator_of(setup);
}

void LiveSession::record_to(recording::Recorder& recorder) {
  station_.record_to(recorder);
  far_.side.record_to(recorder);
}

void LiveSession::step(const HandInput& held) noexcept {
  now_ += kTick;
  network_.advance(now_);
  if (scripted_) {
    station_.step(now_, scripted_->step(now_, seen_by_operator()));
  } else {
    station_.step(now_, held);
  }
  far_.step(now_, [this] { far_.side.step(now_); });
  count_breaks();
}

sim::OperatorView LiveSession::seen_by_operator() const noexcept {
  return session::person_view(session::view_of(now_, station_.master()), station_.start_rad(), station_.hand(),
                              breaks_);
}

void LiveSession::count_breaks() noexcept {
  const sim::WorldEventRing& ring = plant().events;
  for (; events_read_ < ring.count; ++events_read_)
    if (ring.at(events_read_).kind == sim::WorldEventKind::kPieceBroke) ++breaks_;
}

void LiveSession::show(ConsoleView& view) noexcept {
  station_.show(now_, view);
  view.simulated = true;
  view.led_by_scenario = led_by_scenario();
  view.simulated_s = to_seconds(now_);
  const sim::PlantState& plant = this->plant();
  SimulatedTruth& truth = view.truth;
  truth.pump_Pa = plant.pump_Pa;
  truth.joint_rad = plant.joint_rad;
  truth.events = plant.events;
}

}  // namespace knuckle::console
