#include "transport/thread_wires.h"

namespace knuckle {

void ThreadCan::exchange(CanBus& port) noexcept {
  if (controller_.acknowledged_.exchange(false, std::memory_order_relaxed)) port.acknowledge();
  CanFrame frame;
  // A port that refuses a frame has dropped it: a set-point is never repeated, only followed by a newer one.
  while (controller_.sent_.pop(frame)) (void)port.send(frame);
  while (port.receive(frame)) (void)controller_.arrived_.push(frame);
  (void)port.state();
  controller_.told_.store(port.states(), std::memory_order_relaxed);
  controller_.errors_.store(port.errors(), std::memory_order_relaxed);
}

}  // namespace knuckle
