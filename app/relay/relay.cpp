#include "app/relay/relay.h"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <ctime>
#include <optional>
#include <utility>

#include "app/cli/interrupt.h"
#include "app/cli/json.h"
#include "app/programs/program_console.h"
#include "app/programs/program_options.h"
#include "app/session/link_file.h"
#include "core/error.h"
#include "core/loop_table.h"
#include "machine/load.h"

namespace knuckle::relay {

namespace {

RelayPlan plan_of(const RelaySetup& setup) {
  RelayPlan plan{parse_address(setup.listen, "--listen"),
                 look_up_one(setup.connect, "--connect"),
                 setup.to_machine,
                 setup.to_operator,
                 setup.seed,
                 kNever};
  const bool own = plan.listen.is_any() && plan.connect.is_loopback() && plan.listen.port() == plan.connect.port();
  if (plan.listen == plan.connect || own)
    throw InputError("--connect " + setup.connect + ": the relay would send to itself");
  check(plan.to_machine);
  check(plan.to_operator);
  return plan;
}

}  // namespace

Relay::Relay(const RelaySetup& setup)
    : plan_(plan_of(setup)), listening_(open_udp_socket(setup.listen, plan_.listen, ::bind, "listen on")) {
  plan_.listen = local_address(listening_.descriptor());
}

void Relay::run_until(const RealtimeClock& clock, Time until) {
  for (;;) {
    const Time now = clock.now();
    receive_from_operators(clock);
    for (const auto& flow : flows_) {
      if (flow) flow->receive(clock, buffer_);
    }
    follow_plan(now);
    for (const auto& flow : flows_) {
      if (flow) flow->send_due(clock);
    }
    look_after_flows(now);
    if (now >= until) return;  // what was due by then is sent
    wait(clock, until);
  }
}

void Relay::receive_from_operators(const RealtimeClock& clock) {
  SocketAddress from;
  for (int i = 0; i < kAtOnce; ++i) {
    const auto arrival = listening_.receive(buffer_, from);
    if (!arrival) return;
    const Time arrived_at = clock.now() - arrival->waited;
    Flow* const flow = flow_of(from, arrived_at);
    if (flow == nullptr) {
      ++refused_;
    } else if (arrival->size > Flow::kMostBytes) {
      flow->too_long_from_operator();
    } else {
      flow->from_operator(std::span(buffer_).first(arrival->size), arrived_at, true);
    }
  }
}

Flow* Relay::flow_of(const SocketAddress& from, Time now) {
  for (const auto& flow : flows_) {
    if (flow && flow->so_far().operators == from) return flow.get();
  }
  return begin_flow(from, now);
}

Flow* Relay::begin_flow(const SocketAddress& from, Time now) {
  const auto place = std::find(flows_.begin(), flows_.end(), nullptr);
  if (place == flows_.end()) {
    if (!std::exchange(full_told_, true)) tell(now, "no room for another operator, such as " + text(from));
    return nullptr;
  }
  if (plan_.began_at == kNever) plan_.began_at = now;
  try {
    *place = std::make_unique<Flow>(flows_begun_ + 1, from, plan_, listening_, now);
  } catch (const InputError& error) {  // such as a route that has gone
    tell(now, error.what());
    return nullptr;
  }
  ++flows_begun_;
  tell(now,
       fmt::format("flow {}: {} reaches the machine's side from {}", flows_begun_, text(from),
                   text(local_address((*place)->descriptors()[0]))),
       "flow");
  return place->get();
}

void Relay::follow_plan(Time now) {
  if (plan_.began_at == kNever) return;
  follow(now, plan_.to_machine, to_machine_, &Flow::change_address_to_machine);
  follow(now, plan_.to_operator, to_operator_, &Flow::change_address_to_operator);
}

void Relay::follow(Time now, const LinkImpairment& plan, Standing& standing, SocketAddress (Flow::*change_address)()) {
  const Time at(now - plan_.began_at);
  if (const bool out = plan.is_out(at); out != std::exchange(standing.out, out))
    tell(now, fmt::format("outage {} {}", standing.name, out ? "begins" : "ends"));
  if (const std::size_t changes = plan.changes_by(at); changes != std::exchange(standing.changes, changes))
    tell(now, fmt::format("change {} of {} in force", changes, standing.name));
  while (standing.address_changes < plan.address_changes.size() &&
         plan.address_changes[standing.address_changes] <= at) {
    ++standing.address_changes;
    for (const auto& flow : flows_) {
      if (!flow) continue;
      const std::string address = text((*flow.*change_address)());
      tell(now, fmt::format("flow {}: what goes {} comes from {} now", flow->so_far().number, standing.name, address),
           "address change");
    }
  }
}

void Relay::look_after_flows(Time now) {
  for (auto& flow : flows_) {
    if (!flow) continue;
    if (flow->take_refusal())
      tell(now, fmt::format("flow {}: nobody listens at {}", flow->so_far().number, text(plan_.connect)));
    if (now - flow->so_far().heard_at < kForgetAfter) continue;
    tell(now,
         fmt::format("flow {}: {} has been silent for {:.0f} s: forgotten", flow->so_far().number,
                     text(flow->so_far().operators), to_seconds(kForgetAfter)),
         "forgotten");
    if (ended_.size() < kMostEnded) {
      ended_.push_back(flow->report());
    } else {
      ++left_out_;
    }
    flow.reset();
  }
}

void Relay::wait(const RealtimeClock& clock, Time until) const {
  std::array<pollfd, 1 + 2 * kMostFlows> waiting{};
  std::size_t count = 0;
  waiting[count++] = {listening_.descriptor(), POLLIN, 0};
  for (const auto& flow : flows_) {
    if (!flow) continue;
    until = std::min(until, flow->next_due());
    for (const int descriptor : flow->descriptors()) waiting[count++] = {descriptor, POLLIN, 0};  // -1 is passed over
  }
  const auto left = std::max(until - clock.now(), Duration::zero());
  const auto whole = std::chrono::duration_cast<std::chrono::seconds>(left);
  const timespec timeout{whole.count(), (left - whole).count()};
  (void)::ppoll(waiting.data(), count, &timeout, nullptr);
}

std::vector<RelayEvent> Relay::take_events() {
  return std::exchange(events_, {});
}

std::size_t Relay::active_flows() const noexcept {
  return kMostFlows - static_cast<std::size_t>(std::count(flows_.begin(), flows_.end(), nullptr));
}

std::vector<FlowReport> Relay::reports() const {
  std::vector<FlowReport> all = ended_;
  for (const auto& flow : flows_) {
    if (flow) all.push_back(flow->report());
  }
  return all;
}

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
  return cli::command<Options>(
      "relay", "An impaired network between the two sides: delays, loses, repeats and reorders their datagrams",
      add_options, run);
}

}  // namespace knuckle::relay
