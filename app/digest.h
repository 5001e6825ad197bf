// One number for a whole run: SHA-256 over every sample and every CAN frame. Equal digests mean equal runs. Also of
// files' bytes, as sha256sum gives it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "app/session_record.h"
#include "core/time.h"
#include "transport/can_bus.h"

namespace knuckle::app {

class Digest {
 public:
  Digest();
  ~Digest();
  Digest(const Digest&) = delete;
  Digest& operator=(const Digest&) = delete;

  void add(const Sample& sample);
  void add(Time at, const CanFrame& frame);
  void add(std::string_view bytes);
  /// Hex of everything added so far; the digest is finished by it.
  [[nodiscard]] std::string finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace knuckle::app
