// What the console keeps of a session while it runs, of a recording at any time of it: loads carried, places of
// contact, the minutes of the link. The whole of it is looked at once, as often as a window would.
#pragma once

#include <vector>

#include "app/console/link_history.h"
#include "app/console/player/run.h"
#include "app/console/screens/distances.h"
#include "app/console/screens/payload_total.h"
#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle::console::screens {

class KeptOfRun {
 public:
  KeptOfRun(const player::Run& run, const MachineDescription& machine, const Kinematics& kinematics);

  /// What a console that was there from the beginning on has kept by this time.
  void show(Time at);

  [[nodiscard]] const PayloadTotal& payload() const noexcept { return payload_; }
  [[nodiscard]] const ContactTrail& contacts() const noexcept { return contacts_; }
  [[nodiscard]] const LinkHistory& link() const noexcept { return link_; }

 private:
  struct Load {
    Time at{};
    PayloadTotal total;
  };
  struct Look {
    Time at{};
    LinkValues values{};
  };
  void show_contacts(Time at);
  void show_link(Time at);

  std::vector<Load> loads_;  ///< Whenever it changed.
  std::vector<ContactTrail::Touch> touches_;
  std::vector<Look> looks_;
  PayloadTotal payload_;
  ContactTrail contacts_;
  LinkHistory link_;
  Time link_at_ = kNever;
};

}  // namespace knuckle::console::screens
