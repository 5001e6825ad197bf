#include "app/eds/assign_id.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <set>

#include "app/eds/device_file.h"
#include "core/error.h"
#include "slave/bus_listen.h"

namespace knuckle::eds {
namespace {

using canopen::Object;
using canopen::SdoResponse;
using lss::Service;

constexpr Duration kListen = 1200ms;  // a heartbeat of once a second is heard
constexpr Duration kPatience = 500ms, kStoring = 3s, kShortestBoot = 10s;
constexpr Duration kLinger = 60ms;  // after an answer, for that of another device
constexpr Duration kApart = 10ms;   // devices have no queue for LSS
constexpr Object kRevision{0x1018, 3};
constexpr std::uint32_t kMost = 0xFFFFFFFF;  // of a revision or serial
constexpr const char* kOneAtATime = "unplug all but the one that is to have the id";

/// Asks one thing at a time, and hears every answer to it.
class Talk {
 public:
  Talk(BusAccess& access, const std::function<void(bool)>& check) : access_(access), check_(check) {}

  [[nodiscard]] const std::string& name() const noexcept { return access_.name(); }
  [[nodiscard]] CanBus& bus() const noexcept { return access_.bus(); }
  [[noreturn]] void refuse(const std::string& why) const { throw InputError(name() + ": " + why); }
  /// From here on the device may have another id.
  void tell() noexcept { told_ = true; }

  void send(const CanFrame& frame) {
    if (!bus().send(frame)) refuse("takes no frame: knuckle doctor --can " + name() + " says why");
  }

  /// @param parse what of a frame is wanted: an optional. @return all of it until patience is over, or a moment after
  /// the first.
  template <typename Parse>
  auto gather(Duration patience, const Parse& parse) {
    std::vector<typename decltype(parse(CanFrame()))::value_type> all;
    for (Time end = access_.now() + patience; access_.now() < end;) {
      if (check_) check_(told_);
      access_.wait_until(access_.now() + 1ms);
      CanFrame frame;
      for (int i = 0; i < kMostFramesPerStep && bus().receive(frame); ++i) {
        const auto wanted = parse(frame);
        if (!wanted) continue;
        if (all.empty()) end = std::min(end, access_.now() + kLinger);
        all.push_back(*wanted);
      }
    }
    return all;
  }

  /// Every identifier that is heard.
  [[nodiscard]] std::set<std::uint32_t> listen() {
    std::set<std::uint32_t> heard;
    (void)gather(kListen, [&](const CanFrame& frame) {
      heard.insert(frame.id);
      return std::optional<CanFrame>();
    });
    return heard;
  }

  /// As pause(), on the way out: nothing ends it.
  void settle() noexcept {
    try {
      access_.wait_until(access_.now() + kApart);
    } catch (...) {  // a simulated bus that cannot go on
    }
  }

  void pause() {
    (void)gather(kApart, [](const CanFrame&) { return std::optional<CanFrame>(); });
  }

  /// @return the values of all answers with this service.
  [[nodiscard]] std::vector<std::uint32_t> ask(Service service, std::uint32_t value, Service answer,
                                               Duration patience = kPatience) {
    send(lss::request(service, value));
    return gather(patience, [answer](const CanFrame& frame) {
      const auto message = lss::parse_answer(frame);
      return message && message->service == answer ? std::optional(message->value) : std::nullopt;
    });
  }
  [[nodiscard]] std::vector<std::uint32_t> ask(Service service) { return ask(service, 0, service); }

  [[nodiscard]] std::vector<SdoResponse> sdo(const CanFrame& request, Object object, Duration patience = kPatience) {
    send(request);
    const std::uint32_t id = canopen::sdo_response_id(canopen::node_of(request.id));
    return gather(patience, [id, object](const CanFrame& frame) {
      const auto response = canopen::parse_sdo_response(frame);
      return frame.id == id && response && response->object == object ? response : std::nullopt;
    });
  }
  [[nodiscard]] std::vector<SdoResponse> read(std::uint8_t node, Object object) {
    return sdo(canopen::sdo_upload(node, object), object);
  }

 private:
  BusAccess& access_;
  const std::function<void(bool)>& check_;
  bool told_ = false;
};

/// Why an answer is none; empty where it is as wanted.
std::string failed(const std::vector<SdoResponse>& answers, SdoResponse::Kind wanted) {
  if (answers.empty()) return "no answer";
  if (answers[0].kind == wanted) return "";
  return answers[0].kind == SdoResponse::Kind::kAborted ? canopen::abort_text(answers[0].abort)
                                                        : "an answer of another kind";
}

struct SdoIdentity {
  lss::Identity device;
  bool has_serial = false;
  std::string problem;
};

/// What the device under this node id says of itself. Revision and serial may be missing.
SdoIdentity identity_of(Talk& talk, std::uint8_t node) {
  SdoIdentity found;
  for (const auto& [object, value] : {std::pair{canopen::kVendorId, &found.device.vendor},
                                      {canopen::kProductCode, &found.device.product},
                                      {kRevision, &found.device.revision},
                                      {canopen::kSerialNumber, &found.device.serial}}) {
    const std::vector<SdoResponse> answers = talk.read(node, object);
    const std::string who = fmt::format("node 0x{:02X}", node);
    if (answers.size() > 1) {
      found.problem = fmt::format("{} devices answer as {}: {}", answers.size(), who, kOneAtATime);
      return found;
    }
    const std::string why = failed(answers, SdoResponse::Kind::kUploaded);
    const bool optional = object == kRevision || object == canopen::kSerialNumber;
    if (!why.empty() && (answers.empty() || !optional)) {
      found.problem = fmt::format("{}: {} cannot be read: {}", who, object_text(object), why);
      return found;
    }
    if (!why.empty()) continue;
    *value = answers[0].value;
    found.has_serial = found.has_serial || object == canopen::kSerialNumber;
  }
  return found;
}

/// The same, where it is known.
lss::Identity known_identity(Talk& talk, std::uint8_t node) {
  const SdoIdentity found = identity_of(talk, node);
  if (!found.problem.empty()) talk.refuse(found.problem);
  return found.device;
}

bool is_node_id(std::uint8_t id) {
  return id >= 1 && id <= 127;
}

// ---- Before anything is told

/// Whether only a node with this id sends such a frame.
bool sent_by(std::uint32_t frame, std::uint8_t id) {
  const std::array own{canopen::emcy_id(id),     canopen::tpdo_id(id, 1), canopen::tpdo_id(id, 2),
                       canopen::tpdo_id(id, 3),  canopen::tpdo_id(id, 4), canopen::sdo_response_id(id),
                       canopen::heartbeat_id(id)};
  return std::find(own.begin(), own.end(), frame) != own.end();
}

void check_bus(Talk& talk, BusAccess& access, const IdRequest& request) {
  slave::refuse_other_controller(request.bus, access);
  const std::string wanted = fmt::format("node id 0x{:02X} ", request.id);
  for (const std::uint32_t frame : talk.listen()) {
    if (canopen::function_of(frame) == canopen::sdo_request_id(0) && canopen::node_of(frame) != 0)
      talk.refuse("another program uses SDO: stop it, then start again");
    if (frame == lss::kRequestId) talk.refuse("another program uses LSS: stop it, then start again");
    if (sent_by(frame, request.id))
      talk.refuse(wanted + fmt::format("is in use: heard 0x{:03X}; choose another, or unplug that device", frame));
  }
  if (talk.read(request.id, canopen::kDeviceType).empty()) return;
  const SdoIdentity user = identity_of(talk, request.id);
  talk.refuse(wanted + "is in use: " + (user.problem.empty() ? text(user.device) : user.problem) +
              "; choose another, or unplug that device");
}

/// The device against what the machine file has under this id.
void check_fits(Talk& talk, const lss::Identity& device, const IdRequest& request) {
  if (const NodeDescription* node = request.bus.find(request.id);
      node != nullptr && (node->vendor != device.vendor || node->product != device.product)) {
    talk.refuse(
        fmt::format("found {}; node id 0x{:02X} is {} in {}, with vendor 0x{:08X}, product 0x{:08X}: give it "
                    "another id, or correct the file (knuckle bus add)",
                    text(device), request.id, node->name, request.machine, node->vendor, node->product));
  }
}

// ---- LSS

/// However its work ends, all devices are in LSS state waiting.
class LssMaster {
 public:
  explicit LssMaster(Talk& talk) : talk_(talk) { wait(); }
  ~LssMaster() {
    for (int i = 0; configures_ && i < 2; ++i) {  // a device that was busy, or a full queue, may miss the first
      talk_.settle();
      talk_.bus().send(switch_all(lss::State::kWaiting));
    }
  }
  LssMaster(const LssMaster&) = delete;
  LssMaster& operator=(const LssMaster&) = delete;

  void wait() {
    talk_.send(switch_all(lss::State::kWaiting));
    configures_ = false;
    talk_.pause();
  }
  void configure_all() {
    configures_ = true;
    talk_.send(switch_all(lss::State::kConfiguration));
    talk_.pause();
  }
  /// @return how many devices said that they are it: these are in configuration.
  [[nodiscard]] std::size_t select(const lss::Identity& device) {
    configures_ = true;
    say(Service::kSelectVendor, device.vendor);
    say(Service::kSelectProduct, device.product);
    say(Service::kSelectRevision, device.revision);
    return talk_.ask(Service::kSelectSerial, device.serial, Service::kSelected).size();
  }
  /// Whether a device of this kind has a serial within these bounds. Answers are equal: on a wire they become one.
  [[nodiscard]] bool any_between(const lss::Identity& kind, std::uint32_t low, std::uint32_t high) {
    say(Service::kIdentifyVendor, kind.vendor);
    say(Service::kIdentifyProduct, kind.product);
    say(Service::kIdentifyRevisionLow, 0);
    say(Service::kIdentifyRevisionHigh, kMost);
    say(Service::kIdentifySerialLow, low);
    return !talk_.ask(Service::kIdentifySerialHigh, high, Service::kIdentified).empty();
  }

 private:
  static CanFrame switch_all(lss::State state) noexcept {
    return lss::request(Service::kSwitchAll, static_cast<std::uint32_t>(state));
  }
  void say(Service service, std::uint32_t value) {
    talk_.send(lss::request(service, value));
    talk_.pause();
  }

  Talk& talk_;
  bool configures_ = false;
};

/// Whether all answers are the same.
bool agree(const std::vector<std::uint32_t>& answers) {
  return std::adjacent_find(answers.begin(), answers.end(), std::not_equal_to<>()) == answers.end();
}

/// What the device, or each of several equal ones, answers while all are in configuration; its serial is still 0.
/// @return how many there are at least
std::size_t ask_kind(Talk& talk, lss::Identity& kind) {
  std::size_t devices = 0;
  for (const auto& [service, value] : {std::pair{Service::kAskVendor, &kind.vendor},
                                       {Service::kAskProduct, &kind.product},
                                       {Service::kAskRevision, &kind.revision}}) {
    const auto answers = talk.ask(service);
    if (answers.empty() && service == Service::kAskVendor) {
      talk.refuse(
          "no device answers LSS: check its power, its plug and the bit rate; a device without LSS needs --from "
          "and --by-object");
    }
    if (answers.empty()) talk.refuse(std::string("a device answers LSS only in part: ") + kOneAtATime);
    if (!agree(answers)) talk.refuse(std::string("devices of more than one kind answer LSS: ") + kOneAtATime);
    *value = answers[0];
    devices = std::max(devices, answers.size());
  }
  return devices;
}

/// The only device that answers LSS; with a serial that is wanted, the one of several equal ones that should have it.
lss::Identity device_by_lss(Talk& talk, LssMaster& master, std::optional<std::uint32_t> serial) {
  lss::Identity device;
  const std::uint64_t errors = talk.bus().errors();
  master.configure_all();
  std::size_t devices = ask_kind(talk, device);
  if (serial) {
    device.serial = *serial;
    master.wait();
    return device;
  }
  std::set<std::uint32_t> serials;
  for (int i = 0; i < 2; ++i) {  // where answers destroy each other, one may come through, and another the next time
    const auto answers = talk.ask(Service::kAskSerial);
    serials.insert(answers.begin(), answers.end());
    devices = std::max({devices, answers.size(), serials.size()});
  }
  master.wait();
  if (devices > 1) {
    talk.refuse(fmt::format("{} devices answer LSS, with the serials {}: {}, or name it by --serial", devices,
                            fmt::join(serials, ", "), kOneAtATime));
  }
  if (serials.empty() || talk.bus().errors() != errors) {
    talk.refuse(std::string("answers to LSS are lost or destroyed, as where two devices answer at once: ") +
                kOneAtATime);
  }
  device.serial = *serials.begin();
  return device;
}

/// The device is in configuration, it alone. Where nothing else names it, nobody else of its kind may be there.
/// @return its node id now
std::uint8_t select_device(Talk& talk, LssMaster& master, const lss::Identity& device, const IdRequest& request) {
  const std::string who = text(device);
  const bool only = !request.from && !request.serial;
  const std::size_t devices = master.select(device);
  if (devices == 0) {
    talk.refuse("no device answers LSS as " + who +
                (only           ? std::string(", put together from several answers: ") + kOneAtATime
                 : request.from ? "; a device without LSS needs --by-object"
                                : ""));
  }
  const auto serials = talk.ask(Service::kAskSerial), ids = talk.ask(Service::kAskNodeId);
  if (devices > 1 || serials != std::vector{device.serial} || ids.size() != 1)
    talk.refuse("more than one device answers LSS as " + who + ": " + kOneAtATime);
  const std::uint32_t serial = device.serial;
  if (only && ((serial > 0 && master.any_between(device, 0, serial - 1)) ||
               (serial < kMost && master.any_between(device, serial + 1, kMost)))) {
    talk.refuse("found " + who + ", and another device of its kind: " + kOneAtATime + ", or name it by --serial");
  }
  return lss::Message{Service::kAskNodeId, ids[0]}.code();
}

/// @return what the device did not do.
std::string failure_of(Talk& talk, Service service, std::uint32_t value, Duration patience) {
  const char* const what = service == Service::kStore
                               ? "does not store its node id, so that it has it until its power is off"
                               : "does not take the node id";
  const auto answers = talk.ask(service, value, service, patience);
  if (answers.empty()) return std::string(what) + ": no answer";
  const std::uint8_t error = lss::Message{service, answers[0]}.code();
  return error == 0 ? "" : fmt::format("{}: {} (LSS error {})", what, lss::error_text(service, error), error);
}

AssignedId by_lss(Talk& talk, const IdRequest& request) {
  AssignedId result;
  LssMaster master(talk);
  result.device = request.from ? known_identity(talk, *request.from) : device_by_lss(talk, master, request.serial);
  check_fits(talk, result.device, request);
  result.before = select_device(talk, master, result.device, request);
  if (request.from && result.before != *request.from)
    talk.refuse(fmt::format("{} answers LSS with node id 0x{:02X}, not 0x{:02X}: switch its power off and on",
                            text(result.device), result.before, *request.from));
  // It will be reset under the id that it has now: no other device may have it.
  if (is_node_id(result.before) && !request.from) (void)known_identity(talk, result.before);
  talk.tell();
  result.problem = failure_of(talk, Service::kConfigureNodeId, request.id, kPatience);
  if (result.problem.empty()) result.problem = failure_of(talk, Service::kStore, 0, kStoring);
  return result;  // and all are waiting again: one that had none starts with it
}

// ---- Objects of the device

std::string write_id(Talk& talk, std::uint8_t node, Object object, std::uint8_t bytes, std::uint8_t id) {
  std::string why =
      failed(talk.sdo(canopen::sdo_download(node, object, id, bytes), object), SdoResponse::Kind::kDownloaded);
  if (!why.empty()) return object_text(object) + " cannot be written: " + why;
  const auto read = talk.read(node, object);
  why = failed(read, SdoResponse::Kind::kUploaded);
  if (why.empty() && read[0].value != id) why = fmt::format("it still is 0x{:X}", read[0].value);
  return why.empty() ? "" : object_text(object) + " was written, but " + why;
}

AssignedId by_objects(Talk& talk, const IdRequest& request) {
  AssignedId result;
  const std::uint8_t node = result.before = *request.from;
  result.device = known_identity(talk, node);
  check_fits(talk, result.device, request);
  std::vector<std::uint8_t> bytes;
  for (const Object object : request.objects) {
    const auto read = talk.read(node, object);
    const std::string why = failed(read, SdoResponse::Kind::kUploaded);
    if (!why.empty()) talk.refuse(fmt::format("node 0x{:02X}: {} cannot be read: {}", node, object_text(object), why));
    if (read[0].value != node) {
      talk.refuse(fmt::format("node 0x{:02X}: {} is 0x{:X}: an object that holds the node id would be 0x{:X}", node,
                              object_text(object), read[0].value, node));
    }
    bytes.push_back(read[0].size);
  }
  talk.tell();
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    result.problem = write_id(talk, node, request.objects[i], bytes[i], request.id);
    if (result.problem.empty()) continue;
    for (std::size_t j = 0; j < i; ++j) (void)write_id(talk, node, request.objects[j], bytes[j], node);
    return result;
  }
  // Many keep such an object by themselves: whether it was kept is seen after the restart.
  if (const Object store = canopen::kStoreParameters;
      failed(talk.read(node, store), SdoResponse::Kind::kUploaded).empty())
    (void)talk.sdo(canopen::sdo_download(node, store, canopen::kSaveSignature, 4), store, kStoring);
  return result;
}

// ---- Afterwards

bool starts(Talk& talk, std::uint8_t id, Duration patience) {
  return !talk.gather(patience,
                      [id](const CanFrame& frame) {
                        return frame.id == canopen::heartbeat_id(id) ? canopen::parse_heartbeat(frame) : std::nullopt;
                      })
              .empty();
}

/// @return what is wrong with the device under its new id.
std::string verified(Talk& talk, const IdRequest& request, const AssignedId& given) {
  using canopen::NmtCommand;
  const bool by_lss = request.objects.empty();
  const auto boot = std::max(kShortestBoot, from_seconds(request.bus.boot_timeout_s));
  const bool had_id = is_node_id(given.before);
  bool started = false;
  if (had_id && by_lss) {
    talk.pause();  // NMT goes before LSS on the bus: they must have left configuration
    talk.send(canopen::nmt_frame(NmtCommand::kResetCommunication, given.before));
    started = starts(talk, request.id, boot);
  }
  if (had_id && !started) talk.send(canopen::nmt_frame(NmtCommand::kResetNode, given.before));
  if (!started) (void)starts(talk, request.id, boot);
  const SdoIdentity found = identity_of(talk, request.id);
  if (!found.problem.empty())
    return found.problem + "; switch its power off and on, then see what knuckle doctor --can " + talk.name() +
           " finds";
  if (found.device == given.device) return "";
  if (!found.has_serial && given.device.serial != 0) {
    return fmt::format("node 0x{:02X} answers, but has no {}: whether it is the device with this serial is not known",
                       request.id, object_text(canopen::kSerialNumber));
  }
  return fmt::format("node 0x{:02X} is {}: another device", request.id, text(found.device));
}

}  // namespace

std::string text(const lss::Identity& device) {
  return fmt::format("vendor 0x{:08X}, product 0x{:08X}, revision 0x{:08X}, serial {}", device.vendor, device.product,
                     device.revision, device.serial);
}

AssignedId assign_id(BusAccess& access, const IdRequest& request, const std::function<void(bool)>& check) {
  Talk talk(access, check);
  check_bus(talk, access, request);
  AssignedId result = request.objects.empty() ? by_lss(talk, request) : by_objects(talk, request);
  if (result.problem.empty()) result.problem = verified(talk, request, result);
  return result;
}

}  // namespace knuckle::eds
