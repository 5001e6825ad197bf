#include "app/relay/relay_command.h"

#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>

#include "app/cli/interrupt.h"
#include "app/cli/json.h"
#include "app/programs/program_console.h"
#include "app/programs/program_options.h"
#include "app/relay/relay.h"
#include "app/session/link_file.h"
#include "core/loop_table.h"
#include "core/realtime_thread.h"
#include "machine/load.h"

namespace knuckle::relay {
namespace {

using cli::Json;
constexpr const char* kSchema = "knuckle-relay/1";
constexpr Duration kTendPeriod = 20ms;

struct Options {
  std::string listen, connect, impairment, json;
  std::uint64_t seed = 1;
  std::optional<double> duration_s;
};

void add_options(const cli::OptionList& c, Options& o) {
  c.add_option("--listen", o.listen, "Address and port for operators' sides, such as 127.0.0.1:5684").required();
  c.add_option("--connect", o.connect, "Machine's side, HOST:PORT such as 192.0.2.7:5683 or arm.example.org:5683")
      .required();
  c.add_option("--impairment", o.impairment, "What happens to datagrams: name or .toml file, such as lte").required();
  c.add_option("--seed", o.seed, "Random seed (default: 1)").check(cli::seed_error);
  c.add_option("--duration", o.duration_s, "Stop after so many seconds (default: when interrupted)");
  c.add_option("--json", o.json, "Write counts and delays as JSON (described in docs/network.md)");
}

void check(const Options& o) {
  cli::check_range("--duration", o.duration_s, 0.1, programs::kLongestRun_s, " s");
  cli::Places places;
  places.configuration("--impairment", o.impairment);
  places.output("--json", o.json);
}

/// [upper edge in ms, datagrams up to it and above the edge before], a quarter of an octave each.
Json bins_json(const Histogram& histogram) {
  constexpr std::int64_t kFirst_ns = 1 << 16, kLast_ns = std::int64_t{1} << 34;  // 66 us to 17 s
  Json bins = Json::array();
  std::uint64_t before = 0;
  for (std::int64_t octave_ns = kFirst_ns; octave_ns < kLast_ns; octave_ns *= 2) {
    for (std::int64_t quarter = 0; quarter < 4; ++quarter) {
      const Duration edge(octave_ns + quarter * octave_ns / 4);
      const std::uint64_t below = histogram.count_below(edge);
      if (below > before) bins.push_back({1e3 * to_seconds(edge), below - before});
      before = below;
    }
  }
  if (histogram.count() > before) bins.push_back({nullptr, histogram.count() - before});
  return bins;
}

Json direction_json(const DirectionReport& d) {
  const ImpairmentCounts& c = d.counts;
  return {{"received", c.sent},
          {"forwarded", d.forwarded},
          {"forwarded_bytes", d.forwarded_bytes},
          {"lost", c.lost},
          {"lost_in_outage", c.lost_in_outage},
          {"lost_in_burst", c.lost_in_burst},
          {"queue_full", c.queue_full},
          {"duplicated", c.duplicated},
          {"held_back", c.held_back},
          {"overflowed", c.overflowed},
          {"too_long", d.too_long},
          {"not_sent", d.not_sent},
          {"old_address", d.old_address},
          {"address_changes", d.address_changes},
          {"delay_ms", programs::milliseconds_json(d.delay)},
          {"delay_bins_ms", bins_json(d.delay)},
          {"lateness_ms", programs::milliseconds_json(d.lateness)}};
}

Json result_json(const Options& o, const session::LinkFile& link, double started_unix_s, double ran_s,
                 const Relay& relay, std::uint64_t lines_lost) {
  Json json{{"schema", kSchema},
            {"version", cli::program_version()},
            {"listen", text(relay.address())},
            {"connect", o.connect},
            {"impairment", link.name},
            {"seed", o.seed},
            {"started_unix_s", started_unix_s},
            {"ran_s", ran_s},
            {"first_datagram_at_s", relay.began_at() == kNever ? Json() : Json(to_seconds(relay.began_at()))},
            {"flows", Json::array()},
            {"flows_left_out", relay.reports_left_out()},
            {"refused_datagrams", relay.refused_datagrams()},
            {"lines_lost", lines_lost}};
  for (const FlowReport& flow : relay.reports()) {
    json["flows"].push_back({{"flow", flow.number},
                             {"operator", text(flow.operators)},
                             {"began_at_s", to_seconds(flow.began_at)},
                             {"heard_at_s", to_seconds(flow.heard_at)},
                             {"to_machine", direction_json(flow.to_machine)},
                             {"to_operator", direction_json(flow.to_operator)}});
  }
  return json;
}

std::string summary(const Relay& relay) {
  std::uint64_t to_machine = 0, to_operator = 0;
  for (const FlowReport& flow : relay.reports()) {
    to_machine += flow.to_machine.forwarded;
    to_operator += flow.to_operator.forwarded;
  }
  return fmt::format("stopped: {} datagrams forwarded to the machine, {} to the operator", to_machine, to_operator);
}

int run(const Options& o) {
  check(o);
  const cli::InterruptGuard interrupt;
  const session::LinkFile link = session::load_link(find_config("link", o.impairment));
  programs::AskedOutput json("--json", o.json, programs::AskedOutput::Content::kResult);
  Relay relay({o.listen, o.connect, link.to_machine, link.to_operator, o.seed});

  programs::ProgramConsole console("knuckle relay");
  console.note(fmt::format("from {} to {}: {} ({}), seed {}", text(relay.address()), o.connect, link.name,
                           link.description, o.seed));
  const double started_unix_s = programs::unix_time_s();
  ask_for_fifo(fifo_priority::kRelay);  // after the console's own thread has begun, which may wait
  const RealtimeClock clock;
  Time now = clock.now();
  while (!interrupt.pending() && !(o.duration_s && to_seconds(now) >= *o.duration_s)) {
    relay.run_until(clock, now + kTendPeriod);
    now = clock.now();
    for (const RelayEvent& event : relay.take_events()) console.event(event.at, event.what, event.kind);
    console.status(now, {fmt::format("{} operators", relay.active_flows())});
    console.tend(now);
  }
  console.event(now, summary(relay));
  if (auto* out = json.stream())
    *out << result_json(o, link, started_unix_s, to_seconds(now), relay, console.lines_lost()).dump(2) << '\n';
  programs::commit_all({&json});
  return 0;
}

}  // namespace

cli::Command relay_entry() {
  return {"relay", "An impaired network between the two sides: delays, loses, repeats and reorders their datagrams",
          [](const cli::OptionList& command) {
            const auto options = std::make_shared<Options>();
            add_options(command, *options);
            return [options] { return run(*options); };
          }};
}

}  // namespace knuckle::relay
