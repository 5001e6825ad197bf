#include "app/hardware/commission_result.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>

#include "app/command.h"
#include "machine/toml_reader.h"

namespace knuckle::app {
namespace {

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return out + '"';
}

std::string hex(std::uint32_t value) {
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "0x%X", value);
  return text.data();
}

/// What was not measured has no key.
void put(std::ostream& out, const char* key, const std::optional<double>& value, double unit, double step) {
  if (value) out << key << " = " << number_text(std::round(*value / unit / step) * step) << '\n';
}

void write_axis(const AxisResult& axis, const char* name, std::ostream& out) {
  out << "\n[axes." << name << "]\n";
  put(out, "stroke_mm", axis.stroke_m, 1e-3, 0.1);
  put(out, "encoder_offset_mm", axis.offset_m, 1e-3, 0.1);
  out << "encoder_preset = " << (axis.preset ? "true" : "false") << '\n';
  put(out, "dead_band_extend", axis.dead_band_extend, 1, 1e-4);
  put(out, "dead_band_retract", axis.dead_band_retract, 1, 1e-4);
}

}  // namespace

void write_wizard_result(const WizardResult& result, const MachineDescription& machine, const ResultOrigin& origin,
                         std::ostream& out) {
  out << "# Written by knuckle commission.\n"
      << "schema = \"knuckle.commissioning\"\nversion = 1\n"
      << "machine = " << quoted(machine.name) << "\nmachine_sha256 = " << quoted(origin.machine_sha256)
      << "\nbus = " << quoted(origin.bus) << "\ndate = " << quoted(origin.date)
      << "\nprogram = " << quoted(program_version()) << '\n';
  put(out, "tilt_error_deg", result.tilt_error_rad, std::numbers::pi / 180, 0.01);
  out << "recordings = [";
  for (std::size_t i = 0; i < result.recordings.size(); ++i) out << (i > 0 ? ", " : "") << quoted(result.recordings[i]);
  out << "]\n";
  for (std::size_t j = 0; j < kJoints; ++j) write_axis(result.axes[j], kJointNames[j], out);
  for (const NodeLine& node : result.nodes) {
    out << "\n[[nodes]]\nid = " << hex(node.id) << "\nname = " << quoted(node.name)
        << "\ndevice_type = " << hex(node.device_type.value_or(0)) << "\nvendor = " << hex(node.vendor.value_or(0))
        << "\nproduct = " << hex(node.product.value_or(0)) << '\n';
  }
  for (const Finding& one : result.findings) {
    out << "\n[[findings]]\nlevel = " << quoted(name(one.level)) << "\nabout = " << quoted(one.about)
        << "\ntext = " << quoted(one.text) << '\n';
  }
}

}  // namespace knuckle::app
