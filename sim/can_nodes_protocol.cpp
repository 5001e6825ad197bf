#include <algorithm>
#include <utility>

#include "sim/can_nodes.h"

namespace knuckle::sim {

using canopen::NmtCommand;
using canopen::NmtState;
using canopen::Object;
using canopen::SdoAbort;
using canopen::SdoRequest;

namespace {

constexpr std::uint16_t kRpdoParameters = 0x1400, kTpdoParameters = 0x1800, kMapOffset = 0x200;
constexpr std::uint16_t kRpdoMaps = kRpdoParameters + kMapOffset, kTpdoMaps = kTpdoParameters + kMapOffset;
constexpr std::uint8_t kCobId = 1, kType = 2;  // sub-indices of a PDO's parameters
constexpr std::uint32_t kMostSyncs = 240;      // a transmission type up to this is every so many SYNCs
constexpr std::uint32_t kByTimer = 254;        // as the manufacturer likes: here by its timer alone; 255 also on change
constexpr std::uint16_t kFirstDeviceIndex = 0x2000;
constexpr std::uint16_t kFirstAxisIndex = 0x6000, kAxisIndices = 0x800;
constexpr std::uint32_t kNoRemoteRequest = 0x40000000;  // bit 30 of a COB-ID
constexpr Object kRevision{0x1018, 3};

/// The object of an entry of a map.
Object mapped_by(std::uint32_t mapping) noexcept {
  return {static_cast<std::uint16_t>(mapping >> 16), static_cast<std::uint8_t>(mapping >> 8)};
}

/// Of a device that lets nobody change it.
canopen::PdoMap own_map(const NodeDescription& node, std::size_t pdo) noexcept {
  canopen::PdoMap map;
  if (pdo >= node.tpdo_maps.size()) return map;
  for (const std::uint32_t entry : node.tpdo_maps[pdo]) map.entries.at(map.count++) = entry;
  return map;
}

Duration milliseconds(std::uint32_t value) noexcept {
  return std::chrono::milliseconds(value & 0xFFFFU);
}

}  // namespace

NodeProtocol::NodeProtocol(const NodeDescription& identity, const TpdoMaps& tpdos, std::uint8_t tpdo_type,
                           const std::vector<canopen::PdoMap>& rpdos)
    : id_(identity.id), cob_id_of_(identity.id) {
  lss_.set_node_id(id_);
  add(canopen::kDeviceType, 4, Access::kReadOnly, identity.device_type);
  error_register_ = add(canopen::kErrorRegister, 1, Access::kReadOnly);
  consumer_ = add(canopen::kConsumerHeartbeat, 4, Access::kReadWrite);
  producer_ = add(canopen::kProducerHeartbeat, 2, Access::kReadWrite);
  add(canopen::kVendorId, 4, Access::kReadOnly, identity.vendor);
  add(canopen::kProductCode, 4, Access::kReadOnly, identity.product);
  for (std::size_t i = 0; i < rpdos.size(); ++i) {
    const auto parameters = static_cast<std::uint16_t>(kRpdoParameters + i);
    const std::uint32_t cob_id = canopen::rpdo_id(id_, static_cast<unsigned>(i) + 1);
    rpdos_.push_back({add_pdo(parameters, cob_id, canopen::kEventDriven, rpdos[i])});
  }
  const bool fixed = !identity.tpdo_maps.empty();
  for (std::size_t i = 0; i < kTpdos; ++i) {
    const auto parameters = static_cast<std::uint16_t>(kTpdoParameters + i);
    tpdos_[i].pdo = add_pdo(parameters, canopen::tpdo_id(id_, static_cast<unsigned>(i) + 1), tpdo_type,
                            fixed ? own_map(identity, i) : tpdos[i], fixed ? Access::kReadOnly : Access::kReadWrite);
  }
}

NodeProtocol::Handle NodeProtocol::add(Object object, std::uint8_t size, Access access, std::uint32_t value) {
  entries_.push_back({object, size, access, value, value});
  return entries_.size() - 1;
}

NodeProtocol::Pdo NodeProtocol::add_pdo(std::uint16_t parameters, std::uint32_t cob_id, std::uint8_t type,
                                        const canopen::PdoMap& map, Access map_access) {
  Pdo pdo;
  pdo.cob_id = add({parameters, kCobId}, 4, Access::kReadWrite, cob_id | (map.count == 0 ? canopen::kPdoDisabled : 0U));
  pdo.type = add({parameters, kType}, 1, Access::kReadWrite, type);
  pdo.timer = add({parameters, 5}, 2, Access::kReadWrite);
  const auto map_index = static_cast<std::uint16_t>(parameters + kMapOffset);
  pdo.count = add({map_index, 0}, 1, map_access, map.count);
  for (std::uint8_t i = 0; i < kMapSlots; ++i) {
    add({map_index, static_cast<std::uint8_t>(i + 1)}, 4, map_access, i < map.count ? map.entries[i] : 0);
  }
  return pdo;
}

NodeProtocol::Entry* NodeProtocol::find(Object object) noexcept {
  for (Entry& entry : entries_) {
    if (entry.object == object) return &entry;
  }
  return nullptr;
}

std::uint32_t NodeProtocol::value(Object object) const noexcept {
  const Entry* entry = const_cast<NodeProtocol*>(this)->find(object);
  return entry != nullptr ? entry->value : 0;
}

void NodeProtocol::replace(Object object, std::uint32_t value) noexcept {
  if (Entry* entry = find(object)) entry->value = entry->at_power_on = value;
  count_tpdos();
}

void NodeProtocol::become(const std::vector<DeviceObject>& dictionary) {
  const auto of_device = [&dictionary](Object object) {
    return std::find_if(dictionary.begin(), dictionary.end(),
                        [&](const DeviceObject& one) { return one.object == object; });
  };
  for (Entry& entry : entries_) {
    const auto sold = of_device(entry.object);
    if (sold == dictionary.end()) {
      entry.object = {};
      continue;
    }
    entry.access = sold->access;
    entry.value = entry.at_power_on = sold->value;
  }
  for (const DeviceObject& entry : dictionary) {
    if (find(entry.object) == nullptr) add(entry.object, entry.size, entry.access, entry.value);
  }
  power_on(0, 0xFFFF);
}

void NodeProtocol::set_serial(std::uint32_t serial) {
  if (find(canopen::kSerialNumber) == nullptr) add(canopen::kSerialNumber, 4, Access::kReadOnly);
  replace(canopen::kSerialNumber, serial);
}

void NodeProtocol::start_as(std::uint8_t id) noexcept {
  lss_.set_node_id(id);
  take_node_id(false);
  power_on(0, 0xFFFF);
}

void NodeProtocol::remove(Object object) noexcept {
  if (Entry* entry = find(object)) entry->object = {};
}

void NodeProtocol::refuse(Object object, SdoAbort abort) noexcept {
  if (Entry* entry = find(object)) entry->refusal = abort;
}

void NodeProtocol::resolve(Pdo& pdo) noexcept {
  pdo.length = std::min<std::size_t>(entries_[pdo.count].value, kMapSlots);
  pdo.bytes = 0;
  for (std::size_t i = 0; i < pdo.length; ++i) {
    const std::uint32_t mapping = entries_[pdo.count + 1 + i].value;
    const Entry* entry = find(mapped_by(mapping));
    pdo.mapped[i] = entry == nullptr ? kDummy : static_cast<Handle>(entry - entries_.data());
    pdo.mapped_bytes[i] = entry == nullptr ? (mapping & 0xFFU) / 8 : entry->size;
    if (pdo.bytes + pdo.mapped_bytes[i] > sizeof(CanFrame::data)) {  // delivered so: no write gets here
      pdo.length = i;
      return;
    }
    pdo.bytes += pdo.mapped_bytes[i];
  }
}

bool NodeProtocol::enabled(const Pdo& pdo) const noexcept {
  return (entries_[pdo.cob_id].value & canopen::kPdoDisabled) == 0;
}

// The first PDO's type says when it samples even while that PDO is disabled: its objects are read by SDO, too.
bool NodeProtocol::samples_now() const noexcept {
  if (!operational()) return true;
  for (std::size_t i = 0; i < used_tpdos_; ++i) {
    const bool due = tpdos_[i].sync_due || entries_[tpdos_[i].pdo.type].value > kMostSyncs;
    if (due && (i == 0 || enabled(tpdos_[i].pdo))) return true;
  }
  return false;
}

void NodeProtocol::count_tpdos() noexcept {
  used_tpdos_ = 1;
  for (std::size_t i = 1; i < kTpdos; ++i) {
    if (enabled(tpdos_[i].pdo)) {
      used_tpdos_ = i + 1;
    } else {
      tpdos_[i].sync_due = false;  // a SYNC of before is none of its next life
    }
  }
}

NodeProtocol::Tpdo* NodeProtocol::tpdo_with(std::uint16_t index, std::uint16_t first) noexcept {
  return index >= first && index < first + kTpdos ? &tpdos_[static_cast<std::size_t>(index - first)] : nullptr;
}

NodeProtocol::Rpdo* NodeProtocol::rpdo_with(std::uint16_t index, std::uint16_t first) noexcept {
  return index >= first && index < first + rpdos_.size() ? &rpdos_[static_cast<std::size_t>(index - first)] : nullptr;
}

NodeProtocol::Rpdo* NodeProtocol::rpdo_under(std::uint32_t id) noexcept {
  for (Rpdo& rpdo : rpdos_)
    if (id == (entries_[rpdo.pdo.cob_id].value & ~kNoRemoteRequest)) return &rpdo;
  return nullptr;
}

void NodeProtocol::note_written(Object object) noexcept {
  const std::size_t index = std::max(object.index, kFirstAxisIndex);
  written_[std::min((index - kFirstAxisIndex) / kAxisIndices, written_.size() - 1)] = true;
}

bool NodeProtocol::take_written_axis(std::size_t axis) noexcept {
  return std::exchange(written_[axis], false);
}

bool NodeProtocol::take_written(Object object) noexcept {
  const bool written = last_written_ == object;
  if (written) last_written_ = {};
  return written;
}

bool NodeProtocol::take_reset() noexcept {
  const bool reset = reset_;
  reset_ = false;
  return reset;
}

bool NodeProtocol::heartbeat_lost(Time now) const noexcept {
  const Duration allowed = milliseconds(entries_[consumer_].value);
  return allowed > Duration::zero() && producer_heard_ != kNever && now - producer_heard_ > allowed;
}

bool NodeProtocol::rpdo_lost(Time now, std::size_t rpdo) const noexcept {
  const Time heard = rpdos_[rpdo].heard;
  const Duration allowed = milliseconds(entries_[rpdos_[rpdo].pdo.timer].value);
  return allowed > Duration::zero() && heard != kNever && now - heard > allowed;
}

void NodeProtocol::receive(const CanFrame& frame, Time now, Outbox& out) noexcept {
  if (frame.id == lss::kRequestId) return hear_lss(frame, out);
  if (state_ == NmtState::kBootUp) return;
  if (frame.id == canopen::kSyncId) {
    if (operational()) hear_sync();
  } else if (frame.id == canopen::kNmtId) {
    const auto request = canopen::parse_nmt(frame);
    if (request && (request->node == 0 || request->node == id_)) obey(request->command);
  } else if (frame.id == canopen::sdo_request_id(id_)) {
    if (state_ == NmtState::kOperational || state_ == NmtState::kPreOperational) serve(frame, out);
  } else if (Rpdo* const rpdo = rpdo_under(frame.id)) {
    take_rpdo(*rpdo, frame, now, out);
  } else if (frame.id == canopen::heartbeat_id(static_cast<std::uint8_t>(entries_[consumer_].value >> 16 & 0x7FU))) {
    if (canopen::parse_heartbeat(frame)) producer_heard_ = now;
  }
}

void NodeProtocol::hear_lss(const CanFrame& frame, Outbox& out) noexcept {
  const bool boots = state_ == NmtState::kBootUp && id_ != lss::kNoNodeId;
  if (!has_lss_ || boots) return;
  const LssNode::Reply reply = lss_.receive(
      frame, id_,
      {value(canopen::kVendorId), value(canopen::kProductCode), value(kRevision), value(canopen::kSerialNumber)});
  if (reply.answers) out.push(reply.frame);
  if (reply.boots) obey(NmtCommand::kResetCommunication);
}

void NodeProtocol::take_node_id(bool all) noexcept {
  std::uint8_t id = lss_.pending();
  if (all && !id_objects_.empty()) {
    id = static_cast<std::uint8_t>(value(id_objects_[0]));
    for (const Object object : id_objects_) {
      if (Entry* entry = find(object)) entry->at_power_on = entry->value;
      if (value(object) != id) id = id_;
    }
    if (id < 1 || id > 127) id = id_;
    lss_.set_node_id(id);
  }
  if (id != lss::kNoNodeId) {
    const auto move = [&](Handle cob_id) {
      Entry& entry = entries_[cob_id];
      if (canopen::node_of(entry.at_power_on) == cob_id_of_)
        entry.at_power_on += static_cast<std::uint32_t>(id - cob_id_of_);
    };
    for (const Rpdo& rpdo : rpdos_) move(rpdo.pdo.cob_id);
    for (const Tpdo& tpdo : tpdos_) move(tpdo.pdo.cob_id);
    cob_id_of_ = id;
  }
  id_ = id;
}

void NodeProtocol::hear_sync() noexcept {
  for (std::size_t i = 0; i < used_tpdos_; ++i) {
    Tpdo& tpdo = tpdos_[i];
    const std::uint32_t every = entries_[tpdo.pdo.type].value;
    if (every >= 1 && every <= kMostSyncs && ++tpdo.syncs % every == 0) tpdo.sync_due = true;
  }
}

void NodeProtocol::take_rpdo(Rpdo& rpdo, const CanFrame& frame, Time now, Outbox& out) noexcept {
  if (!operational()) return;
  const Pdo& pdo = rpdo.pdo;
  if (frame.size < pdo.bytes) {
    emergency(0x8210, out);
    return;
  }
  std::size_t at = 0;
  for (std::size_t i = 0; i < pdo.length; ++i) {
    if (pdo.mapped[i] == kDummy) {
      at += pdo.mapped_bytes[i];
      continue;
    }
    Entry& entry = entries_[pdo.mapped[i]];
    note_written(entry.object);
    entry.value = 0;
    for (std::size_t byte = 0; byte < entry.size; ++byte) {
      entry.value |= std::uint32_t{frame.data[at++]} << (8 * byte);
    }
  }
  rpdo.heard = now;
}

void NodeProtocol::obey(NmtCommand command) noexcept {
  switch (command) {
    case NmtCommand::kStart:
      state_ = NmtState::kOperational;
      break;
    case NmtCommand::kStop:
      state_ = NmtState::kStopped;
      break;
    case NmtCommand::kEnterPreOperational:
      state_ = NmtState::kPreOperational;
      break;
    case NmtCommand::kResetNode:
      take_node_id(true);
      power_on(0, 0xFFFF);
      break;
    case NmtCommand::kResetCommunication:
      take_node_id(false);
      power_on(0, kFirstDeviceIndex - 1);
      break;
  }
  for (Tpdo& tpdo : tpdos_) {
    tpdo.syncs = 0;
    tpdo.sync_due = false;
    tpdo.sent = kNever;
  }
  for (Rpdo& rpdo : rpdos_) rpdo.heard = kNever;
}

void NodeProtocol::save() noexcept {
  for (Entry& entry : entries_) entry.at_power_on = entry.value;
}

void NodeProtocol::power_on(std::uint16_t first_index, std::uint16_t last_index) noexcept {
  for (Entry& entry : entries_) {
    if (entry.object.index >= first_index && entry.object.index <= last_index) entry.value = entry.at_power_on;
  }
  state_ = NmtState::kBootUp;
  producer_heard_ = kNever;
  reset_ = true;
}

void NodeProtocol::step(Time now, Outbox& out) noexcept {
  if (state_ == NmtState::kBootUp) {
    if (id_ == lss::kNoNodeId) return;
    if (boots_since_ == kNever) boots_since_ = now;
    if (now - boots_since_ < boot_time_) return;
    boots_since_ = kNever;
    for (Tpdo& tpdo : tpdos_) resolve(tpdo.pdo);
    for (Rpdo& rpdo : rpdos_) resolve(rpdo.pdo);
    count_tpdos();
    out.push(canopen::heartbeat_frame(id_, NmtState::kBootUp));
    state_ = NmtState::kPreOperational;
    heartbeat_due_ = now;
  }
  if (const Duration period = milliseconds(entries_[producer_].value); period > Duration::zero()) {
    if (now >= heartbeat_due_) {
      out.push(canopen::heartbeat_frame(id_, state_));
      heartbeat_due_ = now + period;
    }
  }
  const bool lost = heartbeat_lost(now);
  if (lost && !loss_told_) {
    emergency(canopen::kEmcyHeartbeat, out);
    communication_error();
  }
  loss_told_ = lost;
  if (!lost && !device_error_ && entries_[error_register_].value != 0) emergency(canopen::kEmcyReset, out);
  for (std::size_t i = 0; i < used_tpdos_; ++i) {
    if (operational() && enabled(tpdos_[i].pdo) && tpdos_[i].pdo.length > 0) send(tpdos_[i], now, out);
    tpdos_[i].sync_due = false;
  }
}

void NodeProtocol::send(Tpdo& tpdo, Time now, Outbox& out) noexcept {
  const Pdo& pdo = tpdo.pdo;
  const bool event_driven = entries_[pdo.type].value > kMostSyncs;
  if (!event_driven && !tpdo.sync_due) return;
  CanFrame frame;
  frame.id = entries_[pdo.cob_id].value & 0x7FFU;
  frame.size = static_cast<std::uint8_t>(pdo.bytes);
  std::size_t at = 0;
  for (std::size_t i = 0; i < pdo.length; ++i) {
    if (pdo.mapped[i] == kDummy) {
      at += pdo.mapped_bytes[i];
      continue;
    }
    const Entry& entry = entries_[pdo.mapped[i]];
    for (std::size_t byte = 0; byte < entry.size; ++byte) {
      frame.data[at++] = static_cast<std::uint8_t>(entry.value >> (8 * byte));
    }
  }
  if (event_driven) {
    const Duration period = milliseconds(entries_[pdo.timer].value);
    const bool repeat = period > Duration::zero() && now - tpdo.sent >= period;
    const bool by_timer_alone = entries_[pdo.type].value == kByTimer;
    if (tpdo.sent != kNever && (by_timer_alone || frame == tpdo.last) && !repeat) return;
  }
  tpdo.last = frame;
  tpdo.sent = now;
  out.push(frame);
}

void NodeProtocol::communication_error() noexcept {
  constexpr std::uint32_t kGoPreOperational = 0, kStop = 2;
  const Entry* behaviour = find(canopen::kErrorBehaviour);
  if (behaviour == nullptr || !operational()) return;
  if (behaviour->value == kGoPreOperational) obey(NmtCommand::kEnterPreOperational);
  if (behaviour->value == kStop) obey(NmtCommand::kStop);
}

void NodeProtocol::emergency(std::uint16_t code, Outbox& out) noexcept {
  const std::uint8_t error_register = code == canopen::kEmcyReset ? 0 : 1;
  entries_[error_register_].value = error_register;
  if (state_ == NmtState::kStopped || id_ == lss::kNoNodeId) return;
  out.push(canopen::emergency_frame(id_, {code, error_register, {}}));
}

void NodeProtocol::serve(const CanFrame& frame, Outbox& out) noexcept {
  const auto request = canopen::parse_sdo_request(frame);
  if (!request || request->kind == SdoRequest::Kind::kAbort) return;
  SdoAbort abort = SdoAbort::kUnknownCommand;
  if (request->kind == SdoRequest::Kind::kUpload) {
    if (const Entry* entry = find(request->object)) {
      out.push(canopen::sdo_uploaded(id_, request->object, entry->value, entry->size));
      return;
    }
    abort = missing(request->object);
  } else if (request->kind == SdoRequest::Kind::kDownload) {
    abort = write(request->object, request->value, request->size);
    if (abort == SdoAbort::kNone) {
      out.push(canopen::sdo_downloaded(id_, request->object));
      return;
    }
  }
  out.push(canopen::sdo_aborted(id_, request->object, abort));
}

SdoAbort NodeProtocol::missing(Object object) const noexcept {
  const bool other_subindex = std::any_of(entries_.begin(), entries_.end(),
                                          [&](const Entry& entry) { return entry.object.index == object.index; });
  return other_subindex ? SdoAbort::kNoSubindex : SdoAbort::kNoObject;
}

SdoAbort NodeProtocol::write(Object object, std::uint32_t value, std::uint8_t size) noexcept {
  if (object == canopen::kStoreParameters) {
    if (value != canopen::kSaveSignature) return SdoAbort::kCannotStore;
    save();
    return SdoAbort::kNone;
  }
  Entry* entry = find(object);
  if (entry == nullptr) return missing(object);
  if (entry->access == Access::kReadOnly) return SdoAbort::kReadOnly;
  if (entry->refusal != SdoAbort::kNone) return entry->refusal;
  if (size != 0 && size != entry->size) return size > entry->size ? SdoAbort::kTooLong : SdoAbort::kTooShort;
  if (const SdoAbort abort = check(*entry, value); abort != SdoAbort::kNone) return abort;
  entry->value = value;
  if (Tpdo* tpdo = tpdo_with(object.index, kTpdoMaps); tpdo != nullptr && object.subindex == 0) resolve(tpdo->pdo);
  if (Rpdo* rpdo = rpdo_with(object.index, kRpdoMaps); rpdo != nullptr && object.subindex == 0) resolve(rpdo->pdo);
  if (object == canopen::kConsumerHeartbeat) producer_heard_ = kNever;
  if (Tpdo* tpdo = tpdo_with(object.index, kTpdoParameters)) {
    if (object.subindex == kType) tpdo->syncs = 0;
    if (object.subindex == kCobId) count_tpdos();
  }
  if (object.index >= kFirstDeviceIndex) {
    note_written(object);
    last_written_ = object;
  }
  return SdoAbort::kNone;
}

SdoAbort NodeProtocol::check(const Entry& entry, std::uint32_t value) noexcept {
  const Object object = entry.object;
  const bool of_tpdo = tpdo_with(object.index, kTpdoParameters) != nullptr;
  const bool of_rpdo = rpdo_with(object.index, kRpdoParameters) != nullptr;
  if ((of_tpdo || of_rpdo) && object.subindex == kCobId) {
    if ((value & canopen::kPdoDisabled) != 0) return SdoAbort::kNone;
    const bool moves_while_enabled = (entry.value & canopen::kPdoDisabled) == 0 && (entry.value ^ value) != 0;
    // 29-bit identifiers (bit 29) and those of other services are refused.
    const std::uint32_t id = value & ~kNoRemoteRequest;
    return moves_while_enabled || id < 0x181 || id > 0x57F ? SdoAbort::kInvalidValue : SdoAbort::kNone;
  }
  if (of_tpdo && object.subindex == kType) {
    return value == 0 || (value > kMostSyncs && value < 254) ? SdoAbort::kInvalidValue : SdoAbort::kNone;
  }
  if (of_rpdo && object.subindex == kType) return value < 254 ? SdoAbort::kInvalidValue : SdoAbort::kNone;
  if (const Tpdo* tpdo = tpdo_with(object.index, kTpdoMaps)) return check_map(tpdo->pdo, entry, value);
  if (const Rpdo* rpdo = rpdo_with(object.index, kRpdoMaps)) return check_map(rpdo->pdo, entry, value);
  if (object == canopen::kConsumerHeartbeat) {
    return (value >> 16) > 127 ? SdoAbort::kInvalidValue : SdoAbort::kNone;
  }
  return SdoAbort::kNone;
}

// CiA 301: disable the PDO, set the count to 0, write the entries, set the count, enable.
SdoAbort NodeProtocol::check_map(const Pdo& pdo, const Entry& entry, std::uint32_t value) noexcept {
  if (enabled(pdo)) return SdoAbort::kUnsupportedAccess;
  if (entry.object.subindex > 0) {
    return entries_[pdo.count].value != 0 ? SdoAbort::kUnsupportedAccess : check_mapped(value);
  }
  if (value > kMapSlots) return SdoAbort::kPdoTooLong;
  unsigned bits = 0;
  for (std::size_t i = 0; i < value; ++i) {
    const std::uint32_t mapping = entries_[pdo.count + 1 + i].value;
    if (const SdoAbort abort = check_mapped(mapping); abort != SdoAbort::kNone) return abort;
    bits += mapping & 0xFFU;
  }
  return bits > 64 ? SdoAbort::kPdoTooLong : SdoAbort::kNone;
}

SdoAbort NodeProtocol::check_mapped(std::uint32_t mapping) noexcept {
  const Object object = mapped_by(mapping);
  const Entry* entry = find(object);
  if (entry == nullptr) return SdoAbort::kNoObject;
  const bool fits = object.index >= kFirstDeviceIndex && (mapping & 0xFFU) == 8U * entry->size;
  return fits ? SdoAbort::kNone : SdoAbort::kNotMappable;
}

}  // namespace knuckle::sim
