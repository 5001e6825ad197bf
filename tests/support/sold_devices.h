// Several devices as they are delivered, each at its own plug of one bus, and a controller's interface.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "sim/can_nodes.h"
#include "transport/bus_access.h"
#include "transport/canopen.h"
#include "transport/lss.h"
#include "transport/virtual_can.h"

namespace knuckle::test {

class SoldDevices {
 public:
  static constexpr std::uint32_t kVendor = 0x01000019, kProduct = 0x53373235, kRevision = 0x00010100;
  static constexpr canopen::Object kIdA{0x20F0, 0}, kIdB{0x20F1, 0};

  /// All plugged in and without a node id.
  explicit SoldDevices(const std::vector<std::uint32_t>& serials) : bus(1 + serials.size(), 500000) {
    bus.set_tap(
        {[](void* self, Time, const CanFrame& frame) { static_cast<SoldDevices*>(self)->heard.push_back(frame); },
         this});
    for (const std::uint32_t serial : serials) {
      devices.push_back(std::make_unique<sim::NodeProtocol>(
          identity(), sim::NodeProtocol::TpdoMaps{canopen::kValveTpdo}, 1, std::vector{canopen::kValveRpdo}));
      become(devices.size() - 1, kProduct, serial);
      devices.back()->start_as(lss::kNoNodeId);
    }
    plugged.assign(serials.size(), true);
  }
  SoldDevices(const SoldDevices&) = delete;
  SoldDevices& operator=(const SoldDevices&) = delete;

  void become(std::size_t which, std::uint32_t product, std::uint32_t serial) {
    using sim::Access;
    devices[which]->become({{canopen::kDeviceType, 4, Access::kReadOnly, 0x198},
                            {canopen::kVendorId, 4, Access::kReadOnly, kVendor},
                            {canopen::kProductCode, 4, Access::kReadOnly, product},
                            {{0x1018, 3}, 4, Access::kReadOnly, kRevision},
                            {canopen::kSerialNumber, 4, Access::kReadOnly, serial},
                            {canopen::kTpdo1CobId, 4, Access::kReadWrite, canopen::tpdo1_id(kMadeFor)},
                            {canopen::kProducerHeartbeat, 2, Access::kReadWrite, 0},
                            {kIdA, 1, Access::kReadWrite, 0x7F},
                            {kIdB, 1, Access::kReadWrite, 0x7F}});
  }
  /// The others have no plug in the bus.
  void plug_in_only(std::size_t which) {
    for (std::size_t i = 0; i < plugged.size(); ++i) {
      plugged[i] = i == which;
      bus.disconnect(i + 1, !plugged[i]);
    }
  }
  void plug_all_in() {
    for (std::size_t i = 0; i < plugged.size(); ++i) {
      plugged[i] = true;
      bus.disconnect(i + 1, false);
    }
  }
  void run(Duration time) {
    for (const Time end = now + time; now < end;) tick();
  }
  /// @param interface in place of the controller's port
  [[nodiscard]] BusAccess access(CanBus* interface = nullptr) {
    return {"can0", std::shared_ptr<CanBus>(std::shared_ptr<void>(), interface != nullptr ? interface : &bus.port(0)),
            [this](Time due) {
              while (now < due) tick();
              return now;
            }};
  }

  VirtualCanBus bus;
  std::vector<std::unique_ptr<sim::NodeProtocol>> devices;
  std::vector<bool> plugged;
  std::vector<CanFrame> heard;  ///< Every frame of the bus.
  Time now{};
  /// Whoever else is on the bus, every millisecond.
  std::function<void()> each_tick;
  /// What becomes of answers over LSS that are sent at once; nothing: each is heard.
  std::function<void(std::vector<CanFrame>& answers)> collide;

 private:
  static constexpr std::uint8_t kMadeFor = 0x10;
  static NodeDescription identity() {
    NodeDescription node;
    node.id = kMadeFor;
    return node;
  }
  void tick() {
    now += 1ms;
    bus.advance(now);
    if (each_tick) each_tick();
    std::vector<CanFrame> answers;
    for (std::size_t i = 0; i < devices.size(); ++i) {
      if (!plugged[i]) continue;
      CanBus& plug = bus.port(i + 1);
      sim::Outbox out;
      for (CanFrame frame; plug.receive(frame);) devices[i]->receive(frame, now, out);
      devices[i]->step(now, out);
      for (std::size_t f = 0; f < out.count; ++f) {
        if (out.frames[f].id == lss::kAnswerId && collide) {
          answers.push_back(out.frames[f]);
        } else {
          plug.send(out.frames[f]);
        }
      }
    }
    if (!answers.empty()) collide(answers);
    for (const CanFrame& answer : answers) bus.port(1).send(answer);
  }
};

}  // namespace knuckle::test
