// A link whose datagrams, both ways, are shown to somebody else as well: a second screen, a recorder, a trainer.
#pragma once

#include "transport/link.h"

namespace knuckle {

/// Passes everything to and from `link`, and a copy to `mirror`, from which nothing is read.
class MirroredLink final : public Link {
 public:
  /// Both outlive this.
  MirroredLink(Link& link, Link& mirror) noexcept : link_(link), mirror_(mirror) {}

  bool send(std::span<const std::uint8_t> bytes) noexcept override {
    const bool sent = link_.send(bytes);
    (void)mirror_.send(bytes);
    return sent;
  }
  bool receive(Datagram& datagram) noexcept override {
    if (!link_.receive(datagram)) return false;
    (void)mirror_.send(datagram.view());
    return true;
  }
  [[nodiscard]] bool emptied() const noexcept override { return link_.emptied(); }

 private:
  Link& link_;
  Link& mirror_;
};

}  // namespace knuckle
