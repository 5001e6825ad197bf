#include "sim/lss_node.h"

namespace knuckle::sim {

using lss::Service;

namespace {

LssNode::Reply reply(Service service, std::uint32_t value = 0) noexcept {
  return {true, lss::answer(service, value), false};
}

}  // namespace

LssNode::Reply LssNode::receive(const CanFrame& frame, std::uint8_t active, const lss::Identity& own) noexcept {
  const auto asked = lss::parse_request(frame);
  if (!asked) return {};
  switch (asked->service) {
    case Service::kSwitchAll: {
      const bool leaves = state_ == lss::State::kConfiguration && asked->value == 0;
      if (asked->value <= 1) state_ = static_cast<lss::State>(asked->value);
      selected_ = {};
      return {false, {}, leaves && active == lss::kNoNodeId && pending_ != lss::kNoNodeId};
    }
    case Service::kSelectVendor:
      selected_.vendor = asked->value;
      return {};
    case Service::kSelectProduct:
      selected_.product = asked->value;
      return {};
    case Service::kSelectRevision:
      selected_.revision = asked->value;
      return {};
    case Service::kSelectSerial:
      selected_.serial = asked->value;
      if (!waiting() || selected_ != own) return {};
      state_ = lss::State::kConfiguration;
      return reply(Service::kSelected);
    case Service::kIdentifyVendor:
      low_.vendor = high_.vendor = asked->value;
      return {};
    case Service::kIdentifyProduct:
      low_.product = high_.product = asked->value;
      return {};
    case Service::kIdentifyRevisionLow:
      low_.revision = asked->value;
      return {};
    case Service::kIdentifyRevisionHigh:
      high_.revision = asked->value;
      return {};
    case Service::kIdentifySerialLow:
      low_.serial = asked->value;
      return {};
    case Service::kIdentifySerialHigh: {
      high_.serial = asked->value;
      const bool within = own.vendor == low_.vendor && own.product == low_.product && own.revision >= low_.revision &&
                          own.revision <= high_.revision && own.serial >= low_.serial && own.serial <= high_.serial;
      return within ? reply(Service::kIdentified) : Reply{};
    }
    case Service::kIdentifyUnconfigured:
      return active == lss::kNoNodeId ? reply(Service::kUnconfigured) : Reply{};
    default:
      return waiting() ? Reply{} : configure(*asked, active, own);
  }
}

LssNode::Reply LssNode::configure(const lss::Message& asked, std::uint8_t active, const lss::Identity& own) noexcept {
  switch (asked.service) {
    case Service::kConfigureNodeId: {
      const bool valid = (asked.value >= 1 && asked.value <= 127) || asked.value == lss::kNoNodeId;
      const std::uint8_t error = valid ? node_id_error_ : 1;
      if (error == 0) pending_ = static_cast<std::uint8_t>(asked.value);
      return reply(asked.service, error);
    }
    case Service::kStore:
      if (store_error_ == 0) stored_ = pending_;
      return reply(asked.service, store_error_);
    case Service::kAskVendor:
      return reply(asked.service, own.vendor);
    case Service::kAskProduct:
      return reply(asked.service, own.product);
    case Service::kAskRevision:
      return reply(asked.service, own.revision);
    case Service::kAskSerial:
      return reply(asked.service, own.serial);
    case Service::kAskNodeId:
      return reply(asked.service, active);
    default:
      return {};
  }
}

}  // namespace knuckle::sim
