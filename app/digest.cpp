#include "app/digest.h"

#include <openssl/evp.h>

#include <cstring>
#include <stdexcept>

namespace knuckle::app {
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
  [[nodiscard]] const std::uint8_t* data() const noexcept { return bytes_.data(); }
  [[nodiscard]] std::size_t size() const noexcept { return size_; }

 private:
  std::array<std::uint8_t, 2 * sizeof(Sample)> bytes_;  // more than any packed value needs
  std::size_t size_ = 0;
};

template <typename... T>
Packed pack(const T&... values) noexcept {
  Packed packed;
  (packed.add(values), ...);
  return packed;
}

}  // namespace

struct Digest::State {
  EVP_MD_CTX* context = EVP_MD_CTX_new();
  ~State() { EVP_MD_CTX_free(context); }
  void add(const Packed& packed) { EVP_DigestUpdate(context, packed.data(), packed.size()); }
};

Digest::Digest() : state_(std::make_unique<State>()) {
  if (EVP_DigestInit_ex(state_->context, EVP_sha256(), nullptr) != 1) throw std::runtime_error("SHA-256 is not there");
}
Digest::~Digest() = default;

void Digest::add(const Sample& s) {
  state_->add(pack('s', s.t_s, s.mode, s.blocking, s.fault, s.joint_rad, s.joint_radps, s.setpoint_rad,
                   s.setpoint_radps, s.valve_command, s.pressure_Pa, s.tip_force_N, s.force_cov_N2, s.confidence,
                   s.confidence_reasons, s.contact, s.limits, s.payload_kg, s.payload_sigma_kg, s.truth_joint_rad,
                   s.truth_joint_radps, s.truth_spool, s.truth_tip_m, s.truth_tip_force_N, s.truth_pipe_N,
                   s.truth_payload_kg, s.truth_pump_flow_share, s.truth_energy_to_machine_J, s.hand_rad, s.hand_radps,
                   s.intent_rad, s.hand_tip_m, s.hand_setpoint_tip_m, s.tip_m, s.felt_N, s.drag_N, s.hand_energy_J,
                   s.rtt_s, s.phase, s.felt_slew_N_per_ms));
}

void Digest::add(Time at, const CanFrame& frame) {
  state_->add(pack('c', std::int64_t{at.time_since_epoch().count()}, frame.id, frame.size, frame.data));
}

void Digest::add(std::string_view bytes) {
  EVP_DigestUpdate(state_->context, bytes.data(), bytes.size());
}

std::string Digest::finish() {
  std::array<unsigned char, EVP_MAX_MD_SIZE> hash{};
  unsigned size = 0;
  if (EVP_DigestFinal_ex(state_->context, hash.data(), &size) != 1) throw std::runtime_error("SHA-256 failed");
  std::string hex;
  constexpr char kDigits[] = "0123456789abcdef";
  for (unsigned i = 0; i < size; ++i) {
    hex += kDigits[hash[i] >> 4];
    hex += kDigits[hash[i] & 15];
  }
  return hex;
}

}  // namespace knuckle::app
