#include "app/bringup/doctor_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "machine/load_broadcasts.h"
#include "machine/reason_text.h"
#include "machine/signal_units.h"
#include "machine/toml_reader.h"
#include "slave/bus_map.h"
#include "transport/j1939_packets.h"

namespace knuckle::bringup {
namespace {

using Level = Finding::Level;

class OwnFrames {
 public:
  OwnFrames(const BusSurvey& survey, const BusDescription& bus) : survey_(survey), bus_(bus) {}

  [[nodiscard]] Findings run() {
    // A module sends once it is started, and is told by who has started it.
    for (const BroadcastFrame& frame : bus_.broadcasts)
      if (frame.module == 0) judge_broadcast(frame);
    for (const CommandFrame& frame : bus_.commands)
      if (frame.module == 0) judge_command(frame);
    judge_address();
    return std::move(findings_);
  }

 private:
  void say(Level level, const std::string& about, const std::string& text) {
    findings_.push_back({level, about, text});
  }

  [[nodiscard]] std::vector<const HeardFrames*> heard_as(const CanFilter& filter) const {
    std::vector<const HeardFrames*> all;
    for (const auto& [id, frames] : survey_.heard)
      if (filter.lets(id)) all.push_back(&frames);
    return all;
  }
  /// Of a group all that sends it.
  [[nodiscard]] std::vector<const HeardFrames*> heard_as(const BroadcastFrame& frame) const {
    if (!frame.multiplexer) return heard_as(frame.filter());
    std::vector<const HeardFrames*> all;
    for (const auto& [key, frames] : survey_.multiplexed)
      if (key.second == frame.name) all.push_back(&frames);
    return all;
  }

  /// The sender whose values count: the one that the file gives, else the most frequent.
  const HeardFrames* sender_of(const BroadcastFrame& frame, const std::string& about) {
    const std::vector<const HeardFrames*> all = heard_as(frame);
    const HeardFrames* sender = nullptr;
    std::string others;
    for (const HeardFrames* one : all) {
      const bool is_it = !frame.source || j1939::source_of(one->newest.id) == *frame.source;
      if (is_it && (sender == nullptr || one->count > sender->count)) sender = one;
    }
    for (const HeardFrames* one : all)
      if (one != sender)
        others += fmt::format("{}0x{:02X}", others.empty() ? "" : ", ", j1939::source_of(one->newest.id));
    if (!others.empty())
      say(frame.source || frame.only_readings() ? Level::kNote : Level::kFault, about,
          "is also sent by " + others + ": take that device off" +
              (frame.source ? "" : ", or give the address of the right one as bus.broadcast.source"));
    return sender;
  }

  /// "boom_angle 0.320 rad, arm_angle not available"
  static std::string readings_in(const CanFrame& newest, const BroadcastFrame& frame) {
    std::string all;
    for (const BroadcastField& field : frame.fields) {
      const auto raw = read_raw(field.bits, newest);
      const bool is_value = raw && (!field.invalid_from || *raw < *field.invalid_from);
      const bool yes_or_no = is_yes_or_no(field.info());
      const double value = !is_value ? 0 : yes_or_no ? (*raw == field.on ? 1 : 0) : value_of(field.bits, *raw);
      all += fmt::format("{}{} {}", all.empty() ? "" : ", ", field.info().name,
                         is_value ? value_text(field.info(), value) : "not available");
    }
    return all;
  }

  /// What the machine should send by itself.
  void judge_broadcast(const BroadcastFrame& frame) {
    const std::string about = frame_text(frame, bus_);
    if (j1939::in_packets(frame.bytes))
      return say(Level::kNote, about,
                 fmt::format("comes in {} packets, which this check does not put together: knuckle slave tells what is "
                             "in them",
                             j1939::packets_of(frame.bytes)));
    const HeardFrames* const heard = sender_of(frame, about);
    if (heard == nullptr) {
      if (frame.on_request)
        say(Level::kNote, about, "comes only when it is asked for, which this check does not");
      else
        say(frame.only_readings() ? Level::kNote : Level::kFault, about,
            "not received: check that the machine's controller is on and that the identifier is right");
      return;
    }
    const double seen_ms = 1e3 * survey_.listened_s / static_cast<double>(heard->count);
    const bool is_short = heard->newest.size < frame.bytes;
    const bool only_optional = !leads(frame);
    // What moves nothing may come as often as the file says, and a little later.
    constexpr double kLate = 1.5;
    const double most_ms = 1e3 * (only_optional ? kLate * frame.period_s : bus_.sensor_age_limit_s / 2);
    const bool late = seen_ms > most_ms && !frame.only_readings();
    const std::string every = fmt::format("comes every {:.1f} ms, with {} bytes", seen_ms, heard->newest.size);
    say(is_short || late ? Level::kFault : Level::kOk, about,
        is_short ? every + fmt::format("; the file has {}: bus.broadcast.bytes", frame.bytes)
        : late   ? every + fmt::format("; must be at most {} ms, {}", number_text(most_ms),
                                     only_optional ? "one and a half of period_ms" : "half of bus.sensor_age_limit_ms")
                 : every + ": " + readings_in(heard->newest, frame));
  }

  /// What nobody but Knuckle may send.
  void judge_command(const CommandFrame& frame) {
    for (const HeardFrames* heard : heard_as(frame.filter()))
      say(Level::kNote, fmt::format("{} ({})", frame.name, id_text(heard->newest.id)),
          fmt::format("comes {:.0f} times a second: another sender tells the machine what to do",
                      static_cast<double>(heard->count) / survey_.listened_s));
  }

  /// Whoever sends from the address that Knuckle will claim.
  void judge_address() {
    const auto& address = bus_.j1939_address;
    const auto sends = [&](const auto& entry) {
      return (entry.first & kExtendedId) != 0 && j1939::source_of(entry.first) == address;
    };
    const auto user = std::find_if(survey_.heard.begin(), survey_.heard.end(), sends);
    if (!address || user == survey_.heard.end()) return;
    say(Level::kNote, fmt::format("J1939 address 0x{:02X}", *address),
        fmt::format(
            "is used: {} comes from it; where that is not knuckle slave, give bus.j1939_address one that nobody "
            "has",
            id_text(user->first)));
  }

  const BusSurvey& survey_;
  const BusDescription& bus_;
  Findings findings_;
};

}  // namespace

bool of_own_controller(std::uint32_t id, const BusDescription& bus) {
  const auto has = [id](const auto& frames) {
    return std::any_of(frames.begin(), frames.end(), [id](const auto& frame) { return frame.filter().lets(id); });
  };
  return has(bus.broadcasts) || has(bus.commands) || slave::hears(slave::packet_filters(bus), id);
}

Findings own_frame_findings(const BusSurvey& survey, const BusDescription& bus) {
  return OwnFrames(survey, bus).run();
}

}  // namespace knuckle::bringup
