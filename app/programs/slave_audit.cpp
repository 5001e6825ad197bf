#include "app/programs/slave_audit.h"

#include <array>
#include <filesystem>

#include "app/audit/audit_files.h"
#include "app/cli/command.h"
#include "app/cli/digest.h"
#include "core/error.h"
#include "machine/reason_text.h"

namespace knuckle::programs {
namespace {

using cli::Json;
using Kind = secure::LinkEvent::Kind;

constexpr const char* kListsAll = " (knuckle audit lists all of it)";

const char* event_name(Kind kind) {
  static constexpr std::array kNames{"control_taken",    "keys_renewed",       "refused",       "address_changed",
                                     "control_released", "ended_there",        "cut_off",       "control_asked_for",
                                     "control_granted",  "observer_connected", "observer_gone", "handshake_tried"};
  static_assert(kNames.size() == static_cast<std::size_t>(Kind::kTried) + 1);
  return kNames[static_cast<std::size_t>(kind)];
}

std::string digest_of(const std::string& file) {
  cli::Digest digest;
  digest.add_file(file);
  return digest.finish();
}

/// Of a trail that cannot be read either: the machine can be led all the same.
std::string damage_of(const std::string& folder) {
  if (!std::filesystem::is_directory(folder)) return "";
  try {
    const audit::Check check = audit::check_trail(folder);
    return check.breaks.empty() ? "" : "audit trail " + folder + " is BROKEN: " + check.broken() + kListsAll;
  } catch (const InputError& error) {
    return std::string("audit trail: ") + error.what();
  }
}

}  // namespace

SlaveAudit::SlaveAudit(const std::string& folder, const BusDescription& bus)
    : bus_(bus), damage_(damage_of(folder)), trail_(folder) {}

void SlaveAudit::started(const std::string& machine_file, const std::string& bus, const std::string& address,
                         const std::vector<std::string>& link_notes) {
  Json details{{"version", cli::program_version()},
               {"machine_file", machine_file},
               {"machine_file_sha256", digest_of(machine_file)},
               {"bus", bus},
               {"listen", address.empty() ? Json() : Json(address)}};
  details["link"] = link_notes;
  trail_.note("started", std::move(details));
}

void SlaveAudit::link(const secure::LinkEvent& event) {
  Json details = Json::object();
  if (!(event.peer == secure::Fingerprint{})) {
    details["name"] = event.name.view();
    details["fingerprint"] = secure::hex(event.peer);
  }
  details["address"] = knuckle::text(event.address);
  if (!(event.other == secure::Fingerprint{})) details["to"] = secure::hex(event.other);
  std::string kind = event_name(event.kind);
  if (event.refusal != secure::Refusal::kNone) {
    details["why"] = text(event.refusal);
    kind += std::string(": ") + text(event.refusal);  // a flood of one reason hides no other
  }
  trail_.note(event_name(event.kind), std::move(details), kind);
}

void SlaveAudit::link_events_lost(std::uint64_t count) {
  trail_.note("left_out", {{"kind", "link"}, {"count", count}});
}

void SlaveAudit::mode(const ModeEvent& event) {
  Json details{{"mode", name(event.mode)}};
  if (event.blocking) details["blocking"] = text(event.blocking, bus_);
  if (event.home_on_two) details["home_on_two"] = true;
  if (event.fault) {
    details["code"] = name(event.fault.code);
    details["fault"] = text(event.fault, bus_);
  }
  trail_.note(event.fault ? "fault" : "mode", std::move(details),
              event.fault ? std::string("fault ") + name(event.fault.code) : "mode");
}

void SlaveAudit::assist(const AssistSettings& assist) {
  trail_.note("limits_set", {{"force_limit_N", assist.force_limit_N}, {"stop_on_object", assist.stop_on_object}});
}

void SlaveAudit::pairings_changed(const std::string& what) {
  trail_.note("pairings_changed", {{"what", what}});
}

void SlaveAudit::ended(bool confirmed) {
  trail_.note("ended", {{"stop_confirmed", confirmed}});
}

}  // namespace knuckle::programs
