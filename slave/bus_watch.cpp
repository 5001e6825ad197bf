#include "slave/bus_watch.h"

#include <algorithm>

#include "slave/bus_map.h"
#include "transport/canopen.h"

namespace knuckle::slave {
namespace {

/// Whether a request to an SDO server leaves its objects as they are; what is not known may change them.
bool only_reads(const CanFrame& frame) noexcept {
  // Upload, its segments, abort, block upload (CiA 301).
  const unsigned command = frame.size == 0 ? 0 : frame.data[0] >> 5;
  return command >= 2 && command <= 5;
}

Reason heard(ReasonCode code, std::uint8_t node, const CanFrame& frame) noexcept {
  return {code, node, static_cast<float>(frame.id), 0};
}

}  // namespace

BusWatch::BusWatch(const BusDescription& bus) {
  const std::vector<BusFrame> frames = bus_frames(bus);
  for (std::size_t n = 0; n < bus.nodes.size(); ++n) {
    const std::uint8_t node = bus.nodes[n].id;
    for (const BusFrame& frame : frames) {
      if (frame.node != n) continue;
      if (frame.to_node)
        add(frame.id, Kind::kSetPoint, node);
      else
        add_stream(frame.id, stream_of(frame, node, bus));
    }
    for (const BroadcastFrame& inputs : bus.broadcasts)
      if (inputs.module == node)
        add_stream(inputs.id, stream_of({.every_nth_sync = 1, .fields = {}, .mapped = {}}, node, bus));
    add_stream(canopen::heartbeat_id(node), {.node = node, .heartbeat = true, .per_s = 1 / bus.node_heartbeat_s});
    add(canopen::sdo_request_id(node), Kind::kRequest, node);
  }
  for (const std::uint32_t id : controllers_own(bus)) add(id, Kind::kController, 0);
  for (const CommandFrame& frame : bus.commands) commands_.push_back(frame.filter());
}

BusWatch::Stream BusWatch::stream_of(const BusFrame& frame, std::uint8_t node, const BusDescription& bus) {
  Stream stream{.node = node};
  if (frame.every_nth_sync > 0) {
    stream.per_sync = 1.0 / frame.every_nth_sync;
  } else {
    stream.per_s = 1 / frame.repeat_s;
    stream.most_over = kMostOverWithEvents;
    stream.by_change = true;
  }
  const double per_s = stream.per_sync * bus.sync_Hz + stream.per_s;
  stream.most_over = std::max(stream.most_over, 2 * bus.sensor_age_limit_s * per_s);
  return stream;
}

void BusWatch::add_stream(std::uint32_t id, const Stream& stream) {
  add(id, Kind::kCounted, static_cast<std::uint8_t>(streams_.size()));
  streams_.push_back(stream);
}

void BusWatch::receive(const CanFrame& frame, Time now) noexcept {
  if (hears(commands_, frame.id)) return controller_.hear(heard(ReasonCode::kOtherController, 0, frame), now);
  if (frame.id > kMostId) return;  // none of a node's
  const Identifier identifier = identifiers_[frame.id & 0x7FFU];
  switch (identifier.kind) {
    case Kind::kNone:
      return;
    case Kind::kController:
      if (frame.id == canopen::kSyncId) synced();  // the nodes answer to it
      return controller_.hear(heard(ReasonCode::kOtherController, 0, frame), now);
    case Kind::kSetPoint:
      return sender_.hear(heard(ReasonCode::kForeignSender, identifier.which, frame), now);
    case Kind::kRequest:
      return on_request(frame, identifier.which, now);
    case Kind::kCounted:
      break;
  }
  Stream& stream = streams_[identifier.which];
  // A node that starts anew says so out of turn.
  const bool boots = stream.heartbeat && canopen::parse_heartbeat(frame) == canopen::NmtState::kBootUp;
  const bool changed = stream.by_change && frame != stream.newest;
  stream.newest = frame;
  if (counting_ && !boots && !changed) ++stream.frames;
}

void BusWatch::on_request(const CanFrame& frame, std::uint8_t node, Time now) noexcept {
  if (!only_reads(frame)) return sender_.hear(heard(ReasonCode::kForeignSender, node, frame), now);
  ++reads_;
  last_read_ = node;
}

void BusWatch::Foreign::hear(const Reason& why, Time now) noexcept {
  if (now - at > kStands) reason = why;
  at = now;
}

void BusWatch::became_due(Stream& stream, double frames) noexcept {
  stream.due += frames;
  if (stream.over() < 0) stream.frames = stream.due = 0;
}

void BusWatch::synced() noexcept {
  for (Stream& stream : streams_) became_due(stream, stream.per_sync);
}

void BusWatch::step(Time now) noexcept {
  const double passed_s = stepped_at_ == kNever ? 0 : to_seconds(now - stepped_at_);
  stepped_at_ = now;
  for (Stream& stream : streams_) became_due(stream, stream.per_s * passed_s);
}

void BusWatch::count_frames(bool on) noexcept {
  if (on == counting_) return;
  counting_ = on;
  for (Stream& stream : streams_) stream.frames = stream.due = 0;
}

void BusWatch::restart() noexcept {
  count_frames(false);
  signs_ = {};
}

Reason BusWatch::foreign(Time now) const noexcept {
  for (const Foreign* one : {&controller_, &sender_}) {
    if (now - one->at <= kStands) return one->reason;
  }
  return {};
}

Reason BusWatch::twice() const noexcept {
  for (std::size_t i = 0, end = 0; i < streams_.size(); i = end) {
    const std::uint8_t node = streams_[i].node;
    // What holds up one frame of a node's data holds up all: they are one sign together.
    int of_data = 0, of_heartbeat = 0;
    const Stream* worst = nullptr;
    for (end = i; end < streams_.size() && streams_[end].node == node; ++end) {
      const Stream& stream = streams_[end];
      const double over = stream.over();
      if (over <= stream.most_over / 2) continue;
      int& signs = stream.heartbeat ? of_heartbeat : of_data;
      signs = std::max(signs, over > stream.most_over ? 2 : 1);
      if (worst == nullptr || over > worst->over()) worst = &stream;
    }
    if (signs_[node] + of_data + of_heartbeat < 2) continue;
    if (worst == nullptr) return {ReasonCode::kNodeIdTwice, node, 2, 1};
    return {ReasonCode::kNodeIdTwice, node, worst->frames, worst->due};
  }
  return {};
}

}  // namespace knuckle::slave
