#include "app/hardware/slave_command.h"

#include <CLI/CLI.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "app/hardware/program_options.h"
#include "app/hardware/slave_program.h"
#include "app/interrupt.h"
#include "machine/load.h"
#include "slave/bus_map.h"
#include "transport/socket_can.h"
#include "transport/udp_link.h"

namespace knuckle::app {
namespace {

using Json = nlohmann::ordered_json;
constexpr const char* kSchema = "knuckle-slave/1";

struct Options {
  std::string machine, can, listen;
  bool insecure = false;
  std::optional<double> duration_s;
  std::string candump, csv, json;
};

void add_options(CLI::App& c, Options& o) {
  c.add_option("--machine", o.machine, "Machine name or .toml file")->required();
  c.add_option("--can", o.can, "CAN interface of the machine's bus, such as can0")->required();
  c.add_option("--listen", o.listen, "Address and port for the operator's side, such as 0.0.0.0:5683 or [::]:5683")
      ->required();
  c.add_flag("--insecure", o.insecure, "Allow a link that is plain UDP");
  c.add_option("--duration", o.duration_s, "End after so many seconds (default: when told to)");
  c.add_option("--candump", o.candump, "Write every CAN frame in candump log format (- = standard output)");
  c.add_option("--csv", o.csv, "Write sensors, commands and estimates, a row each step; `knuckle identify` reads it");
  c.add_option("--json", o.json, "Write what happened (docs/programs.md says what is in it)");
}

void check(const Options& o) {
  check_range("--duration", o.duration_s, 0.1, kLongestRun_s, " s");
  check_plain_link("--listen", o.listen, o.insecure);
  Places places;
  places.configuration("--machine", o.machine);
  places.output("--candump", o.candump);
  places.output("--csv", o.csv);
  places.output("--json", o.json);
}

Json counters_json(const CanCounters& c) {
  return {{"sent", c.sent},
          {"received", c.received},
          {"queue_full", c.queue_full},
          {"not_sendable", c.not_sendable},
          {"overflows", c.overflows},
          {"controller_overflows", c.controller_overflows},
          {"error_frames", c.error_frames},
          {"no_acknowledge", c.no_acknowledge},
          {"passive", c.passive},
          {"bus_off", c.bus_off},
          {"restarts", c.restarts},
          {"downs", c.downs}};
}

Json result_json(const Options& o, double started_unix_s, const SlaveOutcome& outcome, const CanCounters& counters) {
  Json json{{"schema", kSchema},  {"version", program_version()},     {"machine", o.machine},  {"can", o.can},
            {"listen", o.listen}, {"started_unix_s", started_unix_s}, {"ran_s", outcome.ran_s}};
  json["modes"] = Json::array();
  json["faults"] = Json::array();
  Reason standing;
  for (const ModeEvent& event : outcome.events) {
    json["modes"].push_back(
        {{"mode", name(event.mode)}, {"at_s", to_seconds(event.at)}, {"blocking", reason_json(event.blocking)}});
    const bool news = event.fault && (event.fault.code != standing.code || event.fault.subject != standing.subject);
    standing = event.fault;
    if (!news) continue;
    Json fault = reason_json(event.fault);
    fault["at_s"] = to_seconds(event.at);
    json["faults"].push_back(std::move(fault));
  }
  json["stop"] = {{"confirmed", outcome.unconfirmed.empty()}, {"unconfirmed", outcome.unconfirmed}};
  json["can_counters"] = counters_json(counters);
  json["malformed_datagrams"] = outcome.malformed_datagrams;
  json["records_lost"] = outcome.records_lost;
  json["realtime"] = {{"slave", loop_json(outcome.loop)}};
  return json;
}

int run(const Options& o) {
  check(o);
  const InterruptGuard interrupt;
  const MachineDescription machine = calibrated(load_machine(find_config("machine", o.machine)));
  AskedOutput candump("--candump", o.candump), csv("--csv", o.csv), json("--json", o.json);
  SocketCanBus bus(o.can, slave::heard_by_controller(machine.bus));
  UdpLink link = UdpLink::listen(o.listen);

  ProgramConsole console("knuckle slave");
  console.note("link: " + std::string(kPlainLinkNote));
  console.note("machine " + machine.name + " on " + o.can + ", listening on " + o.listen);
  const SlaveRecords records{candump.stream(), o.can, csv.stream()};
  ProgramRun program{[&interrupt] { return !interrupt.pending(); }, console};
  if (o.duration_s) program.duration_s = *o.duration_s;
  const double started_unix_s = unix_time_s();
  const SlaveOutcome outcome = run_slave(machine, bus, link, program, records);

  if (const std::string wrong = bus.diagnosis(); !wrong.empty()) console.note(wrong);
  if (auto* out = json.stream()) *out << result_json(o, started_unix_s, outcome, bus.counters()).dump(2) << '\n';
  for (auto* file : {&candump, &csv, &json}) file->commit();
  return 0;
}

}  // namespace

Command slave_entry() {
  return {"slave", "Machine's side: drive a machine on a CAN interface for an operator's side over the link",
          [](CLI::App& command) {
            const auto options = std::make_shared<Options>();
            add_options(command, *options);
            return [options] { return run(*options); };
          }};
}

}  // namespace knuckle::app
