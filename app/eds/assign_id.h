// `knuckle bus assign-id`: gives one CANopen device its node id over the bus, by LSS (CiA 305) or by the device's own
// objects, and makes sure by its identity that it was this device and no other.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "machine/bus_description.h"
#include "transport/bus_access.h"
#include "transport/canopen.h"
#include "transport/lss.h"

namespace knuckle::eds {

struct IdRequest {
  std::uint8_t id = 0;
  std::optional<std::uint8_t> from;      ///< Its node id now. Else: the only device that answers LSS.
  std::optional<std::uint32_t> serial;   ///< Of several equal devices that answer LSS, this one.
  std::vector<canopen::Object> objects;  ///< Hold its node id, all of them. None: by LSS.
  /// What else the bus has. Without nodes: of this nothing is known.
  BusDescription bus;
  std::string machine;  ///< The file that says so, for messages.
};

struct AssignedId {
  lss::Identity device;
  std::uint8_t before = lss::kNoNodeId;
  std::string problem;  ///< What the device did not do; empty: it was found under its new node id.
};

/// @param check called every millisecond and told whether the device may have another id already; may throw to end it.
/// However it ends, no device is left in LSS state configuration.
/// @throws InputError in one line, before any device was told another id: somebody else is on the bus, the id is in
/// use, no device answers or more than one, or it is not the one that the machine file has under this id.
[[nodiscard]] AssignedId assign_id(BusAccess& access, const IdRequest& request,
                                   const std::function<void(bool told)>& check = {});

/// "vendor 0x01000019, product 0x53373235, revision 0x00010100, serial 4711"
[[nodiscard]] std::string text(const lss::Identity& device);

}  // namespace knuckle::eds
