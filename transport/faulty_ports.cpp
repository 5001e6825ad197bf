#include "transport/faulty_ports.h"

#include <algorithm>

#include "transport/canopen.h"

namespace knuckle {
namespace {

constexpr std::size_t kTruncatedSize = 20;  // in the middle of the counts

}  // namespace

bool FaultyPort::send(const CanFrame& frame) noexcept {
  if (cut_) return true;  // who is cut off believes that it was sent
  if (doubled_[canopen::node_of(frame.id)]) (void)bus_.send(frame);
  return bus_.send(frame);
}

bool FaultyPort::receive(CanFrame& frame) noexcept {
  if (whispered_.pop(frame)) return true;
  while (bus_.receive(frame)) {
    if (!cut_ && !(drop_sync_ && frame.id == canopen::kSyncId)) return true;
  }
  return false;
}

bool TruncatingPort::write(const HidReport& report) noexcept {
  if (!truncating_) return port_.write(report);
  HidReport cut{};
  std::copy_n(report.begin(), kTruncatedSize, cut.begin());
  return port_.write(cut);
}

}  // namespace knuckle
