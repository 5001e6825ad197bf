#include "app/bringup/doctor_command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <iostream>
#include <memory>
#include <optional>
#include <utility>

#include "app/bringup/can_interfaces.h"
#include "app/bringup/device_probe.h"
#include "app/cli/interrupt.h"
#include "app/cli/output_file.h"
#include "machine/kinematics.h"
#include "machine/load.h"
#include "machine/room.h"
#include "sim/machine_on_bus.h"

namespace knuckle::bringup {

namespace {

using cli::Json;

std::string hex(int digits, std::optional<std::uint32_t> value) {
  return value ? fmt::format("0x{:0{}X}", *value, digits) : "-";
}

std::string profile_of(std::optional<std::uint32_t> device_type) {
  return device_type ? std::to_string(*device_type & 0xFFFFU) : "-";
}

std::string row(const std::array<std::string, 8>& cells) {
  return fmt::format("{:5} {:20} {:16} {:4} {:11} {:11} {:6} {}", cells[0], cells[1], cells[2], cells[3], cells[4],
                     cells[5], cells[6], cells[7]);
}

/// Null where there is none.
Json or_null(const std::string& text, const char* none = "") {
  return text == none ? Json() : Json(text);
}

}  // namespace

std::vector<BusDiagnosis> diagnose_each(std::vector<BusAccess>& access, const MachineDescription& machine,
                                        const SurveyOptions& options, const std::function<void()>& check) {
  std::vector<BusDiagnosis> each;
  MachineDescription one = machine;
  for (std::size_t on = 0; on < access.size(); ++on) {
    one.bus = machine.bus.alone(on);
    SurveyOptions own = options;
    own.multiplexed = multiplexed_frames(one.bus);
    each.push_back(diagnose(survey_bus(access[on], one.bus.bit_rate, doctor_objects(one), own, check), &one));
  }
  return each;
}

BusDiagnosis together(std::vector<BusDiagnosis> each, const BusDescription& bus) {
  BusDiagnosis all = std::move(each.front());
  for (std::size_t on = 1; on < each.size(); ++on) {
    for (Finding& finding : each[on].findings) {
      finding.about = "bus " + bus.line(on).name + ", " + finding.about;
      all.findings.push_back(std::move(finding));
    }
    all.nodes.insert(all.nodes.end(), each[on].nodes.begin(), each[on].nodes.end());
  }
  return all;
}

std::vector<std::string> finding_lines(const Findings& findings) {
  std::vector<std::string> lines;
  using Level = Finding::Level;
  for (const Level level : {Level::kFault, Level::kNote, Level::kOk}) {
    for (const Finding& one : findings) {
      if (one.level != level) continue;
      lines.push_back(fmt::format("{:6}{}: {}", name(level), one.about, one.text));
    }
  }
  return lines;
}

std::vector<std::string> diagnosis_lines(const BusDiagnosis& diagnosis) {
  std::vector<std::string> lines{row({"node", "name", "state", "CiA", "vendor", "product", "error", "reading"})};
  for (const NodeLine& node : diagnosis.nodes) {
    std::vector<std::string> now{node.reading, node.guard};
    if (node.serial) now.push_back(fmt::format("serial {}", *node.serial));
    if (node.settings)
      now.push_back(fmt::format("{} of {} settings as in the machine file", *node.settings_as_file, *node.settings));
    std::erase(now, "");
    lines.push_back(row({hex(2, node.id), node.name, node.state, profile_of(node.device_type), hex(8, node.vendor),
                         hex(8, node.product), hex(2, node.error_register), fmt::format("{}", fmt::join(now, "; "))}));
  }
  lines.emplace_back();
  for (std::string& line : finding_lines(diagnosis.findings)) lines.push_back(std::move(line));
  return lines;
}

cli::Json findings_json(const Findings& findings) {
  Json all = Json::array();
  for (const Finding& one : findings) {
    const char* level = one.level == Finding::Level::kFault ? "fault" : name(one.level);
    all.push_back({{"level", level}, {"about", one.about}, {"text", one.text}});
  }
  return all;
}

cli::Json diagnosis_json(const BusDiagnosis& diagnosis) {
  Json nodes = Json::array();
  for (const NodeLine& node : diagnosis.nodes) {
    nodes.push_back({{"id", node.id},
                     {"name", or_null(node.name, "-")},
                     {"state", node.state},
                     {"device_type", node.device_type},
                     {"vendor", node.vendor},
                     {"product", node.product},
                     {"serial", node.serial},
                     {"heartbeat_ms", node.heartbeat_ms},
                     {"guard", or_null(node.guard)},
                     {"error_register", node.error_register},
                     {"emergency", node.emergency},
                     {"reading", or_null(node.reading)},
                     {"settings_as_file", node.settings_as_file},
                     {"settings", node.settings}});
  }
  return {{"bus", diagnosis.bus},
          {"load", diagnosis.load},
          {"listened_s", diagnosis.listened_s},
          {"expected_load", diagnosis.expected_load},
          {"nodes", nodes}};
}

namespace {

std::vector<std::string> guard_notes(const BusDescription& bus, const std::vector<NodeLine>& found) {
  return slave::guard_lines(bus, [&](std::uint8_t id) {
    const std::uint32_t proved = bus.find(id)->guard.serial;
    return proved == 0 || std::any_of(found.begin(), found.end(),
                                      [&](const NodeLine& node) { return node.id == id && node.serial == proved; });
  });
}

struct DoctorOptions {
  std::string machine, json;
  std::vector<std::string> can;
  bool simulate = false;
  std::optional<double> listen_s;
  std::optional<std::uint32_t> bit_rate_kbps;
  std::optional<std::string> device_file;
  DeviceDoctorOptions device;
  LinkDoctorOptions link;
};

void add_options(const cli::OptionList& c, DoctorOptions& o) {
  c.add_option("--can", o.can,
               "CAN interface of the machine bus to check (can0); of two NAME=INTERFACE for each; reads only")
      .one_value_each();
  c.add_flag("--simulate", o.simulate, "Check the simulated machine's bus instead");
  c.add_option("--machine", o.machine,
               "Compare the bus with this machine: name or .toml file (default with --simulate: solar015)");
  c.add_option("--listen", o.listen_s, "Seconds to listen before the first request (default: 2)");
  c.add_option("--bit-rate", o.bit_rate_kbps,
               "Bit rate in kbit/s, to compute the bus load without --machine (default: 500)");
  c.add_option("--device", o.device.back_end, "Check a haptic device through hid or usb; commands no torque");
  add_device_choice(c, o.device.choice);
  c.add_option("--device-file", o.device_file,
               "Compare the device with this file: name or .toml file (default: knuckle1)");
  c.add_option("--connect", o.link.address,
               "Check the link to the machine's side at this HOST:PORT: pairing and handshake; takes no control");
  c.add_option("--keys", o.link.keys, "With --connect: folder of this computer's key (default: ~/.config/knuckle)");
  c.add_option("--json", o.json, "Write the findings as JSON (- = standard output)");
}

void check(const DoctorOptions& o) {
  if (o.simulate && !o.can.empty()) cli::refuse_option("--can", can_text(o.can), "give --can or --simulate, not both");
  if (!o.machine.empty() && o.can.empty() && !o.simulate)
    cli::refuse_option("--machine", o.machine, "needs --can or --simulate");
  const bool bus = o.simulate || !o.can.empty(), device = !o.device.back_end.empty();
  if (!o.link.address.empty() && (bus || device))
    cli::refuse_option("--connect", o.link.address, "check link, bus and device one after the other");
  if (!o.link.address.empty()) (void)parse_host_and_port(o.link.address, "--connect");
  if (o.link.address.empty() && !o.link.keys.empty()) cli::refuse_option("--keys", o.link.keys, "needs --connect");
  if (bus && device) cli::refuse_option("--device", o.device.back_end, "check bus and device one after the other");
  if (!device) check_no_device_choice(o.device.choice, "needs --device");
  if (!device && o.device_file) cli::refuse_option("--device-file", *o.device_file, "needs --device");
  if (!bus && o.listen_s) cli::refuse_option("--listen", "", "needs --can or --simulate");
  if (!bus && o.bit_rate_kbps) cli::refuse_option("--bit-rate", "", "needs --can");
  cli::check_range("--bit-rate", o.bit_rate_kbps, 10, 1000, " kbit/s");
  if (o.bit_rate_kbps && !o.machine.empty())
    cli::refuse_option("--bit-rate", "", "only goes without --machine, whose file has a bit rate");
  cli::check_range("--listen", o.listen_s, 0.1, 60, " s");
  cli::Places places;
  places.configuration("--machine", o.machine);
  if (o.device_file) places.configuration("--device-file", *o.device_file);
  places.output("--json", o.json);
}

/// One for each of the machine's buses.
std::vector<BusAccess> access_of(const DoctorOptions& o, const std::optional<MachineDescription>& read) {
  constexpr std::uint64_t kSeed = 1;
  const BusDescription bus = read ? read->bus : BusDescription();
  std::vector<BusAccess> all;
  if (!o.simulate) {
    for (const std::string& interface : can_interfaces(o.can, bus)) all.push_back(real_access(interface));
    return all;
  }
  const auto simulated = std::make_shared<sim::MachineOnBus>(sim::sample_truth(*read, kSeed), sim::WorldDescription{},
                                                             middle_of_range(*read), kSeed);
  for (std::size_t on = 0; on < bus.lines(); ++on) all.push_back(sim::access_to(simulated, on));
  return all;
}

BusDiagnosis diagnose_buses(const DoctorOptions& o, const std::optional<MachineDescription>& read,
                            const std::optional<MachineDescription>& machine, const cli::InterruptGuard& interrupt,
                            Json& result) {
  SurveyOptions survey;
  survey.listen_s = o.listen_s.value_or(survey.listen_s);
  const auto check = [&interrupt] { interrupt.check(); };
  std::vector<BusAccess> access = access_of(o, read);
  if (!machine)
    return diagnose(survey_bus(access.front(), 1000 * o.bit_rate_kbps.value_or(500), {}, survey, check), nullptr);
  std::vector<BusDiagnosis> each = diagnose_each(access, *machine, survey, check);
  if (each.size() > 1) result["second"] = diagnosis_json(each[1]);
  return together(std::move(each), machine->bus);
}

int run_doctor(DoctorOptions options) {
  if (options.simulate && options.machine.empty()) options.machine = "solar015";
  check(options);
  if (options.device_file) options.device.device = *options.device_file;
  const cli::InterruptGuard interrupt;
  cli::OptionalOutput json("--json", options.json);
  std::ostream& out = cli::is_standard_output(options.json) ? std::cerr : std::cout;
  const auto tell = [&out](const std::vector<std::string>& lines) {
    for (const std::string& line : lines) out << line << '\n';
  };
  cli::Json result{{"schema", "knuckle-doctor/2"}, {"version", cli::program_version()}};
  Findings findings;
  if (options.can.empty() && !options.simulate) {
    const bool device = !options.device.back_end.empty();
    findings = !options.link.address.empty() ? doctor_link(options.link, [&interrupt] { return !interrupt.pending(); })
               : device                      ? doctor_device(options.device)
                                             : judge_computer(computer_facts());
    tell(finding_lines(findings));
  } else {
    std::optional<MachineDescription> read, machine;
    if (!options.machine.empty()) {
      read = load_machine(find_config("machine", options.machine));
      machine = calibrated(*read);
    }
    BusDiagnosis diagnosis = diagnose_buses(options, read, machine, interrupt, result);
    const auto note = [&diagnosis](const char* about, const std::vector<std::string>& lines) {
      for (const std::string& line : lines) diagnosis.findings.push_back({Finding::Level::kNote, about, line});
    };
    if (machine) note("machine file", machine_notes(*machine));
    if (machine) note("guards", guard_notes(machine->bus, diagnosis.nodes));
    if (options.simulate)
      note("simulated", {"identities and set-ups are those of the machine file, not of your devices"});
    findings = diagnosis.findings;
    tell(diagnosis_lines(diagnosis));
    result.update(diagnosis_json(diagnosis));
  }
  const bool passed = healthy(findings);
  out << (passed ? "nothing wrong\n" : "something is wrong: see FAULT above\n");
  result["passed"] = passed;
  result["findings"] = findings_json(findings);
  json.write([&result](std::ostream& to) { to << result.dump(2) << '\n'; });
  return passed ? 0 : 1;
}

}  // namespace

cli::Command doctor_entry() {
  return cli::command<DoctorOptions>(
      "doctor", "Check this computer, a machine bus, a haptic device or the link, and list faults; reads only",
      add_options, run_doctor);
}

}  // namespace knuckle::bringup
