#include "transport/machine_status.h"

#include <algorithm>

#include "transport/link_codec.h"

namespace knuckle {
namespace {

using link_codec::put;
using link_codec::put_each;

constexpr std::size_t kSize = kLinkHeaderSize + link_codec::kStampSize + 2 * 3 * 8 + 1 + 2 * 8 + 2 * 3 * 8 + 8 + 2 * 8 +
                              1 + 8 + 4 + 2 * 8 + 1 + MachineName::kSize;
// No honest number comes near these.
constexpr double kMostOpening = 1e3;  // of spool stroke, as a valve may report it
constexpr double kMostFlow_m3ps = 1e3, kMostPower_W = 1e12, kMostLoad = 10;
constexpr std::uint8_t kMostPriority = 99;
constexpr std::uint8_t kPilotOn = 1, kSimulated = 2, kCalibrated = 4, kAllFlags = 7;

void put(ByteWriter& out, const MachineStatus::Timing& timing) noexcept {
  put(out, timing.p50);
  put(out, timing.p99);
  put(out, timing.max);
}

MachineStatus::Timing timing(link_codec::BoundedReader& bounded) noexcept {
  MachineStatus::Timing timing;
  timing.p50 = bounded.span();
  timing.p99 = bounded.span();
  timing.max = bounded.span();
  return timing;
}

bool printable(char c) noexcept {
  return c >= ' ' && c <= '~';
}

void put(ByteWriter& out, const MachineName& name) noexcept {
  const std::string_view text = name.text();
  for (std::size_t i = 0; i < MachineName::kSize; ++i)
    out.put(static_cast<std::uint8_t>(i < text.size() ? text[i] : '\0'));
}

/// nullopt where it is not as put() writes it.
std::optional<MachineName> machine_name(ByteReader& in) noexcept {
  std::array<char, MachineName::kSize> told{};
  for (char& c : told) c = static_cast<char>(in.get<std::uint8_t>());
  const auto end = std::find(told.begin(), told.end(), '\0');
  const bool honest = end != told.end() && std::all_of(told.begin(), end, printable) &&
                      std::all_of(end, told.end(), [](char c) { return c == '\0'; });
  if (!honest) return std::nullopt;
  return MachineName(std::string_view(told.data(), static_cast<std::size_t>(end - told.begin())));
}

}  // namespace

MachineName::MachineName(std::string_view name) noexcept {
  const std::size_t size = std::min(name.size(), kSize - 1);
  std::replace_copy_if(
      name.begin(), name.begin() + static_cast<std::ptrdiff_t>(size), bytes_.begin(),
      [](char c) { return !printable(c); }, '?');
}

std::string_view MachineName::text() const noexcept {
  return {bytes_.data(), static_cast<std::size_t>(std::find(bytes_.begin(), bytes_.end() - 1, '\0') - bytes_.begin())};
}

Datagram encode(const MachineStatus& status) noexcept {
  Datagram datagram;
  ByteWriter out = link_codec::begin(datagram, LinkKind::kStatus, kSize);
  put(out, status.stamp);
  put_each(out, status.valve_command, kMostOpening);
  put_each(out, status.spool, kMostOpening);
  out.put(static_cast<std::uint8_t>((status.pilot_on ? kPilotOn : 0) | (status.simulated ? kSimulated : 0) |
                                    (status.calibrated ? kCalibrated : 0)));
  out.put(std::clamp(status.oil_flow_m3ps, 0.0, kMostFlow_m3ps));
  out.put(std::clamp(status.hydraulic_power_W, 0.0, kMostPower_W));
  put(out, status.wake_lateness);
  put(out, status.execution);
  put(out, status.period);
  out.put(status.steps);
  out.put(status.overruns);
  out.put(status.fifo_priority);
  out.put(std::clamp(status.bus_load, 0.0, kMostLoad));
  out.put(status.can_errors);
  put(out, status.acted_report_at);
  put(out, status.acted_ago);
  out.put(status.force_doubts);
  put(out, status.machine);
  return datagram;
}

std::optional<MachineStatus> decode_status(std::span<const std::uint8_t> bytes) noexcept {
  auto in = link_codec::open(bytes, LinkKind::kStatus, kSize);
  if (!in) return std::nullopt;
  link_codec::BoundedReader bounded(*in);
  MachineStatus status;
  status.stamp = bounded.stamp();
  bounded.each(status.valve_command, kMostOpening);
  bounded.each(status.spool, kMostOpening);
  const auto flags = in->get<std::uint8_t>();
  status.pilot_on = (flags & kPilotOn) != 0;
  status.simulated = (flags & kSimulated) != 0;
  status.calibrated = (flags & kCalibrated) != 0;
  status.oil_flow_m3ps = bounded.number(0, kMostFlow_m3ps);
  status.hydraulic_power_W = bounded.number(0, kMostPower_W);
  status.wake_lateness = timing(bounded);
  status.execution = timing(bounded);
  status.period = bounded.span();
  status.steps = in->get<std::uint64_t>();
  status.overruns = in->get<std::uint64_t>();
  status.fifo_priority = in->get<std::uint8_t>();
  status.bus_load = bounded.number(0, kMostLoad);
  status.can_errors = in->get<std::uint32_t>();
  status.acted_report_at = bounded.time();
  status.acted_ago = bounded.span();
  status.force_doubts = in->get<std::uint8_t>();
  const auto machine = machine_name(*in);
  if (flags > kAllFlags || status.fifo_priority > kMostPriority || !machine || !bounded.ok()) return std::nullopt;
  status.machine = *machine;
  return status;
}

}  // namespace knuckle
