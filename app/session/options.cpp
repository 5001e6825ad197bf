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

sim::PersonClass person_named(const std::string& name, sim::PersonClass fallback) {
  if (name.empty()) return fallback;
  for (const auto person : {sim::PersonClass::kExact, sim::PersonClass::kSteady, sim::PersonClass::kRough}) {
    if (name == sim::name(person)) return person;
  }
  cli::refuse_option("--person", name, "must be one of exact, steady, rough");
}

}  // namespace knuckle::session
