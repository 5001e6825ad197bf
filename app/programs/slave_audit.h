// What the machine's side writes into its audit trail (docs/network.md).
#pragma once

#include <string>
#include <vector>

#include "app/audit/audit_trail.h"
#include "app/programs/slave_program.h"
#include "machine/bus_description.h"
#include "transport/secure/secure_link.h"

namespace knuckle::programs {

/// All of it is for the thread that tends the program.
class SlaveAudit {
 public:
  /// @param bus of the machine: outlives this. @throws InputError where nothing can be written there.
  SlaveAudit(const std::string& folder, const BusDescription& bus);
  /// What is wrong with the trail so far, in one line; empty: nothing.
  [[nodiscard]] const std::string& damage() const noexcept { return damage_; }

  /// @param machine_file whose content is named by its SHA-256. @param link_notes first lines on the link in use.
  void started(const std::string& machine_file, const std::string& bus, const std::string& address,
               const std::vector<std::string>& link_notes);
  void link(const secure::LinkEvent& event);
  void mode(const ModeEvent& event);
  void assist(const AssistSettings& assist);
  void link_events_lost(std::uint64_t count);
  void pairings_changed(const std::string& what);
  void ended(bool confirmed);
  [[nodiscard]] std::string news() { return trail_.news(); }

 private:
  const BusDescription& bus_;
  std::string damage_;  // before anything is written
  audit::AuditTrail trail_;
};

}  // namespace knuckle::programs
