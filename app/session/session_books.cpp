#include "app/session/session_books.h"

namespace knuckle::session {
namespace {

constexpr std::size_t kMostEvents = 1024, kMostWarnings = 256;

/// A latency less is no harm; memory taken in a step is.
void add_span(std::vector<Span>& spans, const Span& span) noexcept {
  if (spans.size() < spans.capacity()) spans.push_back(span);
}

}  // namespace

MasterBook::MasterBook(std::size_t rows, Duration origin) : far_origin(origin) {
  felt.reserve(rows);
  warnings.reserve(kMostWarnings);
}

void MasterBook::hand_over(SessionRecord& record) const {
  record.records_lost += lost;
  record.warnings = warnings;
}

void MasterBook::note(Time now, const master::MasterLoop& master) noexcept {
  const Reason warning = master.warning();
  if (warning && !same_cause(warning, warned)) keep(warnings, {warning, to_seconds(now.time_since_epoch())}, lost);
  warned = warning;
  const auto& told = master.machine();
  if (!told || told->stamp.sequence == heard) return;
  heard = told->stamp.sequence;
  slave_to_master.add(now - (told->stamp.sent_at - far_origin));
  if (told->sensor_at != kNever && told->sensor_at != felt_sensor_at)
    add_span(felt, {told->sensor_at - far_origin, now});
  felt_sensor_at = told->sensor_at;
  if (master.device().ok) hand_to_master.add(now - master.device().measured_at);
}

SlaveBook::SlaveBook(std::size_t rows, Duration origin) : far_origin(origin) {
  for (auto* spans : {&measured, &acted}) spans->reserve(rows);
}

void SlaveBook::note(Time now, const slave::SlaveLoop& slave) noexcept {
  add_span(measured, {now, now});
  const MasterMessage& message = slave.operator_input().message();
  if (message.stamp.sequence == heard) return;
  heard = message.stamp.sequence;
  master_to_slave.add(now - (message.stamp.sent_at - far_origin));
  if (slave.mode() == Mode::kEngaged) add_span(acted, {message.device_report_at - far_origin, now});
}

MachineBook::MachineBook(std::size_t most_frames) {
  frames.reserve(most_frames);
  events.reserve(kMostEvents);
}

void MachineBook::note(const sim::WorldEventRing& ring) noexcept {
  for (; events_read < ring.count; ++events_read) {
    const sim::WorldEvent& event = ring.at(events_read);
    if (event.kind == sim::WorldEventKind::kPieceBroke) ++breaks;
    keep(events, event, lost);
  }
}

void MachineBook::hand_over(SessionRecord& record) const {
  record.records_lost += lost;
  for (const sim::WorldEvent& event : events) record.events.push_back({event.t_s, sim::name(event.kind)});
}

HopHistograms hops_of(const MasterBook& master, const SlaveBook& slave, const MachineBook& machine,
                      const BusDescription& bus) {
  HopHistograms hops;
  hops.hand_to_master = master.hand_to_master;
  hops.slave_to_master = master.slave_to_master;
  hops.master_to_slave = slave.master_to_slave;
  add_wire_latencies(machine.frames, bus, {slave.measured, slave.acted, master.felt}, hops);
  return hops;
}

}  // namespace knuckle::session
