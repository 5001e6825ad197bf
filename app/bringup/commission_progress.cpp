#include "app/bringup/commission_progress.h"

#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>

#include "app/cli/command.h"
#include "app/cli/digest.h"
#include "app/cli/output_file.h"
#include "core/error.h"
#include "core/text.h"
#include "machine/file_text.h"

namespace knuckle::bringup {
namespace {

using OrderedJson = nlohmann::ordered_json;
constexpr const char* kSchema = "knuckle-commission-progress/2";
constexpr std::size_t kLargest_MB = 1;
constexpr int kDeepest = 8;  // of what is nested in it; written are 5

OrderedJson json_of(const std::optional<double>& value) {
  return value ? OrderedJson(*value) : OrderedJson(nullptr);
}
std::optional<double> optional_of(const OrderedJson& value) {
  return value.is_null() ? std::nullopt : std::optional(value.get<double>());
}

OrderedJson json_of(const WizardProgress& progress) {
  OrderedJson axes = OrderedJson::array(), findings = OrderedJson::array(), serials = OrderedJson::array();
  for (const auto& [id, serial] : progress.serials) serials.push_back({{"node", id}, {"serial", serial}});
  for (const AxisResult& axis : progress.axes)
    axes.push_back({{"stroke_m", json_of(axis.stroke_m)},
                    {"offset_m", json_of(axis.offset_m)},
                    {"preset", axis.preset},
                    {"dead_band_extend", json_of(axis.dead_band_extend)},
                    {"dead_band_retract", json_of(axis.dead_band_retract)}});
  for (const Finding& one : progress.findings)
    findings.push_back({{"level", static_cast<int>(one.level)}, {"about", one.about}, {"text", one.text}});
  return {{"completed", progress.completed}, {"serials", serials}, {"axes", axes}, {"findings", findings}};
}

struct Unusable {};

/// @throws Unusable where it is no whole number within these.
template <typename Number>
Number whole_number(const OrderedJson& value, std::int64_t least, std::int64_t most) {
  const bool fits = value.is_number_unsigned() ? value.get<std::uint64_t>() <= static_cast<std::uint64_t>(most)
                                               : value.is_number_integer();
  if (!fits || value.get<std::int64_t>() < least || value.get<std::int64_t>() > most) throw Unusable{};
  return static_cast<Number>(value.get<std::int64_t>());
}
/// @throws Unusable where a terminal would not show it as it is.
std::string words_of(const OrderedJson& value) {
  std::string words = value.get<std::string>();
  if (printable(words) != words) throw Unusable{};
  return words;
}

/// @throws nlohmann::json::exception where something is missing or of another kind. @throws Unusable
WizardProgress progress_of(const OrderedJson& json) {
  WizardProgress progress;
  progress.completed = whole_number<int>(json.at("completed"), 0, kDeadBands);
  for (const OrderedJson& one : json.at("serials"))
    progress.serials[whole_number<std::uint8_t>(one.at("node"), 1, 127)] =
        whole_number<std::uint32_t>(one.at("serial"), 0, std::numeric_limits<std::uint32_t>::max());
  for (std::size_t j = 0; j < progress.axes.size(); ++j) {
    const OrderedJson& axis = json.at("axes").at(j);
    progress.axes[j] = {optional_of(axis.at("stroke_m")), optional_of(axis.at("offset_m")),
                        axis.at("preset").get<bool>(), optional_of(axis.at("dead_band_extend")),
                        optional_of(axis.at("dead_band_retract"))};
  }
  for (const OrderedJson& one : json.at("findings"))
    progress.findings.push_back(
        {static_cast<Finding::Level>(whole_number<int>(one.at("level"), 0, static_cast<int>(Finding::Level::kFault))),
         words_of(one.at("about")), words_of(one.at("text"))});
  return progress;
}

/// @throws nlohmann::json::exception, Unusable: nothing that is nested deeper is taken apart.
OrderedJson parsed(const std::string& text) {
  return OrderedJson::parse(text, [](int depth, OrderedJson::parse_event_t, const OrderedJson&) {
    if (depth > kDeepest) throw Unusable{};
    return true;
  });
}

/// Of all that is said; nobody's secret, it only finds what was changed by hand.
std::string digest_of(OrderedJson json) {
  json.erase("sha256");
  cli::Digest digest;
  digest.add(json.dump());
  return digest.finish();
}

}  // namespace

std::string progress_file(const std::string& out) {
  return out + ".progress";
}

void write_progress(const std::string& file, const WizardProgress& progress, const ProgressOf& of) {
  OrderedJson json{{"schema", kSchema},
                   {"program", cli::program_version()},
                   {"bus", of.bus},
                   {"machine_sha256", of.machine_sha256},
                   {"progress", json_of(progress)}};
  json["sha256"] = digest_of(json);
  cli::OutputFile out("--out", file);
  out.stream() << json.dump(1) << '\n';
  out.commit();
}

WizardProgress read_progress(const std::string& file, const ProgressOf& of) {
  const auto refuse = [&file](const std::string& why) {
    throw InputError(file + ": " + why + ": begin anew, without --resume");
  };
  const std::string text = whole_file(file, kLargest_MB);
  try {
    const OrderedJson json = parsed(text);
    if (json.at("schema") != kSchema) refuse("is not the progress of a commissioning of this version");
    if (json.at("sha256") != digest_of(json)) refuse("was changed since it was written");
    if (json.at("machine_sha256") != of.machine_sha256)
      refuse("is of another machine file, or of an older version of it");
    if (json.at("bus") != of.bus)
      refuse("is of the bus " + shortened(json.at("bus").get<std::string>()) + ", not " + of.bus);
    return progress_of(json.at("progress"));
  } catch (const nlohmann::json::exception&) {
    refuse("is not the progress of a commissioning");
  } catch (const Unusable&) {
    refuse("is not the progress of a commissioning");
  }
  return {};
}

}  // namespace knuckle::bringup
