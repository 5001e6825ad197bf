#include "app/session/session_logs.h"

#include <algorithm>
#include <utility>

#include "machine/bus_frames.h"
#include "transport/canopen.h"

namespace knuckle::session {
namespace {

constexpr std::size_t kMostEvents = 1024, kMostWarnings = 256;

/// A latency less is no harm; memory taken in a step is.
void add_span(std::vector<Span>& spans, const Span& span) noexcept {
  if (spans.size() < spans.capacity()) spans.push_back(span);
}

/// After a SYNC the highest identifier comes last.
std::uint32_t last_pressure_id(const BusDescription& bus) {
  std::uint32_t last = 0;
  for (const BusFrame& frame : bus_frames(bus))
    if (bus.nodes[frame.node].role == NodeRole::kPressure) last = std::max(last, frame.id);
  for (const BroadcastFrame& frame : bus.broadcasts) {
    const auto is_pressure = [](const BroadcastField& field) { return field.info().role == NodeRole::kPressure; };
    if (std::any_of(frame.fields.begin(), frame.fields.end(), is_pressure)) last = frame.id;
  }
  return last;
}

}  // namespace

MasterLog::MasterLog(std::size_t rows, Duration origin) : far_origin(origin) {
  felt.reserve(rows);
  warnings.reserve(kMostWarnings);
}

void MasterLog::hand_over(SessionRecord& record) const {
  record.records_lost += lost;
  record.warnings = warnings;
}

void MasterLog::note(Time now, const master::MasterLoop& master) noexcept {
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

SlaveLog::SlaveLog(std::size_t rows, Duration origin) : far_origin(origin) {
  for (auto* spans : {&measured, &acted}) spans->reserve(rows);
}

void SlaveLog::note(Time now, const slave::SlaveLoop& slave) noexcept {
  add_span(measured, {now, now});
  const MasterMessage& message = slave.operator_input().message();
  if (message.stamp.sequence == heard) return;
  heard = message.stamp.sequence;
  master_to_slave.add(now - (message.stamp.sent_at - far_origin));
  if (slave.mode() == Mode::kEngaged) add_span(acted, {message.device_report_at - far_origin, now});
}

MachineLog::MachineLog(std::size_t most_frames) {
  frames.reserve(most_frames);
  events.reserve(kMostEvents);
}

void MachineLog::note(const sim::WorldEventRing& ring) noexcept {
  for (; events_read < ring.count; ++events_read) {
    const sim::WorldEvent& event = ring.at(events_read);
    if (event.kind == sim::WorldEventKind::kPieceBroke) ++breaks;
    keep(events, event, lost);
  }
}

void MachineLog::note(Time at, const CanFrame& frame) noexcept {
  keep(frames, {at, frame}, lost);
  for (std::size_t i = frames.size(); i > 1 && frames[i - 1].at < frames[i - 2].at; --i)
    std::swap(frames[i - 1], frames[i - 2]);
}

void MachineLog::hand_over(SessionRecord& record) const {
  record.records_lost += lost;
  for (const sim::WorldEvent& event : events) record.events.push_back({event.t_s, sim::name(event.kind)});
}

Histogram since_frame(const FrameLog& frames, std::uint32_t id, const std::vector<Span>& spans) {
  Histogram latency;
  auto next = frames.begin();
  Time last = kNever;
  for (const Span& span : spans) {
    for (; next != frames.end() && next->at <= span.from; ++next) {
      if (next->frame.id == id) last = next->at;
    }
    if (last != kNever) latency.add(span.to - last);
  }
  return latency;
}

Histogram until_frame(const FrameLog& frames, std::uint32_t id, const std::vector<Span>& spans) {
  Histogram latency;
  auto frame = frames.begin();
  Time taken = kNever;
  for (const Span& span : spans) {
    while (frame != frames.end() && (frame->at < span.to || frame->frame.id != id)) ++frame;
    if (frame == frames.end()) break;
    if (frame->at != taken) latency.add(frame->at - span.from);
    taken = frame->at;
  }
  return latency;
}

SessionLogs::SessionLogs(const SessionSetup& setup, double spare_s)
    : record(start_record(setup)),
      master(record.samples.capacity(), setup.starts().machine_end.origin),
      slave(record.samples.capacity(), setup.starts().operator_end.origin),
      machine(most_frames(setup.machine.bus, setup.scenario.duration_s + spare_s)) {}

SessionOutcome SessionLogs::hand_over(const MachineDescription& description, const sim::Operator& person, Time end,
                                      const std::function<Cause(Time)>& cause_of) {
  faults.judge(machine.frames, description, end, cause_of, record);
  machine.hand_over(record);
  master.hand_over(record);
  record.plan_finished = person.finished();
  record.phases_timed_out = person.timed_out() >= 0 || !person.finished() ? 1 : 0;
  SessionOutcome outcome;
  outcome.elapsed_s = to_seconds(end);
  // Of a cycle's frames the last: pressures and set-points.
  const std::uint32_t set_point_id = description.bus.set_point_id(kBucket);
  const std::uint32_t pressure_id = last_pressure_id(description.bus);
  const auto add = [&outcome](const char* name, const Histogram& latency) {
    outcome.hops.push_back({name, latency.count(), percentiles_us(latency)});
  };
  add("hand_to_master", master.hand_to_master);   // device report made -> taken by the master
  add("master_to_slave", slave.master_to_slave);  // datagram sent -> taken by the slave loop
  add("hand_to_valve", until_frame(machine.frames, set_point_id, slave.acted));
  add("pressure_to_slave", since_frame(machine.frames, pressure_id, slave.measured));
  add("slave_to_master", master.slave_to_master);  // datagram sent -> taken by the master
  add("pressure_to_hand", since_frame(machine.frames, pressure_id, master.felt));
  outcome.heard = slave.master_to_slave.count() > 0;
  outcome.record = std::move(record);
  outcome.frames = std::move(machine.frames);
  return outcome;
}

}  // namespace knuckle::session
