#include "recording/loop_tap.h"

#include <libdeflate.h>

#include <cstring>

namespace knuckle::recording {
namespace {

// Behind the message's header: time_ns, step, crc, lost, number of events.
constexpr std::size_t kTimeAt = 0, kStepAt = 8, kCrcAt = 12, kLostAt = 16, kCountAt = 20, kEventsAt = 24;

}  // namespace

void LoopTap::begin_wires() noexcept {
  const std::size_t room = kStepBytes - sizeof(StepHeader) - kStateBytes;
  CdrWriter& out = wires_.emplace(std::span<std::uint8_t>(room_).subspan(sizeof(StepHeader), room));
  out.put(std::int64_t{0});
  for (int i = 0; i < 4; ++i) out.put(std::uint32_t{0});
  count_ = lost_ = 0;
}

void LoopTap::add(WireEventKind kind, std::uint32_t value, std::span<const std::uint8_t> data) noexcept {
  if (!on()) return;
  if (!wires_) begin_wires();
  CdrWriter& out = *wires_;
  const std::size_t before = out.size();
  out.put(static_cast<std::uint8_t>(kind));
  out.put(value);
  out.put_bytes(data);
  if (out.ok()) {
    ++count_;
  } else {
    out.cut(before);
    ++lost_;
  }
}

std::size_t LoopTap::finish_wires(Time now) noexcept {
  if (!wires_) begin_wires();
  CdrWriter& out = *wires_;
  const auto events = out.written().subspan(kCdrHeader.size() + kEventsAt);
  out.patch(kTimeAt, static_cast<std::int64_t>(now.time_since_epoch().count()));
  out.patch(kStepAt, step_++);
  out.patch(kCrcAt, libdeflate_crc32(0, events.data(), events.size()));
  out.patch(kLostAt, lost_);
  out.patch(kCountAt, count_);
  const std::size_t size = out.size();
  wires_.reset();
  return size;
}

void LoopTap::push(Time now, std::size_t wires_size, std::size_t state_size, ReasonCode alarm) noexcept {
  StepHeader header;
  header.time_ns = now.time_since_epoch().count();
  header.wires_size = static_cast<std::uint32_t>(wires_size);
  header.state_size = static_cast<std::uint32_t>(state_size);
  header.alarm = alarm;
  std::memcpy(room_.data(), &header, sizeof header);
  ring_->push(std::span<std::uint8_t>(room_).first(sizeof header + wires_size + state_size));
}

}  // namespace knuckle::recording
