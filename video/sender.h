// The sending end of a camera: H.264 over RTP, each picture with the time it was captured, on a UDP socket of its own.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "video/frame.h"
#include "video/sealing.h"
#include "video/source.h"

namespace knuckle::video {

inline constexpr int kLeastRate_kbps = 200, kMostRate_kbps = 50000;

struct SenderSetup {
  CameraSource camera;
  std::string host;  ///< An address or a name.
  std::uint16_t port = 0;
  int rate_kbps = 4000;
  bool sealed = false;  ///< With a key that Sender::set_key() brings; nothing is sent before.
};

/// Instead of a camera: pictures of this size that Sender::give() brings.
[[nodiscard]] CameraSource given_pictures(const std::string& name, int width_px, int height_px);
/// The sender's pipeline as gst-launch-1.0 would take it. Marked AF41 (RFC 4594), below what leads the machine.
[[nodiscard]] std::string pipeline_of(const SenderSetup& setup);
/// As check_source() for a camera, of all that is between it and the network. @throws InputError, one line.
void check_sender(const SenderSetup& setup);
/// The source of pictures for Camera of what such a sender sends to this port of this computer.
/// @param address of this computer, that it listens at. @param sealed as the sender's.
[[nodiscard]] std::string receiver_of(std::uint16_t port, const std::string& address = "127.0.0.1",
                                      bool sealed = false);

class Sender {
 public:
  /// Begins to send. @param setup its camera checked before.
  explicit Sender(const SenderSetup& setup);
  /// Waits until GStreamer has let go of the camera.
  ~Sender();
  Sender(const Sender&) = delete;
  Sender& operator=(const Sender&) = delete;

  /// One thread: the newest picture of given_pictures(); those that the encoder has not taken yet are dropped.
  void give(std::unique_ptr<Frame> frame);
  /// Any thread: what pictures are sealed with from the next packet on; nullopt: nothing is sent.
  void set_key(const std::optional<PictureKey>& key);
  /// Any thread; never waits. Takes effect within 0.1 s.
  void set_rate(int kbps) noexcept;
  /// One thread.
  [[nodiscard]] const CameraStatus& status() noexcept;
  [[nodiscard]] std::uint64_t pictures() const noexcept;

 private:
  class Writer;
  std::unique_ptr<Writer> writer_;
  CameraStatus status_;
};

}  // namespace knuckle::video
