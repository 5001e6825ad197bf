// The force in the hand: one of the bilateral laws, and cues in its place while link or estimate is sick.
#pragma once

#include <variant>

#include "core/reason.h"
#include "machine/device_description.h"
#include "master/cues_law.h"
#include "master/direct_law.h"
#include "master/downgrade.h"
#include "master/echo_spring.h"
#include "master/felt_inputs.h"

namespace knuckle::master {

class FeltLaw {
 public:
  FeltLaw(ControlLaw law, const DeviceDescription::Feel& feel) noexcept;

  /// One millisecond. Between law and cues the force is faded over a second. kDirect is never downgraded: what it does
  /// over a bad link is what it is kept for.
  /// @return force on the hand at the tip [N], frame D, within the device's force limit. Not slew-limited.
  [[nodiscard]] PlanarVector step(const FeltInputs& in, double dt_s) noexcept;

  /// Of that, what the hand is held against by a contact: without cues, which are signals, and without the load's
  /// weight. It bounds what the machine presses (MasterMessage::rendered_N), so that neither moves it or lets it press
  /// harder.
  [[nodiscard]] const PlanarVector& rendered_N() const noexcept { return rendered_N_; }

  /// K_l = lambda mu Ks; to be kept in step with the scales. Only while not engaged.
  void set_spring(double spring_N_per_m) noexcept;

  [[nodiscard]] ControlLaw law() const noexcept { return static_cast<ControlLaw>(law_.index()); }
  /// Why cues have taken the law's place; kNone: they have not.
  [[nodiscard]] const Reason& downgraded() const noexcept { return downgraded_; }
  [[nodiscard]] Cue cue() const noexcept;  ///< Being given.
  /// nullptr with another law.
  [[nodiscard]] const EchoSpring* spring() const noexcept { return std::get_if<EchoSpring>(&law_); }

 private:
  std::variant<EchoSpring, CuesLaw, DirectLaw> law_;  // in the order of ControlLaw
  CuesLaw cues_;
  Downgrade downgrade_;
  Reason downgraded_;
  double cues_share_ = 0;
  PlanarVector rendered_N_ = PlanarVector::Zero();
};

}  // namespace knuckle::master
