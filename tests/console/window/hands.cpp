// xdotool's words for keys and mouse, by XTest itself: a program for each of thousands of keys takes longer than a
// frame.
#include <X11/XKBlib.h>
#include <X11/Xlib.h>
#include <dlfcn.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <iterator>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/console/window/virtual_display.h"

namespace knuckle::console::window {
namespace {

Display* display = nullptr;

/// From the library that xdotool needs, without a package more.
template <typename Function>
Function* of_xtest(const char* name) {
  static void* const library = dlopen("libXtst.so.6", RTLD_NOW);
  return library == nullptr ? nullptr : reinterpret_cast<Function*>(dlsym(library, name));
}

bool press(unsigned code, bool down) {
  static auto* const fake = of_xtest<int(Display*, unsigned, int, unsigned long)>("XTestFakeKeyEvent");
  return fake != nullptr && code != 0 && fake(display, code, down ? 1 : 0, 0) != 0;
}
bool press_button(unsigned button, bool down) {
  static auto* const fake = of_xtest<int(Display*, unsigned, int, unsigned long)>("XTestFakeButtonEvent");
  return fake != nullptr && fake(display, button, down ? 1 : 0, 0) != 0;
}

/// Of "F2", "shift", "ctrl+r"; none where one of them needs more than its key.
std::vector<unsigned> codes_of(const std::string& keys) {
  std::vector<unsigned> codes;
  std::istringstream names(keys);
  for (std::string name; std::getline(names, name, '+');) {
    if (name == "shift") name = "Shift_L";
    if (name == "ctrl") name = "Control_L";
    if (name == "alt") name = "Alt_L";
    const KeySym symbol = XStringToKeysym(name.c_str());
    const KeyCode code = symbol == NoSymbol ? KeyCode(0) : XKeysymToKeycode(display, symbol);
    if (code == 0 || XkbKeycodeToKeysym(display, code, 0, 0) != symbol) return {};
    codes.push_back(code);
  }
  return codes;
}

bool strike(const std::string& keys, bool down, bool up) {
  const std::vector<unsigned> codes = codes_of(keys);
  const auto all = [](auto first, auto last, bool pressed) {
    return std::all_of(first, last, [pressed](unsigned code) { return press(code, pressed); });
  };
  // GLFW takes a second press of a key within the same millisecond for the first one, told twice by an input method.
  if (down) {
    XSync(display, 0);
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return !codes.empty() && (!down || all(codes.begin(), codes.end(), true)) &&
         (!up || all(codes.rbegin(), codes.rend(), false));
}

constexpr std::array kWords{"key", "keydown", "keyup", "mousemove", "mousedown", "mouseup", "click"};
bool is_word(const std::string& text) {
  return std::find(kWords.begin(), kWords.end(), text) != kWords.end();
}

/// @return false where there is another word among them, or a key that is not plain; then nothing was done.
bool are_plain(const std::vector<std::string>& words) {
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (is_word(words[i])) continue;
    if (i == 0) return false;
    const bool number = std::all_of(words[i].begin(), words[i].end(), [](char c) { return c >= '0' && c <= '9'; });
    if (!number && codes_of(words[i]).empty()) return false;
  }
  return !words.empty();
}

bool act(const std::string& word, const std::string& what, const std::string& more) {
  if (word.starts_with("key")) return strike(what, word != "keyup", word != "keydown");
  if (word == "mousemove")
    return XWarpPointer(display, 0, DefaultRootWindow(display), 0, 0, 0, 0, std::stoi(what), std::stoi(more)) != 0;
  const auto button = static_cast<unsigned>(std::stoi(what));
  return (word == "mouseup" || press_button(button, true)) && (word == "mousedown" || press_button(button, false));
}

}  // namespace

bool xdotool(const std::string& text) {
  if (display == nullptr) display = XOpenDisplay(nullptr);
  std::istringstream in(text);
  const std::vector<std::string> words{std::istream_iterator<std::string>(in), {}};
  if (display == nullptr || of_xtest<int()>("XTestFakeKeyEvent") == nullptr || !are_plain(words))
    return std::system(("xdotool " + text).c_str()) == 0;
  std::string word;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (is_word(words[i])) {
      word = words[i];
      continue;
    }
    const bool pair = word == "mousemove";
    if (!act(word, words[i], pair ? words.at(i + 1) : std::string())) return false;
    i += pair ? 1 : 0;
  }
  // Once more around: what others are to hear of it has been sent to them then.
  XSync(display, 0);
  XSync(display, 0);
  return true;
}

void let_go_of_display() {
  if (display != nullptr) XCloseDisplay(display);
  display = nullptr;
}

}  // namespace knuckle::console::window
