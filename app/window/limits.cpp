// Words for limits and for trust in the force.
#include <array>
#include <cmath>

#include "app/window/screens.h"

namespace knuckle::app {

const char* limit_word(unsigned bit) noexcept {
  constexpr std::array<const char*, 9> kWords{"full stroke", "spool rate", "joint range",    "virtual wall", "pressure",
                                              "power",       "pump flow",  "joint velocity", "assist force"};
  return bit < kWords.size() ? kWords[bit] : nullptr;
}

bool limit_chips(const Ui& ui, std::uint16_t limits, const Area& area) {
  const Theme& t = ui.theme;
  float x = area.min.x, y = area.min.y + t.px(16);
  bool any = false;
  for (unsigned bit = 0; limit_word(bit) != nullptr; ++bit) {
    if ((limits & (1U << bit)) == 0) continue;
    const float width = chip_width(ui, limit_word(bit));
    if (any && x + width > area.max.x) {
      x = area.min.x;
      y += t.px(34);
    }
    chip(ui, {x, y}, Icon::kWarning, limit_word(bit), t.colours.notice);
    x += width + t.unit();
    any = true;
  }
  return any;
}

std::string confidence_words(const ConsoleView& view, const MachineDescription& machine) {
  const SlaveMessage& m = view.machine;
  if (m.confidence <= 0) return "unknown: sensors are not usable";
  std::string words;
  const auto add = [&words](const char* why) { words += (words.empty() ? "" : ", ") + std::string(why); };
  // Bounds near those that lower the estimate's confidence itself.
  constexpr double kUsableSigma_N = 600, kStill_radps = 0.005, kFastShare = 0.6, kNearRelief = 0.95;
  const auto& [xx, xz, zz] = m.covariance_N2;
  const double sigma_N = std::sqrt(0.5 * (xx + zz) + std::hypot(0.5 * (xx - zz), xz));
  if (sigma_N > kUsableSigma_N) add("arm near straight or bucket near its end");
  double fastest = 0;
  for (std::size_t j = 0; j < kJoints; ++j)
    fastest =
        std::max(fastest, std::abs(m.velocity_radps[static_cast<Eigen::Index>(j)]) / machine.links[j].max_rate_radps);
  if (m.velocity_radps.cwiseAbs().maxCoeff() < kStill_radps) add("standing: friction hides small forces");
  if (fastest > kFastShare) add("fast motion");
  for (const double pressure : m.pressure_Pa) {
    if (pressure < kNearRelief * machine.hydraulics.port_relief_Pa) continue;
    add("a relief valve is open");
    break;
  }
  if (words.empty()) words = m.confidence > 0.75 ? "nothing in the way" : "still learning this machine's free motion";
  return words;
}

}  // namespace knuckle::app
