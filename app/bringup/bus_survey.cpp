#include "app/bringup/bus_survey.h"

#include <algorithm>

#include "transport/virtual_can.h"

namespace knuckle::bringup {
namespace {

using canopen::Object;

constexpr std::uint8_t kLastNode = 127;
constexpr std::size_t kAtOnce = 8;  // nodes whose answers are waited for side by side
// Request and response take half a millisecond at 500 kbit/s: an eighth of the bus load, beside other participants.
constexpr Duration kApart = 4ms;
const std::vector<Object> kStranger{canopen::kDeviceType, canopen::kVendorId, canopen::kProductCode,
                                    canopen::kErrorRegister};

/// Reads one node's objects one after the other.
class Reader {
 public:
  Reader(std::uint8_t node, std::vector<Object> objects) : node_(node), objects_(std::move(objects)) {}

  [[nodiscard]] std::uint8_t node() const noexcept { return node_; }
  [[nodiscard]] bool done() const noexcept { return next_ == objects_.size(); }
  [[nodiscard]] std::vector<ObjectRead> take() noexcept { return std::move(results_); }
  /// Answers beyond one to each request.
  [[nodiscard]] int second_answers() const noexcept { return std::max(0, answers_ - requests_); }

  /// @return whether a request was to be sent.
  bool step(CanBus& bus, Time now, Duration patience, bool may_ask) {
    if (done()) return false;
    const bool asks = may_ask && !asked_;
    if (asks) {
      if (wanted_at_ == kNever) wanted_at_ = now;
      asked_ = bus.send(canopen::sdo_upload(node_, objects_[next_]));
      if (asked_) ++requests_;
    }
    if (wanted_at_ != kNever && now - wanted_at_ >= patience) {
      const bool first = results_.empty();
      keep({objects_[next_], ObjectRead::Answer::kSilent, 0, canopen::SdoAbort::kNone});
      if (first) next_ = objects_.size();  // a node that does not answer the first request gets no other
    }
    return asks;
  }

  void receive(const CanFrame& frame) {
    const auto answer = canopen::parse_sdo_response(frame);
    if (done() || !answer) return;
    ++answers_;
    if (!asked_ || answer->object != objects_[next_]) return;
    using Kind = canopen::SdoResponse::Kind;
    ObjectRead read{objects_[next_], ObjectRead::Answer::kAborted, 0, canopen::SdoAbort::kUnknownCommand};
    if (answer->kind == Kind::kUploaded) read = {read.object, ObjectRead::Answer::kValue, answer->value, {}};
    if (answer->kind == Kind::kAborted) read.abort = answer->abort;
    keep(read);
  }

 private:
  void keep(const ObjectRead& read) {
    results_.push_back(read);
    ++next_;
    asked_ = false;
    wanted_at_ = kNever;
  }

  std::uint8_t node_;
  std::vector<Object> objects_;
  std::vector<ObjectRead> results_;
  std::size_t next_ = 0;
  int requests_ = 0, answers_ = 0;
  bool asked_ = false;
  Time wanted_at_ = kNever;  // also limits the wait for a bus that accepts no frame
};

class Surveyor {
 public:
  Surveyor(BusAccess& access, const SurveyOptions& options, const std::function<void()>& check)
      : access_(access), options_(options), check_(check) {
    found_.name = access.name();
  }

  /// What waited since the interface was opened tells of the nodes, but is no measure of the time that begins now.
  void listen(std::uint32_t bit_rate) {
    hear_what_waits();
    errors_ = access_.bus().errors();
    const Time start = access_.now(), end = start + from_seconds(options_.listen_s);
    listening_ = true;
    while (access_.now() < end) tick();
    listening_ = false;
    found_.listened_s = to_seconds(access_.now() - start);
    std::uint64_t bits = 0;
    for (const auto& [id, frames] : found_.heard) bits += frames.bits;
    found_.load = static_cast<double>(bits) / (found_.listened_s * bit_rate);
  }

  void ask(std::vector<Reader> all) {
    std::size_t next = 0;
    while (next < all.size() || !busy_.empty()) {
      while (busy_.size() < kAtOnce && next < all.size()) busy_.push_back(std::move(all[next++]));
      tick();
      for (Reader& reader : busy_) {
        if (!reader.done()) continue;
        SurveyedNode& node = found_.nodes[reader.node()];
        node.second_answers = found_.others_ask ? 0 : reader.second_answers();
        node.objects = reader.take();
      }
      std::erase_if(busy_, [](const Reader& reader) { return reader.done(); });
    }
  }

  [[nodiscard]] BusSurvey& found() noexcept { return found_; }
  [[nodiscard]] BusSurvey finish() {
    found_.state = access_.bus().state();
    found_.errors = access_.bus().errors() - errors_;
    for (auto& [id, node] : found_.nodes) node.id = id;
    return std::move(found_);
  }

 private:
  void tick() {
    if (check_) check_();
    access_.wait_until(access_.now() + 1ms);
    hear_what_waits();
    bool may_ask = access_.now() - asked_at_ >= kApart;
    for (Reader& reader : busy_) {
      if (!reader.step(access_.bus(), access_.now(), from_seconds(options_.answer_s), may_ask)) continue;
      may_ask = false;
      asked_at_ = access_.now();
    }
  }

  void hear_what_waits() {
    CanFrame frame;
    while (access_.bus().receive(frame)) hear(frame);
  }

  void hear(const CanFrame& frame) {
    if (listening_) {
      HeardFrames& frames = found_.heard[frame.id];
      ++frames.count;
      frames.bits += worst_case_bits(frame.size);
      if (frame == frames.newest) ++frames.repeated;
      frames.newest = frame;
    }
    found_.sync = found_.sync || frame.id == canopen::kSyncId;
    const std::uint8_t id = canopen::node_of(frame.id);
    if (id == 0) return;
    if (canopen::function_of(frame.id) == canopen::sdo_request_id(0)) found_.others_ask = true;
    if (const auto state = canopen::parse_heartbeat(frame)) {
      SurveyedNode& node = found_.nodes[id];
      const bool boots = *state == canopen::NmtState::kBootUp;
      node.booted = node.booted || boots;
      node.state = boots ? canopen::NmtState::kPreOperational : *state;  // its state after the boot-up message
    } else if (const auto emergency = canopen::parse_emergency(frame)) {
      SurveyedNode& node = found_.nodes[id];
      node.emergency = *emergency;
      ++node.emergencies;
    }
    for (Reader& reader : busy_) {
      if (frame.id == canopen::sdo_response_id(reader.node())) reader.receive(frame);
    }
  }

  BusAccess& access_;
  const SurveyOptions& options_;
  const std::function<void()>& check_;
  BusSurvey found_;
  std::vector<Reader> busy_;
  Time asked_at_ = kNever;
  std::uint64_t errors_ = 0;  // before it listened
  bool listening_ = false;
};

}  // namespace

const ObjectRead* SurveyedNode::read(Object object) const noexcept {
  const auto found =
      std::find_if(objects.begin(), objects.end(), [&](const ObjectRead& one) { return one.object == object; });
  return found == objects.end() ? nullptr : &*found;
}

std::optional<std::uint32_t> SurveyedNode::value(Object object) const noexcept {
  const ObjectRead* one = read(object);
  if (one == nullptr || one->answer != ObjectRead::Answer::kValue) return std::nullopt;
  return one->value;
}

bool SurveyedNode::answers() const noexcept {
  return std::any_of(objects.begin(), objects.end(),
                     [](const ObjectRead& one) { return one.answer != ObjectRead::Answer::kSilent; });
}

bool SurveyedNode::contradicts_itself() const noexcept {
  return std::any_of(objects.begin(), objects.end(), [this](const ObjectRead& one) {
    const ObjectRead& first = *read(one.object);
    using Answer = ObjectRead::Answer;
    return one.answer == Answer::kValue && first.answer == Answer::kValue && one.value != first.value;
  });
}

BusSurvey survey_bus(BusAccess& access, std::uint32_t bit_rate,
                     const std::map<std::uint8_t, std::vector<Object>>& wanted, const SurveyOptions& options,
                     const std::function<void()>& check) {
  Surveyor surveyor(access, options, check);
  surveyor.listen(bit_rate);
  // Two SDO clients of the same node would receive each other's responses.
  if (surveyor.found().others_ask) return surveyor.finish();
  std::vector<Reader> readers;
  for (const auto& [id, objects] : wanted) readers.emplace_back(id, objects);
  surveyor.ask(std::move(readers));
  readers = {};
  for (std::uint8_t id = 1; id <= kLastNode; ++id) {
    if (!wanted.contains(id)) readers.emplace_back(id, kStranger);
  }
  surveyor.ask(std::move(readers));
  std::erase_if(surveyor.found().nodes, [&](const auto& entry) {
    const SurveyedNode& node = entry.second;
    return !wanted.contains(entry.first) && !node.answers() && !node.state && !node.emergency;
  });
  return surveyor.finish();
}

}  // namespace knuckle::bringup
