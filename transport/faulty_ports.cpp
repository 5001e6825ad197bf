#include "transport/faulty_ports.h"

#include "transport/canopen.h"

namespace knuckle {

bool FaultyPort::send(const CanFrame& frame) noexcept {
  if (cut_off(frame)) return true;  // who is cut off believes that it was sent
  if (frame.id <= kMostId && doubled_[canopen::node_of(frame.id)]) (void)bus_.send(frame);
  return bus_.send(frame);
}

bool FaultyPort::receive(CanFrame& frame) noexcept {
  if (whispered_.pop(frame)) return true;
  while (bus_.receive(frame)) {
    if (!cut_off(frame) && !(drop_sync_ && frame.id == canopen::kSyncId)) return true;
  }
  return false;
}

}  // namespace knuckle
