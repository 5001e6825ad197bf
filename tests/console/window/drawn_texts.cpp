#include "tests/console/window/drawn_texts.h"

#include <algorithm>

namespace {
std::vector<knuckle::console::window::DrawnText>* drawn_texts = nullptr;  // collected while it points somewhere
}

// Every text of the window passes here: the linker puts this in the place of ImGui's own (tests/CMakeLists.txt).
extern "C" void __real__ZN10ImDrawList7AddTextEPK6ImFontfRK6ImVec2jPKcS7_fPK6ImVec4(ImDrawList*, const ImFont*, float,
                                                                                    const ImVec2&, ImU32, const char*,
                                                                                    const char*, float, const ImVec4*);
extern "C" void __wrap__ZN10ImDrawList7AddTextEPK6ImFontfRK6ImVec2jPKcS7_fPK6ImVec4(ImDrawList* list,
                                                                                    const ImFont* font, float size,
                                                                                    const ImVec2& at, ImU32 colour,
                                                                                    const char* begin, const char* end,
                                                                                    float width, const ImVec4* clip) {
  if (drawn_texts != nullptr) {
    const std::string words = end == nullptr ? std::string(begin) : std::string(begin, end);
    const ImVec2 extent = font == nullptr ? ImVec2() : font->CalcTextSizeA(size, 1e9F, width, words.c_str());
    drawn_texts->push_back({words,
                            at,
                            {at.x + extent.x, at.y + extent.y},
                            std::max(0.F, at.y + extent.y - list->_ClipRectStack.back().w)});
  }
  __real__ZN10ImDrawList7AddTextEPK6ImFontfRK6ImVec2jPKcS7_fPK6ImVec4(list, font, size, at, colour, begin, end, width,
                                                                      clip);
}

namespace knuckle::console::window {

std::vector<DrawnText> texts_of(const std::function<void()>& drawing) {
  std::vector<DrawnText> all;
  drawn_texts = &all;
  drawing();
  drawn_texts = nullptr;
  return all;
}

}  // namespace knuckle::console::window
