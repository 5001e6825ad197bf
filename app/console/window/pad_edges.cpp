#include "app/console/window/pad_edges.h"

#include <X11/Xlib.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <linux/input.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <climits>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <system_error>

namespace knuckle::console::window {
namespace {

constexpr std::size_t kLongBits = sizeof(unsigned long) * CHAR_BIT;

bool is_gamepad(int fd) noexcept {
  std::array<unsigned long, KEY_MAX / kLongBits + 1> keys{};
  if (ioctl(fd, EVIOCGBIT(EV_KEY, sizeof keys), keys.data()) < 0) return false;
  const auto has = [&keys](unsigned button) { return (keys[button / kLongBits] >> (button % kLongBits) & 1U) != 0; };
  // C and Z: a driver that only counts buttons, whatever they are.
  return has(BTN_GAMEPAD) && has(BTN_EAST) && has(BTN_TR) && !has(BTN_C) && !has(BTN_Z);
}

/// Sticks report up to a thousand times a second, and would fill the kernel's queue for this reader.
void want_buttons_only(int fd) noexcept {
  std::array<unsigned long, ABS_CNT / kLongBits + 1> none{};
  for (const unsigned type : {unsigned{EV_ABS}, unsigned{EV_MSC}}) {
    input_mask mask{};
    mask.type = type;
    mask.codes_size = sizeof none;
    mask.codes_ptr = reinterpret_cast<std::uintptr_t>(none.data());
    (void)ioctl(fd, EVIOCSMASK, &mask);
  }
}

}  // namespace

PadEdges::~PadEdges() {
  for (const auto& [path, fd] : open_) close(fd);
}

void PadEdges::look() {
  std::error_code none;  // a computer without any input device has no such folder
  for (const auto& entry : std::filesystem::directory_iterator("/dev/input", none)) {
    const std::string path = entry.path().string();
    if (!entry.path().filename().string().starts_with("event") || open_.contains(path)) continue;
    const int fd = open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0) continue;
    if (is_gamepad(fd)) {
      want_buttons_only(fd);
      add(path, fd);
    } else {
      close(fd);
    }
  }
}

void PadEdges::add(const std::string& path, int fd) {
  if (const auto [old, fresh] = open_.try_emplace(path, fd); !fresh) {
    close(old->second);
    old->second = fd;
  }
}

PadEdges::Edges PadEdges::take() noexcept {
  Edges edges;
  for (auto pad = open_.begin(); pad != open_.end();) {
    std::array<input_event, 64> events{};
    ssize_t read_bytes = 0;
    while ((read_bytes = read(pad->second, events.data(), sizeof events)) > 0) {
      const std::size_t count = static_cast<std::size_t>(read_bytes) / sizeof(input_event);
      for (std::size_t i = 0; i < count; ++i) {
        // The queue was full: nobody knows what was let go of.
        edges.enable_released |= events[i].type == EV_SYN && events[i].code == SYN_DROPPED;
        if (events[i].type != EV_KEY) continue;
        edges.stop_pressed |= events[i].code == BTN_EAST && events[i].value == 1;
        edges.enable_released |= events[i].code == BTN_TR && events[i].value == 0;
      }
    }
    const bool there = read_bytes < 0 && (errno == EAGAIN || errno == EINTR);
    if (!there) close(pad->second);
    pad = there ? std::next(pad) : open_.erase(pad);
  }
  return edges;
}

GamepadState with(const PadEdges::Edges& edges, GamepadState held) noexcept {
  if (edges.stop_pressed) held.buttons[GamepadState::kB] = 1;
  if (edges.enable_released) held.buttons[GamepadState::kRightBumper] = 0;
  return held;
}

GrabWatch::GrabWatch() = default;
GrabWatch::~GrabWatch() = default;

void GrabWatch::Close::operator()(_XDisplay* display) const {
  XCloseDisplay(display);
}

void GrabWatch::watch(GLFWwindow* window) {
  // Debian's GLFW for Wayland lacks both.
  const auto window_of = reinterpret_cast<::Window (*)(GLFWwindow*)>(dlsym(RTLD_DEFAULT, "glfwGetX11Window"));
  const auto display_of = reinterpret_cast<Display* (*)()>(dlsym(RTLD_DEFAULT, "glfwGetX11Display"));
  if (window_of == nullptr || display_of == nullptr) return;
  XSync(display_of(), False);             // until then the window may be known to GLFW only
  display_.reset(XOpenDisplay(nullptr));  // a connection of its own: GLFW takes what comes on its own
  if (!display_) return;
  XSelectInput(display_.get(), window_of(window), FocusChangeMask);
  XSync(display_.get(), False);  // as long as the window is there
}

bool GrabWatch::grabbed() {
  while (display_ && XPending(display_.get()) > 0) {
    XEvent event;
    XNextEvent(display_.get(), &event);
    if (event.type == FocusOut && event.xfocus.mode == NotifyGrab) grabbed_ = true;
    // Also where the focus went elsewhere during the grab and comes back after it.
    if (event.type == FocusIn && (event.xfocus.mode == NotifyUngrab || event.xfocus.mode == NotifyNormal))
      grabbed_ = false;
  }
  return grabbed_;
}

}  // namespace knuckle::console::window
