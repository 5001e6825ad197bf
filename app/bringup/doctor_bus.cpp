#include "app/bringup/doctor_bus.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "app/bringup/doctor_frames.h"
#include "machine/bus_budget.h"
#include "machine/bus_frames.h"
#include "machine/device_profile.h"
#include "machine/reason_text.h"
#include "machine/toml_reader.h"
#include "slave/emergency_log.h"
#include "slave/node_setup.h"

namespace knuckle::bringup {
namespace {

using canopen::Object;
using Level = Finding::Level;
using slave::NodeScript;
using slave::SdoStep;

constexpr std::array kIdentity{canopen::kDeviceType, canopen::kVendorId, canopen::kProductCode, canopen::kSerialNumber};
constexpr Object kErrorCount{0x1003, 0}, kNewestError{0x1003, 1};

std::string profile(std::uint32_t device_type) {
  const unsigned number = profile_number(device_type);
  const auto known = std::find_if(kDeviceProfiles.begin(), kDeviceProfiles.end(),
                                  [&](const DeviceProfile& one) { return one.number == number; });
  const std::string name = fmt::format("CiA {}", number);
  return known == kDeviceProfiles.end() ? name : name + ", " + known->devices;
}

std::string error_bits(std::uint32_t error_register) {
  constexpr std::array kBits{"generic",       "current", "voltage",  "temperature",
                             "communication", "profile", "reserved", "manufacturer"};
  std::string text;
  for (std::size_t i = 0; i < kBits.size(); ++i) {
    if ((error_register >> i & 1U) != 0) text += (text.empty() ? "" : ", ") + std::string(kBits[i]);
  }
  return text;
}

std::string emergency_text(std::uint32_t code) {
  return fmt::format("0x{:04X} {}", code, canopen::emergency_text(static_cast<std::uint16_t>(code)));
}

std::string state_text(const SurveyedNode& node) {
  if (!node.state) return node.answers() ? "no heartbeat" : "silent";
  switch (*node.state) {
    case canopen::NmtState::kBootUp:
      return "booting";
    case canopen::NmtState::kStopped:
      return "stopped";
    case canopen::NmtState::kOperational:
      return "operational";
    case canopen::NmtState::kPreOperational:
      return "pre-operational";
  }
  return "?";
}

/// What stops the node where its controller falls silent, as it is set now.
std::string guard_text(const SurveyedNode& node, const NodeScript& expected) {
  std::string text;
  bool any = false;
  for (const slave::SetupPart& part : expected.script) {
    if (part.kind != slave::SetupPart::Kind::kGuard) continue;
    any = true;
    // Of several axes that with the longest time, and none where one has none.
    std::uint32_t value = 0;
    bool all = true;
    for (const SdoStep& step : part.asked) {
      const std::uint32_t one = node.value(step.object).value_or(0);
      all = all && (one & 0xFFFFU) != 0;
      value = std::max(value, one);
    }
    if (!all) continue;
    const std::uint32_t ms = value & 0xFFFFU;
    text += text.empty() ? "" : ", ";
    text += part.asked[0].object == canopen::kConsumerHeartbeat
                ? fmt::format("{} ms without heartbeat of 0x{:02X}", ms, value >> 16)
                : fmt::format("{} ms without set-points", ms);
  }
  if (!any) return "";
  return text.empty() ? "has no guard until start-up sets it" : "stops after " + text;
}

class Doctor {
 public:
  Doctor(const BusSurvey& survey, const MachineDescription* machine) : survey_(survey), machine_(machine) {
    result_.bus = survey.name;
    result_.load = survey.load;
    result_.listened_s = survey.listened_s;
    if (machine != nullptr) {
      scripts_ = slave::node_scripts(*machine);
      frames_ = bus_frames(machine->bus);
      result_.expected_load = worst_bus_load(machine->bus);
    }
  }

  [[nodiscard]] BusDiagnosis run() {
    judge_bus();
    for (const NodeScript& expected : scripts_) judge_expected(expected);
    for (const auto& [id, node] : survey_.nodes) {
      if (!expects(id)) judge_stranger(node);
    }
    if (machine_ == nullptr) return std::move(result_);
    for (Finding& one : own_frame_findings(survey_, machine_->bus)) result_.findings.push_back(std::move(one));
    judge_frames();
    return std::move(result_);
  }

 private:
  void say(Level level, const std::string& about, const std::string& text) {
    result_.findings.push_back({level, about, text});
  }
  [[nodiscard]] bool expects(std::uint8_t id) const {
    return std::any_of(scripts_.begin(), scripts_.end(), [id](const NodeScript& s) { return s.node.id == id; });
  }
  [[nodiscard]] bool bus_silent() const {
    return survey_.heard.empty() && survey_.without_id == 0 &&
           std::none_of(survey_.nodes.begin(), survey_.nodes.end(),
                        [](const auto& entry) { return entry.second.answers(); });
  }

  void judge_bus() {
    const std::string& name = survey_.name;
    switch (survey_.state) {
      case CanState::kActive:
        break;
      case CanState::kPassive:
        say(Level::kFault, name,
            "the CAN controller is error passive (no node acknowledges its frames, or frames are damaged): check bit "
            "rate, "
            "termination (120 ohm at both ends) and cable");
        break;
      case CanState::kBusOff:
        say(Level::kFault, name,
            "the CAN controller is bus off: check bit rate and wiring (CAN-H and CAN-L exchanged, short circuit), then "
            "set the interface down and up again");
        break;
      case CanState::kDown:
        say(Level::kFault, name, "the interface is down: set it up (ip link set " + name + " up type can bitrate ...)");
        break;
    }
    if (survey_.others_ask) {
      say(Level::kFault, name, "another program uses SDO: stop it, then run this check again; no SDO request was sent");
    }
    if (survey_.sync)
      say(Level::kNote, name, "SYNC is received: a controller is active on this bus; the nodes were read meanwhile");
    if (bus_silent() && !survey_.others_ask) {
      say(Level::kFault, name, "no frame received, no node answers: check the nodes' power, the plug and the bit rate");
    }
    if (survey_.without_id > 0) {
      say(Level::kNote, name,
          "a device without a node id is on the bus, perhaps several: knuckle bus assign-id gives it one");
    }
    const std::string load = fmt::format("{:.1f} % load over {:.1f} s", 100 * survey_.load, survey_.listened_s);
    say(survey_.load > kFullestBus ? Level::kFault : Level::kOk, name,
        survey_.load > kFullestBus
            ? load + fmt::format(", limit {:.0f} %: find the node that sends too much", 100 * kFullestBus)
            : load);
    if (machine_ != nullptr) judge_budget();
  }

  [[nodiscard]] bool of_machine(std::uint32_t id) const {
    if (of_own_controller(id, machine_->bus)) return true;
    if (id > kMostId) return false;
    const std::uint8_t node = canopen::node_of(id);
    const std::uint32_t function = canopen::function_of(id);
    if (id == canopen::kNmtId || id == canopen::kSyncId) return true;
    if (function == canopen::emcy_id(0) || function >= canopen::sdo_response_id(0))
      return expects(node) || node == machine_->bus.controller_id;
    return std::any_of(frames_.begin(), frames_.end(), [id](const BusFrame& frame) { return frame.id == id; });
  }

  /// Whether there is room for all that the machine's nodes will send beside what others do.
  void judge_budget() {
    std::uint64_t bits = 0;
    for (const auto& [id, frames] : survey_.heard) bits += of_machine(id) ? 0 : frames.bits;
    const double others_bits_per_s =
        std::max(static_cast<double>(bits) / survey_.listened_s, machine_->bus.foreign_load * machine_->bus.bit_rate);
    const double others = others_bits_per_s / machine_->bus.bit_rate, own = *result_.expected_load;
    if (bits == 0 || own + others <= kFullestBus) return;
    const std::string fits = what_fits(machine_->bus, machine_->sensors, others_bits_per_s);
    say(Level::kNote, survey_.name,
        fmt::format("{:.1f} % are frames that the machine file does not have; with those that it has it can become "
                    "{:.1f} %, limit {:.0f} %",
                    100 * others, 100 * (own + others), 100 * kFullestBus) +
            (fits.empty() ? "" : "; " + fits));
  }

  NodeLine line_of(const SurveyedNode& node, const std::string& name) {
    NodeLine line;
    line.id = node.id;
    line.name = name;
    line.state = state_text(node);
    line.device_type = node.value(canopen::kDeviceType);
    line.vendor = node.value(canopen::kVendorId);
    line.product = node.value(canopen::kProductCode);
    line.serial = node.value(canopen::kSerialNumber);
    line.error_register = node.value(canopen::kErrorRegister);
    if (node.emergency) {
      line.emergency = node.emergency->code;
    } else if (node.value(kErrorCount).value_or(0) > 0) {
      if (const auto newest = node.value(kNewestError)) line.emergency = static_cast<std::uint16_t>(*newest & 0xFFFFU);
    }
    return line;
  }

  void judge_expected(const NodeScript& expected) {
    const auto found = survey_.nodes.find(expected.node.id);
    SurveyedNode node;
    node.id = expected.node.id;
    if (found != survey_.nodes.end()) node = found->second;
    const std::string about = fmt::format("node 0x{:02X} ", node.id) + expected.node.name;
    NodeLine line = line_of(node, expected.node.name);
    const std::size_t before = result_.findings.size();
    if (!node.answers()) {
      silent(node, about);
    } else if (twice(node, expected.node, about)) {
      // Whatever it reads, either of the two may have said it.
    } else if (identity(node, expected, about)) {
      settings(node, expected, about, line);
      heartbeat(node, about, line);
      line.guard = guard_text(node, expected);
      if (const std::string lacks = missing_status_text(expected.node, *machine_); !lacks.empty())
        say(Level::kNote, about, lacks);
      const NodeReading reading = reading_of(node, expected.node, *machine_);
      line.reading = reading.text;
      if (!reading.complaint.empty()) say(reading.fault ? Level::kFault : Level::kNote, about, reading.complaint);
    }
    errors(node, about);
    result_.nodes.push_back(line);
    const bool complained =
        std::any_of(result_.findings.begin() + static_cast<std::ptrdiff_t>(before), result_.findings.end(),
                    [](const Finding& one) { return one.level != Level::kOk; });
    if (!complained && node.answers()) say(Level::kOk, about, "as the machine file requires");
  }

  void silent(const SurveyedNode& node, const std::string& about) {
    if (survey_.others_ask || bus_silent()) return;  // reported once for the whole bus
    if (node.state == canopen::NmtState::kStopped) {
      say(Level::kFault, about,
          "is in NMT state stopped, where it answers no SDO request: switch its power off and on");
    } else if (node.state) {
      say(Level::kFault, about,
          "sends its heartbeat, but answers no SDO request: check that no other program uses its SDO channel");
    } else {
      say(Level::kFault, about,
          "does not answer SDO requests: check its power, its plug, its node id and its bit rate");
    }
  }

  /// @return whether two devices have this node id.
  bool twice(const SurveyedNode& node, const NodeDescription& expected, const std::string& about) {
    const auto found = second_device(survey_, *machine_, node, expected, about);
    if (found) result_.findings.push_back(*found);
    return found && found->level == Level::kFault;
  }

  /// @return whether it is the device that the file names.
  bool identity(const SurveyedNode& node, const NodeScript& expected, const std::string& about) {
    const auto type = node.value(canopen::kDeviceType);
    if (type && *type != expected.node.device_type) {
      const bool other_profile = (*type & 0xFFFFU) != (expected.node.device_type & 0xFFFFU);
      say(Level::kFault, about,
          fmt::format("device type 0x{:08X} (", *type) + profile(*type) +
              fmt::format("), the machine file requires 0x{:08X} (", expected.node.device_type) +
              profile(expected.node.device_type) + "): " +
              (other_profile ? "two node ids may be exchanged"
                             : "correct the machine file if this device is the intended one"));
      return false;
    }
    const auto same = [&](Object object, const char* what, std::uint32_t wanted) {
      const auto value = node.value(object);
      if (value == wanted) return true;
      const std::string is = value ? fmt::format("{} 0x{:08X}", what, *value) : fmt::format("{} cannot be read", what);
      say(Level::kFault, about,
          is + fmt::format(
                   ", the machine file requires 0x{:08X}: another device; correct the machine file if this one is "
                   "intended",
                   wanted));
      return false;
    };
    return same(canopen::kDeviceType, "device type", expected.node.device_type) &&
           same(canopen::kVendorId, "vendor", expected.node.vendor) &&
           same(canopen::kProductCode, "product", expected.node.product);
  }

  /// Objects that start-up asks must exist, and where it writes nothing have their value. Of guards one is enough.
  void settings(const SurveyedNode& node, const NodeScript& expected, const std::string& about, NodeLine& line) {
    int as_file = 0, all = 0, guards = 0, guards_there = 0;
    for (const slave::SetupPart& part : expected.script) {
      using Kind = slave::SetupPart::Kind;
      // A timer counts only where start-up finds that the transmission type cannot be changed.
      if (part.kind == Kind::kIdentity || part.kind == Kind::kProof || part.kind == Kind::kTimer) continue;
      bool all_there = true;
      for (const SdoStep& step : part.asked) {
        const ObjectRead* read = node.read(step.object);
        const bool there = read != nullptr && read->answer == ObjectRead::Answer::kValue;
        all_there = all_there && there;
        if ((part.kind == Kind::kGuard || part.kind == Kind::kOptional) && !there) continue;
        if (!there || (part.kind == Kind::kRequire && !step.holds(read->value))) {
          say(Level::kFault, about, wrong_setting(step, read));
        }
        if (part.kind == Kind::kRequire) continue;
        ++all;
        if (there && step.holds(read->value)) ++as_file;
      }
      if (part.kind != Kind::kGuard) continue;
      ++guards;
      guards_there += all_there ? 1 : 0;
    }
    if (guards > 0 && guards_there == 0) {
      say(Level::kFault, about,
          "has no guard that start-up knows (0x1400:05, 0x1016:01): without its controller it would not stop");
    }
    line.settings = all;
    line.settings_as_file = as_file;
  }

  /// Its period as measured, against what the node says of it and what the file wants.
  void heartbeat(const SurveyedNode& node, const std::string& about, NodeLine& line) {
    constexpr double kTolerance = 0.1;
    const auto differs = [](double is, double wanted) { return std::abs(is - wanted) > kTolerance * wanted; };
    const double wanted_ms = 1e3 * machine_->bus.node_heartbeat_s;
    const double limit_ms = 1e3 * machine_->bus.node_heartbeat_timeout_s;
    const double set_ms = node.value(canopen::kProducerHeartbeat).value_or(0);
    const auto heard = survey_.heard.find(canopen::heartbeat_id(node.id));
    const std::uint64_t count = heard == survey_.heard.end() ? 0 : heard->second.count;
    if (node.booted) return;  // its heartbeat began meanwhile
    if (count < 2) {
      if (set_ms > 0 && 1e3 * survey_.listened_s >= 3 * set_ms) {
        say(Level::kFault, about,
            fmt::format("0x1017:00 says a heartbeat every {:.0f} ms, heard {} in {:.1f} s: see the device's manual",
                        set_ms, count == 0 ? "none" : "one", survey_.listened_s));
      }
      return;
    }
    if (const auto period_s = heard->second.period_s()) line.heartbeat_ms = 1e3 * *period_s;
    if (!line.heartbeat_ms || !differs(*line.heartbeat_ms, wanted_ms)) return;
    const std::string measured = fmt::format("sends its heartbeat every {:.0f} ms", *line.heartbeat_ms);
    const std::string wanted = fmt::format("node_heartbeat_ms = {:.0f} of the machine file", wanted_ms);
    if (differs(set_ms, wanted_ms)) {
      say(Level::kNote, about, measured + fmt::format(" (0x1017:00 is {:.0f}); start-up sets it to ", set_ms) + wanted);
    } else if (*line.heartbeat_ms < limit_ms) {
      say(Level::kNote, about, measured + ", though 0x1017:00 is as " + wanted);
    } else {
      say(Level::kFault, about,
          measured + ", though 0x1017:00 is as " + wanted +
              fmt::format(": after {:.0f} ms (node_heartbeat_timeout_ms) it counts as silent; see its manual",
                          limit_ms));
    }
  }

  /// @param read null where it was not asked.
  static std::string wrong_setting(const SdoStep& step, const ObjectRead* read) {
    const std::string object = fmt::format("0x{:04X}:{:02X} ", step.object.index, step.object.subindex);
    if (read != nullptr && read->answer == ObjectRead::Answer::kValue) {
      return object + fmt::format(
                          "is 0x{:X}, the machine file requires 0x{:X}: set it with the manufacturer's tool, or "
                          "correct the machine file",
                          read->value, step.value);
    }
    const bool refused = read != nullptr && read->answer == ObjectRead::Answer::kAborted;
    return object + "cannot be read (" + (refused ? canopen::abort_text(read->abort) : "no answer") +
           "), but start-up asks it";
  }

  void errors(const SurveyedNode& node, const std::string& about) {
    if (node.emergency && node.emergency->code != canopen::kEmcyReset) {
      say(Level::kFault, about,
          "reports the emergency " + emergency_text(node.emergency->code) +
              fmt::format(" ({} received): see the device's manual", node.emergencies));
    }
    const std::uint32_t bits = node.value(canopen::kErrorRegister).value_or(0);
    if (bits == 0) return;
    std::string history;
    if (node.value(kErrorCount).value_or(0) > 0) {
      if (const auto newest = node.value(kNewestError)) history = ", newest " + emergency_text(*newest & 0xFFFFU);
    }
    say(Level::kFault, about,
        fmt::format("error register 0x{:02X} (", bits) + error_bits(bits) + ")" + history +
            ": find the cause with the device's manual, then switch its power off and on");
  }

  /// One that leads the machine meanwhile, which is no fault, or more than that.
  void controller(const SurveyedNode& node, const std::string& about) {
    if (node.answers()) say(Level::kFault, about, "a device has the controller's own node id: give it another id");
    if (const auto found = second_controller(survey_, *machine_, about)) result_.findings.push_back(*found);
  }

  void judge_stranger(const SurveyedNode& node) {
    const std::string about = fmt::format("node 0x{:02X}", node.id);
    const NodeLine line = line_of(node, "-");
    result_.nodes.push_back(line);
    if (machine_ != nullptr && node.id == machine_->bus.controller_id) {
      controller(node, about);
    } else if (machine_ != nullptr) {
      say(Level::kNote, about,
          "is not in the machine file" +
              (line.device_type ? " (" + profile(*line.device_type) +
                                      fmt::format(", vendor 0x{:08X}, product 0x{:08X}{})", line.vendor.value_or(0),
                                                  line.product.value_or(0),
                                                  line.serial ? fmt::format(", serial {}", *line.serial) : "")
                                : std::string()) +
              possible_node(node));
    }
    errors(node, about);
  }

  /// Missing nodes of the same type and product: most likely its id is wrong.
  [[nodiscard]] std::string possible_node(const SurveyedNode& node) const {
    std::string names;
    for (const NodeScript& expected : scripts_) {
      const auto there = survey_.nodes.find(expected.node.id);
      const bool missing = there == survey_.nodes.end() || !there->second.answers();
      if (missing && node.value(canopen::kDeviceType) == expected.node.device_type &&
          node.value(canopen::kProductCode) == expected.node.product) {
        names += (names.empty() ? "" : ", or ") +
                 fmt::format("{}, expected with node id 0x{:02X}", expected.node.name, expected.node.id);
      }
    }
    if (names.empty()) return "";
    return ": possibly " + names + fmt::format("; knuckle bus assign-id --from 0x{:02X} gives it that id", node.id);
  }

  /// Identifiers that no node of the file sends.
  void judge_frames() {
    std::set<std::uint32_t> known{canopen::kNmtId, canopen::kSyncId, 0x100};
    for (const BusFrame& frame : frames_) known.insert(frame.id);
    for (const auto& [id, frames] : survey_.heard) {
      const std::uint32_t function = canopen::function_of(id);
      const bool service = id <= kMostId && (function == 0x080 || function >= 0x580);
      if (known.contains(id) || service || of_own_controller(id, machine_->bus)) continue;
      const unsigned node = id <= kMostId ? canopen::node_of(id) : 0;
      say(Level::kNote, "frames " + id_text(id),
          fmt::format("{:.0f} frames/s that no node of the machine file sends",
                      static_cast<double>(frames.count) / survey_.listened_s) +
              (expects(static_cast<std::uint8_t>(node))
                   ? fmt::format(
                         ": possibly an additional PDO of node 0x{:02X}; disable it with the manufacturer's tool", node)
                   : std::string()));
    }
  }

  const BusSurvey& survey_;
  const MachineDescription* machine_;
  std::vector<NodeScript> scripts_;
  std::vector<BusFrame> frames_;
  BusDiagnosis result_;
};

}  // namespace

std::map<std::uint8_t, std::vector<Object>> doctor_objects(const MachineDescription& machine) {
  std::map<std::uint8_t, std::vector<Object>> wanted;
  for (const NodeScript& node : slave::node_scripts(machine)) {
    std::vector<Object>& objects = wanted[node.node.id];
    for (const slave::SetupPart& part : node.script)
      for (const SdoStep& step : part.asked) objects.push_back(step.object);
    for (const Object& object : {canopen::kErrorRegister, kErrorCount, kNewestError, canopen::kSerialNumber})
      objects.push_back(object);
    for (const Object& object : reading_objects(node.node, machine)) objects.push_back(object);
    // Once more, so that two devices that answer in turn contradict each other.
    for (const Object& object : kIdentity) objects.push_back(object);
  }
  return wanted;
}

BusDiagnosis diagnose(const BusSurvey& survey, const MachineDescription* machine) {
  return Doctor(survey, machine).run();
}

}  // namespace knuckle::bringup
