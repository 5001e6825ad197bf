#include "app/console/window/window.h"

#include <epoxy/gl.h>
// After epoxy, which is to be the only one that declares OpenGL.
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <stb/stb_image_write.h>

#include <algorithm>
#include <span>
#include <thread>
#include <utility>

#include "app/cli/output_file.h"
#include "app/console/keys.h"
#include "app/console/picture/gl_program.h"
#include "core/error.h"

namespace knuckle::console::window {
namespace {

/// @param rgb three bytes a pixel, rows from the bottom up as OpenGL reads them.
void write_png_file(const std::string& path, int width, int height, std::span<const std::uint8_t> rgb) {
  cli::OutputFile file("--screenshot", path);
  stbi_flip_vertically_on_write(1);
  const auto write = [](void* stream, void* bytes, int size) {
    static_cast<std::ostream*>(stream)->write(static_cast<const char*>(bytes), size);
  };
  stbi_write_png_to_func(write, &file.stream(), width, height, 3, rgb.data(), width * 3);
  file.commit();
}

constexpr std::chrono::nanoseconds kFramePeriod{16'666'667};
constexpr std::chrono::milliseconds kLeastPeriod{8};                    // however fast pictures come
constexpr std::chrono::milliseconds kPatience{8};                       // for one that comes late
constexpr std::chrono::milliseconds kLongestPeriod{60}, kOverdue{100};  // of whole frames

/// GLFW's last message, on one line.
std::string last_error() {
  const char* text = nullptr;
  glfwGetError(&text);
  std::string line = text != nullptr ? text : "no reason given";
  std::replace(line.begin(), line.end(), '\n', ' ');
  return line;
}

/// What is beyond the display cannot be seen: Stop is at the lower right.
std::array<int, 2> within_display(int width, int height) {
  int x = 0, y = 0, most_width = 0, most_height = 0;
  if (GLFWmonitor* monitor = glfwGetPrimaryMonitor(); monitor != nullptr)
    glfwGetMonitorWorkarea(monitor, &x, &y, &most_width, &most_height);
  if (most_width <= 0 || most_height <= 0) return {width, height};
  return {std::min(width, most_width), std::min(height, most_height)};
}

}  // namespace

float content_scale(float width, float height, float monitor, float person) noexcept {
  constexpr float kLargest = 4;
  const float room = std::min(width / kDesignWidth, height / kDesignHeight);
  const float wanted = person > 0 ? monitor * person : std::max(monitor, room / 2);
  return std::clamp(wanted, kSmallestScale, std::clamp(room, kSmallestScale, kLargest));
}

Window::Window(const WindowOptions& options) : scale_(options.scale), full_speed_(options.full_speed) {
  presses_.reserve(64);
  arriving_.reserve(64);
  if (glfwInit() == GLFW_FALSE)
    throw InputError("no display: " + last_error() + " (is DISPLAY or WAYLAND_DISPLAY set?)");
  try {
    open(options);
    start_widgets();
    set_light(options.light);
  } catch (...) {
    glfwTerminate();
    throw;
  }
}

void Window::open(const WindowOptions& options) {
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  // No multisampling: the picture smooths its own lines, and where the processor draws it would halve the frames.
  glfwWindowHint(GLFW_SAMPLES, 0);
  glfwWindowHint(GLFW_FOCUS_ON_SHOW, GLFW_TRUE);
  const auto [width, height] = within_display(options.width, options.height);
  window_ = glfwCreateWindow(width, height, options.title.c_str(), nullptr, nullptr);
  if (window_ == nullptr) throw InputError("OpenGL 3.3 is missing: " + last_error());
  glfwMakeContextCurrent(window_);
  if (epoxy_gl_version() < 33)
    throw InputError("OpenGL 3.3 is missing: this display has " + std::to_string(epoxy_gl_version() / 10) + "." +
                     std::to_string(epoxy_gl_version() % 10));
  glfwSwapInterval(full_speed_ ? 0 : 1);
  glfwSetWindowSizeLimits(window_, kLeastWidth, kLeastHeight, GLFW_DONT_CARE, GLFW_DONT_CARE);
  glfwSetWindowUserPointer(window_, this);
  grab_.watch(window_);
  // ImGui's own come after and call these.
  glfwSetKeyCallback(window_, on_key);
  glfwSetMouseButtonCallback(window_, [](GLFWwindow* window, int, int, int) { on_touch(window); });
  glfwSetScrollCallback(window_, [](GLFWwindow* window, double, double) { on_touch(window); });
  glfwSetWindowFocusCallback(window_, [](GLFWwindow* window, int) { on_touch(window); });
  glfwSetFramebufferSizeCallback(window_, [](GLFWwindow* window, int, int) { on_touch(window); });
}

void Window::start_widgets() {
  IMGUI_CHECKVERSION();
  ImGui::CreateContext();
  ImGuiIO& io = ImGui::GetIO();
  io.IniFilename = nullptr;  // nothing is remembered behind the person's back
  io.ConfigFlags |= ImGuiConfigFlags_NavEnableKeyboard;
  ImGui_ImplGlfw_InitForOpenGL(window_, true);
  ImGui_ImplOpenGL3_Init("#version 330");
  io.KeyMap[ImGuiKey_Space] = GLFW_KEY_ENTER;  // Enter activates: Space is Stop, and nothing else
  io.KeyMap[ImGuiKey_Tab] = -1;                // FocusOrder does more
  widgets_started_ = true;
}

Window::~Window() {
  if (widgets_started_) {
    ImGui_ImplOpenGL3_Shutdown();
    ImGui_ImplGlfw_Shutdown();
    ImGui::DestroyContext();
  }
  glfwDestroyWindow(window_);
  glfwTerminate();
}

void Window::on_touch(GLFWwindow* window) {
  static_cast<Window*>(glfwGetWindowUserPointer(window))->touched_ = true;
}

void Window::on_key(GLFWwindow* window, int key, int /*scancode*/, int action, int modifiers) {
  auto* self = static_cast<Window*>(glfwGetWindowUserPointer(window));
  if (action != GLFW_REPEAT) self->touched_ = true;
  if (action != GLFW_PRESS) return;  // a key that repeats must not take the place of one that is pressed
  if (self->arriving_.size() < self->arriving_.capacity())
    self->arriving_.push_back({key, modifiers});
  else if (key == GLFW_KEY_SPACE || key == GLFW_KEY_ESCAPE)
    self->arriving_.back() = {key, modifiers};  // Stop is never the one too many
}

bool Window::closing() const {
  return glfwWindowShouldClose(window_) != 0;
}

bool Window::attended() const {
  return !grabbed_ && glfwGetWindowAttrib(window_, GLFW_FOCUSED) == GLFW_TRUE &&
         glfwGetWindowAttrib(window_, GLFW_ICONIFIED) == GLFW_FALSE;
}

void Window::begin_frame() {
  glfwPollEvents();
  polled_ = began_ = std::chrono::steady_clock::now();
  whole_ = true;
  touched_ = false;
  presses_.swap(arriving_);
  arriving_.clear();
  grabbed_ = grab_.grabbed();
  float x = 1, y = 1;
  glfwGetWindowContentScale(window_, &x, &y);
  monitor_scale_ = std::max(x, y);
  int width = 0, height = 0;
  glfwGetWindowSize(window_, &width, &height);
  too_small_ = width < kLeastWidth || height < kLeastHeight;
  const float wanted = content_scale(static_cast<float>(width), static_cast<float>(height), monitor_scale_, scale_);
  if (wanted != theme_.scale || theme_.fonts.body == nullptr) {
    theme_.scale = wanted;
    rebuild_fonts();
  }
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
}

void Window::rebuild_fonts() {
  ImGuiIO& io = ImGui::GetIO();
  theme_.fonts = font_files_.build(*io.Fonts, theme_.scale);
  ImGui_ImplOpenGL3_DestroyFontsTexture();
  ImGui_ImplOpenGL3_CreateFontsTexture();
  io.FontDefault = theme_.fonts.body;
  apply_style(theme_);
}

void Window::clear() {
  const auto [width, height] = framebuffer_size();
  const ImVec4 c = ImGui::ColorConvertU32ToFloat4(theme_.colours.background);
  glViewport(0, 0, width, height);
  glClearColor(c.x, c.y, c.z, 1);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
}

void Window::draw_widgets() {
  ImGui::Render();
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

void Window::swap() {
  if (std::exchange(whole_, false)) {
    glFinish();  // a display that sets the pace may keep the swap waiting, which is no work
    took_ = std::chrono::steady_clock::now() - began_;
  }
  glfwSwapBuffers(window_);
}

bool Window::touched() {
  glfwPollEvents();
  polled_ = std::chrono::steady_clock::now();
  for (int button = GLFW_MOUSE_BUTTON_1; button <= GLFW_MOUSE_BUTTON_3; ++button)
    touched_ |= glfwGetMouseButton(window_, button) == GLFW_PRESS;
  return touched_;
}

bool Window::slow() const {
  return took_ > kLeastPeriod && std::chrono::steady_clock::now() < began_ + kOverdue;
}

void Window::wait(video::Bell& pictures, std::chrono::steady_clock::time_point next_picture) {
  if (full_speed_) return;
  // Where the display does not set the pace, or a faster one than is of use.
  const auto now = std::chrono::steady_clock::now(), due = std::max(began_ + kFramePeriod, now);
  const bool in_its_way = now < next_picture + kPatience && due + took_ > next_picture;
  pictures.wait_until(in_its_way ? std::max(due, std::min(next_picture + kPatience, began_ + kLongestPeriod)) : due);
  std::this_thread::sleep_until(polled_ + kLeastPeriod);
}

void Window::write_png(const std::string& path) const {
  const auto [width, height] = framebuffer_size();
  write_png_file(path, width, height, picture::bound_pixels(width, height));
}

void Window::set_light(bool light) {
  theme_.light = light;
  theme_.colours = light ? light_palette() : dark_palette();
  if (theme_.fonts.body != nullptr) apply_style(theme_);
}

void Window::toggle_full_screen() {
  auto& [x, y, width, height] = windowed_;
  if (glfwGetWindowMonitor(window_) != nullptr) {
    glfwSetWindowMonitor(window_, nullptr, x, y, width, height, GLFW_DONT_CARE);
    return;
  }
  GLFWmonitor* monitor = glfwGetPrimaryMonitor();
  const GLFWvidmode* mode = monitor != nullptr ? glfwGetVideoMode(monitor) : nullptr;
  if (mode == nullptr) return;
  glfwGetWindowPos(window_, &x, &y);
  glfwGetWindowSize(window_, &width, &height);
  glfwSetWindowMonitor(window_, monitor, 0, 0, mode->width, mode->height, mode->refreshRate);
}

bool Window::key_down(int key) const {
  return glfwGetKey(window_, key) == GLFW_PRESS;
}

std::optional<GamepadState> Window::gamepad() {
  const PadEdges::Edges edges = pad_edges_.take();
  pad_since_.stop_pressed |= edges.stop_pressed;
  pad_since_.enable_released |= edges.enable_released;
  for (int id = GLFW_JOYSTICK_1; id <= GLFW_JOYSTICK_LAST; ++id) {
    GLFWgamepadstate read;
    if (glfwJoystickIsGamepad(id) == 0 || glfwGetGamepadState(id, &read) == 0) continue;
    // GLFW forgets the pointer of a gamepad that is gone.
    const bool another = pad_ >= 0 && (pad_ != id || glfwGetJoystickUserPointer(id) != this);
    const bool fresh = pad_ < 0 || another;
    pad_ = id;
    glfwSetJoystickUserPointer(id, this);
    if (fresh) pad_edges_.look();
    if (another) return std::nullopt;
    GamepadState state;
    std::copy(std::begin(read.buttons), std::end(read.buttons), state.buttons.begin());
    std::copy(std::begin(read.axes), std::end(read.axes), state.axes.begin());
    return with(std::exchange(pad_since_, {}), state);
  }
  pad_ = -1;
  return std::nullopt;
}

std::array<int, 2> Window::framebuffer_size() const {
  std::array<int, 2> size{};
  glfwGetFramebufferSize(window_, size.data(), &size[1]);
  return size;
}

}  // namespace knuckle::console::window
