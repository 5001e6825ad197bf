#include "app/session/session_digest.h"

#include <array>
#include <cstring>
#include <string_view>
#include <type_traits>

namespace knuckle::session {
namespace {

/// Packs values without padding, so that the digest depends on values only.
class Packed {
 public:
  template <typename T>
  void add(const T& value) noexcept {
    static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
    std::memcpy(bytes_.data() + size_, &value, sizeof value);
    size_ += sizeof value;
  }
  template <typename T, std::size_t n>
  void add(const std::array<T, n>& values) noexcept {
    for (const T& value : values) add(value);
  }
  template <int n>
  void add(const Eigen::Matrix<double, n, 1>& v) noexcept {
    for (int i = 0; i < n; ++i) add(v[i]);
  }
  [[nodiscard]] std::string_view bytes() const noexcept { return {bytes_.data(), size_}; }

 private:
  std::array<char, 2 * sizeof(Sample)> bytes_;  // more than any packed value needs
  std::size_t size_ = 0;
};

template <typename... T>
Packed pack(const T&... values) noexcept {
  Packed packed;
  (packed.add(values), ...);
  return packed;
}

}  // namespace

void add(cli::Digest& digest, const Sample& s) {
  digest.add(pack('s', s.t_s, s.mode, s.blocking, s.fault, s.joint_rad, s.joint_radps, s.setpoint_rad, s.setpoint_radps,
                  s.valve_command, s.pressure_Pa, s.tip_force_N, s.force_cov_N2, s.confidence, s.confidence_reasons,
                  s.contact, s.limits, s.payload_kg, s.payload_sigma_kg, s.truth_joint_rad, s.truth_joint_radps,
                  s.truth_spool, s.truth_tip_m, s.truth_tip_force_N, s.truth_contact_m, s.truth_pipe_N,
                  s.truth_payload_kg, s.truth_weight_N, s.truth_pump_flow_share, s.truth_energy_to_machine_J,
                  s.hand_rad, s.hand_radps, s.intent_rad, s.hand_tip_m, s.hand_setpoint_tip_m, s.tip_m, s.felt_N,
                  s.drag_N, s.hand_energy_J, s.rtt_s, s.phase, s.felt_slew_N_per_ms)
                 .bytes());
}

void add(cli::Digest& digest, Time at, const CanFrame& frame) {
  digest.add(pack('c', std::int64_t{at.time_since_epoch().count()}, frame.id, frame.size, frame.data).bytes());
}

}  // namespace knuckle::session
