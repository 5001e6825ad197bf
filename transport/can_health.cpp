#include "transport/can_health.h"

#include <linux/can/error.h>

#include <cerrno>

namespace knuckle {

void CanHealth::on_error_frame(std::uint32_t error_class, const std::array<std::uint8_t, 8>& data) noexcept {
  ++counters_.error_frames;
  if ((error_class & (CAN_ERR_PROT | CAN_ERR_BUSERROR)) != 0) ++counters_.protocol_errors;
  if ((error_class & CAN_ERR_ACK) != 0) ++counters_.no_acknowledge;
  if ((error_class & CAN_ERR_CRTL) != 0) {
    constexpr unsigned kOverflow = CAN_ERR_CRTL_RX_OVERFLOW,
                       kPassive = CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE,
                       kBetter = CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING | CAN_ERR_CRTL_ACTIVE;
    const unsigned what = data[1];
    if ((what & kOverflow) != 0) ++counters_.controller_overflows;
    if ((what & kPassive) != 0) {
      if (!passive_) {
        ++counters_.passive;
        received_before_passive_ = counters_.received;
      }
      passive_ = true;
    } else if ((what & kBetter) != 0) {
      passive_ = false;
    }
    // Drivers fill in both counters with every change of state, whether or not they set CAN_ERR_CNT (Linux 6.0).
    counters_.transmit_errors = data[6];
    counters_.receive_errors = data[7];
  }
  if ((error_class & CAN_ERR_BUSOFF) != 0) {
    if (!off_) ++counters_.bus_off;
    off_ = was_off_ = true;
    passive_ = false;
  }
  if ((error_class & CAN_ERR_RESTARTED) != 0) {
    ++counters_.restarts;
    off_ = passive_ = false;
  }
}

void CanHealth::on_received() noexcept {
  ++counters_.received;
  works_again_ = true;
}

void CanHealth::on_sent() noexcept {
  ++counters_.sent;
  works_again_ = true;
}

void CanHealth::on_send_error(int error) noexcept {
  switch (error) {
    case ENOBUFS:  // the interface's queue
    case EAGAIN:   // the socket's share of it
      ++counters_.queue_full;
      return;
    case ENXIO:
    case ENODEV:
      ++counters_.not_sendable;
      return go_down(true);
    default:  // ENETDOWN, and whatever else makes sending impossible
      ++counters_.not_sendable;
      return go_down(false);
  }
}

void CanHealth::on_receive_error(int error) noexcept {
  if (error == EAGAIN || error == EINTR) return;
  go_down(error == ENODEV || error == ENXIO);
}

void CanHealth::go_down(bool gone) noexcept {
  if (!down_) ++counters_.downs;
  down_ = true;
  gone_ = gone_ || gone;
  works_again_ = false;
  off_ = passive_ = false;  // a controller that comes up again starts error-active
}

void CanHealth::on_look() noexcept {
  if (works_again_) down_ = gone_ = false;
}

CanState CanHealth::state() const noexcept {
  if (down_) return CanState::kDown;
  if (was_off_) return CanState::kBusOff;
  return passive_ ? CanState::kPassive : CanState::kActive;
}

void CanHealth::acknowledge() noexcept {
  was_off_ = off_;
  if (counters_.received > received_before_passive_) passive_ = false;
}

std::string CanHealth::diagnosis(const std::string& interface) const {
  const auto line = [&](const std::string& what) { return interface + ": " + what; };
  const std::string ip_link = "ip link set " + interface;
  if (gone_) return line("the interface is gone: plug the adapter in again and set it up");
  if (down_) return line("the interface is down: " + ip_link + " up");
  if (off_) return line("bus-off: correct wiring or bit rate, then " + ip_link + " type can restart");
  if (was_off_) return line("was bus-off and has been restarted: nothing is sent before an operator acknowledges it");
  if (passive_ && counters_.received == 0)
    return line("error-passive and no frame received: wrong bit rate, or no other node on the bus (power, cable)");
  if (passive_ && counters_.received == received_before_passive_)
    return line("error-passive and no frame received since: cable, termination, or all nodes without power");
  if (passive_) return line("error-passive, many frames are damaged: check bit rate, termination, cable, earth");
  if (counters_.received == 0 && counters_.queue_full > 0)
    return line("no frame is sent or received: " + ip_link + " down, then up, and check power and cable");
  return "";
}

}  // namespace knuckle
