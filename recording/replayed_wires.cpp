#include "recording/replayed_wires.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "transport/link_header.h"

namespace knuckle::recording {
namespace {

enum Wire : std::size_t { kCanWire, kHidWire, kLinkWire };
constexpr std::array kWireNames{"CAN", "HID", "link"};

struct KindInfo {
  Wire wire;
  bool input;
};
constexpr std::array<KindInfo, static_cast<std::size_t>(WireEventKind::kCount)> kInfos{
    {{kCanWire, true},     // received
     {kCanWire, false},    // sent
     {kCanWire, false},    // refused
     {kCanWire, true},     // state
     {kCanWire, false},    // acknowledged
     {kHidWire, true},     // received
     {kHidWire, false},    // sent
     {kHidWire, false},    // refused
     {kHidWire, true},     // connected
     {kLinkWire, true},    // received
     {kLinkWire, false},   // sent
     {kLinkWire, false},   // refused
     {kLinkWire, true}}};  // not emptied

bool refused(WireEventKind kind) noexcept {
  return kind == WireEventKind::kCanRefused || kind == WireEventKind::kHidRefused ||
         kind == WireEventKind::kLinkRefused;
}
/// Sent or refused are one to whoever sends.
WireEventKind as_written(WireEventKind kind) noexcept {
  return refused(kind) ? static_cast<WireEventKind>(static_cast<int>(kind) - 1) : kind;
}

std::string bytes_text(std::span<const std::uint8_t> bytes) {
  if (bytes.size() > 8) return fmt::format("{} bytes", bytes.size());
  return fmt::format("{:02X}", fmt::join(bytes, " "));
}

std::string text_of(WireEventKind kind, std::uint32_t value, std::span<const std::uint8_t> data) {
  const std::string what = as_written(kind) == WireEventKind::kCanSent   ? fmt::format("frame {:#05x}", value)
                           : kind == WireEventKind::kCanAcknowledged     ? "acknowledgement"
                           : as_written(kind) == WireEventKind::kHidSent ? "report"
                                                                         : "datagram";
  return what + " (" + bytes_text(data) + ")";
}

}  // namespace

bool is_input(WireEventKind kind) noexcept {
  return kind < WireEventKind::kCount && kInfos[static_cast<std::size_t>(kind)].input;
}

void ReplayedWire::begin() noexcept {
  inputs_.clear();
  outputs_.clear();
  differences_.clear();
  read_ = written_ = 0;
}

const WireEvent* ReplayedWire::take(WireEventKind kind) noexcept {
  return read_ < inputs_.size() && inputs_[read_].kind == kind ? &inputs_[read_++] : nullptr;
}

std::uint32_t ReplayedWire::take_state(WireEventKind kind, std::uint32_t& state) noexcept {
  if (const WireEvent* said = take(kind)) state = said->value;
  return state;
}

bool ReplayedWire::write(WireEventKind sent, std::uint32_t value, std::span<const std::uint8_t> data) {
  if (written_ == outputs_.size()) {
    differences_.push_back("wrote " + text_of(sent, value, data) + ", which the recorded loop did not");
    return true;
  }
  const WireEvent& recorded = outputs_[written_++];
  const auto its_own = recorded.data.first(recorded.data.size() - recorded.made_up);
  if (recorded.made_up > 0 && data.size() == recorded.data.size()) data = data.first(its_own.size());
  const auto [mine, its] = std::mismatch(data.begin(), data.end(), its_own.begin(), its_own.end());
  if (as_written(recorded.kind) != sent || recorded.value != value || mine != data.end() || its != its_own.end()) {
    differences_.push_back(fmt::format("wrote {}, recorded is {}; they differ from byte {} on",
                                       text_of(sent, value, data),
                                       text_of(recorded.kind, recorded.value, recorded.data), mine - data.begin()));
  }
  return !refused(recorded.kind);
}

void ReplayedWire::end(std::vector<std::string>& differences) {
  for (std::string& difference : differences_) differences.push_back(std::move(difference));
  for (; written_ < outputs_.size(); ++written_) {
    const WireEvent& recorded = outputs_[written_];
    differences.push_back("did not write " + text_of(recorded.kind, recorded.value, recorded.data) +
                          ", which the recorded loop did");
  }
  if (read_ < inputs_.size())
    differences.push_back(fmt::format("left {} of {} inputs unread", inputs_.size() - read_, inputs_.size()));
}

void ReplayedWires::begin(const StepWires& wires) {
  for (ReplayedWire& wire : wires_) wire.begin();
  for (const WireEvent& event : wires.events) {
    if (event.kind >= WireEventKind::kCount) continue;
    const KindInfo& info = kInfos[static_cast<std::size_t>(event.kind)];
    const auto kind = info.wire == kLinkWire && !info.input ? link_kind(event.data) : std::nullopt;
    if (kind == LinkKind::kStatus || kind == LinkKind::kReadings) continue;
    if (info.input)
      wires_[info.wire].add_input(event);
    else
      wires_[info.wire].add_output(event);
  }
}

std::vector<std::string> ReplayedWires::end() {
  std::vector<std::string> all;
  for (std::size_t i = 0; i < wires_.size(); ++i) {
    std::vector<std::string> some;
    wires_[i].end(some);
    for (const std::string& one : some) all.push_back(std::string(kWireNames[i]) + ": " + one);
  }
  return all;
}

bool ReplayedWires::Can::send(const CanFrame& frame) noexcept {
  const auto size = std::min<std::size_t>(frame.size, frame.data.size());
  return wire_.write(WireEventKind::kCanSent, frame.id, std::span(frame.data).first(size));
}
bool ReplayedWires::Can::receive(CanFrame& frame) noexcept {
  const WireEvent* event = wire_.take(WireEventKind::kCanReceived);
  if (event == nullptr) return false;
  frame = can_frame(*event);
  return true;
}
CanState ReplayedWires::Can::state() const noexcept {
  return can_state(wire_.take_state(WireEventKind::kCanState, state_));
}
void ReplayedWires::Can::acknowledge() noexcept {
  (void)wire_.write(WireEventKind::kCanAcknowledged, 0, {});
}

bool ReplayedWires::Hid::write(const HidReport& report) noexcept {
  return wire_.write(WireEventKind::kHidSent, 0, report);
}
bool ReplayedWires::Hid::read(HidReport& report) noexcept {
  const WireEvent* event = wire_.take(WireEventKind::kHidReceived);
  if (event == nullptr) return false;
  report.fill(0);
  std::copy_n(event->data.begin(), std::min(event->data.size(), report.size()), report.begin());
  return true;
}
bool ReplayedWires::Hid::connected() const noexcept {
  return wire_.take_state(WireEventKind::kHidConnected, connected_) != 0;
}

bool ReplayedWires::LinkEnd::send(std::span<const std::uint8_t> bytes) noexcept {
  return wire_.write(WireEventKind::kLinkSent, 0, bytes);
}
bool ReplayedWires::LinkEnd::receive(Datagram& datagram) noexcept {
  const WireEvent* event = wire_.take(WireEventKind::kLinkReceived);
  if (event == nullptr) return false;
  datagram.size = static_cast<std::uint16_t>(std::min(event->data.size(), datagram.bytes.size()));
  datagram.waited = Duration(event->value);
  std::copy_n(event->data.begin(), datagram.size, datagram.bytes.begin());
  return true;
}
bool ReplayedWires::LinkEnd::emptied() const noexcept {
  return wire_.take_state(WireEventKind::kLinkNotEmptied, not_emptied_) == 0;
}

}  // namespace knuckle::recording
