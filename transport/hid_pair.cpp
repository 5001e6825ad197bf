#include "transport/hid_pair.h"

namespace knuckle {

bool HidPair::End::write(const HidReport& report) noexcept {
  if (!connected_) return false;
  if (peer_->stored_ == kSlots) {
    ++dropped_;
    return false;
  }
  peer_->incoming_[(peer_->oldest_ + peer_->stored_++) % kSlots] = report;
  return true;
}

bool HidPair::End::read(HidReport& report) noexcept {
  if (readable_ == 0) return false;
  report = incoming_[oldest_];
  oldest_ = (oldest_ + 1) % kSlots;
  --readable_;
  --stored_;
  return true;
}

void HidPair::advance() noexcept {
  host_.readable_ = host_.stored_;
  device_.readable_ = device_.stored_;
}

void HidPair::unplug() noexcept {
  for (End* end : {&host_, &device_}) {
    end->connected_ = false;
    end->stored_ = end->readable_ = 0;
  }
}

}  // namespace knuckle
