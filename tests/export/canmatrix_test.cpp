// The machine's DBC read by canmatrix: every message as it is meant, and frames decoded to what Knuckle's own decoders
// make of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <numbers>
#include <optional>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "app/export/export_command.h"
#include "machine/bus_description.h"
#include "tests/export/machines.h"
#include "tests/support/multiplexed_machine.h"
#include "tests/support/run_program.h"
#include "tests/support/sensor_frames.h"
#include "tests/support/temporary_folder.h"
#include "transport/canopen.h"
#include "transport/timed_frame.h"

namespace knuckle::exporting {
namespace {

using test::machines_of_every_wire;
using test::TemporaryFolder;
using Values = std::map<std::string, double>;  // by signal

canopen::PressureFormat pressure_format(const WireDescription& wire) {
  using Pressure = WireDescription::Pressure;
  canopen::PressureFormat format = canopen::pressure_format(wire.pressure == Pressure::kFloat, wire.pressure_digits);
  if (wire.pressure == Pressure::kInteger16) format.bytes = 2;
  return format;
}
/// The channels in each of a node's TPDOs, by number: as many as a frame of 8 bytes has room for.
std::vector<std::vector<NodeChannel>> by_tpdo(const NodeDescription& node, const WireDescription& wire) {
  if (node.role == NodeRole::kValve) {
    std::vector<std::vector<NodeChannel>> axes;
    for (const NodeChannel& channel : node.channels) axes.push_back({channel});
    return axes;
  }
  if (node.role != NodeRole::kPressure) return {node.channels};
  const std::size_t room = 8 / (pressure_format(wire).bytes + 1);
  std::vector<std::vector<NodeChannel>> tpdos;
  for (const NodeChannel& channel : node.channels) {
    if (tpdos.empty() || tpdos.back().size() == room) tpdos.emplace_back();
    tpdos.back().push_back(channel);
  }
  return tpdos;
}

/// What Knuckle's decoders make of a frame, in the units of the DBC.
class OwnDecoders {
 public:
  explicit OwnDecoders(const MachineDescription& machine) : machine_(machine) {}

  /// The message's name and its signals; nothing where they refuse it.
  std::optional<std::pair<std::string, Values>> decode(const CanFrame& frame) const {
    if (const auto nmt = canopen::parse_nmt(frame))
      return {{"NMT", {{"Command", static_cast<double>(nmt->command)}, {"Node", nmt->node}}}};
    if (frame.id == canopen::kSyncId) return {{"SYNC", {}}};
    if (frame.id == canopen::heartbeat_id(machine_.bus.controller_id))
      return {{"controller_heartbeat", {{"State", static_cast<double>(canopen::parse_heartbeat(frame).value())}}}};
    for (const NodeDescription& node : machine_.bus.nodes) {
      const auto tpdos = by_tpdo(node, machine_.bus.wire);
      for (std::size_t pdo = 0; pdo < tpdos.size(); ++pdo) {
        if (frame.id == node.tpdo_id(pdo))
          return {{node.name + "_TPDO" + std::to_string(pdo + 1), sent(node, tpdos[pdo], frame)}};
      }
      const bool told = node.role == NodeRole::kValve || node.role == NodeRole::kEnable;
      for (std::size_t pdo = 0; told && pdo < node.channels.size(); ++pdo)
        if (frame.id == node.rpdo_id(pdo))
          return {{node.name + "_RPDO" + std::to_string(pdo + 1), commanded(node, node.channels[pdo], frame)}};
    }
    for (const NodeDescription& node : machine_.bus.nodes) {
      if (canopen::node_of(frame.id) == node.id) return service(node.name, frame);
    }
    return std::nullopt;
  }

 private:
  [[nodiscard]] Values sent(const NodeDescription& node, const std::vector<NodeChannel>& channels,
                            const CanFrame& frame) const {
    const WireDescription& wire = machine_.bus.wire;
    switch (node.role) {
      case NodeRole::kValve: {
        const auto status = canopen::parse_valve_status(frame, wire.valve_full_stroke).value();
        const std::string of = named(node, channels[0]);
        return {{of + "State", static_cast<double>(canopen::valve_state(status.status_word).value())},
                {of + "Ready", canopen::valve_fault(status.status_word) ? 0 : 1},
                {of + "Local", (status.status_word & canopen::kStatusLocal) != 0 ? 1 : 0},
                {of + "SpoolPosition", 100 * status.spool}};
      }
      case NodeRole::kPressure: {
        Values values;
        for (std::size_t place = 0; place < channels.size(); ++place) {
          const auto reading = canopen::parse_pressure(frame, pressure_format(wire), place).value();
          const std::string of = named(node, channels[place]);
          values[of + "Pressure"] = reading.pressure_Pa / 1e5;
          values[of + "Invalid"] = (reading.status & canopen::kPressureInvalid) != 0 ? 1 : 0;
          values[of + "Overload"] = (reading.status & canopen::kPressureOverload) != 0 ? 1 : 0;
          values[of + "Underload"] = (reading.status & canopen::kPressureUnderload) != 0 ? 1 : 0;
        }
        return values;
      }
      case NodeRole::kEncoder: {
        if (node.measures_angle())
          return {{"Shaft", 360.0 * (frame.data[0] | frame.data[1] << 8U | frame.data[2] << 16U) / 16384}};
        const auto reading =
            canopen::parse_encoder(frame, machine_.sensors.encoder_step_m, wire.encoder_speed_step_mps).value();
        return {{"Length", reading.position_m * 1e3}, {"Speed", reading.speed_mps * 1e3}};
      }
      case NodeRole::kTilt:
        return {{"Slope", canopen::parse_tilt(frame, machine_.sensors.tilt_step_rad).value() * 180 / std::numbers::pi}};
      case NodeRole::kEnable:
      case NodeRole::kReading:
      case NodeRole::kPilot:
      case NodeRole::kModule:
        break;
    }
    const std::uint8_t inputs = canopen::parse_enable(frame).value();
    return {{"EStopClosed", (inputs & canopen::kInputEStopClosed) != 0 ? 1 : 0},
            {"PilotOn", (inputs & canopen::kInputPilotOn) != 0 ? 1 : 0}};
  }
  static std::string named(const NodeDescription& node, const NodeChannel& channel) {
    return node.channels.size() > 1 ? std::string(channel.info().name) + "_" : "";
  }
  [[nodiscard]] Values commanded(const NodeDescription& node, const NodeChannel& channel, const CanFrame& frame) const {
    if (node.role == NodeRole::kEnable)
      return {{"Enable", (canopen::parse_enable(frame).value() & canopen::kOutputEnable) != 0 ? 1 : 0}};
    const auto command = canopen::parse_valve_command(frame, machine_.bus.wire.valve_full_stroke).value();
    const std::string of = named(node, channel);
    return {{of + "State", command.control_word & canopen::kControlActive},
            {of + "Reset", (command.control_word & canopen::kControlReset) != 0 ? 1 : 0},
            {of + "SpoolSetPoint", 100 * command.set_point}};
  }
  static std::optional<std::pair<std::string, Values>> service(const std::string& node, const CanFrame& frame) {
    if (const auto state = canopen::parse_heartbeat(frame))
      return {{node + "_heartbeat", {{"State", static_cast<double>(*state)}}}};
    if (const auto emergency = canopen::parse_emergency(frame)) {
      double vendor = 0;
      for (std::size_t i = 5; i-- > 0;) vendor = 256 * vendor + emergency->vendor[i];
      return {{node + "_EMCY",
               {{"ErrorCode", emergency->code}, {"ErrorRegister", emergency->error_register}, {"Vendor", vendor}}}};
    }
    if (const auto answer = canopen::parse_sdo_response(frame)) {
      const auto data = answer->kind == canopen::SdoResponse::Kind::kAborted ? static_cast<std::uint32_t>(answer->abort)
                                                                             : answer->value;
      return {{node + "_SDO_tx", sdo(frame, answer->object, data)}};
    }
    if (const auto request = canopen::parse_sdo_request(frame)) {
      EXPECT_NE(request->kind, canopen::SdoRequest::Kind::kOther);
      return {{node + "_SDO_rx", sdo(frame, request->object, request->value)}};
    }
    return std::nullopt;
  }
  static Values sdo(const CanFrame& frame, const canopen::Object& object, std::uint32_t data) {
    return {{"Command", frame.data[0]}, {"Index", object.index}, {"Subindex", object.subindex}, {"Data", data}};
  }

  const MachineDescription& machine_;
};

/// Frames of every kind with drawn content, where none has a range beyond what its sender sends.
std::vector<CanFrame> drawn_frames(const MachineDescription& machine, int rounds) {
  using namespace canopen;
  std::mt19937_64 random(17);
  const auto uniform = [&random](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const auto word = [&random] { return static_cast<std::uint32_t>(random()); };
  const WireDescription& wire = machine.bus.wire;
  constexpr std::array<std::uint16_t, 4> kStates{0x0, 0x1, 0x3, 0x7};
  std::vector<CanFrame> frames{sync_frame()};
  for (const auto command : {NmtCommand::kStart, NmtCommand::kStop, NmtCommand::kEnterPreOperational,
                             NmtCommand::kResetNode, NmtCommand::kResetCommunication})
    frames.push_back(nmt_frame(command, machine.bus.tilt().id));
  for (const NodeDescription& node : machine.bus.nodes) {
    for (const auto state : {NmtState::kBootUp, NmtState::kStopped, NmtState::kOperational, NmtState::kPreOperational})
      frames.push_back(heartbeat_frame(node.id, state));
    frames.push_back(heartbeat_frame(node.id, NmtState::kOperational));
    frames.back().data[0] |= 0x80;  // the toggle bit of node guarding, which is no part of the state
    for (int n = 0; n < rounds; ++n) {
      const Object object{static_cast<std::uint16_t>(word()), static_cast<std::uint8_t>(word())};
      frames.push_back(sdo_download(node.id, object, word(), n % 2 == 0 ? 4 : 2));
      frames.push_back(sdo_upload(node.id, object));
      frames.push_back(sdo_uploaded(node.id, object, word(), n % 2 == 0 ? 4 : 1));
      frames.push_back(sdo_downloaded(node.id, object));
      frames.push_back(sdo_aborted(node.id, object, SdoAbort::kNoObject));
      Emergency emergency{static_cast<std::uint16_t>(word()), static_cast<std::uint8_t>(word())};
      for (std::uint8_t& byte : emergency.vendor) byte = static_cast<std::uint8_t>(word());
      frames.push_back(emergency_frame(node.id, emergency));
      const auto control = static_cast<std::uint16_t>(kStates[word() % 4] | (word() & 0x8U));
      const auto status = static_cast<std::uint16_t>(kStates[word() % 4] | (word() & 0x18U));
      switch (node.role) {
        case NodeRole::kValve:
          for (std::size_t pdo = 0; pdo < node.channels.size(); ++pdo) {
            frames.push_back(valve_status_frame(node.tpdo_id(pdo), {status, uniform(-1, 1)}, wire.valve_full_stroke));
            frames.push_back(valve_command_frame(node.rpdo_id(pdo), {control, uniform(-1, 1)}, wire.valve_full_stroke));
          }
          break;
        case NodeRole::kPressure:
          for (std::size_t pdo = 0; pdo < by_tpdo(node, wire).size(); ++pdo) {
            frames.push_back({.id = node.tpdo_id(pdo)});
            for (std::size_t left = by_tpdo(node, wire)[pdo].size(); left > 0; --left)
              add_pressure(frames.back(), {uniform(-3e5, 420e5), static_cast<std::uint8_t>(word() & 0x7U)},
                           pressure_format(wire));
          }
          break;
        case NodeRole::kEncoder:
          if (node.measures_angle()) {
            const std::uint32_t steps = word() % 16384U;
            frames.push_back({.id = node.tpdo_id(),
                              .size = 4,
                              .data = {static_cast<std::uint8_t>(steps), static_cast<std::uint8_t>(steps >> 8U)}});
            break;
          }
          frames.push_back(encoder_frame(node.tpdo_id(), {uniform(-3, 3), uniform(-0.8, 0.8)},
                                         machine.sensors.encoder_step_m, wire.encoder_speed_step_mps));
          break;
        case NodeRole::kTilt:
          frames.push_back(tilt_frame(node.tpdo_id(), uniform(-3, 3), machine.sensors.tilt_step_rad));
          break;
        case NodeRole::kEnable:
          frames.push_back(enable_inputs_frame(node.tpdo_id(), static_cast<std::uint8_t>(word() & 0x3U)));
          frames.push_back(enable_output_frame(node.rpdo_id(), static_cast<std::uint8_t>(word() & 0x1U)));
          break;
        case NodeRole::kReading:
        case NodeRole::kPilot:
        case NodeRole::kModule:
          break;
      }
    }
  }
  return frames;
}

std::vector<std::string> cells(const std::string& line) {
  std::vector<std::string> all;
  std::istringstream row(line);
  for (std::string cell; std::getline(row, cell, '\t');) all.push_back(cell);
  return all;
}

class Canmatrix : public ::testing::Test {
 protected:
  /// Runs the witness on the machine's DBC. @return its lines, cell by cell; empty where it is not there.
  std::vector<std::vector<std::string>> ask(const MachineDescription& machine, const std::string& what,
                                            const std::string& log = {}) {
    const std::string dbc = folder_.file("bus.dbc"), out = folder_.file("out");
    {
      std::ofstream file(dbc);
      write_dbc(machine, file);
    }
    std::vector<std::string> arguments{test::source_dir() + "/tests/export/canmatrix_witness.py", what, dbc};
    if (!log.empty()) arguments.push_back(log);
    arguments.push_back(out);
    const test::ProgramRun run = test::run_program("/usr/bin/python3", arguments);  // Debian's: its modules
    if (run.exit_code == 77 || run.exit_code == 127) return {};
    EXPECT_EQ(run.exit_code, 0) << run.err;
    std::vector<std::vector<std::string>> lines;
    std::ifstream answer(out);
    for (std::string line; std::getline(answer, line);) lines.push_back(cells(line));
    EXPECT_FALSE(lines.empty());
    return lines;
  }
  /// Of a log as `knuckle simulate` writes it. @return frames that were compared.
  std::size_t compare(const MachineDescription& machine, const std::vector<CanFrame>& frames, const std::string& log) {
    const auto decoded = ask(machine, "decode", log);
    if (decoded.empty()) return 0;
    EXPECT_EQ(decoded.size(), frames.size());
    const OwnDecoders own(machine);
    for (std::size_t n = 0; n < std::min(decoded.size(), frames.size()); ++n) {
      const auto ours = own.decode(frames[n]);
      if (!ours) {
        ADD_FAILURE() << "frame " << n + 1 << " is none of ours";
        return n;
      }
      EXPECT_EQ(decoded[n][0], ours->first) << "frame " << n + 1;
      EXPECT_EQ(decoded[n].size(), ours->second.size() + 1) << ours->first;
      for (std::size_t i = 1; i < decoded[n].size(); ++i) {
        const auto equals = decoded[n][i].find('=');
        const std::string name = decoded[n][i].substr(0, equals);
        const double value = std::stod(decoded[n][i].substr(equals + 1));
        if (!ours->second.contains(name)) {
          ADD_FAILURE() << ours->first << " has no " << name;
          return n;
        }
        const double expected = ours->second.at(name);
        EXPECT_NEAR(value, expected, 1e-12 * std::max(1.0, std::abs(expected))) << ours->first << " " << name;
      }
    }
    return frames.size();
  }

  static constexpr const char* kMissing =
      "NOT TESTED: canmatrix is not installed (python3-canmatrix), so nobody else has read our DBC";
  TemporaryFolder folder_;
};

TEST_F(Canmatrix, DecodesDrawnFramesOfEveryKindAndWireAsOurDecodersDo) {
  for (const MachineDescription& machine : machines_of_every_wire()) {
    const std::vector<CanFrame> frames = drawn_frames(machine, 10);
    const std::string log = folder_.file("drawn.log");
    {
      std::ofstream file(log);
      for (const CanFrame& frame : frames) file << candump_line(Time{}, frame) << '\n';
    }
    if (compare(machine, frames, log) == 0) GTEST_SKIP() << kMissing;
    RecordProperty("frames_of_" + machine.name, std::to_string(frames.size()));
  }
}

TEST_F(Canmatrix, DecodesOfAMultiplexedFrameWhatItHas) {
  const MachineDescription machine = test::multiplexed_machine();
  const std::string log = folder_.file("multiplexed.log");
  {
    std::ofstream file(log);
    for (const std::uint8_t value : {std::uint8_t{1}, std::uint8_t{2}}) {
      const CanFrame frame{0x18FF1021U | kExtendedId, 8, {0xB4, 0x5F, 0x02, 0x53, 0xEE, 0x18, 9, value}};
      file << candump_line(Time{}, frame) << '\n';
    }
  }
  const auto decoded = ask(machine, "raw", log);
  if (decoded.empty()) GTEST_SKIP() << kMissing;
  ASSERT_EQ(decoded.size(), 2U);
  const auto sorted = [](std::vector<std::string> row) {
    std::sort(row.begin() + 1, row.end());
    return row;
  };
  EXPECT_EQ(sorted(decoded[0]), (std::vector<std::string>{"front_angle", "arm_angle=21250", "boom_angle=24500",
                                                          "bucket_angle=-4584", "counter=9", "multiplexer=1"}));
  EXPECT_EQ(sorted(decoded[1]),
            (std::vector<std::string>{"front_angle", "arm_head_pressure=2", "arm_rod_pressure=83",
                                      "boom_head_pressure=180", "boom_rod_pressure=95", "bucket_head_pressure=238",
                                      "bucket_rod_pressure=24", "counter=9", "multiplexer=2"}));
}

TEST_F(Canmatrix, ReadsEveryMessageAndSignalAsTheyAreMeant) {
  for (const MachineDescription& read : machines_of_every_wire()) {
    const auto lines = ask(read, "describe");
    if (lines.empty()) GTEST_SKIP() << kMissing;
    std::size_t n = 0;
    const auto number = [&](std::size_t cell) { return std::stod(lines.at(n).at(cell)); };
    for (const Message& message : bus_messages(calibrated(read))) {
      ASSERT_LT(n, lines.size());
      const std::vector<std::string>& m = lines[n];
      ASSERT_EQ(m.at(1), message.name);
      EXPECT_EQ(number(2), message.id);
      EXPECT_EQ(number(3), message.size);
      EXPECT_EQ(m.at(4), message.sender);
      const double period_ms = message.period_s.value_or(0) * 1e3;
      const bool whole = std::abs(period_ms - std::round(period_ms)) < 1e-6;
      EXPECT_NEAR(number(5), whole ? period_ms : 0, 1e-9) << message.name;
      ++n;
      for (const Signal& signal : message.signals) {
        const std::vector<std::string>& s = lines.at(n);
        ASSERT_EQ(s.at(1), signal.name) << message.name;
        constexpr std::array kTypes{"unsigned", "signed", "float"};
        EXPECT_EQ(s.at(2), kTypes.at(static_cast<std::size_t>(signal.type))) << message.name << " " << signal.name;
        EXPECT_EQ(s.at(3), "little");
        EXPECT_EQ(number(4), signal.start_bit);
        EXPECT_EQ(number(5), signal.bits);
        EXPECT_DOUBLE_EQ(number(6), signal.factor);
        EXPECT_EQ(number(7), 0);
        EXPECT_DOUBLE_EQ(number(8), signal.min) << message.name << " " << signal.name;
        EXPECT_DOUBLE_EQ(number(9), signal.max) << message.name << " " << signal.name;
        EXPECT_EQ(s.at(10), signal.unit);
        EXPECT_EQ(static_cast<std::size_t>(std::count(s.at(11).begin(), s.at(11).end(), ',')) + 1,
                  message.receivers.size());
        EXPECT_EQ(s.at(11).substr(0, message.receivers[0].size()), message.receivers[0]);
        const std::string& values = s.at(12);
        EXPECT_EQ(static_cast<std::size_t>(std::count(values.begin(), values.end(), '=')), signal.values.size());
        for (const auto& [raw, name] : signal.values)
          EXPECT_NE((";" + values + ";").find(";" + std::to_string(raw) + "=" + name + ";"), std::string::npos) << name;
        EXPECT_EQ(s.size() > 13 ? s[13] : "", signal.about);
        ++n;
      }
    }
    EXPECT_EQ(n, lines.size());
  }
}

}  // namespace
}  // namespace knuckle::exporting
