#include "transport/socket_can.h"

#include <fcntl.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>
#include <vector>

#include "core/error.h"

namespace knuckle {
namespace {

constexpr canid_t kFunctionMask = 0x780 | CAN_EFF_FLAG | CAN_RTR_FLAG;
constexpr canid_t kExtendedMask = CAN_EFF_FLAG | CAN_RTR_FLAG;
static_assert(kExtendedId == CAN_EFF_FLAG);
constexpr int kInteractive = 6;  // first band of pfifo_fast, the queue of CAN interfaces; above it needs privileges
// The kernel doubles this. A queued frame weighs about 768 bytes: some 20 frames, three steps of the loop. So the band
// stays short even where somebody has set txqueuelen to hundreds.
constexpr int kProcessSendBytes = 8 * 1024;
constexpr int kErrorBatches = 8;  // a flood of error frames may not keep the loop busy

/// SDOs wait for nobody and nobody waits for them; everything else is part of the process.
constexpr bool is_service(canid_t id) noexcept {
  const canid_t function = id & ~0x7FU;
  return function == 0x580 || function == 0x600;
}

[[noreturn]] void refuse(const std::string& interface, const std::string& why) {
  throw InputError("CAN interface \"" + interface + "\": " + why);
}

ifreq request(const std::string& interface) noexcept {
  ifreq r{};
  interface.copy(r.ifr_name, sizeof r.ifr_name - 1);
  return r;
}

/// What is known of an interface, and why it cannot be used yet.
struct Found {
  int index = 0;
  std::string problem;
};
/// Asked over an ordinary socket, so that the answer does not hang on CAN in the kernel.
Found find(const std::string& interface) {
  const Descriptor any(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  ifreq index = request(interface), hardware = index, flags = index;
  const std::string none = "no such interface; `ip -brief link show type can` lists what there is (or: type vcan)";
  if (interface.empty() || interface.size() >= IFNAMSIZ) refuse(interface, none);
  if (::ioctl(any.get(), SIOCGIFINDEX, &index) != 0) return {0, none};
  if (::ioctl(any.get(), SIOCGIFHWADDR, &hardware) != 0 || hardware.ifr_hwaddr.sa_family != ARPHRD_CAN)
    refuse(interface, "is not a CAN interface");
  if (::ioctl(any.get(), SIOCGIFFLAGS, &flags) != 0 || (flags.ifr_flags & IFF_UP) == 0) {
    const bool is_virtual = interface.starts_with("vcan") || interface.starts_with("vxcan");
    return {index.ifr_ifindex,
            "is down; as root: ip link set " + interface + (is_virtual ? " up" : " up type can bitrate 500000")};
  }
  return {index.ifr_ifindex, ""};
}

void set_option(const std::string& interface, int socket, int level, int option, const void* value, std::size_t size) {
  if (::setsockopt(socket, level, option, value, static_cast<socklen_t>(size)) != 0)
    refuse(interface, std::string("cannot set a socket option: ") + std::strerror(errno));
}

/// Filters come before bind(): not one unwanted frame may slip in between.
int open_socket(const std::string& interface, int index, std::span<const can_filter> filters, can_err_mask_t errors) {
  Descriptor socket(::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW));
  if (socket.get() < 0) {
    if (errno == EPERM || errno == EACCES) refuse(interface, "no permission to open CAN sockets");
    refuse(interface, std::string("cannot open a CAN socket (as root: modprobe can_raw): ") + std::strerror(errno));
  }
  const int on = 1, off = 0;
  const int fd = socket.get();
  set_option(interface, fd, SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(), filters.size_bytes());
  set_option(interface, fd, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors);
  // What arrives under an identifier that only this program sends is somebody else's. Where another of its sockets
  // sends it, the filters keep it out.
  set_option(interface, fd, SOL_CAN_RAW, CAN_RAW_RECV_OWN_MSGS, &off, sizeof off);
  set_option(interface, fd, SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = index;
  if (::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    if (errno == EPERM || errno == EACCES) refuse(interface, "no permission to use it");
    refuse(interface, std::string("cannot be used: ") + std::strerror(errno));
  }
  return socket.release();
}

/// What one of the two sockets is to hear.
std::vector<can_filter> filters_of(bool service, std::span<const CanFilter> hear) {
  std::vector<can_filter> filters;
  for (const auto& [id, mask] : hear) {
    const canid_t bits = mask & ((id & CAN_EFF_FLAG) != 0 ? CAN_EFF_MASK : CAN_SFF_MASK);
    if (is_service(id) == service) filters.push_back({id, bits | CAN_EFF_FLAG | CAN_RTR_FLAG});
  }
  for (canid_t function = 0; hear.empty() && function <= 0x780; function += 0x80) {
    if (is_service(function) == service) filters.push_back({function, kFunctionMask});
  }
  if (hear.empty() && !service) filters.push_back({CAN_EFF_FLAG, kExtendedMask});
  return filters;
}

SocketCanBus::Sockets open_sockets(const std::string& interface, std::span<const CanFilter> hear) {
  for (const auto& [id, mask] : hear) {
    const bool extended = (id & kExtendedId) != 0;
    const std::uint32_t number = id & ~kExtendedId, most = extended ? kMostExtendedId : kMostId;
    if (number > most)
      refuse(interface, "identifier " + std::to_string(number) + " to hear; limit " + std::to_string(most));
  }
  if (hear.size() > CAN_RAW_FILTER_MAX)
    refuse(interface,
           std::to_string(hear.size()) + " identifiers to hear; limit " + std::to_string(CAN_RAW_FILTER_MAX));
  const Found found = find(interface);
  if (!found.problem.empty()) refuse(interface, found.problem);
  const int index = found.index;
  Descriptor process(open_socket(interface, index, filters_of(false, hear), 0));
  Descriptor service(open_socket(interface, index, filters_of(true, hear), 0));
  Descriptor errors(open_socket(interface, index, {}, CAN_ERR_MASK));
  set_option(interface, process.get(), SOL_SOCKET, SO_PRIORITY, &kInteractive, sizeof kInteractive);
  set_option(interface, process.get(), SOL_SOCKET, SO_SNDBUF, &kProcessSendBytes, sizeof kProcessSendBytes);
  return {process.release(), service.release(), errors.release()};
}

}  // namespace

std::string why_not_yet(const std::string& interface) {
  return find(interface).problem;
}

SocketCanBus::SocketCanBus(const std::string& interface, std::span<const CanFilter> hear)
    : SocketCanBus(interface, open_sockets(interface, hear),
                   [interface, again = std::vector<CanFilter>(hear.begin(), hear.end())] {
                     return open_sockets(interface, again);
                   }) {}

SocketCanBus::SocketCanBus(const std::string& interface, const Sockets& sockets, std::function<Sockets()> open_again)
    : interface_(interface),
      process_(sockets.process),
      service_(sockets.service),
      errors_(sockets.errors),
      open_again_(std::move(open_again)) {}

bool SocketCanBus::send(const CanFrame& frame) noexcept {
  // Whoever was off the bus stays silent until somebody wants him back: the nodes then stop by themselves.
  if (!usable() || health_.state() == CanState::kBusOff || frame.size > CAN_MAX_DLEN) {
    health_.on_not_sent();
    return false;
  }
  can_frame out{};
  out.can_id = frame.id & ((frame.id & kExtendedId) != 0 ? CAN_EFF_FLAG | CAN_EFF_MASK : CAN_SFF_MASK);
  out.len = frame.size;
  std::copy_n(frame.data.begin(), frame.size, out.data);
  const Inbox& way = is_service(out.can_id) ? service_ : process_;
  if (::send(way.socket(), &out, sizeof out, MSG_DONTWAIT | MSG_NOSIGNAL) == static_cast<ssize_t>(sizeof out)) {
    health_.on_sent();
    return true;
  }
  health_.on_send_error(errno);
  give_away_if_gone();
  return false;
}

bool SocketCanBus::receive(CanFrame& frame) noexcept {
  if (!usable()) return false;
  if (process_.empty()) look_at_errors();
  const bool received = take(process_, frame) || take(service_, frame);
  if (!received) give_away_if_gone();
  return received;
}

bool SocketCanBus::usable() noexcept {
  const Ends ends = ends_.load(std::memory_order_acquire);
  if (ends != Ends::kFoundAgain) return ends == Ends::kInUse;
  for (Inbox* inbox : {&process_, &service_, &errors_}) inbox->start_anew();
  health_.on_found_again();
  ends_.store(Ends::kInUse, std::memory_order_relaxed);
  return true;
}

void SocketCanBus::give_away_if_gone() noexcept {
  if (health_.gone()) ends_.store(Ends::kGone, std::memory_order_release);
}

bool SocketCanBus::find_again() {
  if (!open_again_ || ends_.load(std::memory_order_acquire) != Ends::kGone) return false;
  Sockets fresh;
  try {
    fresh = open_again_();
  } catch (const InputError&) {
    return false;  // not there yet, or not up
  }
  const std::array<std::pair<int, int>, 3> ways{
      {{fresh.process, process_.socket()}, {fresh.service, service_.socket()}, {fresh.errors, errors_.socket()}}};
  bool replaced = true;
  for (const auto& [number, to] : ways) {
    const Descriptor from(number);
    // Closes the old one: in this thread, as that may wait.
    replaced = ::dup3(from.get(), to, O_CLOEXEC) == to && replaced;
  }
  if (replaced) ends_.store(Ends::kFoundAgain, std::memory_order_release);
  return replaced;
}

bool SocketCanBus::take(Inbox& inbox, CanFrame& frame) noexcept {
  if (inbox.empty()) inbox.fill(health_);
  while (!inbox.empty()) {
    const can_frame& in = inbox.take();
    // The filters let nothing else pass; a frame that is cut short or no data frame is nobody's.
    if ((in.can_id & (CAN_RTR_FLAG | CAN_ERR_FLAG)) != 0 || in.len > CAN_MAX_DLEN) continue;
    frame.id = in.can_id;
    frame.size = in.len;
    frame.data = {};
    std::copy_n(in.data, in.len, frame.data.begin());
    health_.on_received();
    return true;
  }
  return false;
}

void SocketCanBus::look_at_errors() noexcept {
  health_.on_look();
  for (int batch = 0; batch < kErrorBatches; ++batch) {
    errors_.fill(health_);
    if (errors_.empty()) return;
    while (!errors_.empty()) {
      const can_frame& in = errors_.take();
      if ((in.can_id & CAN_ERR_FLAG) == 0) continue;
      std::array<std::uint8_t, 8> data{};
      std::copy_n(in.data, data.size(), data.begin());
      health_.on_error_frame(in.can_id & CAN_ERR_MASK, data);
    }
  }
}

SocketCanBus::Inbox::Inbox(int socket) noexcept : socket_(socket) {
  for (std::size_t i = 0; i < kBatch; ++i) {
    places_[i] = {&frames_[i], sizeof(can_frame)};
    messages_[i].msg_hdr.msg_iov = &places_[i];
    messages_[i].msg_hdr.msg_iovlen = 1;
    messages_[i].msg_hdr.msg_control = &controls_[i];
  }
}

void SocketCanBus::Inbox::fill(CanHealth& health) noexcept {
  next_ = count_ = 0;
  for (mmsghdr& message : messages_) message.msg_hdr.msg_controllen = sizeof(Control);
  const int got = ::recvmmsg(socket_.get(), messages_.data(), kBatch, MSG_DONTWAIT, nullptr);
  if (got < 0) return health.on_receive_error(errno);
  count_ = static_cast<std::size_t>(got);
  for (std::size_t i = 0; i < count_; ++i) {
    count_overflows(health, messages_[i].msg_hdr);
    if (messages_[i].msg_len != sizeof(can_frame)) frames_[i].can_id = CAN_RTR_FLAG;  // no classic frame: nobody's
  }
}

/// The kernel tells with a frame how many were lost before it, since the socket was opened.
void SocketCanBus::Inbox::count_overflows(CanHealth& health, const msghdr& message) noexcept {
  if (message.msg_controllen < sizeof(cmsghdr)) return;
  const cmsghdr* header = CMSG_FIRSTHDR(&message);
  if (header == nullptr || header->cmsg_level != SOL_SOCKET || header->cmsg_type != SO_RXQ_OVFL) return;
  std::uint32_t lost = 0;
  std::memcpy(&lost, CMSG_DATA(header), sizeof lost);
  health.on_overflow(lost - overflows_);
  overflows_ = lost;
}

}  // namespace knuckle
