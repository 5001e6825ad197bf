// The CANopen side that all simulated nodes share (CiA 301): network state, heartbeats, SDO server over an object
// table, one transmit and one receive PDO with honoured parameters. Devices put process values in and take them out by
// handle.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/time.h"
#include "machine/bus_description.h"
#include "transport/can_bus.h"
#include "transport/canopen.h"

namespace knuckle::sim {

/// Frames that nodes want to send in one step.
struct Outbox {
  std::array<CanFrame, 64> frames{};
  std::size_t count = 0;
  void push(const CanFrame& frame) noexcept {
    if (count < frames.size()) frames[count++] = frame;
  }
};

enum class Access : std::uint8_t { kReadOnly, kReadWrite };

class NodeProtocol {
 public:
  using Handle = std::size_t;
  /// Identifiers follow the pre-defined connection set; PDOs start enabled with these maps, producer heartbeat and
  /// timers off, as a device does before it is configured. @param tpdo_type every n-th SYNC, or kEventDriven.
  NodeProtocol(const NodeDescription& identity, const canopen::PdoMap& tpdo, std::uint8_t tpdo_type,
               const canopen::PdoMap& rpdo = {});

  /// Adds a device object before the first step; little-endian value of 1, 2 or 4 bytes.
  Handle add(canopen::Object object, std::uint8_t size, Access access, std::uint32_t value = 0) noexcept;
  [[nodiscard]] std::uint32_t value(Handle handle) const noexcept { return entries_[handle].value; }
  void set(Handle handle, std::uint32_t value) noexcept { entries_[handle].value = value; }
  /// Any object by its address; 0 where there is none. For tests and set-up.
  [[nodiscard]] std::uint32_t value(canopen::Object object) const noexcept;
  void replace(canopen::Object object, std::uint32_t value) noexcept;

  void receive(const CanFrame& frame, Time now, Outbox& out) noexcept;
  /// Boot-up message, heartbeat, EMCY once where the watched heartbeat is lost, and the TPDO where it is due, from the
  /// values of this moment.
  void step(Time now, Outbox& out) noexcept;
  void emergency(std::uint16_t code, Outbox& out) noexcept;

  [[nodiscard]] std::uint8_t id() const noexcept { return id_; }
  [[nodiscard]] canopen::NmtState state() const noexcept { return state_; }
  [[nodiscard]] bool operational() const noexcept { return state_ == canopen::NmtState::kOperational; }
  /// Whether this step's values can go out: the moment to sample.
  [[nodiscard]] bool samples_now() const noexcept;
  /// True once after something was written to the device's objects, by PDO or SDO.
  [[nodiscard]] bool take_written() noexcept;
  /// True once after this very object was written by SDO.
  [[nodiscard]] bool take_written(canopen::Object object) noexcept;
  /// True once after a reset of node or power-on.
  [[nodiscard]] bool take_reset() noexcept;
  /// The watched producer was heard and has been silent for longer than 0x1016:01 allows.
  [[nodiscard]] bool heartbeat_lost(Time now) const noexcept;
  /// The RPDO was heard while operational and has been missing for longer than 0x1400:05 allows.
  [[nodiscard]] bool rpdo_lost(Time now) const noexcept;

 private:
  static constexpr std::size_t kMapSlots = 4;
  struct Entry {
    canopen::Object object;
    std::uint8_t size = 0;
    Access access = Access::kReadOnly;
    std::uint32_t value = 0, at_power_on = 0;
  };
  /// Where a PDO's parameters live in the table, and what its map says, resolved.
  struct Pdo {
    Handle cob_id = 0, type = 0, timer = 0, count = 0;  ///< Map entries follow count.
    std::array<Handle, kMapSlots> mapped{};
    std::size_t length = 0, bytes = 0;
  };
  [[nodiscard]] Entry* find(canopen::Object object) noexcept;
  Pdo add_pdo(std::uint16_t parameters, std::uint32_t cob_id, std::uint8_t type, const canopen::PdoMap& map) noexcept;
  void resolve(Pdo& pdo) noexcept;
  [[nodiscard]] bool enabled(const Pdo& pdo) const noexcept;
  void obey(canopen::NmtCommand command) noexcept;
  /// Whatever can be written is kept over a reset from now on.
  void save() noexcept;
  void power_on(std::uint16_t first_index, std::uint16_t last_index) noexcept;
  void serve(const CanFrame& frame, Outbox& out) noexcept;
  [[nodiscard]] canopen::SdoAbort missing(canopen::Object object) const noexcept;
  [[nodiscard]] canopen::SdoAbort write(canopen::Object object, std::uint32_t value, std::uint8_t size) noexcept;
  [[nodiscard]] canopen::SdoAbort check(const Entry& entry, std::uint32_t value) noexcept;
  [[nodiscard]] canopen::SdoAbort check_map(const Pdo& pdo, const Entry& entry, std::uint32_t value) noexcept;
  [[nodiscard]] canopen::SdoAbort check_mapped(std::uint32_t mapping) noexcept;
  void take_rpdo(const CanFrame& frame, Time now, Outbox& out) noexcept;
  void send_tpdo(Time now, Outbox& out) noexcept;

  std::uint8_t id_;
  std::array<Entry, 40> entries_{};
  std::size_t used_ = 0;
  Handle error_register_ = 0, consumer_ = 0, producer_ = 0;
  Pdo tpdo_, rpdo_;
  canopen::NmtState state_ = canopen::NmtState::kBootUp;
  Time heartbeat_due_{}, producer_heard_ = kNever, rpdo_heard_ = kNever, tpdo_sent_ = kNever;
  std::uint32_t syncs_ = 0;
  bool sync_due_ = false, written_ = false, reset_ = true, loss_told_ = false;
  canopen::Object last_written_;
  CanFrame last_tpdo_;
};

}  // namespace knuckle::sim
