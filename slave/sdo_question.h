// What a node says in its process data, asked by SDO: one that is not operational sends none, but answers.
#pragma once

#include <cstdint>
#include <optional>

#include "machine/bus_description.h"
#include "transport/canopen.h"

namespace knuckle::slave {

/// Of the axis that this joint's valve is. @param object of a driver with one axis.
[[nodiscard]] inline canopen::Object valve_object(const BusDescription& bus, int joint,
                                                  canopen::Object object) noexcept {
  return of_axis(object, bus.valve_channel(joint).number);
}

/// What this object holds, where this is the answer to that question.
[[nodiscard]] inline std::optional<std::uint32_t> answered(const canopen::SdoResponse& answer,
                                                           canopen::Object object) noexcept {
  if (answer.kind != canopen::SdoResponse::Kind::kUploaded || answer.object != object) return std::nullopt;
  return answer.value;
}

}  // namespace knuckle::slave
