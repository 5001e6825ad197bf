#include "app/session/options.h"

#include "app/cli/command.h"

namespace knuckle::session {

std::string SimulateOptions::operator_path() const {
  return operator_name.rfind("path:", 0) == 0 ? operator_name.substr(5) : "";
}

sim::LimbClass limb_named(const std::string& name, sim::LimbClass fallback, const std::string& or_else) {
  if (name.empty()) return fallback;
  std::string known;
  for (const auto limb :
       {sim::LimbClass::kRelaxed, sim::LimbClass::kNormal, sim::LimbClass::kCoContracted, sim::LimbClass::kLightGrip}) {
    if (name == sim::name(limb)) return limb;
    known += (known.empty() ? "" : ", ") + std::string(sim::name(limb));
  }
  cli::refuse_option("--operator", name, "must be one of " + known + or_else);
}

}  // namespace knuckle::session
