// Who else speaks on the machine's bus. What arrives under an identifier that only this controller sends is somebody
// else's, as its own frames do not come back. And each node id must stand for one device: two send more frames under an
// identifier than its transmission type and period explain, and answer one SDO request twice.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/reason.h"
#include "core/time.h"
#include "machine/bus_frames.h"
#include "transport/can_bus.h"

namespace knuckle::slave {

class BusWatch {
 public:
  static constexpr Duration kStands = 1s;  ///< A foreign frame is a reason for so long.
  /// Frames beyond those that are due, as many as no delay explains; more where the file lets a sensor's value grow so
  /// old that more could be held up. Half of them are a sign.
  static constexpr double kMostOver = 12;
  /// Likewise where a node also sends whenever its inputs change: contacts bounce faster than it reads them.
  static constexpr double kMostOverWithEvents = 40;
  /// Room for a node's clock, and for single frames that an error on the bus makes arrive twice.
  static constexpr double kSpareBySync = 0.02, kSpareByClock = 0.05;

  explicit BusWatch(const BusDescription& bus);

  void receive(const CanFrame& frame, Time now) noexcept;
  /// SYNC was sent: what answers it is due once.
  void synced() noexcept;
  /// What nodes send by their own clocks is due.
  void step(Time now) noexcept;
  /// Whether all nodes run as they were configured: only then it is known what they send. Begins anew each time.
  void count_frames(bool on) noexcept;
  /// SDO requests of ours were answered so many times more than they were asked, although nobody else had asked.
  void note_second_answers(std::uint8_t node, int signs) noexcept { signs_[node & 0x7FU] = signs; }
  /// The nodes start anew: what was noted of them is forgotten.
  void restart() noexcept;

  /// kOtherController or kForeignSender for kStands after the newest such frame, as it was first heard; else kNone.
  [[nodiscard]] Reason foreign(Time now) const noexcept;
  /// kNodeIdTwice where two signs were seen of a node, or far too many frames; else kNone.
  [[nodiscard]] Reason twice() const noexcept;
  /// SDO requests of others that read, and the newest: no fault, but no secret either.
  [[nodiscard]] std::uint64_t foreign_reads() const noexcept { return reads_; }
  [[nodiscard]] std::uint8_t last_read_node() const noexcept { return last_read_; }

 private:
  enum class Kind : std::uint8_t { kNone, kController, kSetPoint, kRequest, kCounted };
  struct Identifier {
    Kind kind = Kind::kNone;
    std::uint8_t which = 0;  ///< Node id; kCounted: place in streams_.
  };
  /// What one node sends under one identifier, counted since it was last as much as is due.
  struct Stream {
    std::uint8_t node = 0;
    bool heartbeat = false;
    double per_sync = 0, per_s = 0;
    double most_over = kMostOver;
    bool by_change = false;  ///< A frame that is not as the one before it was sent for that.
    CanFrame newest{};
    double frames = 0, due = 0;
    [[nodiscard]] double over() const noexcept {
      return frames - due * (1 + (per_sync > 0 ? kSpareBySync : kSpareByClock));
    }
  };
  /// The first of several foreign frames, and when the newest came.
  struct Foreign {
    Reason reason;
    Time at = kNever;
    void hear(const Reason& why, Time now) noexcept;
  };
  [[nodiscard]] static Stream stream_of(const BusFrame& frame, std::uint8_t node, const BusDescription& bus);
  void add(std::uint32_t id, Kind kind, std::uint8_t which) noexcept { identifiers_[id & 0x7FFU] = {kind, which}; }
  void add_stream(std::uint32_t id, const Stream& stream);
  static void became_due(Stream& stream, double frames) noexcept;
  void on_request(const CanFrame& frame, std::uint8_t node, Time now) noexcept;

  std::array<Identifier, 0x800> identifiers_{};
  std::vector<CanFilter> commands_;  // frames that the machine's own controller is told by
  std::vector<Stream> streams_;      // sized once, at construction; those of a node side by side
  bool counting_ = false;
  Time stepped_at_ = kNever;
  Foreign controller_, sender_;
  std::array<int, 128> signs_{};  // second answers of each node
  std::uint64_t reads_ = 0;
  std::uint8_t last_read_ = 0;
};

}  // namespace knuckle::slave
