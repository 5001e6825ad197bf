// The firmware's end of a USB cable as a file: a HID gadget (/dev/hidg0), or one end of a packet socket pair.
#pragma once

#include <string>

#include "core/descriptor.h"
#include "transport/hid_port.h"

namespace knuckle {

/// One report a read or write, never blocking. What the host has not fetched yet is not replaced: the newer report is
/// refused, as by a controller with one buffer. Where the host has gone, the file is closed at once, and opened again
/// every now and then.
class HidFilePort final : public HidPort {
 public:
  /// @param option named in messages, such as "--gadget". @throws InputError where the file cannot be opened.
  HidFilePort(const std::string& option, const std::string& path);
  /// Takes over a descriptor; one that is lost stays lost.
  explicit HidFilePort(int descriptor) noexcept;

  bool write(const HidReport& report) noexcept override;
  /// A report of another length comes out damaged: zeros behind it.
  bool read(HidReport& report) noexcept override;
  /// As the last call found it.
  [[nodiscard]] bool connected() const noexcept override { return connected_; }

 private:
  bool note(long result) noexcept;

  std::string path_;
  Descriptor descriptor_;
  bool connected_ = true;
  int failures_ = 0;
};

}  // namespace knuckle
