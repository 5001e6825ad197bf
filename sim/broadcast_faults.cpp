#include "sim/broadcast_faults.h"

#include <algorithm>

#include "transport/signal_codec.h"

namespace knuckle::sim {

void BroadcastFaults::inject(std::size_t frame, BroadcastFault fault, std::uint64_t signals) noexcept {
  frames_[frame] = {.fault = fault, .signals = signals, .last = frames_[frame].last};
}

void BroadcastFaults::spoil_values(std::size_t frame, const BroadcastFrame& sent, CanFrame& out) noexcept {
  const One& one = frames_[frame];
  if (one.fault == BroadcastFault::kNone) return;
  for (const BroadcastField& field : sent.fields) {
    if ((one.signals >> field.signal & 1U) == 0) continue;
    const std::uint64_t most = ~std::uint64_t{0} >> (64U - field.bits.bits),
                        raw = read_raw(field.bits, out).value_or(0);
    if (one.fault == BroadcastFault::kValuesFrozen)
      write_raw(field.bits, read_raw(field.bits, one.last).value_or(raw), out);
    else if (one.fault == BroadcastFault::kInvalid)
      write_raw(field.bits, field.invalid_from.value_or(most), out);
    else if (one.fault == BroadcastFault::kSpike && !one.spiked)
      write_raw(field.bits, raw ^ (most - most / 2), out);
  }
}

bool BroadcastFaults::spoil(std::size_t frame, const BroadcastFrame& sent, CanFrame& out) noexcept {
  One& one = frames_[frame];
  switch (one.fault) {
    case BroadcastFault::kSilent:
      return false;
    case BroadcastFault::kFrozen:
      if (one.last.size > 0) out = one.last;
      return true;
    case BroadcastFault::kChecksum:
      if (sent.closing.checksum) {
        const BitField& field = sent.closing.checksum->field;
        write_raw(field, read_raw(field, out).value_or(0) ^ 1U, out);
      }
      return true;
    case BroadcastFault::kShort:
      out.size = static_cast<std::uint8_t>(std::max(out.size - 1, 0));
      return true;
    case BroadcastFault::kSpike:
      one.spiked = true;
      return true;
    case BroadcastFault::kValuesFrozen:
    case BroadcastFault::kInvalid:
      return true;
    case BroadcastFault::kNone:
      break;
  }
  one.last = out;
  return true;
}

}  // namespace knuckle::sim
