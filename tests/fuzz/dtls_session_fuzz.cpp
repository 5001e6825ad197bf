// Two ends of the secure link, and a network that does with their datagrams what the input says: loses, doubles, cuts,
// changes, reorders, keeps, and makes its own. However it does that: no session with an end that is not paired, nothing
// opened that the far end did not seal, or twice, or as newer than it is; and a session that is there goes on.
#include <sys/time.h>

#include <algorithm>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "tests/fuzz/require.h"
#include "transport/secure/dtls_session.h"

namespace {

using namespace knuckle::secure;
using Bytes = std::vector<std::uint8_t>;
using Progress = DtlsSession::Progress;

constexpr timeval kBegin{1'700'000'000, 0};
timeval clock_of_openssl = kBegin;

using knuckle::test::require;

/// Numbers out of the input; zeros once it is used up.
class Input {
 public:
  explicit Input(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  [[nodiscard]] bool empty() const { return bytes_.empty(); }
  std::uint8_t byte() {
    if (bytes_.empty()) return 0;
    const std::uint8_t first = bytes_.front();
    bytes_ = bytes_.subspan(1);
    return first;
  }
  std::size_t number() { return static_cast<std::size_t>(byte() << 8) + byte(); }
  Bytes bytes(std::size_t count) {
    const auto taken = bytes_.first(std::min(count, bytes_.size()));
    bytes_ = bytes_.subspan(taken.size());
    return {taken.begin(), taken.end()};
  }

 private:
  std::span<const std::uint8_t> bytes_;
};

struct Wire final : DtlsSession::Out {
  void put(std::span<const std::uint8_t> bytes) override { under_way.emplace_back(bytes.begin(), bytes.end()); }
  std::deque<Bytes> under_way;
};

/// What an end has sealed, and whether the other has opened it.
struct Record {
  Bytes datagram, plain;
  Inner kind = Inner::kMessage;
  bool opened = false;
};

struct End {
  explicit End(const DtlsContext& of) : context(of), session(std::in_place, of) {}
  const DtlsContext& context;
  std::optional<DtlsSession> session;
  Wire sends;
  std::vector<Record> sealed;
  Progress progress = Progress::kUnderWay;
  bool heard_hello = false;  ///< Machine's side: with the cookie of its address.
  bool said_farewell = false, has_ever_said_farewell = false;
  std::size_t life = 0;        ///< Which of the sessions that this end has had.
  std::ptrdiff_t newest = -1;  ///< Of the other end's records, the last of those that were opened.
};

/// Who knows whom; from the first bytes of an input.
struct Pairing {
  enum class Known : std::uint8_t { kPaired, kStranger, kRevoked, kObserver, kAnybody, kCount };
  Known at_machine = Known::kPaired, at_operator = Known::kPaired;
  Purpose purpose = Purpose::kControl;
};

const Identity& identity(Role role) {
  static const Identity machine = make_identity("site arm"), desk = make_identity("desk 1");
  return role == Role::kMachine ? machine : desk;
}

Peers peers(Pairing::Known known, Role far) {
  static const Identity other = make_identity("other");
  const Identity& who = known == Pairing::Known::kStranger ? other : identity(far);
  return {{who.fingerprint(), who.name, known == Pairing::Known::kRevoked, known == Pairing::Known::kObserver, ""}};
}

/// Contexts cost more than a handshake: each is made once.
const DtlsContext& context(Role role, Pairing::Known known, Purpose purpose) {
  static std::array<std::unique_ptr<DtlsContext>, 64> made;
  const auto index = static_cast<std::size_t>(known) * 8 + static_cast<std::size_t>(purpose) * 2 +
                     static_cast<std::size_t>(role == Role::kMachine);
  if (!made[index]) {
    made[index] = std::make_unique<DtlsContext>(identity(role),
                                                peers(known, role == Role::kMachine ? Role::kOperator : Role::kMachine),
                                                role, known == Pairing::Known::kAnybody ? Purpose::kPair : purpose);
  }
  return *made[index];
}

class Network {
 public:
  explicit Network(const Pairing& pairing)
      : pairing_(pairing),
        machine_(context(Role::kMachine, pairing.at_machine, Purpose::kControl)),
        desk_(context(Role::kOperator, pairing.at_operator, pairing.purpose)) {
    took(desk_, desk_.session->start(desk_.sends));
  }

  void step(Input& input) {
    const std::uint8_t what = input.byte();
    End& from = (what & 0x80U) != 0 ? machine_ : desk_;
    std::deque<Bytes>& under_way = from.sends.under_way;
    switch (what & 0x7FU) {
      case 0:
        return deliver_all();
      case 1:
        return deliver(from);
      case 2:
        if (!under_way.empty()) under_way.pop_front();
        return;
      case 3:
        if (!under_way.empty()) under_way.push_back(under_way.front());
        return;
      case 4:
        if (!under_way.empty()) std::rotate(under_way.begin(), under_way.begin() + 1, under_way.end());
        return;
      case 5:
        return cut(under_way, input.number());
      case 6:
        return change(under_way, input.number());
      case 7:
        under_way.push_front(input.bytes(input.byte()));
        return;
      case 8:
        return pass_time(input.byte());
      case 9:
        return seal(from, input);
      case 10:
        return repeat(from, input);
      case 11:
        return say_farewell(from);
      case 12:
        return begin_anew(from);
      case 13:
        return join(under_way);
      case 14:
        return without_tag(under_way);
      default:
        return;
    }
  }

  /// Whatever happened before.
  void end() {
    for (End* one : {&machine_, &desk_}) one->sends.under_way.clear();
    for (End* one : {&machine_, &desk_}) {
      End& far = other(*one);
      if (!same_session() || one->said_farewell || far.said_farewell) continue;
      const Bytes plain{1, 2, 3};
      seal(*one, Inner::kMessage, plain);
      require(one->sends.under_way.size() == 1);
      deliver(*one);
      require(one->sealed.back().opened);
    }
  }

 private:
  [[nodiscard]] End& other(const End& one) { return &one == &machine_ ? desk_ : machine_; }
  [[nodiscard]] bool same_session() const {
    return machine_.progress == Progress::kDone && desk_.progress == Progress::kDone &&
           made_by_machine_of_ == desk_.life && made_by_desk_of_ == machine_.life;
  }

  void deliver_all() {
    for (int i = 0; i < 64 && !(machine_.sends.under_way.empty() && desk_.sends.under_way.empty()); ++i) {
      deliver(desk_);
      deliver(machine_);
    }
  }
  void deliver(End& from) {
    if (from.sends.under_way.empty()) return;
    const Bytes datagram = std::move(from.sends.under_way.front());
    from.sends.under_way.pop_front();
    hear(other(from), from, datagram);
  }

  /// As the link sorts what comes: by its first byte.
  void hear(End& end, End& far, const Bytes& datagram) {
    if (datagram.empty()) return;
    if (datagram[0] >= kObserverTagMark) {
      if (end.progress == Progress::kDone && end.session->mine(datagram)) open(end, far, datagram);
      return;
    }
    static const knuckle::SocketAddress address = knuckle::parse_address("192.0.2.7:5683");
    if (&end == &machine_ && !end.heard_hello) {
      if (!end.session->hear_hello(datagram, address, end.sends)) return;
      end.heard_hello = true;
      return took(end, end.session->start(end.sends));
    }
    took(end, end.session->hear(datagram, end.sends));
  }

  void took(End& end, Progress progress) {
    if (end.progress != Progress::kUnderWay) return;
    if (progress == Progress::kDone) check_peer(end);
    end.progress = progress;
  }

  void check_peer(const End& end) {
    using Known = Pairing::Known;
    const bool machine = &end == &machine_;
    const Known known = machine ? pairing_.at_machine : pairing_.at_operator;
    require(known != Known::kStranger && known != Known::kRevoked);
    if (machine) require(known != Known::kObserver || pairing_.purpose != Purpose::kControl);
    require(end.session->peer() == identity(machine ? Role::kOperator : Role::kMachine).fingerprint());
    const bool pairs = known == Known::kAnybody;
    require(pairs == (pairing_.at_machine == Known::kAnybody) && pairs == (pairing_.at_operator == Known::kAnybody));
    require(end.session->purpose() == (pairs ? Purpose::kPair : pairing_.purpose));
    (machine ? made_by_machine_of_ : made_by_desk_of_) = other(end).life;
  }

  void open(End& end, End& far, const Bytes& datagram) {
    knuckle::Datagram plain;
    const bool was_closed = end.session->closed();
    const auto opened = end.session->open(datagram, plain);
    if (!was_closed && end.session->closed()) require(far.has_ever_said_farewell);
    if (!opened) return;
    const auto sealed =
        std::find_if(far.sealed.begin(), far.sealed.end(), [&](const Record& one) { return one.datagram == datagram; });
    require(sealed != far.sealed.end() && !sealed->opened);
    require(opened->kind == sealed->kind && std::ranges::equal(plain.view(), sealed->plain));
    sealed->opened = true;
    const auto number = sealed - far.sealed.begin();
    require(opened->newest == (number > end.newest));
    end.newest = std::max(end.newest, number);
  }

  static void seal(End& end, Input& input) {
    const auto kind = static_cast<Inner>(input.byte() % 7);
    const std::uint8_t size = input.byte();
    seal(end, kind, Bytes(size == 255 ? knuckle::kMaxDatagram : size, static_cast<std::uint8_t>(end.sealed.size())));
  }
  static void seal(End& end, Inner kind, const Bytes& plain) {
    if (end.progress != Progress::kDone) return;
    Sealed sealed;
    if (!end.session->seal(kind, plain, sealed)) return require(end.said_farewell || end.session->closed());
    require(!end.said_farewell && sealed.size == plain.size() + kSealOverhead);
    const auto view = sealed.view();
    end.sealed.push_back({Bytes(view.begin(), view.end()), plain, kind});
    end.sends.under_way.push_back(end.sealed.back().datagram);
  }
  static void say_farewell(End& end) {
    Sealed sealed;
    if (end.progress != Progress::kDone || !end.session->seal_farewell(sealed)) return;
    end.said_farewell = end.has_ever_said_farewell = true;
    end.sends.under_way.emplace_back(sealed.view().begin(), sealed.view().end());
  }

  /// A program that was started again.
  void begin_anew(End& end) {
    end.session.emplace(end.context);
    end.progress = Progress::kUnderWay;
    end.heard_hello = end.said_farewell = false;
    end.newest = -1;
    ++end.life;
    if (&end == &desk_) took(end, end.session->start(end.sends));
  }

  void pass_time(std::uint8_t tens_of_ms) {
    clock_of_openssl.tv_usec += 10'000 * tens_of_ms;
    clock_of_openssl.tv_sec += clock_of_openssl.tv_usec / 1'000'000;
    clock_of_openssl.tv_usec %= 1'000'000;
    for (End* one : {&machine_, &desk_}) {
      if (one->progress == Progress::kUnderWay && (one == &desk_ || one->heard_hello))
        took(*one, one->session->tend(one->sends));
    }
  }

  static void cut(std::deque<Bytes>& under_way, std::size_t size) {
    if (!under_way.empty() && size < under_way.front().size()) under_way.front().resize(size);
  }
  static void change(std::deque<Bytes>& under_way, std::size_t bit) {
    if (under_way.empty() || under_way.front().empty()) return;
    bit %= 8 * under_way.front().size();
    under_way.front()[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
  }
  /// Something that was sealed before, to whomever.
  void repeat(End& from, Input& input) {
    const End& by = (input.byte() & 1U) != 0 ? machine_ : desk_;
    if (!by.sealed.empty()) from.sends.under_way.push_front(by.sealed[input.byte() % by.sealed.size()].datagram);
  }
  /// Two datagrams as one.
  static void join(std::deque<Bytes>& under_way) {
    if (under_way.size() < 2) return;
    const Bytes first = std::move(under_way.front());
    under_way.pop_front();
    under_way.front().insert(under_way.front().begin(), first.begin(), first.end());
  }
  /// A sealed record looks like one of the handshake then.
  static void without_tag(std::deque<Bytes>& under_way) {
    if (under_way.empty() || under_way.front().size() <= kTagSize) return;
    under_way.front().erase(under_way.front().begin(), under_way.front().begin() + kTagSize);
  }

  const Pairing pairing_;
  End machine_, desk_;
  std::size_t made_by_machine_of_ = 0, made_by_desk_of_ = 0;  // which life of the other end
};

}  // namespace

/// The timers of OpenSSL's handshake: the input's time, so that an input always does the same.
extern "C" int gettimeofday(timeval* now, void* /*zone*/) noexcept {
  *now = clock_of_openssl;
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr int kMostSteps = 150;
  clock_of_openssl = kBegin;
  Input input({data, size});
  constexpr auto kKnown = static_cast<std::uint8_t>(Pairing::Known::kCount);
  Pairing pairing;
  pairing.at_machine = static_cast<Pairing::Known>(input.byte() % kKnown);
  pairing.at_operator = static_cast<Pairing::Known>(input.byte() % kKnown);
  pairing.purpose = static_cast<Purpose>(input.byte() % 3);
  Network network(pairing);
  for (int i = 0; i < kMostSteps && !input.empty(); ++i) network.step(input);
  network.end();
  return 0;
}
