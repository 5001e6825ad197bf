#include "app/relay/relay.h"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <ctime>
#include <utility>

#include "core/error.h"

namespace knuckle::relay {
namespace {

constexpr int kAtOnce = 64;  // datagrams from one socket, before others have their turn

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

}  // namespace knuckle::relay
